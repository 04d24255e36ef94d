#pragma once
/// A table of text cells, for a terminal or for a page.

#include <string>
#include <vector>

namespace substep {

struct TextTable {
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;  ///< as many cells as `head`
};

/// Returns the table with columns padded to their widest cell, the first aligned left, the others right.
std::string to_text(const TextTable& table);
std::string to_markdown(const TextTable& table);
/// Returns the table in one of the two forms.
std::string to_text(const TextTable& table, bool as_markdown);

/// Returns the text as a CSV field, quoted where it has commas or quotes.
std::string csv_field(const std::string& text);

/// Returns three digits; "–" for numbers that are not finite or above a billion, as of a diverged run.
std::string short_number(double value);

}  // namespace substep
