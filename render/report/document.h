#pragma once
/// A page of headings, paragraphs, tables and pictures, as Markdown and as one HTML file.

#include <string>
#include <utility>
#include <vector>

#include "sim/measure/text_table.h"

namespace substep::report {

/// A page as a sequence of blocks.
struct Document {
  /// A heading, paragraph, table or picture; or where a card of several of them begins and ends.
  struct Block {
    enum class Kind { heading, paragraph, table, picture, card_begin, card_end } kind;
    std::string text;  ///< heading, paragraph: Markdown with ** for what is strong; picture: what it shows
    int level = 2;     ///< heading: 1 is the page's title
    TextTable table;
    std::string file;     ///< picture: beside the Markdown page
    std::string content;  ///< picture: SVG, or PNG where its file is named so
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
  void begin_card() { blocks.push_back({Block::Kind::card_begin, {}, 0, {}, {}, {}, {}}); }
  void end_card() { blocks.push_back({Block::Kind::card_end, {}, 0, {}, {}, {}, {}}); }
  void picture(std::string about, std::string file, std::string content) {
    blocks.push_back(
        {Block::Kind::picture, std::move(about), 0, {}, std::move(file), std::move(content), {}});
  }
};

std::string to_markdown(const Document& document);
/// Needs no other file; follows the reader's dark mode.
std::string to_html(const Document& document);

/// The table alone, with the marks of paragraphs in its cells.
std::string to_html(const TextTable& table);

}  // namespace substep::report
