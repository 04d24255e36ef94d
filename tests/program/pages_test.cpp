/// Expects that the tables on the scenes' pages, published.md, descendants.md and README.md equal what the
/// program prints. A table stands between
/// `<!-- measured -->` and `<!-- end -->`; the last `build/substep …` in backticks before it prints it.
///
/// pages_test --rewrite [SCENE…]: writes what the program prints now into the tables, of all pages if none is
/// named. Text around the tables stays as it is.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <regex>
#include <string>
#include <vector>

#include "program.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "tests/folders.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

/// A table on a page and the command that prints it.
struct PageTable {
  std::string command;    ///< arguments of the program: "measure scenes/pendulum.gltf --markdown"
  std::size_t begin = 0;  ///< index of the table's first character in the page
  std::size_t end = 0;    ///< index one past its last character
};

/// Returns the names of all scenes, sorted, then "published", "descendants" and "README" (the project's
/// page).
std::vector<std::string> page_names() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(fs::path(test::source_folder) / "scenes")) {
    if (entry.path().extension() == ".gltf") names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  names.insert(names.end(), {"published", "descendants", "README"});
  return names;
}

fs::path page_file(const std::string& name) {
  return fs::path(test::source_folder) / (name == "README" ? "README.md" : "scenes/" + name + ".md");
}

/// Returns the page's tables in their order. Throws Error where a mark has no end or no command.
std::vector<PageTable> tables_of(const std::string& page) {
  constexpr std::string_view mark = "<!-- measured -->\n";
  constexpr std::string_view program = "`build/substep ";
  std::vector<PageTable> tables;
  for (std::size_t at = 0; (at = page.find(mark, at)) != std::string::npos;) {
    const std::size_t command = page.rfind(program, at);
    const std::size_t quote = command == std::string::npos ? command : page.find('`', command + 1);
    const std::size_t begin = at + mark.size();
    const std::size_t end = page.find("<!-- end -->", begin);
    if (quote >= at || end == std::string::npos)
      throw Error("'{}' has no end, or no command {}…` before it", page.substr(at, 80), program);
    tables.push_back({page.substr(command + program.size(), quote - command - program.size()), begin, end});
    at = end;
  }
  return tables;
}

/// Returns the text without the digits after each ~, since timings differ from run to run.
std::string without_timings(const std::string& text) {
  return std::regex_replace(text, std::regex("~[-+0-9.e]+"), "~");
}

/// Runs the table's command in the project's folder and returns what it prints. Throws Error when it fails.
std::string printed(const PageTable& table) {
  const std::string command = fmt::format("cd {} && {} {} </dev/null", quoted(test::source_folder),
                                          quoted(SUBSTEP_PROGRAM), table.command);
  std::FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) throw Error("'substep {}': cannot be run", table.command);
  std::string text;
  std::array<char, 4096> part{};
  while (const std::size_t count = std::fread(part.data(), 1, part.size(), pipe))
    text.append(part.data(), count);
  if (pclose(pipe) != 0) throw Error("'substep {}': failed", table.command);
  return text;
}

class EachPage : public testing::TestWithParam<std::string> {};

TEST_P(EachPage, EqualsProgramOutput) {
  const std::string page = content_of(page_file(GetParam())).value_or("");
  const std::vector<PageTable> tables = tables_of(page);
  EXPECT_FALSE(tables.empty());
  for (const PageTable& table : tables)
    EXPECT_EQ(without_timings(printed(table)),
              without_timings(page.substr(table.begin, table.end - table.begin)))
        << table.command;
}

INSTANTIATE_TEST_SUITE_P(Pages, EachPage, testing::ValuesIn(page_names()),
                         [](const auto& instance) { return instance.param; });

/// Rewrites the tables of a page that differ.
void rewrite(const std::string& name) {
  const fs::path file = page_file(name);
  const std::optional<std::string> page = content_of(file);
  if (!page) throw Error("{}: cannot be read", file.string());
  std::string rewritten;
  std::size_t position = 0;
  for (const PageTable& table : tables_of(*page)) {
    rewritten += page->substr(position, table.begin - position) + printed(table);
    position = table.end;
  }
  rewritten += page->substr(position);
  if (rewritten == *page) return;
  write_file(file, rewritten);
  fmt::print("wrote {}\n", file.string());
}

}  // namespace
}  // namespace substep

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (argc < 2 || std::string_view(argv[1]) != "--rewrite") return RUN_ALL_TESTS();
  try {
    const std::vector<std::string> named(argv + 2, argv + argc);
    for (const std::string& name : named.empty() ? substep::page_names() : named) substep::rewrite(name);
  } catch (const substep::Error& error) {
    fmt::print(stderr, "pages_test: {}\n", error.what());
    return 2;
  }
  return 0;
}
