#include "golden/report/report_case.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>

#include "golden/compare/blame.h"
#include "golden/compare/provenance.h"
#include "golden/report/error_strip.h"
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

std::string comparison_text(const Json& comparison) {
  if (!comparison.contains("above")) return text_of(comparison.at("judgement"));
  const auto count = comparison.at("above").at(0).get<std::int64_t>();
  std::string text = fmt::format("{} px differ ({:.3g} %), most by {} levels at ({}, {})", count,
                                 100.0 * static_cast<double>(count) / comparison.at("pixels").get<double>(),
                                 comparison.at("max").get<int>(), comparison.at("max_at").at(0).get<int>(),
                                 comparison.at("max_at").at(1).get<int>());
  if (comparison.contains("flip")) {
    const Json& flip = comparison.at("flip");
    text += fmt::format(" · FLIP mean {:.4f}, 99 % {:.2f}, max {:.2f}: <b>{}</b>",
                        flip.at("mean").get<double>(), flip.at("percentile_99").get<double>(),
                        flip.at("max").get<double>(), text_of(flip.at("visibility")));
  }
  return text;
}

std::string percent(const Json& part, const Json& whole) {
  const auto count = whole.get<double>();
  return count > 0 ? fmt::format("{:.1f} %", 100 * part.get<double>() / count) : std::string("–");
}

/// A body's colour in the picture of differing pixels, and its name.
std::string body_label(const Json& body) {
  const std::array<std::uint8_t, 3> color = blame_color(body.at("body").get<int>());
  return fmt::format("<span class=\"swatch\" style=\"background:rgb({},{},{})\"></span>{}{}", color[0],
                     color[1], color[2], text_of(body.at("name")),
                     body.at("gone").get<bool>() ? " (not drawn any more)" : "");
}

/// Which bodies differ most, in words.
std::string blame_line(const Json& blame) {
  std::string html = fmt::format("<p class=\"legend\">{} of the foreground differs",
                                 percent(blame.at("differing_foreground"), blame.at("foreground")));
  if (blame.at("everywhere").get<bool>()) {
    html += ", all over the picture: light, camera or sky, not one body";
  }
  html += ". Weighed by levels: ";
  std::int64_t levels = 0;
  for (const Json& body : blame.at("bodies")) levels += body.at("levels").get<std::int64_t>();
  constexpr std::size_t most = 6;
  for (std::size_t i = 0; i < std::min(most, blame.at("bodies").size()); ++i) {
    const Json& body = blame.at("bodies").at(i);
    html += fmt::format("<span>{} {}</span> ", body_label(body), percent(body.at("levels"), Json(levels)));
  }
  return html + "</p>\n";
}

std::string blame_table(const Json& comparison) {
  if (!comparison.contains("blame")) return {};
  const Json& blame = comparison.at("blame");
  std::string html = blame_line(blame);
  html +=
      "<details><summary>Differing pixels by body</summary><table><tr><th>body</th><th class=\"number\">"
      "pixels</th><th class=\"number\">of all that differ</th><th class=\"number\">of the body</th></tr>\n";
  for (const Json& body : blame.at("bodies")) {
    html += fmt::format(
        "<tr><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td "
        "class=\"number\">{}</td>"
        "</tr>\n",
        body_label(body), body.at("differing").get<std::int64_t>(),
        percent(body.at("differing"), comparison.at("above").at(0)),
        percent(body.at("differing"), body.at("pixels")));
  }
  return html + "</table></details>\n";
}

std::string pair_block(const Json& pair, const Json& entry, ReportPictures& pictures) {
  std::string html = fmt::format("<div class=\"pair\"><h3>{}</h3>\n", pair_title(pair));
  if (pair.at("about") != "only") html += "<p>" + comparison_text(pair.at("comparison")) + "</p>\n";
  html += "<div class=\"pictures\">\n";
  const fs::path folder = entry.at("files").get<std::string>();
  constexpr std::array<std::array<const char*, 2>, 5> kinds{
      {{"expected", "before"},
       {"actual", "after"},
       {"difference", "difference × 16"},
       {"flip", "FLIP: black is not visible, pale yellow most"},
       {"bodies", "differing pixels by body"}}};
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
  return html + "</div>\n" + blame_table(pair.at("comparison")) + "</div>\n";
}

/// The script puts in where the report lies, when it was moved.
std::string command(const char* label, const ApproveCommand& words, const char* style) {
  return fmt::format(
      "<div class=\"command\"><span>{}</span><code class=\"{}\">{}<span "
      "class=\"output\">{}</span>{}</code></div>\n",
      label, style, render::escaped(words.before), render::escaped(words.output),
      render::escaped(words.after));
}

