// Expects that the tables on pages equal the program's output. Where they differ, `cmake --build build
// --target pages` rewrites all pages, and `build/tests/program/rewrite_pages NAME…` those of some scenes.

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "page_tables.h"

namespace substep {
namespace {

class EachPage : public testing::TestWithParam<std::string> {};

TEST_P(EachPage, HoldsWhatTheProgramPrints) {
  std::ifstream file(page_file(GetParam()));
  const std::string page((std::istreambuf_iterator<char>(file)), {});
  const std::vector<PageTable> tables = tables_of(page);
  EXPECT_FALSE(tables.empty());
  for (const PageTable& table : tables)
    EXPECT_EQ(without_timings(printed(table)),
              without_timings(page.substr(table.begin, table.end - table.begin)))
        << table.command;
}

INSTANTIATE_TEST_SUITE_P(Pages, EachPage, testing::ValuesIn(page_names()),
                         [](const auto& instance) { return instance.param; });

}  // namespace
}  // namespace substep
