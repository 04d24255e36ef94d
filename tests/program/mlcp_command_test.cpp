// substep mlcp, and the published results' command: what they print, and what they refuse.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "program.h"

namespace substep {
namespace {

using testing::HasSubstr;

class MlcpCommand : public Program {
 protected:
  /// One contact that slides, dense.
  void SetUp() override { write("one.dat", "3\n1\n0\n3\n3\n3 3\n2 0 0\n0 1 0\n0 0 1\n-2 3 0\n0.5\n"); }
};

TEST_F(MlcpCommand, PrintsErrorAndConvergence) {
  const Outcome outcome = run({"mlcp", "one.dat", "--markdown"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("| one (1 contacts, asymmetry 0) | solved |"));
  EXPECT_THAT(outcome.out, HasSubstr("| sweeps | natural-map error |"));
  EXPECT_EQ(run({"mlcp", "one.dat", "one.dat"}).exit_code, 0);
}

TEST_F(MlcpCommand, SweepsAreDrawn) {
  const Outcome outcome = run({"report", "figure", "sweep-errors", "--problem", "one.dat", "--numbers"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("one (1 contacts)"));
  expect_refused({"report", "figure", "sweep-errors", "--numbers"}, "--problem");
  expect_refused({"report", "figure", "sweep-errors", "--problem", "nowhere.dat"}, "nowhere.dat");
}

TEST_F(MlcpCommand, WritesSiconosText) {
  ASSERT_EQ(run({"mlcp", "one.dat", "--siconos", "two.dat"}).exit_code, 0);
  ASSERT_EQ(run({"mlcp", "two.dat", "--siconos", "three.dat"}).exit_code, 0);
  EXPECT_EQ(content("two.dat"), content("three.dat"));
  expect_refused({"mlcp", "one.dat", "--siconos", "one.dat"}, "one.dat");
}

TEST_F(MlcpCommand, EndsWithOneWhereNothingIsSolved) {
  // A normal that only grows deeper when it is pushed.
  write("indefinite.dat", "3\n1\n0\n3\n3\n3 3\n-1 0 0\n0 1 0\n0 0 1\n-2 3 0\n0.5\n");
  const Outcome outcome = run({"mlcp", "indefinite.dat"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.out, HasSubstr("not solved"));
}

TEST_F(MlcpCommand, RefusesFilesByLine) {
  write("bad.dat", "3\n1\n0\n3\n3\n3 3\n2 0 zero\n");
  expect_refused({"mlcp", "bad.dat"}, "bad.dat:7: 'zero' is no number for a value of the matrix");
  expect_refused({"mlcp", "nowhere.dat"}, "nowhere.dat");
  expect_refused({"report", "published", "nowhere.toml"}, "nowhere.toml");
}

}  // namespace
}  // namespace substep
