#pragma once
/// The tables on the scenes' pages that the program prints: what stands between `<!-- measured: COMMAND -->`
/// and `<!-- end -->`.

#include <filesystem>
#include <string>
#include <vector>

namespace substep {

/// Pages of the scenes in scenes/, by their scenes' names, sorted; then "README", the project's.
std::vector<std::string> page_names();

std::filesystem::path page_file(const std::string& name);

/// A part of a page that a command prints.
struct PageTable {
  std::string command;    ///< "substep measure scenes/pendulum.gltf --markdown"
  std::size_t begin = 0;  /// of what it printed, in the page
  std::size_t end = 0;
};

/// In their order. Throws Error where a mark has no end.
std::vector<PageTable> tables_of(const std::string& page);

/// Without the digits after each ~: timings differ from run to run.
std::string without_timings(const std::string& text);

/// What the command prints now, run in the project's folder. Throws Error when it fails.
std::string printed(const PageTable& table);

}  // namespace substep
