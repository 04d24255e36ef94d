#include "render/report/document.h"

#include <fmt/format.h>

#include "render/markup.h"
#include "sim/math/base64.h"

namespace substep::embedded {
std::string_view document_html();
std::string_view document_css();
}  // namespace substep::embedded

namespace substep::report {
namespace {

/// Returns escaped text in which ** and ` are tags.
std::string with_marks(const std::string& text) {
  std::string result;
  bool is_strong = false;
  bool is_code = false;
  const std::string safe = render::escaped(text);
  for (std::size_t i = 0; i < safe.size(); ++i) {
    if (safe.compare(i, 2, "**") == 0) {
      result += std::exchange(is_strong, !is_strong) ? "</strong>" : "<strong>";
      ++i;
    } else if (safe[i] == '`') {
      result += std::exchange(is_code, !is_code) ? "</code>" : "<code>";
    } else {
      result += safe[i];
    }
  }
  return result;
}

/// Returns the picture as a URL, which keeps the picture's styles and names apart from the page's.
std::string data_address(const Document::Block& picture) {
  const std::string& content = picture.content;
  if (picture.file.ends_with(".png")) return "data:image/png;base64," + base64(content);
  std::string result = "data:image/svg+xml;charset=utf-8,";
  for (const char c : content) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte >= 0x7f || c == '%' || c == '#' || c == '"' || c == '<' || c == '>' || c == '&') {
      result += fmt::format("%{:02X}", byte);
    } else {
      result += c;
    }
  }
  return result;
}

using Kind = Document::Block::Kind;

}  // namespace

std::string to_markdown(const Document& document) {
  std::string text;
  for (const Document::Block& block : document.blocks) {
    if (block.kind == Kind::card_begin || block.kind == Kind::card_end) continue;
    if (!text.empty()) text += '\n';
    if (block.kind == Kind::heading) {
      text += fmt::format("{:#>{}} {}\n", "", block.level, block.text);
    } else if (block.kind == Kind::paragraph) {
      text += block.text + "\n";
    } else if (block.kind == Kind::table) {
      text += to_markdown(block.table);
    } else {
      // Angle brackets allow spaces.
      text += fmt::format("![{}](<{}>)\n", block.text, block.file);
    }
  }
  return text;
}

std::string to_html(const TextTable& table) {
  const auto row = [](const std::vector<std::string>& cells, const char* tag) {
    std::string text = "<tr>";
    for (const std::string& cell : cells) text += fmt::format("<{0}>{1}</{0}>", tag, with_marks(cell));
    return text + "</tr>\n";
  };
  std::string text = "<div class=\"table\"><table>" + row(table.head, "th");
  for (const auto& cells : table.rows) text += row(cells, "td");
  return text + "</table></div>\n";
}

std::string to_html(const Document& document) {
  std::string title = "substep";
  std::string body;
  for (const Document::Block& block : document.blocks) {
    switch (block.kind) {
      case Kind::heading:
        if (block.level == 1) title = block.text;
        body += fmt::format("<h{0}>{1}</h{0}>\n", block.level, with_marks(block.text));
        break;
      case Kind::paragraph:
        body += fmt::format("<p>{}</p>\n", with_marks(block.text));
        break;
      case Kind::table:
        body += to_html(block.table);
        break;
      case Kind::picture:
        body += fmt::format("<div class=\"figure\"><img alt=\"{}\" src=\"{}\"></div>\n",
                            render::escaped(block.text), data_address(block));
        break;
      case Kind::card_begin:
        body += "<section class=\"card\">\n";
        break;
      case Kind::card_end:
        body += "</section>\n";
        break;
    }
  }
  std::string style(embedded::document_css());
  std::erase(style, '\n');
  return fmt::format(fmt::runtime(embedded::document_html()), fmt::arg("title", render::escaped(title)),
                     fmt::arg("style", style), fmt::arg("body", body));
}

}  // namespace substep::report
