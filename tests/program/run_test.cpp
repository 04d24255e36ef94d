#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "program.h"
#include "sim/loading/load_scene.h"
#include "sim/log/pose_log.h"
#include "sim/scene/scene.h"
#include "tests/folders.h"

namespace substep {
namespace {

using testing::HasSubstr;

class RunCommand : public Program {
 protected:
  /// Lines of the table, each as its fields.
  std::vector<std::vector<std::string>> table(const std::string& name) const {
    std::vector<std::vector<std::string>> lines;
    std::istringstream stream(content(name));
    for (std::string line; std::getline(stream, line);) {
      std::vector<std::string> fields;
      std::istringstream parts(line);
      for (std::string field; std::getline(parts, field, ',');) fields.push_back(field);
      lines.push_back(fields);
    }
    return lines;
  }
};

TEST_F(RunCommand, TwoRunsLeaveTheSameBytes) {
  for (const char* const algorithm : {"a1", "a2", "a3", "a4", "a5"}) {
    for (const char* const file : {"one", "two"}) {
      const Outcome outcome = run({"run", scene("rod_chain.gltf"), "--algorithm", algorithm, "--duration",
                                   "0.5", "--output", file, "--csv", std::string(file) + ".csv"});
      ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
      EXPECT_EQ(outcome.err, "");
      EXPECT_THAT(outcome.out, HasSubstr(std::string("wrote ") + file));
    }
    EXPECT_EQ(content("one"), content("two"));
    EXPECT_EQ(content("one.csv"), content("two.csv"));
    EXPECT_EQ(run({"diff", "one", "two"}).exit_code, 0);
  }
}

TEST_F(RunCommand, LogHasTheSettingsAndTheFramesAskedFor) {
  const Outcome outcome =
      run({"run", scene("rod_chain.gltf"), "--algorithm", "A5", "--step", "1/120", "--substeps", "3", "--set",
           "m=2,tau=0.9,kappa=0.8,joints=stable", "--duration", "0.25", "--every", "8"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(files(), testing::ElementsAre("rod_chain.a5.poses.txt"));
  const PoseLog log = read_pose_log(folder() / "rod_chain.a5.poses.txt");
  EXPECT_EQ(log.scene, "rod_chain.gltf");
  EXPECT_EQ(log.settings.algorithm, Algorithm::a5);
  EXPECT_EQ(log.settings.step, 1.0 / 120);
  EXPECT_EQ(log.settings.substeps, 3);
  EXPECT_EQ(log.settings.iterations, 2);
  EXPECT_EQ(log.settings.tau, 0.9);
  EXPECT_EQ(log.settings.kappa, 0.8);
  EXPECT_EQ(log.settings.joints, Joints::stable);
  ASSERT_EQ(log.frames.size(), 31u);
  for (std::size_t k = 0; k < 31; ++k) EXPECT_EQ(log.frames[k].poses.empty(), k % 8 != 0 && k != 30) << k;
}

TEST_F(RunCommand, TableHasTheStatesOfTheLog) {
  ASSERT_EQ(run({"run", scene("tumbling_body.gltf"), "--duration", "1", "--output", "log", "--csv", "table"})
                .exit_code,
            0);
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
    std::vector<double> values;
    for (std::size_t i = 0; i < 15; ++i) {
      double value = 0;
      const std::string& field = lines[line][i];
      if (i != 1) {
        const auto result = std::from_chars(field.data(), field.data() + field.size(), value);
        ASSERT_EQ(result.ptr, field.data() + field.size());
      }
      values.push_back(value);
    }
    const std::size_t frame = (line - 1) / dynamic.size();
    ASSERT_TRUE(dynamic.contains(lines[line][1]));
    const std::size_t index = dynamic[lines[line][1]];
    const Body& body = loaded.bodies[index];
    EXPECT_EQ(values[0], static_cast<double>(frame) * log.settings.step);
    EXPECT_EQ(Vector3(values[2], values[3], values[4]), log.frames[frame].poses[index].linear);
    // The node's own axes, not the principal ones.
    const Quaternion node = log.frames[frame].poses[index].angular * body.body_from_node.orientation;
    EXPECT_EQ(Quaternion(values[5], values[6], values[7], values[8]).coeffs(), node.coeffs());
    if (frame == 0) {
      EXPECT_EQ(Vector3(values[9], values[10], values[11]), body.linear_velocity);
      EXPECT_EQ(Vector3(values[12], values[13], values[14]), body.angular_velocity);
    }
  }
}

TEST_F(RunCommand, DiffNamesFrameAndSetting) {
  ASSERT_EQ(run({"run", scene("rod_chain.gltf"), "--duration", "0.5", "--output", "a"}).exit_code, 0);
  ASSERT_EQ(run({"run", scene("rod_chain.gltf"), "--duration", "0.5", "--output", "b", "--set", "tau=0.5"})
                .exit_code,
            0);
  const Outcome outcome = run({"diff", "a", "b"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.out, HasSubstr("tau: 0.6 → 0.5\n"));
  EXPECT_THAT(outcome.out, HasSubstr("first different state: frame "));
  EXPECT_THAT(outcome.out, HasSubstr("most in body "));
}

TEST_F(RunCommand, EverySceneButOneIsBoundedInA5ByDefault) {
  int scenes = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(test::source_folder) + "/scenes")) {
    if (entry.path().extension() != ".gltf") continue;
    ++scenes;
    const Outcome outcome = run({"run", entry.path().string(), "--algorithm", "a5", "--output", "a.poses"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    // The governor's light rods turn by 0.2 rad in what should hold them.
    const bool is_bounded = entry.path().stem() != "governor";
    EXPECT_EQ(outcome.err.find("not bounded") == std::string::npos, is_bounded) << outcome.err;
  }
  EXPECT_GT(scenes, 40);
}

TEST_F(RunCommand, ReportsWhatGaveWayAndStrictlyRefusesIt) {
  const Outcome good = run({"run", scene("pendulum.gltf"), "--strict"});
  EXPECT_EQ(good.exit_code, 0) << good.err;
  EXPECT_THAT(good.out, HasSubstr("deepest penetration 0 m, largest joint gap "));
  // A loop has redundant rows, which contradict one another.
  const std::vector<std::string> loop{"run", scene("bricard.gltf"), "--algorithm", "a1"};
  const Outcome plain = run(loop);
  EXPECT_EQ(plain.exit_code, 0);
  EXPECT_EQ(plain.err, "");
  EXPECT_THAT(plain.out, HasSubstr("steps solved in the least-squares sense"));
  std::vector<std::string> strict = loop;
  strict.emplace_back("--strict");
  const Outcome refused = run(strict);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_EQ(refused.out, plain.out);
  EXPECT_THAT(refused.err, HasSubstr("steps solved in the least-squares sense only"));
  // A chain whose links are too short for its anchors.
  const Outcome open = run({"run", scene("short_chain.gltf"), "--algorithm", "a2", "--strict"});
  EXPECT_EQ(open.exit_code, 1);
  for (const char* const part : {"joint gap", "energy growth"}) EXPECT_THAT(open.err, HasSubstr(part));
}

TEST_F(RunCommand, WarnsOfWhatNoMotionDoes) {
  const std::vector<std::string> weak{"run", scene("heavy_on_light.gltf"), "--algorithm", "a2"};
  const Outcome plain = run(weak);
  EXPECT_EQ(plain.exit_code, 0);
  EXPECT_THAT(plain.err, HasSubstr("substep: warning: heavy_on_light: A2"));
  EXPECT_THAT(plain.err, HasSubstr(": not bounded: penetration 0."));
  std::vector<std::string> strictly = weak;
  strictly.emplace_back("--strict");
  const Outcome strict = run(strictly);
  EXPECT_EQ(strict.exit_code, 1);
  EXPECT_THAT(strict.err, testing::Not(HasSubstr("warning")));
  // A gap that is above a hundredth of the scene, and no more.
  const Outcome gap = run({"run", scene("rod_chain.gltf"), "--algorithm", "a1"});
  EXPECT_EQ(gap.exit_code, 0);
  EXPECT_THAT(gap.err, HasSubstr("h=1/60: joint gap 0.0"));
}

TEST_F(RunCommand, RefusesJointsThatOpenByMoreThanTheScene) {
  // Nothing drives the chain, and it ends with a hundred times the energy that its fall is worth.
  const Outcome wild = run({"run", scene("heavy_chain.gltf"), "--algorithm", "a5", "--substeps", "1"});
  EXPECT_EQ(wild.exit_code, 1);
  EXPECT_THAT(wild.err, HasSubstr("substep: warning: heavy_chain: A5"));
  EXPECT_THAT(wild.err, HasSubstr("energy growth "));
  EXPECT_THAT(wild.err, HasSubstr("substep: heavy_chain: A5"));
  EXPECT_THAT(wild.err, HasSubstr(" joint gap "));
  // Springs feed in no more than they hold at the start.
  const Outcome sprung = run({"run", scene("governor.gltf"), "--algorithm", "a2", "--set", "m=1"});
  EXPECT_THAT(sprung.err, HasSubstr("energy growth "));
  const Outcome good = run({"run", scene("pendulum.gltf")});
  EXPECT_EQ(good.err, "");
}

TEST_F(RunCommand, SaysBeforeItStartsWhatA1Costs) {
  write("cube.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
        "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  const auto note = [&](const char* algorithm, const char* copies) {
    return run({"run", "cube.obj", "--copies", copies, "--algorithm", algorithm, "--duration", "0"}).err;
  };
  EXPECT_THAT(note("a1", "1000"), HasSubstr("A1 solves all contacts of 1000 bodies at once"));
  EXPECT_THAT(note("a1", "999"), testing::Not(HasSubstr("A1 solves")));
  EXPECT_THAT(note("a5", "1000"), testing::Not(HasSubstr("A1 solves")));
}

}  // namespace
}  // namespace substep
