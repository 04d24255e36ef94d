#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <string>

#include "program.h"
#include "sim/log/file_output.h"

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
  EXPECT_THAT(one.out, HasSubstr("h=1/60, n=4.\n"));
  for (const char* const row : {"\nA1 ", "\nA2 ", "\nA3 "}) EXPECT_THAT(one.out, HasSubstr(row));
  EXPECT_THAT(one.out, HasSubstr("Reference: uncertain by "));
}

TEST_F(MeasureCommand, WritesMarkdownAndJson) {
  ASSERT_EQ(
      run({"measure", scene("pendulum.gltf"), "--duration", "0.2", "--markdown", "--output", "table.md"})
          .exit_code,
      0);
  EXPECT_THAT(content("table.md"), HasSubstr("|---|---:|"));
}

TEST_F(MeasureCommand, PrintsAtMostSevenColumnsUnlessAll) {
  const auto columns = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{
        "measure", scene("heavy_on_light.gltf"), "--duration", "0.5", "--horizon", "0.05", "--markdown"};
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
  expect_refused({"measure", scene("pendulum.gltf"), "--brief", "--all"}, "give one of them");
  expect_refused({"measure", scene("pendulum.gltf"), "--step", "0.01"}, "must be a whole part or multiple");
  expect_refused({"measure", scene("pendulum.gltf"), "--set", "joints=loose"}, "give rows, plain or stable");
  expect_refused({"measure", scene("pendulum.gltf"), "--substeps", "0"}, "substeps 0");
  expect_refused({"measure", scene("pendulum.gltf"), "--horizon", "0"}, "must be above 0");
  expect_refused({"measure", "nothing.gltf"}, "nothing.gltf");
}

/// A cache of its own, in folder().
class CachedReferences : public Program {
 protected:
  /// Runs the program with the cache, and returns what it printed.
  std::string run_cached(const std::string& arguments) const {
    const Outcome outcome =
        run_command(fmt::format("cd {} && XDG_CACHE_HOME=\"$PWD/cache\" {} {}", quoted(folder().string()),
                                quoted(SUBSTEP_PROGRAM), arguments));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  }
  /// Returns the kept files' names with their numbers on the disk: a file that is written anew has another.
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

TEST_F(CachedReferences, AreReadUntilTheSceneOrAFileChanges) {
  const std::string text = content_of(scene("box_stack.gltf")).value();
  write("stack.gltf", text);
  const std::string measure = "measure stack.gltf --horizon 0.1 --duration 0.1 --brief";
  const std::string first = run_cached(measure);
  const auto files_of_first = kept();
  ASSERT_EQ(files_of_first.size(), 1u);
  EXPECT_EQ(run_cached(measure), first);
  EXPECT_EQ(kept(), files_of_first);

  const auto& [name, number] = *files_of_first.begin();
  write(name, content(name).substr(0, 1000));
  EXPECT_EQ(run_cached(measure), first);
  EXPECT_GT(content(name).size(), 1000u);

  write("stack.gltf", text + "\n");
  EXPECT_EQ(run_cached(measure), first);
  EXPECT_EQ(kept().size(), 2u);
}

TEST_F(CachedReferences, KeepBothRunsOfAFilm) {
  const std::string video = fmt::format("video {} --end 0.1 --panel a5 --size 320x180 --frames frames",
                                        quoted(scene("box_stack.gltf")));
  run_cached(video);
  const auto files_of_first = kept();
  EXPECT_EQ(files_of_first.size(), 2u);
  run_cached(video);
  EXPECT_EQ(kept(), files_of_first);
  run_cached(video + " --reference-substeps 32");
  EXPECT_EQ(kept().size(), 3u);  // in eighths, and the check in fourths is the first film's
}

TEST_F(CachedReferences, AreNotKeptWithNoCache) {
  run_cached(
      fmt::format("measure {} --horizon 0.1 --duration 0.1 --no-cache", quoted(scene("box_stack.gltf"))));
  EXPECT_TRUE(kept().empty());
}

}  // namespace
}  // namespace substep
