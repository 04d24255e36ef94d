/// substep info, and meshes on the command line.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "program.h"

namespace substep {
namespace {

using testing::HasSubstr;

class InfoCommand : public Program {
 protected:
  static std::string mesh(const char* name) {
    return std::string(SUBSTEP_SOURCE_DIR) + "/tests/scene/meshes/" + name;
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
              HasSubstr("\nA1 and A2 take each step in 8 parts: weights on its joints "));
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
