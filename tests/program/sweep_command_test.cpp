#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "program.h"
#include "sim/study/engines/engines.h"

namespace substep {
namespace {

using testing::HasSubstr;
using testing::Not;

class SweepCommand : public Program {
 protected:
  /// A sweep of four jobs: A1 has no n, so that its two make one.
  void SetUp() override {
    write("small.toml",
          "horizon = 0.1\n"
          "[[grid]]\nscenes = [\"pendulum.gltf\"]\nalgorithms = [\"a1\", \"a5\"]\nsubsteps = [1, 4]\n"
          "[[limit]]\nscenes = [\"pendulum.gltf\"]\nalgorithms = [\"a5\"]\n");
    std::filesystem::copy_file(scene("pendulum.gltf"), folder() / "pendulum.gltf");
  }
};

TEST_F(SweepCommand, LeavesTheSameErrorsTwice) {
  const Outcome outcome = run({"sweep", "small.toml", "--output", "one"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, HasSubstr("4 jobs, 4 of them done now"));
  ASSERT_EQ(run({"sweep", "small.toml", "--output", "other", "--threads", "1"}).exit_code, 0);
  EXPECT_EQ(content("one/errors.csv"), content("other/errors.csv"));
  EXPECT_EQ(content("one/sweep.json"), content("other/sweep.json"));
  const std::string errors = content("one/errors.csv");
  EXPECT_EQ(std::ranges::count(errors, '\n'), 4);  // a head and three runs
}

TEST_F(SweepCommand, DoesOnlyWhatIsNotDone) {
  ASSERT_EQ(run({"sweep", "small.toml", "--output", "done"}).exit_code, 0);
  const std::string errors = content("done/errors.csv");
  EXPECT_THAT(run({"sweep", "small.toml", "--output", "done"}).out, HasSubstr("0 of them done now"));
  // A job that was cut off, and one that was never begun.
  write("done/jobs/pendulum.a1-h1.json", "0123");
  std::filesystem::remove(folder() / "done/jobs/pendulum.a5-h1-n4-m1-t0.6-k1-ct0.9-ck0.7-stable.json");
  const Outcome refused = run({"sweep", "small.toml", "--output", "done", "--merge"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("2 of 4 jobs are not done, the first is pendulum.a1-h1"));
  EXPECT_THAT(refused.err, HasSubstr("(done/jobs/pendulum.a1-h1.json is damaged)"));
  const Outcome again = run({"sweep", "small.toml", "--output", "done"});
  EXPECT_THAT(again.out, HasSubstr("2 of them done now"));
  EXPECT_EQ(again.err, "substep: note: done/jobs/pendulum.a1-h1.json: is damaged: it is measured again\n");
  EXPECT_EQ(content("done/errors.csv"), errors);
  std::filesystem::remove(folder() / "done/jobs/pendulum.a1-h1.json");
  std::filesystem::create_directory(folder() / "done/jobs/pendulum.a1-h1.json");
  EXPECT_THAT(
      run({"sweep", "small.toml", "--output", "done"}).err,
      HasSubstr("done/jobs/pendulum.a1-h1.json: is no file, where a job's result belongs: remove it"));
  for (const std::string& file : files()) EXPECT_THAT(file, Not(HasSubstr("partial")));
}

TEST_F(SweepCommand, AResultThatWasChangedIsNone) {
  ASSERT_EQ(run({"sweep", "small.toml", "--output", "done"}).exit_code, 0);
  const std::string errors = content("done/errors.csv");
  const auto falsify = [&](const std::string& file) {
    std::string text = content(file);
    const std::size_t value = text.find("\"position\":{\"rms\":");
    ASSERT_NE(value, std::string::npos);
    const std::size_t start = text.find(':', value + 12) + 1;
    write(file, text.replace(start, text.find(',', start) - start, "-7"));
  };
  falsify("done/jobs/pendulum.a1-h1.json");
  EXPECT_THAT(run({"sweep", "small.toml", "--output", "done", "--merge"}).err,
              HasSubstr("1 of 4 jobs are not done, the first is pendulum.a1-h1"));
  EXPECT_THAT(run({"sweep", "small.toml", "--output", "done"}).out, HasSubstr("1 of them done now"));
  EXPECT_EQ(content("done/errors.csv"), errors);
  falsify("done/sweep.json");
  expect_refused({"report", "figure", "work-rows", "--results", "done"},
                 "done/sweep.json: not what a sweep wrote: 'position' of pendulum.a1-h1 is -7");
}

TEST_F(SweepCommand, PartsMakeTheWhole) {
  ASSERT_EQ(run({"sweep", "small.toml", "--output", "whole"}).exit_code, 0);
  for (const char* const part : {"1/3", "2/3", "3/3"}) {
    const Outcome outcome = run({"sweep", "small.toml", "--output", "parts", "--job", part});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  ASSERT_EQ(run({"sweep", "small.toml", "--output", "parts", "--merge"}).exit_code, 0);
  EXPECT_EQ(content("whole/sweep.json"), content("parts/sweep.json"));
}

TEST_F(SweepCommand, ListsAnEngineThatIsNotThere) {
  write("engine.toml",
        "horizon = 0.1\n[[grid]]\nscenes = [\"pendulum.gltf\"]\nalgorithms = [\"a1\"]\nengines = "
        "[\"no-such\"]\n");
  ASSERT_EQ(run({"sweep", "engine.toml", "--output", "engine"}).exit_code, 0);
  EXPECT_THAT(content("engine/sweep.json"), HasSubstr("the program was built without it"));
}

TEST_F(SweepCommand, SaysWhatToInstallForAnEngineThatIsNotInstalled) {
  ASSERT_EQ(std::ranges::count(engines(), "ode-step", &Engine::name), 1)
      << "built without ODE, which the tests need: .ci/install installs it";
  // What stands in the library's place cannot be loaded; nothing else of the program needs it.
  std::filesystem::create_directory(folder() / "broken");
  write("broken/libode.so.8", "no library");
  write("engine.toml",
        "horizon = 0.1\n[[grid]]\nscenes = [\"pendulum.gltf\"]\nalgorithms = [\"a1\"]\nengines = "
        "[\"ode-step\"]\n");
  const std::string program =
      "cd " + quoted(folder().string()) + " && LD_LIBRARY_PATH=broken " + SUBSTEP_PROGRAM;
  ASSERT_EQ(run_command(program + " sweep engine.toml --output engine").exit_code, 0);
  const std::string sentence = "ODE is not installed: on Debian 12, apt-get install libode8 (";
  EXPECT_THAT(content("engine/sweep.json"), HasSubstr(sentence));
  const Outcome film = run_command(program + " video pendulum.gltf --panel ode");
  EXPECT_EQ(film.exit_code, 0) << film.err;
  EXPECT_THAT(film.out, HasSubstr("not simulated: " + sentence)) << "its panel and its row say why";
}

TEST_F(SweepCommand, RefusesWhatItCannotRead) {
  const auto expect = [&](const std::string& text, const std::string& part) {
    write("bad.toml", text);
    expect_refused({"sweep", "bad.toml", "--output", "bad"}, part);
  };
  expect("", "has no [[grid]]");
  expect("[[grid]]\nscenes = [\"pendulum.gltf\"]\n", "bad.toml:1: a grid without 'algorithms'");
  expect("[[grid]]\nscenes = [\"pendulum.gltf\"]\nalgorithms = [\"a6\"]\n",
         "bad.toml:3: 'algorithms' must be");
  expect("[[grid]]\nscenes = [\"nothing.gltf\"]\nalgorithms = [\"a1\"]\n", "nothing.gltf");
  expect("[[grid]]\nscenes = [\"pendulum.gltf\"]\nalgorithms = [\"a3\"]\nkappa = [3]\n", "kappa 3");
  expect("[[grid]]\nscenes = [\"pendulum.gltf\"]\nalgorithms = [\"a3\"]\nsubsteps = [0]\n",
         "bad.toml:4: substeps 0: must be from 1 to 100000");
  expect("[[grid]]\nscenes = [\"pendulum.gltf\"]\nalgorithm = [\"a3\"]\n", "unknown key 'algorithm'");
  expect("properties = 1\n[[grid]]\nscenes = [\"pendulum.gltf\"]\nalgorithms = [\"a1\"]\n",
         "bad.toml:1: 'properties' must be true or false");
  expect("horizon = 1\n[horizons]\nmoon = 1\n[[grid]]\nscenes = [\"pendulum.gltf\"]\nalgorithms = [\"a1\"]\n",
         "'moon' is a scene of no grid");
  expect("[[grid]]\nscenes = [\"moon_*.gltf\"]\nalgorithms = [\"a1\"]\n", "no file is like 'moon_*.gltf'");
  expect("[[grid]]\nscenes = [\"moon/*.gltf\"]\nalgorithms = [\"a1\"]\n", "no file is like 'moon/*.gltf'");
  expect_refused({"sweep", "nothing.toml"}, "nothing.toml");
  expect_refused({"sweep", "small.toml", "--job", "3/2"}, "--job '3/2'");
  expect_refused({"sweep", "small.toml", "--job", "1/2", "--merge"}, "give one of them");
}

TEST_F(SweepCommand, TakesTheFilesThatAreLikeAPattern) {
  write("like.toml",
        "horizon = 0.1\n[horizons]\npendulum = 0.05\n[[grid]]\nscenes = [\"pend*.gltf\"]\nalgorithms = "
        "[\"a1\"]\n");
  ASSERT_EQ(run({"sweep", "like.toml", "--output", "like"}).exit_code, 0);
  EXPECT_THAT(content("like/sweep.json"), HasSubstr("\"scene\":\"pendulum\""));
  EXPECT_THAT(content("like/sweep.json"), HasSubstr("\"horizon\":0.05"));
}

TEST_F(SweepCommand, RunsTheExampleOfItsPage) {
  std::ifstream page(scene("sweeps.md"));
  const std::string text(std::istreambuf_iterator<char>(page), {});
  const std::size_t begin = text.find("<!-- sweep -->\n```toml\n") + 23;
  ASSERT_NE(begin, std::string::npos + 23);
  write("example.toml", text.substr(begin, text.find("\n```", begin) - begin) + "\n");
  std::filesystem::copy_file(scene("rod_chain.gltf"), folder() / "rod_chain.gltf");
  const Outcome outcome = run({"sweep", "example.toml", "--output", "example"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  // Two scenes, two algorithms, four n and two kinds of joints; three steps of A1; a limit
  EXPECT_THAT(outcome.out, HasSubstr("36 jobs, 36 of them done now"));
}

TEST_F(SweepCommand, SaysWhereSlurmIsNotThere) {
  const Outcome outcome = run({"sweep", "small.toml", "--slurm", "2"}, "");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("sbatch cannot be started"));
}

}  // namespace
}  // namespace substep
