/// substep info, and meshes on the command line.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "program.h"
#include "tests/folders.h"

namespace substep {
namespace {

using testing::HasSubstr;

class InfoCommand : public Program {
 protected:
  static std::string mesh(const char* name) {
    return std::string(test::source_folder) + "/tests/scene/meshes/" + name;
  }
};

TEST_F(InfoCommand, SaysWhatASceneContains) {
  const Outcome outcome = run({"info", scene("rod_chain.gltf")});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, HasSubstr("rod_chain: "));
  EXPECT_THAT(outcome.out, HasSubstr("modelled: "));
  EXPECT_THAT(outcome.out, HasSubstr("\njoints:\n"));
}

TEST_F(InfoCommand, SaysWhyAScenesSubstepsAreNotThoseOfMost) {
  const auto words = [&](const char* name) {
    const std::string out = run({"info", scene(name)}).out;
    const std::size_t start = out.find("\nby default: ");
    return out.substr(start, out.find('\n', start + 1) - start);
  };
  EXPECT_THAT(words("heavy_chain.gltf"), HasSubstr(" n=45 "));
  EXPECT_THAT(words("heavy_chain.gltf"),
              testing::EndsWith("n as its heaviest body is 1000 times as heavy as its lightest"));
  EXPECT_THAT(words("ragdoll.gltf"), HasSubstr(" n=32 "));
  EXPECT_THAT(words("ragdoll.gltf"), testing::EndsWith("; n as its file says"));
  EXPECT_THAT(words("box_stack.gltf"), testing::Not(HasSubstr(";")));
}

TEST_F(InfoCommand, SaysHowManyPartsTautJointsNeed) {
  EXPECT_THAT(run({"info", scene("heavy_chain.gltf")}).out,
              HasSubstr("\nA1 and A2 take each step in 8 parts: forces of joints "));
  EXPECT_THAT(run({"info", scene("rod_chain.gltf")}).out, testing::Not(HasSubstr(" parts: ")));
}

TEST_F(InfoCommand, GivesTheSameAsJson) {
  const Outcome outcome = run({"info", "--json", mesh("gear.stl"), "--scale", "0.001", "--mass", "0.25"});
  EXPECT_EQ(outcome.exit_code, 0);
  const nlohmann::json scene = nlohmann::json::parse(outcome.out);
  ASSERT_EQ(scene.at("bodies").size(), 2u);
  EXPECT_EQ(scene.at("bodies")[0].at("colliders")[0].at("shape"), "plane");
  const nlohmann::json& gear = scene.at("bodies")[1];
  EXPECT_EQ(gear.at("name"), "gear");
  EXPECT_NEAR(gear.at("mass").get<double>(), 0.25, 1e-12);
  EXPECT_EQ(gear.at("colliders")[0].at("shape"), "hull");
  EXPECT_TRUE(scene.at("camera").is_null());
  EXPECT_THAT(scene.at("warnings")[0].get<std::string>(), HasSubstr("collides as its convex hull"));
}

/// The whole scene of the page on the format.
std::string scene_of_page() {
  std::ifstream file(std::string(test::source_folder) + "/scenes/format.md");
  const std::string page(std::istreambuf_iterator<char>(file), {});
  const std::size_t begin = page.find("```json\n", page.find("<!-- scene -->")) + 8;
  return page.substr(begin, page.find("```", begin) - begin);
}

TEST_F(InfoCommand, ScenesFormatPageBeginsWithASceneThatRuns) {
  write("arm.gltf", scene_of_page());
  const Outcome info = run({"info", "arm.gltf"});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_EQ(info.err, "");
  EXPECT_THAT(info.out, HasSubstr("2 bodies, 1 joint"));
  EXPECT_THAT(info.out, HasSubstr("friction 0.6 / 0.6 (not stated), restitution 0 (not stated)"));
  const Outcome made = run({"run", "arm.gltf", "--csv", "arm.csv"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(made.err, "");
  // It lies on the ground at its end: half its thickness above.
  const std::string table = content("arm.csv");
  const std::string last = table.substr(table.rfind(",arm,") == std::string::npos ? 0 : table.rfind(",arm,"));
  EXPECT_NEAR(std::stod(last.substr(last.find(',', 5) + 1)), 0.1, 0.01) << last;
  EXPECT_EQ(run({"video", "arm.gltf", "--panel", "a5", "--end", "0.1", "--size", "320x180"}).exit_code, 0);
}

TEST_F(InfoCommand, WarnsOfWhatIsSeldomMeant) {
  const auto note_on = [&](const std::string& from, const std::string& to) {
    std::string text = scene_of_page();
    text.replace(text.find(from), from.size(), to);
    write("changed.gltf", text);
    return run({"run", "changed.gltf", "--duration", "0"}).err;
  };
  EXPECT_THAT(note_on("\"duration\": 3", "\"gravity\": [0, 0, -9.81]"), HasSubstr("/gravity: is along z"));
  EXPECT_EQ(note_on("\"duration\": 3", "\"gravity\": [0, 0, 0]"), "");
  // The arm's joint holds it; as a body of its own it floats.
  EXPECT_EQ(note_on("\"mass\": 2", "\"mass\": 0"), "");
  EXPECT_THAT(note_on("\"motion\": {}, \"collider\": { \"geometry\": { \"shape\": 0 } } } } },\n    { "
                      "\"name\": \"elbow on the arm\", "
                      "\"translation\": [0.5, 0, 0],\n      \"extensions\": { \"KHR_physics_rigid_bodies\": "
                      "{ \"joint\": { "
                      "\"connectedNode\": 4, \"joint\": 0 } } } },",
                      "\"motion\": { \"mass\": 0 }, \"collider\": { \"geometry\": { \"shape\": 0 } } } } "
                      "},\n    { \"name\": "
                      "\"elbow on the arm\" },"),
              HasSubstr("/mass: 0 is infinite, so the body floats"));
  EXPECT_THAT(run({"run", scene("pendulum.gltf"), "--step", "1", "--duration", "1"}).err,
              HasSubstr("--step 1 is a step of 1 s"));
  expect_refused({"run", scene("pendulum.gltf"), "--step", "60"}, "--step 60: is a step of 60 s");
}

TEST_F(InfoCommand, WhatCannotBeUsedIsRefused) {
  expect_refused({"info"}, "scene");
  expect_refused({"info", "missing.gltf"}, "missing.gltf: there is no such file");
  expect_refused({"info", scene("rod_chain.gltf"), "--copies", "3"}, "rod_chain.gltf: is a scene");
  expect_refused({"info", mesh("gear.stl"), "--copies", "0"}, "the copies must be from 1");
  expect_refused({"info", mesh("gear.stl"), "--rotate", "1,2"}, "--rotate");
}

TEST_F(InfoCommand, AMeshRunsDirectlyAndItsLogIsDrawnWithTheSameOptions) {
  const Outcome made =
      run({"run", mesh("dodecahedron.ply"), "--duration", "0.1", "--copies", "2", "--output", "two.poses"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  const std::vector<std::string> draw{"render", "two.poses", "--scene", mesh("dodecahedron.ply"),
                                      "--size", "64x36"};
  EXPECT_THAT(run(draw).err, HasSubstr("another version"));
  std::vector<std::string> same = draw;
  same.insert(same.end(), {"--copies", "2", "--output", "two.png"});
  const Outcome drawn = run(same);
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
}

}  // namespace
}  // namespace substep
