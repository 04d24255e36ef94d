#include "golden/report/report_case.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>

#include "golden/compare/provenance.h"
#include "render/markup.h"
#include "sim/math/base64.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::string pair_title(const Json& pair) {
  const auto about = pair.at("about").get<std::string>();
  const std::string frame = fmt::format("Frame {}", pair.at("frame").get<int>());
  if (about == "renderer")
    return frame + ": the renderer’s part – golden picture, and golden poses drawn now";
  if (about == "simulation") return frame + ": the simulation’s part – golden and new poses, both drawn now";
  if (about == "first visible") return frame + ": the first whose picture is another – old and new poses";
  return frame + ": no golden to compare with";
}

std::string pair_block(const Json& pair, const Json& entry, ReportPictures& pictures) {
  std::string html = fmt::format("<div class=\"pair\"><h3>{}</h3>\n", pair_title(pair));
  html += "<div class=\"pictures\">\n";
  const fs::path folder = entry.at("files").get<std::string>();
  constexpr std::array<std::array<const char*, 2>, 3> kinds{
      {{"expected", "before"},
       {"actual", "after"},
       {"flip", "FLIP: black is not visible, pale yellow most"}}};
  for (const auto& [kind, caption] : kinds) {
    const auto file = pair.at(kind).get<std::string>();
    if (file.empty()) continue;
    fmt::format_to(
        std::back_inserter(html),
        "<figure><img data-what=\"{}\" loading=\"lazy\" width=\"{}\" height=\"{}\" alt=\"{} of frame "
        "{}\" src=\"{}\"><figcaption>{}</figcaption></figure>\n",
        kind, entry.at("size").at(0).get<int>(), entry.at("size").at(1).get<int>(), caption,
        pair.at("frame").get<int>(), pictures.source(folder, file), caption);
  }
  return html + "</div>\n</div>\n";
}

}  // namespace

std::string ReportPictures::source(const fs::path& folder, const std::string& file) {
  const fs::path path = output_ / folder.filename() / file;
  std::error_code none;
  if (fs::file_size(path, none) > budget_) return render::escaped((folder.filename() / file).string());
  const std::string data = "data:image/png;base64," + base64(read_bytes(path));
  if (data.size() > budget_) return render::escaped((folder.filename() / file).string());
  budget_ -= data.size();
  return data;
}

namespace {

/// Returns a link to the page that plays the run beside its golden one, from half a second before they
/// diverge.
std::string player_link(const Json& entry) {
  const std::string file = entry.at("files").get<std::string>() + "/" + entry.at("player").get<std::string>();
  const int diverged = entry.at("poses").at("motion").at("first_frame");
  const double time = std::max(0.0, diverged * entry.at("step").get<double>() - 0.5);
  return fmt::format(
      "<p>Play it beside its golden run, and turn and measure both: <a href=\"{0}#t={1:.3f}\">{0}</a></p>\n",
      render::escaped(file), time);
}

}  // namespace

std::string case_section(const Json& entry, const ResultsLocation& location, ReportPictures& pictures) {
  std::string html = fmt::format(
      "<section class=\"case\" id=\"{0}\">\n<header><h2>{0}</h2><span class=\"verdict "
      "{1}\">{2}</span></header>\n",
      text_of(entry.at("name")), css_class(entry.at("verdict")), text_of(entry.at("meaning")));
  if (!entry.at("cause").get<std::string>().empty()) {
    html += fmt::format("<p>Cause: <b>{}</b></p>\n", text_of(entry.at("cause")));
  }
  if (entry.contains("player")) html += player_link(entry);
  const std::string command = approve_command(entry, location);
  if (command.empty()) {
    html += fmt::format("<p class=\"quiet\">Cannot be approved from this check: {}.</p>\n",
                        text_of(entry.at("refusal")));
  } else {
    html += fmt::format("<div class=\"command\"><span>approve</span><code>{}</code></div>\n",
                        render::escaped(command));
  }
  html += fmt::format("<pre>{}</pre>\n", text_of(entry.at("text")));
  for (const Json& pair : entry.at("pairs")) html += pair_block(pair, entry, pictures);
  return html + "</section>\n";
}

std::string text_of(const Json& json) {
  return render::escaped(json.get<std::string>());
}

std::string css_class(std::string verdict) {
  std::replace(verdict.begin(), verdict.end(), ' ', '-');
  return verdict;
}

}  // namespace substep::golden
