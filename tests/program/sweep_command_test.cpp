#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "program.h"
#include "sim/log/file_output.h"
#include "sim/study/engines/engines.h"

namespace substep {
namespace {

using testing::HasSubstr;
using testing::Not;

class SweepCommand : public Program {
 protected:
  /// Returns a grid over a scene with another line.
  static std::string grid(const std::string& scene, const std::string& line) {
    return "[[grid]]\nscenes = ['" + scene + "']\n" + line + "\n";
  }

  /// Writes a sweep of four jobs: the two of A1, which has no n, are one.
  void SetUp() override {
    write("small.toml", "horizon = 0.1\n" +
                            grid("pendulum.gltf", "algorithms = ['a1', 'a5']\nsubsteps = [1, 4]") +
                            "[[limit]]\nscenes = ['pendulum.gltf']\nalgorithms = ['a5']\n");
    copy_scene("pendulum.gltf");
  }
};

TEST_F(SweepCommand, ContinuesAndRepeatsDamagedJobs) {
  printed("sweep small.toml --output done");
  const std::string errors = content("done/errors.csv");
  EXPECT_THAT(shell("sweep small.toml --output done").out, HasSubstr("0 of them done now"));
  // A job that was cut off, and one that was never begun.
  write("done/jobs/pendulum.a1-h1.json", "0123");
  std::filesystem::remove(folder() / "done/jobs/pendulum.a5-h1-n4-m1-t0.6-k1-ct0.9-ck0.7-stable.json");
  expect("sweep small.toml --output done --merge", 2, {},
         {"2 of 4 jobs are not done, the first is pendulum.a1-h1",
          "(done/jobs/pendulum.a1-h1.json is damaged)"});
  EXPECT_EQ(expect("sweep small.toml --output done", 0, {"2 of them done now"}).err,
            "substep: note: done/jobs/pendulum.a1-h1.json: is damaged: it is measured again\n");
  EXPECT_EQ(content("done/errors.csv"), errors);
  std::filesystem::remove(folder() / "done/jobs/pendulum.a1-h1.json");
  std::filesystem::create_directory(folder() / "done/jobs/pendulum.a1-h1.json");
  EXPECT_THAT(
      shell("sweep small.toml --output done").err,
      HasSubstr("done/jobs/pendulum.a1-h1.json: is not a file: remove it, to make room for a job's result"));
  for (const std::string& file : files()) EXPECT_THAT(file, Not(HasSubstr("partial")));
}

TEST_F(SweepCommand, RejectsTamperedRecord) {
  printed("sweep small.toml --output done");
  const std::string errors = content("done/errors.csv");
  const auto falsify = [&](const std::string& file) {
    std::string text = content(file);
    const std::size_t value = text.find("\"position\":{\"rms\":");
    ASSERT_NE(value, std::string::npos);
    const std::size_t start = text.find(':', value + 12) + 1;
    write(file, text.replace(start, text.find(',', start) - start, "-7"));
  };
  falsify("done/jobs/pendulum.a1-h1.json");
  EXPECT_THAT(shell("sweep small.toml --output done --merge").err,
              HasSubstr("1 of 4 jobs are not done, the first is pendulum.a1-h1"));
  EXPECT_THAT(shell("sweep small.toml --output done").out, HasSubstr("1 of them done now"));
  EXPECT_EQ(content("done/errors.csv"), errors);
  falsify("done/sweep.json");
  refuses("report figure work-rows --results done",
          "done/sweep.json: not what a sweep wrote: 'position' of pendulum.a1-h1 is -7");
}

TEST_F(SweepCommand, MergesParts) {
  EXPECT_EQ(expect("sweep small.toml --output whole --threads 1", 0, {"4 jobs, 4 of them done now"}).err, "");
  EXPECT_EQ(std::ranges::count(content("whole/errors.csv"), '\n'), 4);  // a head and three runs
  for (const std::string part : {"1/3", "2/3", "3/3"})
    printed("sweep small.toml --output parts --job " + part);
  printed("sweep small.toml --output parts --merge");
  EXPECT_EQ(content("whole/sweep.json"), content("parts/sweep.json"));
  EXPECT_EQ(content("whole/errors.csv"), content("parts/errors.csv"));
  // A part of another sweep leaves no results of the old one.
  write("small.toml", "horizon = 0.1\n" + grid("pendulum.gltf", "algorithms = ['a1', 'a2']"));
  printed("sweep small.toml --output parts --job 1/2");
  refuses("report figure work-rows --results parts", "parts/sweep.json: cannot be read");
  EXPECT_FALSE(has("parts/errors.csv"));
}

TEST_F(SweepCommand, ListsEnginesThatCannotRun) {
  ASSERT_NE(find_engine("ode-step"), nullptr)
      << "built without ODE, which the tests need: .ci/install installs it";
  // The file in the library's place cannot be loaded; nothing else of the program needs it.
  std::filesystem::create_directory(folder() / "broken");
  write("broken/libode.so.8", "no library");
  write("engine.toml",
        "horizon = 0.1\n" + grid("pendulum.gltf", "algorithms = ['a1']") + "engines = ['ode-step']\n");
  const std::string program = "LD_LIBRARY_PATH=broken $P ";
  const Outcome sweep = command(program + "sweep engine.toml --output engine");
  ASSERT_EQ(sweep.exit_code, 0) << sweep.err;
  const std::string message = "ODE is not installed: on Debian 12, apt-get install libode8 (";
  const std::string note = "1 of 2 runs are omitted; the first is pendulum.ode-step-h1-m10: " + message;
  EXPECT_THAT(sweep.err, HasSubstr(note));
  expect_content("engine/sweep.json", {message});
  EXPECT_THAT(command(program + "report engine.toml --output page").err, HasSubstr(note));
  expect_content("page/report.md", {"1 run of 1 scene."});
  // With the library, the next sweep runs the engine.
  EXPECT_EQ(expect("sweep engine.toml --output engine", 0, {"2 jobs, 1 of them done now"}).err, "");
  const Outcome film = command(program + "video pendulum.gltf --panel ode");
  EXPECT_EQ(film.exit_code, 0) << film.err;
  EXPECT_THAT(film.out, HasSubstr("not simulated: " + message)) << "its panel and its row say why";
}

TEST_F(SweepCommand, RefusesFilesByLine) {
  const std::string good = grid("pendulum.gltf", "algorithms = ['a3']");
  for (const auto& [text, part] :
       {std::pair(std::string(), "has no [[grid]]"),
        {grid("pendulum.gltf", ""), "bad.toml:1: [[grid]] needs 'algorithms' or 'engines'"},
        {grid("pendulum.gltf", "algorithms = ['a6']"), "bad.toml:3: entries of 'algorithms' must be"},
        {grid("pendulum.gltf", "engines = ['bulet']"), "bad.toml:3: there is no engine 'bulet'; there are "},
        {grid("nothing.gltf", "algorithms = ['a1']"), "nothing.gltf"},
        {good + "kappa = [3]\n", "kappa 3"},
        {good + "substeps = [0]\n", "bad.toml:4: substeps 0: must be from 1 to 100000"},
        {grid("pendulum.gltf", "algorithm = ['a3']"), "unknown key 'algorithm'"},
        {"properties = 1\n" + good, "bad.toml:1: 'properties' must be true or false"},
        {"horizon = 1\n[horizons]\nmoon = 1\n" + good, "no grid has a scene 'moon'"},
        {"horizon = 0.01\n" + good, "pendulum.gltf: horizon 0.01 s: must be at least a step"},
        {"[horizons]\npendulum = 0.01\n" + good, "pendulum.gltf: horizon 0.01 s: must be at least a step"},
        {grid("moon_*.gltf", "algorithms = ['a1']"), "no file matches 'moon_*.gltf'"},
        {grid("moon/*.gltf", "algorithms = ['a1']"), "no file matches 'moon/*.gltf'"}}) {
    write("bad.toml", text);
    refuses("sweep bad.toml --output bad", part);
  }
  refuses("sweep nothing.toml", "nothing.toml");
  refuses("sweep small.toml --job 3/2", "--job '3/2'");
  refuses("sweep small.toml --job 1/2 --merge", "give one of them");
  // Another program in sbatch's place takes the jobs.
  std::filesystem::create_directory(folder() / "bin");
  std::filesystem::create_symlink("/bin/true", folder() / "bin/sbatch");
  EXPECT_THAT(command("PATH=bin $P sweep small.toml --output 'r 7' --slurm 2").out,
              HasSubstr("substep sweep \"small.toml\" --output \"r 7\" --merge"));
  // Without a PATH there is no Slurm.
  EXPECT_THAT(command("PATH= $P sweep small.toml --slurm 2").err, HasSubstr("sbatch cannot be started"));
}

TEST_F(SweepCommand, ExpandsFilePatterns) {
  write("like.toml",
        "horizon = 0.1\n[horizons]\npendulum = 0.05\n" + grid("pend*.gltf", "algorithms = ['a1']"));
  printed("sweep like.toml --output like");
  expect_content("like/sweep.json", {"\"scene\":\"pendulum\"", "\"horizon\":0.05"});
}

TEST_F(SweepCommand, RunsExampleOfItsPage) {
  const std::string text = content_of(scene("sweeps.md")).value();
  const std::size_t begin = text.find("<!-- sweep -->\n```toml\n") + 23;
  ASSERT_NE(begin, std::string::npos + 23);
  write("example.toml", text.substr(begin, text.find("\n```", begin) - begin) + "\n");
  copy_scene("rod_chain.gltf");
  // Two scenes, two algorithms, four n and two kinds of joints; three steps of A1; a limit.
  expect("sweep example.toml --output example", 0, {"36 jobs, 36 of them done now"});
}

}  // namespace
}  // namespace substep
