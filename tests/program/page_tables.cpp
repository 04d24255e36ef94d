#include "page_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "program.h"
#include "sim/error.h"
#include "tests/folders.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view mark = "<!-- measured -->\n";
constexpr std::string_view ends = "<!-- end -->";
constexpr std::string_view program = "`build/substep ";

/// Returns the arguments of the last command that the page shows in backticks.
std::string last_command(std::string_view page) {
  const std::size_t begin = page.rfind(program);
  const std::size_t end = begin == std::string_view::npos ? begin : page.find('`', begin + 1);
  if (end == std::string_view::npos) throw Error(fmt::format("no command {}…` before '{}'", program, mark));
  return std::string(page.substr(begin + program.size(), end - begin - program.size()));
}

}  // namespace

std::vector<std::string> page_names() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(fs::path(test::source_folder) / "scenes")) {
    if (entry.path().extension() == ".gltf") names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  names.emplace_back("published");
  names.emplace_back("descendants");
  names.emplace_back("README");
  return names;
}

fs::path page_file(const std::string& name) {
  if (name == "README") return fs::path(test::source_folder) / "README.md";
  return fs::path(test::source_folder) / "scenes" / (name + ".md");
}

std::string without_timings(const std::string& text) {
  std::string result;
  bool in_timing = false;
  for (const char c : text) {
    const bool is_digit = (c >= '0' && c <= '9') || c == '.' || c == 'e' || c == '+' || c == '-';
    in_timing = c == '~' || (in_timing && is_digit);
    if (!in_timing || c == '~') result += c;
  }
  return result;
}

std::vector<PageTable> tables_of(const std::string& page) {
  std::vector<PageTable> tables;
  std::size_t position = 0;
  while ((position = page.find(mark, position)) != std::string::npos) {
    const std::size_t begin = position + mark.size();
    const std::size_t end = page.find(ends, begin);
    if (end == std::string::npos) throw Error(fmt::format("'{}' has no end", page.substr(position, 80)));
    tables.push_back({last_command(std::string_view(page).substr(0, position)), begin, end});
    position = end;
  }
  return tables;
}

std::string printed(const PageTable& table) {
  const std::string command = fmt::format("cd {} && {} {} </dev/null", quoted(test::source_folder),
                                          quoted(SUBSTEP_PROGRAM), table.command);
  std::FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) throw Error(fmt::format("'substep {}': cannot be run", table.command));
  std::string text;
  std::array<char, 4096> part{};
  while (const std::size_t count = std::fread(part.data(), 1, part.size(), pipe))
    text.append(part.data(), count);
  if (pclose(pipe) != 0) throw Error(fmt::format("'substep {}': failed", table.command));
  return text;
}

}  // namespace substep
