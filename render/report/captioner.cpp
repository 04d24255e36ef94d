#include "render/report/captioner.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "sim/model/settings_fields.h"

namespace substep::report {
namespace {

/// Returns up to six values, or the first three and the last of more.
std::string shortened(const std::set<int>& values) {
  if (values.size() <= 6) return fmt::format("{}", fmt::join(values, ", "));
  const std::vector<int> all(values.begin(), values.end());
  return fmt::format("{}, {}, {} … {}", all[0], all[1], all[2], all.back());
}

/// "n = 1, 2, 4 … 64, m = 1, step h"
std::string text_of(const LineValues& line) {
  std::vector<std::string> parts;
  const auto add = [&parts](const char* symbol, const std::set<int>& values) {
    if (!values.empty()) parts.push_back(fmt::format("{} = {}", symbol, shortened(values)));
  };
  add("n", line.substeps);
  if (line.substeps.size() > 0 || line.iterations.size() > 1) add("m", line.iterations);
  parts.push_back(line.divisions.size() > 1 || *line.divisions.begin() > 1
                      ? fmt::format("h divided by {}", shortened(line.divisions))
                      : "step h");
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace

void Captioner::add(const RunFamily& family) {
  const SweepRecord& first = family.runs.front();
  const bool is_own = first.engine.empty();
  const std::string name = is_own ? std::string(title_of(first.settings.algorithm)) : family.title;
  LineValues& line = lines_[family.title];
  line.name = name;
  line.title = family.title;
  for (const SweepRecord& run : family.runs) {
    const Settings& s = run.settings;
    if (field_named("substeps").is_read_by(s.algorithm) && is_own) line.substeps.insert(s.substeps);
    if (s.algorithm != Algorithm::a1 && is_own) line.iterations.insert(s.iterations);
    line.divisions.insert(run.divisions);
  }
  titles_[name].insert(family.title);
}

void Captioner::finish(Sheet& sheet) const {
  for (Panel& panel : sheet.panels) {
    for (Series& series : panel.series) series.title = short_title(lines_.at(series.title));
  }
  std::vector<std::pair<std::string, std::set<std::string>>> groups;  // values, names
  for (const auto& [title, line] : lines_) {
    std::string text = text_of(line);
    if (short_title(line) != title) text += "; " + title.substr(title.find(' ') + 1);
    auto found = std::ranges::find(groups, text, &std::pair<std::string, std::set<std::string>>::first);
    if (found == groups.end()) found = groups.insert(groups.end(), {text, {}});
    found->second.insert(line.name);
  }
  std::vector<std::string> sentences;
  for (const auto& [text, names] : groups)
    sentences.push_back(fmt::format("{}: {}.", fmt::join(names, ", "), text));
  sheet.caption.insert(sheet.caption.begin(), fmt::format("{}", fmt::join(sentences, " ")));
}

const std::string& Captioner::short_title(const LineValues& line) const {
  return titles_.at(line.name).size() == 1 && line.name != "A2" ? line.name : line.title;
}

}  // namespace substep::report