/// What the poses say, in words.
std::string facts(const Json& entry) {
  const Json& poses = entry.at("poses");
  if (!poses.contains("motion") || poses.at("motion").at("first_frame").get<int>() < 0) return {};
  const Json& motion = poses.at("motion");
  std::string html = "<dl class=\"facts\">\n";
  const auto add = [&](const char* term, const std::string& text) {
    html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", term, text);
  };
  const int first = motion.at("first_frame");
  std::string change = fmt::format("frame {} ({:.3f} s)", first, first * entry.at("step").get<double>());
  if (!motion.at("body").get<std::string>().empty()) {
    change += fmt::format(": {}, {}", text_of(motion.at("body")), text_of(motion.at("change")));
  }
  const std::size_t bodies = motion.at("first_bodies").size();
  if (bodies > 1) change += fmt::format("; {} bodies change in this frame", bodies);
  add("first difference", change);
  if (motion.at("limit_frame").get<int>() >= 0) {
    add("beyond tolerance",
        fmt::format("frame {}: {}", motion.at("limit_frame").get<int>(), text_of(motion.at("limit"))));
  }
  const int predicted = motion.at("predicted_frame");
  add("half a pixel", predicted < 0 ? "never, by the poses"
                                    : fmt::format("frame {}: {}, by the poses", predicted,
                                                  text_of(motion.at("predicted_body"))));
  const int visible = poses.at("visible_frame");
  add("first other picture",
      visible < 0 ? "none was found"
                  : fmt::format("frame {}, {} frames after the first difference", visible, visible - first));
  return html + "</dl>\n";
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

/// To the page that plays the run beside its golden one, from half a second before they part.
std::string player_link(const Json& entry) {
  const std::string file = entry.at("files").get<std::string>() + "/" + entry.at("player").get<std::string>();
  const int parted = entry.at("poses").at("motion").at("first_frame");
  const double time = std::max(0.0, parted * entry.at("step").get<double>() - 0.5);
  return fmt::format(
      "<p>Play it beside its golden run, and turn and measure both: <a href=\"{0}#t={1:.3f}\">{0}</a></p>\n",
      render::escaped(file), time);
}

/// Without its end.
std::string section_start(const Json& entry, const ResultsLocation& location) {
  const CaseCommands commands = commands_of(entry, location);
  std::string html = fmt::format(
      "<section class=\"case\" id=\"{0}\">\n<header><h2>{0}</h2><span class=\"verdict "
      "{1}\">{2}</span></header>\n",
      text_of(entry.at("name")), css_class(entry.at("verdict")), text_of(entry.at("meaning")));
  if (!entry.at("cause").get<std::string>().empty()) {
    html += fmt::format("<p>Cause: <b>{}</b></p>\n", text_of(entry.at("cause")));
  }
  if (entry.contains("player")) html += player_link(entry);
  if (commands.approve.is_there()) {
    html += command("approve", commands.approve, "approve");
  } else {
    html += fmt::format("<p class=\"quiet\">Cannot be approved from this check: {}.</p>\n",
                        text_of(entry.at("refusal")));
  }
  return html;
}

}  // namespace

std::string brief_section(const Json& entry, const ResultsLocation& location) {
  return section_start(entry, location) +
         fmt::format(
             "<p class=\"quiet\">More cases fail than fit on a page: the pictures of this one are in {}, its "
             "figures in results.json.</p>\n</section>\n",
             text_of(entry.at("files")));
}

std::string case_section(const Json& entry, const ResultsLocation& location, ReportPictures& pictures) {
  std::string html = section_start(entry, location);
  for (const Json& note : entry.at("notes")) html += fmt::format("<p>Note: {}</p>\n", text_of(note));
  html += facts(entry);
  const std::string strip = error_strip(entry.at("poses"));
  if (!strip.empty()) html += "<h3>Error over frames</h3>\n" + strip;
  for (const Json& pair : entry.at("pairs")) html += pair_block(pair, entry, pictures);
  return html + fmt::format(
                    "<details><summary>As printed in the terminal</summary><pre>{}</pre></details>\n"
                    "</section>\n",
                    render::escaped(explanation(entry, location)));
}

std::string text_of(const Json& json) {
  return render::escaped(json.get<std::string>());
}

std::string css_class(std::string verdict) {
  std::replace(verdict.begin(), verdict.end(), ' ', '-');
  return verdict;
}

}  // namespace substep::golden
