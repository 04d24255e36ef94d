#pragma once
/// The tables on the scenes' pages that the program prints. A table stands between `<!-- measured -->` and
/// `<!-- end -->`; the last `build/substep …` in backticks before it prints it.

#include <filesystem>
#include <string>
#include <vector>

namespace substep {

/// Returns the names of all scenes, sorted, "descendants", and "README" for the project's page.
std::vector<std::string> page_names();

std::filesystem::path page_file(const std::string& name);

/// A table on a page and the command that prints it.
struct PageTable {
  std::string command;    ///< arguments of the program: "measure scenes/pendulum.gltf --markdown"
  std::size_t begin = 0;  ///< index of the table's first character in the page
  std::size_t end = 0;    ///< index behind its last one
};

/// Returns the page's tables in their order. Throws Error where a mark has no end or no command.
std::vector<PageTable> tables_of(const std::string& page);

/// Returns the text without the digits after each ~, since timings differ from run to run.
std::string without_timings(const std::string& text);

/// Runs the table's command in the project's folder and returns what it prints. Throws Error when it fails.
std::string printed(const PageTable& table);

}  // namespace substep
