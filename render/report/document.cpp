#include "render/report/document.h"

#include <fmt/format.h>

#include "render/embedded_file.h"
#include "render/markup.h"
#include "sim/math/base64.h"

SUBSTEP_EMBEDDED_FILE(page_template, SUBSTEP_REPORT_PAGE "/document.html")
SUBSTEP_EMBEDDED_FILE(page_style, SUBSTEP_REPORT_PAGE "/document.css")

namespace substep::report {
namespace {

/// What is between ** is strong, what is between ` is code.
std::string with_marks(const std::string& text) {
  std::string result;
  bool is_strong = false;
  bool is_code = false;
  const std::string safe = render::escaped(text);
  for (std::size_t i = 0; i < safe.size(); ++i) {
    if (safe.compare(i, 2, "**") == 0) {
      result += is_strong ? "</strong>" : "<strong>";
      is_strong = !is_strong;
      ++i;
    } else if (safe[i] == '`') {
      result += is_code ? "</code>" : "<code>";
      is_code = !is_code;
    } else {
      result += safe[i];
    }
  }
  return result;
}

/// The picture as an address: it keeps its own styles and names to itself.
std::string data_address(const Document::Block& picture) {
  const std::string& svg = picture.content;
  if (picture.file.ends_with(".png")) return "data:image/png;base64," + base64(svg);
  std::string result = "data:image/svg+xml;charset=utf-8,";
  for (const char c : svg) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte >= 0x7f || c == '%' || c == '#' || c == '"' || c == '<' || c == '>' || c == '&') {
      result += fmt::format("%{:02X}", byte);
    } else {
      result += c;
    }
  }
  return result;
}

/// A file's lines without their ends, as the page has them.
std::string joined(std::string_view lines) {
  std::string text(lines);
  std::erase(text, '\n');
  return text;
}

}  // namespace

std::string to_markdown(const Document& document) {
  std::string text;
  for (const Document::Block& block : document.blocks) {
    if (block.kind == Document::Block::Kind::card_begin || block.kind == Document::Block::Kind::card_end)
      continue;
    if (!text.empty()) text += '\n';
    switch (block.kind) {
      case Document::Block::Kind::heading:
        text += fmt::format("{} {}\n", std::string(static_cast<std::size_t>(block.level), '#'), block.text);
        break;
      case Document::Block::Kind::paragraph:
        text += fmt::format("{}\n", block.text);
        break;
      case Document::Block::Kind::table:
        text += to_markdown(block.table);
        break;
      case Document::Block::Kind::picture:
        text += fmt::format("![{}]({})\n", block.text, block.file);
        break;
      default:
        break;
    }
  }
  return text;
}

std::string to_html(const TextTable& table) {
  std::string text = "<div class=\"table\"><table><tr>";
  for (const std::string& cell : table.head) text += fmt::format("<th>{}</th>", with_marks(cell));
  text += "</tr>\n";
  for (const auto& row : table.rows) {
    text += "<tr>";
    for (const std::string& cell : row) text += fmt::format("<td>{}</td>", with_marks(cell));
    text += "</tr>\n";
  }
  return text + "</table></div>\n";
}

std::string to_html(const Document& document) {
  std::string title = "substep";
  std::string body;
  for (const Document::Block& block : document.blocks) {
    switch (block.kind) {
      case Document::Block::Kind::heading:
        if (block.level == 1) title = block.text;
        body += fmt::format("<h{0}>{1}</h{0}>\n", block.level, with_marks(block.text));
        break;
      case Document::Block::Kind::paragraph:
        body += fmt::format("<p>{}</p>\n", with_marks(block.text));
        break;
      case Document::Block::Kind::table:
        body += to_html(block.table);
        break;
      case Document::Block::Kind::picture:
        body += fmt::format("<div class=\"figure\"><img alt=\"{}\" src=\"{}\"></div>\n",
                            render::escaped(block.text), data_address(block));
        break;
      case Document::Block::Kind::card_begin:
        body += "<section class=\"card\">\n";
        break;
      case Document::Block::Kind::card_end:
        body += "</section>\n";
        break;
    }
  }
  return fmt::format(fmt::runtime(page_template()), fmt::arg("title", render::escaped(title)),
                     fmt::arg("style", joined(page_style())), fmt::arg("body", body));
}

}  // namespace substep::report
