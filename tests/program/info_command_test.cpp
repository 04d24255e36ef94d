/// substep info, and meshes on the command line.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "program.h"
#include "sim/log/file_output.h"
#include "tests/scene/example_scene.h"
#include "tests/scene_files.h"

namespace substep {
namespace {

using testing::HasSubstr;

using InfoCommand = Program;

const std::string meshes = "$S/../tests/scene/meshes/";

TEST_F(InfoCommand, PrintsSceneAndModel) {
  const Outcome outcome = expect("info $S/rod_chain.gltf", 0, {"rod_chain: ", "modelled: ", "\njoints:\n"});
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, testing::Not(HasSubstr(" parts: ")));
  // Taut joints divide a step.
  expect("info $S/heavy_chain.gltf", 0, {"\nA1 and A2 take each step in 8 parts: forces of joints "});
}

TEST_F(InfoCommand, ExplainsSubsteps) {
  const auto words = [&](const std::string& name) {
    const std::string out = printed("info $S/" + name);
    const std::size_t start = out.find("\nby default: ");
    return out.substr(start, out.find('\n', start + 1) - start);
  };
  EXPECT_THAT(words("heavy_chain.gltf"), HasSubstr(" n=45 "));
  EXPECT_THAT(words("heavy_chain.gltf"),
              testing::EndsWith("n as its heaviest body is 1000 times as heavy as its lightest"));
  EXPECT_THAT(words("ragdoll.gltf"), HasSubstr(" n=32 "));
  EXPECT_THAT(words("ragdoll.gltf"), testing::EndsWith("; n as its file says"));
  EXPECT_THAT(words("box_stack.gltf"), testing::Not(HasSubstr(";")));
  EXPECT_THAT(words("box_stack.gltf"), HasSubstr("by default: A3 ")) << "the algorithm of run";
}

TEST_F(InfoCommand, GivesTheSameAsJson) {
  const Json scene = Json::parse(printed("info --json --scale 0.001 --mass 0.25 " + meshes + "gear.stl"));
  ASSERT_EQ(scene.at("bodies").size(), 2u);
  EXPECT_EQ(scene.at("bodies")[0].at("colliders")[0].at("shape"), "plane");
  const Json& gear = scene.at("bodies")[1];
  EXPECT_EQ(gear.at("name"), "gear");
  EXPECT_NEAR(gear.at("mass").get<double>(), 0.25, 1e-12);
  EXPECT_EQ(gear.at("colliders")[0].at("shape"), "hull");
  EXPECT_TRUE(scene.at("camera").is_null());
  EXPECT_THAT(scene.at("warnings")[0].get<std::string>(), HasSubstr("collides as its convex hull"));
}

/// Returns the complete scene of the page on the format.
std::string scene_of_page() {
  const std::string page = content_of(scenes_folder() / "format.md").value();
  const std::size_t begin = page.find("```json\n", page.find("<!-- scene -->")) + 8;
  return page.substr(begin, page.find("```", begin) - begin);
}

TEST_F(InfoCommand, ScenesFormatPageBeginsWithASceneThatRuns) {
  write("arm.gltf", scene_of_page());
  const Outcome info =
      expect("info arm.gltf", 0,
             {"2 bodies, 1 joint", "friction 0.6 / 0.6 (not stated), restitution 0 (not stated)"});
  EXPECT_EQ(info.err, "");
  EXPECT_EQ(expect("run arm.gltf --csv arm.csv", 0, {}).err, "");
  // The arm lies on the ground at its end: half its thickness above.
  auto rows = table("arm.csv");
  std::erase_if(rows, [](const std::vector<std::string>& row) { return row.at(1) != "arm"; });
  EXPECT_NEAR(std::stod(rows.back().at(3)), 0.1, 0.01);
  printed("video arm.gltf --panel a5 --end 0.1 --size 320x180");
}

TEST_F(InfoCommand, WarnsOfLikelyMistakes) {
  const auto note_on = [&](const std::string& edits) {
    write("changed.gltf", test::edited(Json::parse(scene_of_page()), edits).dump());
    return shell("run changed.gltf --duration 0").err;
  };
  EXPECT_EQ(note_on("/scenes/0/extras/substep/gravity = [0, 0, 0]"), "");
  // The arm's joint holds it; as a body of its own the forearm floats.
  EXPECT_EQ(note_on("/nodes/1/$/motion/mass = 0"), "");
  EXPECT_THAT(note_on("/nodes/2/$/motion/mass = 0; /nodes/3/extensions ="),
              HasSubstr("/mass: 0 is infinite, so the body floats"));
  EXPECT_THAT(shell("run $S/pendulum.gltf --step 1 --duration 1").err,
              HasSubstr("--step 1 is a step of 1 s"));
  refuses("run $S/pendulum.gltf --step 60", "--step 60: is a step of 60 s");
}

TEST_F(InfoCommand, RunsAndDrawsMeshWithSameOptions) {
  printed("run " + meshes + "dodecahedron.ply --duration 0.1 --copies 2 --output two.poses");
  const std::string draw = "render two.poses --size 64x36 --scene " + meshes + "dodecahedron.ply";
  EXPECT_THAT(shell(draw).err, HasSubstr("another version"));
  printed(draw + " --copies 2 --output two.png");
}

}  // namespace
}  // namespace substep
