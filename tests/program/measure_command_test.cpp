#include <gmock/gmock.h>

#include <algorithm>
#include <sstream>

#include "program.h"

namespace substep {
namespace {

using testing::HasSubstr;

class MeasureCommand : public Program {};

TEST_F(MeasureCommand, PrintsTheSameTwiceAndAllFive) {
  const std::vector<std::string> arguments{
      "measure", scene("rod_chain.gltf"), "--duration", "0.5", "--substeps", "4"};
  const Outcome one = run(arguments);
  ASSERT_EQ(one.exit_code, 0) << one.err;
  EXPECT_EQ(one.err, "");
  EXPECT_EQ(one.out, run(arguments).out);
  EXPECT_THAT(one.out, HasSubstr("A1: h=1/60. A2: m=4 h=1/60. "
                                 "A3 to A5: n=4 m=1 τ=0.6/0.9 κ=1/0.7 stable h=1/60.\n"));
  for (const char* const row : {"\nA1 ", "\nA2 ", "\nA3 "}) EXPECT_THAT(one.out, HasSubstr(row));
  EXPECT_THAT(one.out, HasSubstr("Reference: own of order 12 at h"));
}

TEST_F(MeasureCommand, WritesMarkdownAndJson) {
  ASSERT_EQ(
      run({"measure", scene("pendulum.gltf"), "--duration", "0.2", "--markdown", "--output", "table.md"})
          .exit_code,
      0);
  EXPECT_THAT(content("table.md"), HasSubstr("|---|---:|"));
  ASSERT_EQ(run({"measure", scene("pendulum.gltf"), "--duration", "0.2", "--json", "--times", "1", "--output",
                 "table.json"})
                .exit_code,
            0);
  EXPECT_THAT(content("table.json"), HasSubstr("\"s3\""));
}

TEST_F(MeasureCommand, PrintsAtMostSevenColumnsUnlessAll) {
  const auto columns = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"measure", scene("rod_chain.gltf"), "--duration", "1", "--markdown"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    std::istringstream lines(run(arguments).out);
    std::ptrdiff_t most = 0;
    for (std::string line; std::getline(lines, line);)
      most = std::max(most, std::ranges::count(line, '|') - 1);
    return most;
  };
  EXPECT_EQ(columns({}), 7);
  EXPECT_EQ(columns({"--times", "1"}), 7);
  EXPECT_GT(columns({"--all"}), 7);
}

TEST_F(MeasureCommand, GivesAllAsManyRowSolves) {
  const Outcome outcome = run({"measure", scene("heavy_chain.gltf"), "--duration", "1", "--set", "tau=1",
                               "--substeps", "8", "--equal-rows", "--brief", "--markdown"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  // A1 and A2 take the step in eight parts, which is when A1 holds the chain.
  EXPECT_THAT(outcome.out, testing::ContainsRegex("A1  h=1/60 . 158[0-9][0-9] .[^\n]* yes"));
  for (const char* const row :
       {"A2  m=1  h=1/60 | 15840 |", "A2  m=1  h=1/480 | 15840 |", "A3  n=8 m=1 stable  h=1/60 | 15840 |"})
    EXPECT_THAT(outcome.out, HasSubstr(row));
}

TEST_F(MeasureCommand, RefusesWhatItCannotMeasure) {
  expect_refused({"measure", scene("pendulum.gltf"), "--brief", "--json"},
                 "--brief and --json: give one of them");
  expect_refused({"measure", scene("pendulum.gltf"), "--brief", "--all"}, "give one of them");
  expect_refused({"measure", scene("pendulum.gltf"), "--step", "0.01"}, "must be a whole part or multiple");
  expect_refused({"measure", scene("pendulum.gltf"), "--set", "joints=loose"}, "give rows, plain or stable");
  expect_refused({"measure", scene("pendulum.gltf"), "--substeps", "0"}, "substeps 0");
  expect_refused({"measure", scene("pendulum.gltf"), "--horizon", "0"}, "must be above 0");
  expect_refused({"measure", scene("pendulum.gltf"), "--json", "--markdown"}, "give one of them");
  expect_refused({"measure", "nothing.gltf"}, "nothing.gltf");
}

}  // namespace
}  // namespace substep
