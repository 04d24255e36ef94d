#include "sim/measure/text_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace substep {
namespace {

/// Returns the number of code points of UTF-8 text.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(
      std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

}  // namespace

std::string to_text(const TextTable& table) {
  std::vector<std::size_t> widths;
  for (std::size_t i = 0; i < table.head.size(); ++i) {
    std::size_t widest = width(table.head[i]);
    for (const auto& row : table.rows) widest = std::max(widest, width(row[i]));
    widths.push_back(widest);
  }
  std::string text;
  const auto add = [&](const std::vector<std::string>& cells) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::string padding(widths[i] - width(cells[i]), ' ');
      const bool is_last = i + 1 == cells.size();
      text += i == 0 ? fmt::format("{}{}", cells[i], is_last ? "" : padding)
                     : fmt::format("  {}{}", padding, cells[i]);
    }
    text += '\n';
  };
  add(table.head);
  for (const auto& row : table.rows) add(row);
  return text;
}

std::string to_markdown(const TextTable& table) {
  std::string text;
  const auto add = [&](const std::vector<std::string>& cells) {
    text += '|';
    for (const std::string& cell : cells) {
      text += ' ';
      for (const char c : cell) text += c == '|' ? std::string("\\|") : std::string(1, c);
      text += " |";
    }
    text += '\n';
  };
  add(table.head);
  text += "|---|";
  for (std::size_t i = 1; i < table.head.size(); ++i) text += "---:|";
  text += '\n';
  for (const auto& row : table.rows) add(row);
  return text;
}

std::string to_text(const TextTable& table, bool as_markdown) {
  return as_markdown ? to_markdown(table) : to_text(table);
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? std::string("\"\"") : std::string(1, c);
  return field + "\"";
}

std::string short_number(double value) {
  if (!(std::abs(value) < 1e9)) return "–";
  // Hide the digits of rounding errors, which depend on the order of sums.
  if (value != 0 && std::abs(value) < 1e-12) return "<1e-12";
  return fmt::format("{:.3g}", value);
}

}  // namespace substep
