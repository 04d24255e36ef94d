#pragma once
/// A table of words, for a terminal or for a page.

#include <string>
#include <vector>

namespace substep {

struct TextTable {
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;  ///< as many cells as `head`
};

/// Columns padded to their widest cell: the first to the left, the others to the right.
std::string to_text(const TextTable& table);
std::string to_markdown(const TextTable& table);

/// Three digits; "–" for what is not finite or beyond a billion: a run that has gone so far has blown up.
std::string short_number(double value);

}  // namespace substep
