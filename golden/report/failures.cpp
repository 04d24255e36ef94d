#include "golden/report/failures.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <utility>

#include "golden/compare/verdict.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

/// Returns a path as a shell word, with ./ before a name that would be an option.
std::string path_word(const fs::path& path) {
  const std::string text = path.string();
  return shell_word(text.starts_with('-') ? fmt::format("./{}", text) : text);
}

std::string algorithm_of(const Json& entry) {
  return entry.at("settings").at("algorithm");
}

/// Describes the cases of one group of failures: "all cases of a3", "3 of 10 cases, in 2 scenes, by a1 a3".
std::string which_cases(const std::vector<const Json*>& failing, const Json& checked) {
  if (failing.size() == checked.size()) return "all cases";
  std::set<std::string> algorithms;
  std::set<std::string> scenes;
  for (const Json* entry : failing) {
    algorithms.insert(algorithm_of(*entry));
    scenes.insert(entry->at("scene").get<std::string>());
  }
  const auto of_algorithm = std::ranges::count(checked, *algorithms.begin(), algorithm_of);
  if (algorithms.size() == 1 && of_algorithm == std::ssize(failing)) {
    return fmt::format("all cases of {}", *algorithms.begin());
  }
  return fmt::format("{} of {} cases, in {} scene{}, by {}", failing.size(), checked.size(), scenes.size(),
                     scenes.size() == 1 ? "" : "s", fmt::join(algorithms, " "));
}

std::string first_frames(const std::vector<const Json*>& failing) {
  std::set<int> frames;
  for (const Json* entry : failing) {
    if (entry->at("poses").contains("motion"))
      frames.insert(entry->at("poses").at("motion").at("first_frame").get<int>());
  }
  frames.erase(-1);
  if (frames.empty()) return {};
  if (frames.size() == 1) return fmt::format(", from frame {} on", *frames.begin());
  return fmt::format(", first differing at frames {} to {}", *frames.begin(), *frames.rbegin());
}

/// Returns a key that separates the groups of one verdict. All cases that fail by a change of the program are
/// one group, and so are cases with the same change of input.
std::string origin_key(const Json& entry) {
  const auto verdict = verdict_named(entry.at("verdict").get<std::string>());
  const auto cause = entry.at("cause").get<std::string>();
  const bool is_of_input =
      verdict == Verdict::error || verdict == Verdict::scene_changed || verdict == Verdict::loading_changed;
  return is_of_input || cause == "light, camera or sky" ? cause : std::string();
}

}  // namespace

std::string shell_word(const std::string& word) {
  const bool is_plain = !word.empty() && std::ranges::all_of(word, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.' || c == '/';
  });
  if (is_plain) return word;
  std::string result(1, '\'');
  for (const char c : word) {
    if (c == '\'') result += "'\\'";
    result += c;
  }
  result += '\'';
  return result;
}

ResultsLocation location_of(const Json& results, const fs::path& output) {
  std::error_code none;
  const fs::path here = fs::current_path(none);
  const auto near = [&](const fs::path& path) {
    if (!path.is_absolute() || here.empty()) return path;
    const fs::path relative = path.lexically_relative(here);
    return relative.empty() || *relative.begin() == ".." ? path : relative;
  };
  return {near(results.at("suite").get<std::string>()), near(output)};
}

std::string approve_command(const Json& entry, const ResultsLocation& location) {
  const bool can_approve = entry.at("refusal").get<std::string>().empty() && entry.contains("candidates");
  if (!can_approve) return {};
  std::string command = "substep approve " + shell_word(entry.at("name").get<std::string>());
  if (location.suite != fs::path("golden/suite.toml"))
    command += fmt::format(" --suite {}", path_word(location.suite));
  if (location.output != fs::path("out/check"))
    command += fmt::format(" --output {}", path_word(location.output));
  return command + " --reason \"...\"";
}

std::string explanation(const Json& entry, const ResultsLocation& location) {
  const std::string command = approve_command(entry, location);
  return entry.at("text").get<std::string>() +
         fmt::format("  files    {}\n", (location.output / entry.at("files").get<std::string>()).string()) +
         fmt::format("  approve  {}\n", command.empty() ? fmt::format("not from this check: {}",
                                                                      entry.at("refusal").get<std::string>())
                                                        : command);
}

std::string FailureGroup::line() const {
  const auto simplest = cases.front()->at("name").get<std::string>();
  if (cases.size() == 1) {
    const auto cause = cases.front()->at("cause").get<std::string>();
    return fmt::format("{}, {}{}{}", simplest, verdict, cause.empty() ? "" : ": ", cause);
  }
  return fmt::format("{} cases, {}: {}; simplest: {}", cases.size(), verdict, origin, simplest);
}

std::vector<FailureGroup> failure_groups(const Json& results) {
  const Json& checked = results.at("cases");
  std::vector<FailureGroup> groups;
  for (const std::string_view verdict : verdict_names) {
    if (verdict == "pass") continue;
    std::map<std::string, std::vector<const Json*>> by_origin;
    for (const Json& entry : checked) {
      if (entry.at("verdict") == verdict) by_origin[origin_key(entry)].push_back(&entry);
    }
    std::vector<FailureGroup> found;
    for (auto& [key, cases] : by_origin) {
      std::ranges::stable_sort(cases, {}, [](const Json* e) { return e->at("poses").value("bodies", 0); });
      const std::string which = which_cases(cases, checked) + first_frames(cases);
      found.push_back({std::string(verdict), fmt::format("{}{}{}", key, key.empty() ? "" : ", ", which),
                       std::move(cases)});
    }
    const auto size = [](const FailureGroup& group) { return group.cases.size(); };
    std::ranges::stable_sort(found, std::ranges::greater(), size);
    groups.insert(groups.end(), found.begin(), found.end());
  }
  return groups;
}

}  // namespace substep::golden
