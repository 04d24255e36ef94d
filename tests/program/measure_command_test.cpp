#include <gmock/gmock.h>
#include <sys/stat.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <string>

#include "program.h"

namespace substep {
namespace {

using testing::HasSubstr;

using MeasureCommand = Program;

TEST_F(MeasureCommand, RepeatsByteByByte) {
  const std::string words = "measure $S/rod_chain.gltf --duration 0.5 --substeps 4";
  const Outcome one =
      expect(words, 0, {"h=1/60, n=4.\n", "\nA1 ", "\nA2 ", "\nA3 ", "Reference: uncertain by "});
  EXPECT_EQ(one.err, "");
  EXPECT_EQ(one.out, printed(words));
  printed("measure $S/pendulum.gltf --duration 0.2 --markdown --output table.md");
  EXPECT_THAT(content("table.md"), HasSubstr("|---|---:|"));
}

TEST_F(MeasureCommand, PrintsAtMostSevenColumnsUnlessAll) {
  const auto columns = [&](const std::string& more) {
    std::istringstream lines(
        printed("measure $S/heavy_on_light.gltf --duration 0.5 --horizon 0.05 --markdown" + more));
    std::ptrdiff_t most = 0;
    for (std::string line; std::getline(lines, line);)
      most = std::max(most, std::ranges::count(line, '|') - 1);
    return most;
  };
  EXPECT_EQ(columns(""), 7);
  EXPECT_EQ(columns(" --times 1"), 7);
  EXPECT_GT(columns(" --all"), 7);
}

TEST_F(MeasureCommand, GivesAlgorithmsEqualRowSolves) {
  const Outcome outcome = expect(
      "measure $S/heavy_chain.gltf --duration 1 --set tau=1 --substeps 8 --equal-rows --brief --markdown", 0,
      {"A2  m=1  h=1/60 | 15840 |", "A2  m=1  h=1/480 | 15840 |", "A3  n=8 m=1 stable  h=1/60 | 15840 |"});
  // A1 and A2 take the step in eight parts, with which A1 holds the chain.
  EXPECT_THAT(outcome.out, testing::ContainsRegex("A1  h=1/60 . 158[0-9][0-9] .[^\n]* yes"));
  const std::string words = "measure $S/heavy_chain.gltf --duration 0.1 --horizon 0.05 --brief --markdown";
  expect(words + " --substeps 16", 0, {"A2  m=2  h=1/60 | 3168 |", "A3  n=16 m=1 τ="});
  expect(words + " --substeps 4", 0, {"A2  m=1  h=1/60 | "}, {"note: A2 takes a step in 8 parts"});
  refuses("measure $S/pendulum.gltf --substeps 65536 --set m=65537",
          "iterations 1000000000: must be from 1 to");
}

TEST_F(MeasureCommand, SpendsRowSolvesOnShorterStepsOfA1) {
  // A1 divides steps of 1/60 s in eight; as many row solves as 16 sub-steps have pay for steps of 1/960 s.
  expect(
      "measure $S/heavy_chain.gltf --duration 0.2 --horizon 0.05 --substeps 16 --equal-rows --brief "
      "--markdown",
      0, {"A1  h=1/960 | "});
}

TEST_F(MeasureCommand, WarmStartsAllButA1) {
  expect("measure $S/pendulum.gltf --duration 0.2 --set warm_start=0.5 --brief --markdown", 0,
         {"A1  h=1/60 | ", "warm=0.5  h=1/60 | "});
  refuses("measure $S/pendulum.gltf --set alpha=0.5", "alpha 0.5: A1 does not read it");
}

TEST_F(MeasureCommand, RefusesBadOptions) {
  refuses("measure $S/pendulum.gltf --brief --all", "give one of them");
  refuses("measure $S/pendulum.gltf --step 0.01", "must be a whole part or multiple");
  refuses("measure $S/pendulum.gltf --set joints=loose", "give rows, plain or stable");
  refuses("measure $S/pendulum.gltf --set tau=1,tau=2", "--set 'tau': is given twice");
  refuses("measure $S/pendulum.gltf --set tau=1/2,contact_tau=1", "--set 'contact_tau': is given twice");
  refuses("measure $S/pendulum.gltf --set n=4 --substeps 8", "--substeps '8': --set gives substeps too");
  refuses("measure $S/pendulum.gltf --substeps 0", "substeps 0");
  refuses("measure $S/pendulum.gltf --horizon 0", "must be at least a step");
  refuses("measure nothing.gltf", "nothing.gltf");
  refuses("measure $S/pendulum.gltf --run a.csv --substeps 4", "excludes");
  refuses("measure $S/pendulum.gltf --reference a.csv --all", "excludes");
}

using ReferenceCommand = Program;

TEST_F(ReferenceCommand, WritesThePosesWithTheirUncertainty) {
  expect("measure $S/pendulum.gltf --reference pendulum.csv --duration 1.95", 0,
         {"pendulum: own of order 12 at h/", "wrote pendulum.csv\n"});
  EXPECT_EQ(files(), std::vector<std::string>{"pendulum.csv"});
  const auto lines = table("pendulum.csv");
  ASSERT_EQ(lines.size(), 1U + 118U);
  EXPECT_EQ(lines[0].back(), "turn_uncertainty");
  // After a period, 1.93333485 s, the rod is level and at rest; the nearest row is 1.5e-6 s earlier.
  const std::vector<std::string>& period = lines.at(1 + 116);
  ASSERT_EQ(period.size(), 17U);
  EXPECT_NEAR(std::stod(period[0]), 116.0 / 60, 1e-12);
  EXPECT_EQ(period[1], "rod");
  EXPECT_NEAR(std::stod(period[2]), 0.5, 1e-10);
  EXPECT_NEAR(std::stod(period[3]), 1.4, 1e-10);
  EXPECT_LT(std::stod(period[15]), 1e-11);
  double before = 0;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    EXPECT_GE(std::stod(lines[i][15]), before);  // the uncertainty never decreases
    before = std::stod(lines[i][15]);
  }
}

TEST_F(ReferenceCommand, EndsAtHorizon) {
  expect("measure $S/bouncing_balls.gltf --reference a.csv --duration 1", 0,
         {"bouncing_balls: A1 of order ", "nothing is known, and written, of the 0.55 s after that\n"});
  EXPECT_NEAR(std::stod(table("a.csv").back()[0]), 0.45, 1e-9);  // the balls fall for 0.4515 s
}

TEST_F(ReferenceCommand, WritesNothingWithoutReference) {
  expect("measure $S/short_chain.gltf --reference a.csv", 1, {},
         {"short_chain: no reference: A1 at h/", "(not the own integrator: its joints are open at the start)",
          "nothing is written\n"});
  EXPECT_TRUE(files().empty());
}

/// A test of the program with a cache of its own, in folder().
class CachedReferences : public Program {
 protected:
  /// Runs the program with the cache, and returns its output.
  std::string run_cached(const std::string& words) const {
    const Outcome outcome = command("XDG_CACHE_HOME=\"$PWD/cache\" $P " + words);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  }
  /// Returns the kept files' names with their inode numbers, which change when a file is rewritten.
  std::map<std::string, ino_t> kept() const {
    std::map<std::string, ino_t> result;
    for (const std::string& file : files()) {
      struct stat status {};
      if (file.ends_with(".reference") && stat((folder() / file).c_str(), &status) == 0)
        result[file] = status.st_ino;
    }
    return result;
  }
};

TEST_F(CachedReferences, SpareTheSecondRun) {
  const std::string measure = "measure $S/box_stack.gltf --horizon 0.1 --duration 0.1 --brief";
  const std::string first = run_cached(measure);
  const auto files_of_first = kept();
  ASSERT_EQ(files_of_first.size(), 1u);
  EXPECT_EQ(run_cached(measure), first);
  EXPECT_EQ(kept(), files_of_first);
}

TEST_F(CachedReferences, KeepBothRunsOfAFilm) {
  const std::string video = "video $S/box_stack.gltf --end 0.1 --panel a5 --size 320x180 --frames frames";
  run_cached(video);
  const auto files_of_first = kept();
  EXPECT_EQ(files_of_first.size(), 2u);
  run_cached(video);
  EXPECT_EQ(kept(), files_of_first);
  run_cached(video + " --reference-substeps 32");
  EXPECT_EQ(kept().size(), 3u);  // in eighths, and the check in fourths is the first film's
}

TEST_F(CachedReferences, RespectNoCache) {
  run_cached("measure $S/box_stack.gltf --horizon 0.1 --duration 0.1 --no-cache");
  EXPECT_TRUE(kept().empty());
}

}  // namespace
}  // namespace substep
