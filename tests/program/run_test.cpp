#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "program.h"
#include "sim/loading/load_scene.h"
#include "sim/log/pose_log.h"
#include "sim/scene/scene.h"

namespace substep {
namespace {

using testing::HasSubstr;

using RunCommand = Program;

TEST_F(RunCommand, LogHasSettingsAndFrames) {
  printed(
      "run $S/rod_chain.gltf --algorithm A5 --step 1/120 --substeps 3 --set "
      "m=2,tau=0.9,kappa=0.8,joints=stable --duration 0.25 --every 8");
  EXPECT_THAT(files(), testing::ElementsAre("rod_chain.a5.poses.txt"));
  const PoseLog log = read_pose_log(folder() / "rod_chain.a5.poses.txt");
  EXPECT_EQ(log.scene, "rod_chain.gltf");
  EXPECT_EQ(label(log.settings), "A5  n=3 m=2 τ=0.9 κ=0.8 stable  h=1/120");
  ASSERT_EQ(log.frames.size(), 31u);
  for (std::size_t k = 0; k < 31; ++k) EXPECT_EQ(log.frames[k].poses.empty(), k % 8 != 0 && k != 30) << k;
}

TEST_F(RunCommand, TableHasStatesOfLog) {
  EXPECT_EQ(expect("run $S/tumbling_body.gltf --duration 1 --output log --csv table", 0,
                   {"wrote log\n", "wrote table\n"})
                .err,
            "");
  const Scene loaded = load_scene(scene("tumbling_body.gltf"));
  const PoseLog log = read_pose_log(folder() / "log");
  const auto lines = table("table");
  EXPECT_EQ(content("table").substr(0, content("table").find('\n')),
            "t,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz");

  std::map<std::string, std::size_t> dynamic;
  for (std::size_t i = 1; i < loaded.bodies.size(); ++i) {
    if (loaded.bodies[i].inverse_mass > 0) dynamic[loaded.bodies[i].name] = i;
  }
  ASSERT_FALSE(dynamic.empty());
  ASSERT_EQ(lines.size(), 1 + log.frames.size() * dynamic.size());
  for (std::size_t line = 1; line < lines.size(); ++line) {
    ASSERT_EQ(lines[line].size(), 15u);
    ASSERT_TRUE(dynamic.contains(lines[line][1]));
    const auto vector = [&](std::size_t i) {
      return Vector3(std::stod(lines[line][i]), std::stod(lines[line][i + 1]), std::stod(lines[line][i + 2]));
    };
    const std::size_t frame = (line - 1) / dynamic.size();
    const std::size_t index = dynamic[lines[line][1]];
    const Body& body = loaded.bodies[index];
    EXPECT_EQ(std::stod(lines[line][0]), static_cast<double>(frame) * log.settings.step);
    EXPECT_EQ(vector(2), log.frames[frame].poses[index].linear);
    // The table has the node's own axes, not the principal ones.
    const Quaternion node = log.frames[frame].poses[index].angular * body.body_from_node.orientation;
    EXPECT_EQ(std::stod(lines[line][5]), node.w());
    EXPECT_EQ(vector(6), node.vec());
    if (frame > 0) continue;
    EXPECT_EQ(vector(9), body.linear_velocity);
    EXPECT_EQ(vector(12), body.angular_velocity);
  }
}

TEST_F(RunCommand, DiffNamesFrameAndSetting) {
  printed("run $S/rod_chain.gltf --duration 0.5 --output a");
  printed("run $S/rod_chain.gltf --duration 0.5 --output b --set tau=0.5");
  expect("diff a b", 1, {"tau: 0.6 → 0.5\n", "first different state: frame ", "most in body "});
  // Frames of different steps are at different times.
  printed("run $S/rod_chain.gltf --duration 0.5 --output c --step 1/120");
  refuses("diff a c", "the runs' steps are 0.0166667 s and 0.00833333 s: compare their tables");
}

TEST_F(RunCommand, BoundsAllScenesButOneInA5) {
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(scene(""))) {
    if (entry.path().extension() != ".gltf") continue;
    ++scenes;
    const Outcome outcome =
        expect("run --algorithm a5 --output a.poses " + quoted(entry.path().string()), 0, {});
    // The governor's light rods turn by 0.2 rad within joints that should lock them.
    const bool is_bounded = entry.path().stem() != "governor";
    EXPECT_EQ(outcome.err.find("not bounded") == std::string::npos, is_bounded) << outcome.err;
  }
  EXPECT_GT(scenes, 40);
}

TEST_F(RunCommand, StrictFailsOnViolations) {
  expect("run $S/pendulum.gltf --strict", 0, {"deepest penetration 0 m, largest joint gap "});
  // A loop has redundant rows, which contradict one another.
  const Outcome plain =
      expect("run $S/bricard.gltf --algorithm a1", 0, {"steps solved in the least-squares sense"});
  EXPECT_EQ(plain.err, "");
  expect("run $S/bricard.gltf --algorithm a1 --strict", 1, {plain.out},
         {"steps solved in the least-squares sense only"});
  // The links of this chain are too short for its anchors.
  expect("run $S/short_chain.gltf --algorithm a2 --strict", 1, {}, {"joint gap", "energy growth"});
}

TEST_F(RunCommand, WarnsOfImpossibleMotion) {
  expect("run $S/heavy_on_light.gltf --algorithm a2", 0, {},
         {"substep: warning: heavy_on_light: A2", ": not bounded: penetration 0."});
  // Warnings name the settings as they were given.
  expect("run $S/heavy_on_light.gltf --algorithm a5 --substeps 1", 0, {},
         {": A5  n=1 m=1 τ=0.6/0.9 κ=1/0.7 stable  h=1/60: not bounded: penetration 0."});
  const Outcome strict = expect("run $S/heavy_on_light.gltf --algorithm a2 --strict", 1, {});
  EXPECT_THAT(strict.err, testing::Not(HasSubstr("warning")));
  // The gap exceeds a hundredth of the scene's size, and causes a warning only.
  expect("run $S/rod_chain.gltf --algorithm a1", 0, {}, {"h=1/60: joint gap 0.0"});
}

TEST_F(RunCommand, FailsWhereJointsOpenByMoreThanTheScene) {
  // Nothing drives the chain, and it ends with a hundred times the energy that its fall is worth.
  expect("run $S/heavy_chain.gltf --algorithm a5 --substeps 1", 1, {},
         {"substep: warning: heavy_chain: A5", "energy growth ", "substep: heavy_chain: A5", " joint gap "});
  // Springs add no more energy than they store at the start.
  EXPECT_THAT(shell("run $S/governor.gltf --algorithm a2 --set m=1").err, HasSubstr("energy growth "));
  EXPECT_EQ(shell("run $S/pendulum.gltf").err, "");
}

TEST_F(RunCommand, NotesSettingsThatAreNotRead) {
  expect("run $S/pendulum.gltf --duration 0 --algorithm a1 --substeps 4 --set tau=0.3", 0, {},
         {"note: A1 does not read substeps\n", "note: A1 does not read tau\n"});
}

TEST_F(RunCommand, NotesCostOfA1) {
  write("cube.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
        "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  const auto note = [&](const std::string& words) { return shell("run cube.obj --duration 0 " + words).err; };
  EXPECT_THAT(note("--algorithm a1 --copies 1000"),
              HasSubstr("A1 solves all contacts of 1000 bodies at once"));
  EXPECT_THAT(note("--algorithm a1 --copies 999"), testing::Not(HasSubstr("A1 solves")));
  EXPECT_THAT(note("--algorithm a5 --copies 1000"), testing::Not(HasSubstr("A1 solves")));
}

}  // namespace
}  // namespace substep
