/// rewrite_pages [SCENE…]: writes what the program prints now into the tables of the scenes' pages, of all
/// without names. Text around the tables stays as it is.

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

#include "page_tables.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace {

/// Whether the page changed.
bool rewrite(const std::string& name) {
  const std::filesystem::path path = substep::page_file(name);
  std::ifstream file(path, std::ios::binary);
  if (!file) throw substep::Error(fmt::format("{}: cannot be read", path.string()));
  const std::string page((std::istreambuf_iterator<char>(file)), {});
  std::string rewritten;
  std::size_t place = 0;
  for (const substep::PageTable& table : substep::tables_of(page)) {
    rewritten += page.substr(place, table.begin - place) + substep::printed(table);
    place = table.end;
  }
  rewritten += page.substr(place);
  if (rewritten == page) return false;
  substep::write_file(path, rewritten);
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::vector<std::string> names =
        argc > 1 ? std::vector<std::string>(argv + 1, argv + argc) : substep::page_names();
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (isatty(STDERR_FILENO) != 0)
        fmt::print(stderr, "\r\033[K{} of {}: {}", i + 1, names.size(), names[i]);
      const bool changed = rewrite(names[i]);
      if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r\033[K");
      if (changed) fmt::print("wrote scenes/{}.md\n", names[i]);
    }
  } catch (const substep::Error& error) {
    fmt::print(stderr, "rewrite_pages: {}\n", error.what());
    return 2;
  }
  return 0;
}
