#pragma once
/// A page of headings, paragraphs, tables and pictures, as Markdown and as one HTML file.

#include <string>
#include <utility>
#include <vector>

#include "sim/measure/text_table.h"

namespace substep::report {

/// A page as a sequence of blocks.
struct Document {
  struct Block {
    enum class Kind { heading, paragraph, table, picture, card_begin, card_end } kind;
    std::string text = {};     ///< heading, paragraph: text with ** and ` as marks; picture: description
    int level = 0;             ///< heading: 1 is the page's title
    TextTable table = {};      ///< table
    std::string file = {};     ///< picture: beside the Markdown page
    std::string content = {};  ///< picture: SVG; PNG where `file` ends in .png
    /// Picture: more files, by the extension that replaces the picture's.
    std::vector<std::pair<std::string, std::string>> other_files = {};
  };

  std::vector<Block> blocks;

  void heading(int level, std::string text) {
    blocks.push_back({.kind = Block::Kind::heading, .text = std::move(text), .level = level});
  }
  void paragraph(std::string text) {
    blocks.push_back({.kind = Block::Kind::paragraph, .text = std::move(text)});
  }
  void table(TextTable rows) { blocks.push_back({.kind = Block::Kind::table, .table = std::move(rows)}); }
  void picture(std::string about, std::string file, std::string content,
               std::vector<std::pair<std::string, std::string>> other_files = {}) {
    blocks.push_back({.kind = Block::Kind::picture,
                      .text = std::move(about),
                      .file = std::move(file),
                      .content = std::move(content),
                      .other_files = std::move(other_files)});
  }
  /// Begins a frame around the blocks until end_card().
  void begin_card() { blocks.push_back({.kind = Block::Kind::card_begin}); }
  void end_card() { blocks.push_back({.kind = Block::Kind::card_end}); }
};

std::string to_markdown(const Document& document);
/// Returns a page that needs no other file and follows the reader's dark mode.
std::string to_html(const Document& document);

/// Returns the table alone, with ** and ` of its cells as tags.
std::string to_html(const TextTable& table);

}  // namespace substep::report
