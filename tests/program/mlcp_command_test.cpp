// Tests the output and refusals of `substep report mlcp` and of the command of published results.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "program.h"

namespace substep {
namespace {

class MlcpCommand : public Program {
 protected:
  /// One contact that slides, dense.
  void SetUp() override { write("one.dat", "3\n1\n0\n3\n3\n3 3\n2 0 0\n0 1 0\n0 0 1\n-2 3 0\n0.5\n"); }
};

TEST_F(MlcpCommand, PrintsErrorAndConvergence) {
  expect("report mlcp one.dat --markdown", 0,
         {"| one (1 contacts, asymmetry 0) | solved |", "| sweeps | natural-map error |"});
  printed("report mlcp one.dat one.dat");
  expect("report figure sweep-errors --problem one.dat --numbers", 0, {"one (1 contacts)"});
}

TEST_F(MlcpCommand, WritesSiconosText) {
  printed("report mlcp one.dat --siconos two.dat");
  printed("report mlcp two.dat --siconos three.dat");
  EXPECT_EQ(content("two.dat"), content("three.dat"));
}

TEST_F(MlcpCommand, FailsUnsolvedProblem) {
  // A normal whose impulse increases the approach.
  write("indefinite.dat", "3\n1\n0\n3\n3\n3 3\n-1 0 0\n0 1 0\n0 0 1\n-2 3 0\n0.5\n");
  expect("report mlcp indefinite.dat", 1, {"not solved"});
}

TEST_F(MlcpCommand, RefusesFilesByLine) {
  refuses("report figure sweep-errors --numbers", "--problem");
  refuses("report figure sweep-errors --problem nowhere.dat", "nowhere.dat");
  refuses("report mlcp one.dat --siconos one.dat", "one.dat");
  write("bad.dat", "3\n1\n0\n3\n3\n3 3\n2 0 zero\n");
  refuses("report mlcp bad.dat", "bad.dat:7: 'zero' is no number for a value of the matrix");
  refuses("report mlcp nowhere.dat", "nowhere.dat");
  refuses("report published nowhere.toml", "nowhere.toml");
}

}  // namespace
}  // namespace substep
