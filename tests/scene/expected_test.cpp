/// Expectations in scene files: how they are read and refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/scene/example_scene.h"

namespace substep {
namespace {

using testing::HasSubstr;
using namespace test;

Json scene_with(const std::string& expected) {
  return edited("/scenes/0/extras/substep = {\"duration\": 3, \"expected\": " + expected + "}");
}

TEST(Expected, IsReadWithItsBodiesAndUnits) {
  const Scene scene = load(scene_with(R"([
    {"quantity": "displacement", "value": 0, "tolerance": 0.05, "source": "it stands"},
    {"quantity": "way", "body": "rock", "relative_to": "crate", "direction": [0, 3, -4], "at": 2, "value": -1,
     "tolerance": 0.1, "source": "a closed form", "name": "how far"},
    {"quantity": "angular_velocity", "bodies": ["crate", "rock"], "direction": [0, 1, 0], "frame": "node",
     "crossing": 2, "level": 0.5, "value": 1.5, "tolerance": 0.1, "source": "a paper"},
    {"quantity": "energy_change", "throughout": [1, 2], "at_most": 0, "tolerance": 1, "source": "no drive"}])"));
  ASSERT_EQ(scene.expected.size(), 4u);
  EXPECT_EQ(scene.expected[0].bodies, (std::vector{1, 2}));
  EXPECT_EQ(scene.expected[0].needs, 0);
  EXPECT_EQ(scene.expected[0].name, "2 bodies: displacement");
  const Expectation& way = scene.expected[1];
  EXPECT_EQ(way.bodies, std::vector{2});
  EXPECT_EQ(way.relative_to, 1);
  EXPECT_LT((way.direction - Vector3(0, 0.6, -0.8)).norm(), 1e-15);
  EXPECT_EQ(way.reading, Reading::at);
  EXPECT_EQ(way.needs, 2);
  EXPECT_EQ(way.name, "how far");
  EXPECT_EQ(way.source, "a closed form");
  const Expectation& rate = scene.expected[2];
  EXPECT_TRUE(rate.in_node);
  EXPECT_EQ(rate.count, 2);
  EXPECT_EQ(rate.level, 0.5);
  EXPECT_NEAR(rate.needs, 1.6, 1e-12);
  EXPECT_STREQ(unit_of(rate), "s");
  EXPECT_EQ(rate.name, "2 bodies: angular velocity about +Y goes through 0.5, time 2");
  EXPECT_EQ(scene.expected[3].bound, Bound::at_most);
  EXPECT_EQ(scene.expected[3].needs, 2);
}

TEST(Expected, StaysReadsItsLevel) {
  const Scene scene = load(scene_with(R"([
    {"quantity": "joint_gap", "stays": 0.25, "at_least": 3, "tolerance": 0.1, "source": "a paper"},
    {"quantity": "contact_impulse", "direction": [0, 2, 0], "at": 1, "value": 1, "tolerance": 0.1, "source": "s"}])"));
  EXPECT_EQ(scene.expected[0].reading, Reading::stays);
  EXPECT_EQ(scene.expected[0].level, 0.25);
  EXPECT_EQ(scene.expected[0].needs, scene.duration);
  EXPECT_STREQ(unit_of(scene.expected[0]), "s");
  EXPECT_EQ(scene.expected[0].name, "joint gap stays on its side of 0.25");
  EXPECT_TRUE(scene.expected[1].bodies.empty());
  EXPECT_EQ(scene.expected[1].name, "contact impulse along +Y at 1 s");
}

TEST(Expected, SceneOverridesDocument) {
  Json document =
      scene_with(R"([{"quantity": "speed", "at_most": 2, "tolerance": 1, "source": "the scene"}])");
  document["extras"] = Json::parse(R"({"substep": {"expected": []}})");
  EXPECT_EQ(load(document).expected.size(), 1u);
  document["scenes"][0].erase("extras");
  EXPECT_TRUE(load(document).expected.empty());
}

// Each row: members merged into an expectation | words of the message | path of the fault in the expectation.
TEST(Expected, RefusalNamesPlaceAndRemedy) {
  const Json good =
      Json::parse(R"({"quantity": "way", "body": "rock", "direction": [1, 0, 0], "at": 2, "value": 1,
                                    "tolerance": 0.1, "source": "a closed form"})");
  for (const auto& row : rows(R"(
    "when": 2 | unknown key 'when'
    "quantity": null | has no 'quantity'
    "quantity": "height" | unknown 'height'; known are displacement, position | /quantity
    "body": "rok" | there is no body 'rok'; give the name of a node with motion (crate, rock) | /body
    "body": null, "bodies": ["rock", "world"] | there is no body 'world' | /bodies/1
    "body": null, "bodies": [] | is empty | /bodies
    "bodies": ["rock"] | give one of them | /bodies
    "quantity": "energy_change", "direction": null | has no meaning for 'energy_change' | /body
    "direction": null | has no 'direction'
    "direction": [0, 0, 0] | has no length | /direction
    "quantity": "speed" | leave it out | /direction
    "centre": [0, 0, 0] | leave it out | /centre
    "frame": "body" | unknown 'body'; known are world, node | /frame
    "frame": "node" | for 'angular_velocity' only | /frame
    "quantity": "speed", "direction": null, "relative_to": "crate" | leave it out | /relative_to
    "value": null | needs one of 'value', 'at_most' and 'at_least'
    "at_most": 1 | needs one of
    "value": "1" | must be a number | /value
    "tolerance": null | has no 'tolerance'
    "tolerance": 0 | must be greater than 0 | /tolerance
    "source": null | has no 'source'
    "at": 3.5 | after the scene's end at 3 s | /at
    "at": null, "mean": [2, 1] | must begin before it ends | /mean
    "at": null, "mean": [0, 1, 2] | an array of 2 times | /mean
    "peak": 1 | give one, or none | /peak
    "at": null, "peak": 0 | at least 1 | /peak
    "level": 1 | has no meaning without 'crossing' | /level
    "quantity": "contact_impulse" | leave it out | /body
    "at": null, "stays": 1, "value": 4 | after the scene's end
    "at": null, "crossing": 1, "value": 4 | after the scene's end)")) {
    SCOPED_TRACE(row[0]);
    Json item = good;
    item.merge_patch(Json::parse("{" + row[0] + "}"));
    const std::string message = complaint(scene_with(Json::array({item}).dump()));
    const std::string place = "/scenes/0/extras/substep/expected/0" + (row.size() > 2 ? row[2] : "");
    EXPECT_THAT(message, HasSubstr(place + ": "));
    EXPECT_THAT(message, HasSubstr(row[1]));
  }
}

TEST(Expected, RefusesMoreThanAThousand) {
  const Json item = Json::parse(R"({"quantity": "speed", "at_most": 2, "tolerance": 1, "source": "s"})");
  EXPECT_THAT(complaint(scene_with(Json(std::vector<Json>(1001, item)).dump())),
              HasSubstr("has 1001 items; at most 1000 are read"));
}

}  // namespace
}  // namespace substep
