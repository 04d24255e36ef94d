#include "render/report/document.h"

#include <fmt/format.h>

#include "render/markup.h"

namespace substep {
namespace {

/// What is between ** is strong, what is between ` is code.
std::string with_marks(const std::string& text) {
  std::string result;
  bool is_strong = false;
  bool is_code = false;
  const std::string safe = escaped(text);
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
std::string data_address(const std::string& svg) {
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

constexpr std::string_view style =
    ":root{color-scheme:light dark}"
    "body{font:16px/1.5 system-ui,'DejaVu Sans',sans-serif;max-width:1240px;margin:2em auto;padding:0 1.2em}"
    "p{max-width:52em}h2{margin-top:2.2em;border-bottom:1px solid #8886}h3{margin-top:1.8em}"
    ".table{overflow-x:auto}table{border-collapse:collapse;font-size:13.5px;font-variant-numeric:tabular-"
    "nums}"
    "th,td{padding:.22em .7em;border-bottom:1px solid #8885;text-align:right;white-space:nowrap}"
    "th:first-child,td:first-child{text-align:left}th{border-bottom-color:#888}"
    "img{max-width:100%;display:block;margin:1em 0}code{font-size:.92em}";

std::string html_table(const TextTable& table) {
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

}  // namespace

std::string to_markdown(const Document& document) {
  std::string text;
  for (const Block& block : document.blocks) {
    if (!text.empty()) text += '\n';
    switch (block.kind) {
      case Block::Kind::heading:
        text += fmt::format("{} {}\n", std::string(static_cast<std::size_t>(block.level), '#'), block.text);
        break;
      case Block::Kind::paragraph:
        text += fmt::format("{}\n", block.text);
        break;
      case Block::Kind::table:
        text += to_markdown(block.table);
        break;
      case Block::Kind::picture:
        text += fmt::format("![{}]({})\n", block.text, block.file);
        break;
    }
  }
  return text;
}

std::string to_html(const Document& document) {
  std::string title = "substep";
  std::string body;
  for (const Block& block : document.blocks) {
    switch (block.kind) {
      case Block::Kind::heading:
        if (block.level == 1) title = block.text;
        body += fmt::format("<h{0}>{1}</h{0}>\n", block.level, with_marks(block.text));
        break;
      case Block::Kind::paragraph:
        body += fmt::format("<p>{}</p>\n", with_marks(block.text));
        break;
      case Block::Kind::table:
        body += html_table(block.table);
        break;
      case Block::Kind::picture:
        body += fmt::format("<img alt=\"{}\" src=\"{}\">\n", escaped(block.text), data_address(block.svg));
        break;
    }
  }
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>{}</title><style>{}</style></head><body>\n{}</body></html>\n",
      escaped(title), style, body);
}

}  // namespace substep
