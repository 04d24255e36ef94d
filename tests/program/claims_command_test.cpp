#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "program.h"

namespace substep {
namespace {

using testing::HasSubstr;

class ClaimsCommand : public Program {
 protected:
  static std::string scenes() { return std::string(SUBSTEP_SOURCE_DIR) + "/scenes"; }
};

TEST_F(ClaimsCommand, WritesTheTablesAndTheMap) {
  const Outcome outcome = run(
      {"claims", "--scenes", scenes(), "--format", "markdown", "--output", "claims.md", "--map", "map.svg"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(files(), testing::ElementsAre("claims.md", "map.svg"));
  const std::string table = content("claims.md");
  for (int number = 1; number <= 14; ++number)
    EXPECT_THAT(table, HasSubstr("\n| " + std::to_string(number) + " | "));
  EXPECT_THAT(table, HasSubstr("| frozen Jacobian | "));
  const std::string map = content("map.svg");
  EXPECT_THAT(map, HasSubstr("<svg"));
  for (const char* const text : {"A3", "A4", "A5", "stable", "unstable", "τ = 4 − 2κ", "</svg>"}) {
    EXPECT_THAT(map, HasSubstr(text));
  }
}

TEST_F(ClaimsCommand, WhatCannotBeUsedIsRefused) {
  expect_refused({"claims", "--scenes", scenes(), "--format", "html"}, "--format 'html'");
  expect_refused({"claims", "--scenes", "nowhere"}, "nowhere");
  expect_refused({"claims", "--scenes", scenes(), "--output", "nowhere/claims.md"}, "nowhere");
  expect_refused({"claims", "--scenes", scenes(), "--map", "nowhere/map.svg"}, "nowhere");
}

TEST_F(ClaimsCommand, WithoutGnuplotItSaysWhatToInstall) {
  const Outcome outcome = run({"claims", "--scenes", scenes(), "--map", "map.svg"}, "");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("apt-get install gnuplot-nox"));
  EXPECT_TRUE(files().empty());
}

}  // namespace
}  // namespace substep
