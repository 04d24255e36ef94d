#pragma once
/// A page of headings, paragraphs, tables and pictures, as Markdown and as one HTML file.

#include <string>
#include <utility>
#include <vector>

#include "sim/measure/text_table.h"

namespace substep::report {

/// A page as a sequence of blocks.
struct Document {
  /// A heading, paragraph, table or picture.
  struct Block {
    enum class Kind { heading, paragraph, table, picture } kind;
    std::string text;  ///< heading, paragraph: Markdown with ** for what is strong; picture: what it shows
    int level = 2;     ///< heading: 1 is the page's title
    TextTable table;
    std::string file;                                              ///< picture: beside the Markdown page
    std::string svg;                                               ///< picture: its content
    std::vector<std::pair<std::string, std::string>> beside = {};  ///< picture: files with other extensions
  };

  std::vector<Block> blocks;

  void heading(int level, std::string text) {
    blocks.push_back({Block::Kind::heading, std::move(text), level, {}, {}, {}, {}});
  }
  void paragraph(std::string text) {
    blocks.push_back({Block::Kind::paragraph, std::move(text), 0, {}, {}, {}, {}});
  }
  void table(TextTable rows) { blocks.push_back({Block::Kind::table, {}, 0, std::move(rows), {}, {}, {}}); }
  void picture(std::string about, std::string file, std::string svg) {
    blocks.push_back({Block::Kind::picture, std::move(about), 0, {}, std::move(file), std::move(svg), {}});
  }
};

std::string to_markdown(const Document& document);
/// Needs no other file; follows the reader's dark mode.
std::string to_html(const Document& document);

/// The table alone, with the marks of paragraphs in its cells.
std::string to_html(const TextTable& table);

}  // namespace substep::report
