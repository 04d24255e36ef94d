#include "render/site/scene_page.h"

#include <fmt/format.h>

#include <algorithm>

#include "render/embedded_file.h"
#include "render/markup.h"
#include "render/report/document.h"
#include "render/site/markdown.h"
#include "render/video/comparison_table.h"
#include "render/video/composition.h"
#include "sim/log/file_output.h"

SUBSTEP_EMBEDDED_FILE(scene_html, SUBSTEP_SITE "/scene.html")
SUBSTEP_EMBEDDED_FILE(scene_css, SUBSTEP_SITE "/site.css")

namespace substep::render {
namespace {

namespace fs = std::filesystem;

}  // namespace

std::string in_address(std::string_view name) {
  std::string result;
  for (const char c : name) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                          c == '_' || c == '-' || c == '.' || c == '~';
    result += is_plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return result;
}

SceneText text_of(const Scene& scene) {
  SceneText text;
  text.title = film_title(scene, "");
  fs::path page = scene.file;
  text.rest = content_of(page.replace_extension(".md")).value_or("");
  std::erase(text.rest, '\r');
  const auto cut_line = [&] {
    const std::size_t end = std::min(text.rest.find('\n'), text.rest.size());
    std::string line = text.rest.substr(0, end);
    text.rest.erase(0, std::min(end + 1, text.rest.size()));
    return line;
  };
  if (text.rest.starts_with("# ")) text.title = cut_line().substr(2);
  text.rest.erase(0, std::min(text.rest.find_first_not_of('\n'), text.rest.size()));
  // A paragraph, not a table or a heading.
  while (!text.rest.empty() && text.rest[0] != '\n' && text.rest[0] != '|' && text.rest[0] != '#') {
    text.lead += cut_line() + '\n';
  }
  return text;
}

std::string html_of(const std::string& markdown, const std::vector<std::string>& names) {
  return html_of_markdown(markdown, [&](const std::string& given) -> std::string {
    const fs::path path = given.substr(0, given.find('#'));
    const bool is_beside = path == path.filename() && path.extension() == ".md";
    if (!is_beside || std::ranges::find(names, path.stem().string()) == names.end()) return "";
    return "../" + in_address(path.stem().string()) + "/index.html";
  });
}

std::string scene_page(const SceneText& text, const Comparison& comparison,
                       const std::vector<std::string>& names, bool film) {
  const std::string shown_film =
      film ? "<video controls loop muted preload=\"none\" poster=\"poster.png\" src=\"film.mp4\"></video>\n"
           : "";
  return filled(scene_html(), {{"title", escaped(text.title)},
                               {"style", std::string(scene_css())},
                               {"lead", html_of(text.lead, names)},
                               {"film", shown_film},
                               {"table", report::to_html(table_of(comparison, false))},
                               {"reference", escaped(words_on_reference(comparison))},
                               {"text", html_of(text.rest, names)}});
}

}  // namespace substep::render
