#include "page_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "program.h"
#include "sim/error.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view begins = "<!-- measured: ";
constexpr std::string_view closes = " -->\n";
constexpr std::string_view ends = "<!-- end -->";
constexpr std::string_view program = "substep ";

}  // namespace

std::vector<std::string> page_names() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(fs::path(SUBSTEP_SOURCE_DIR) / "scenes")) {
    if (entry.path().extension() == ".gltf") names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  names.emplace_back("README");
  return names;
}

fs::path page_file(const std::string& name) {
  if (name == "README") return fs::path(SUBSTEP_SOURCE_DIR) / "README.md";
  return fs::path(SUBSTEP_SOURCE_DIR) / "scenes" / (name + ".md");
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
  std::size_t place = 0;
  while ((place = page.find(begins, place)) != std::string::npos) {
    const std::size_t words = place + begins.size();
    const std::size_t text = page.find(closes, words);
    const std::size_t end = text == std::string::npos ? text : page.find(ends, text);
    if (end == std::string::npos) throw Error(fmt::format("'{}' has no end", page.substr(place, 80)));
    tables.push_back({page.substr(words, text - words), text + closes.size(), end});
    place = end;
  }
  return tables;
}

std::string printed(const PageTable& table) {
  if (!table.command.starts_with(program))
    throw Error(fmt::format("'{}': is no command of substep", table.command));
  const std::string command = fmt::format("cd {} && {} {} </dev/null", quoted(SUBSTEP_SOURCE_DIR),
                                          quoted(SUBSTEP_PROGRAM), table.command.substr(program.size()));
  std::FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) throw Error(fmt::format("'{}': cannot be run", table.command));
  std::string text;
  std::array<char, 4096> part{};
  while (const std::size_t count = std::fread(part.data(), 1, part.size(), pipe))
    text.append(part.data(), count);
  if (pclose(pipe) != 0) throw Error(fmt::format("'{}': failed", table.command));
  return text;
}

}  // namespace substep
