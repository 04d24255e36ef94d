/// Expectations in scene files: how they are read and refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/scene/example_scene.h"

namespace substep {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using namespace test;

json with(const std::string& expected) {
  json document = example();
  document["scenes"][0]["extras"] = {{"substep", {{"duration", 3}, {"expected", json::parse(expected)}}}};
  return document;
}

TEST(Expected, IsReadWithItsBodiesAndUnits) {
  const Scene scene = load(with(R"([
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
  const Scene scene = load(with(R"([
    {"quantity": "joint_gap", "stays": 0.25, "at_least": 3, "tolerance": 0.1, "source": "a paper"},
    {"quantity": "contact_impulse", "direction": [0, 2, 0], "at": 1, "value": 1, "tolerance": 0.1, "source": "s"}])"));
  EXPECT_EQ(scene.expected[0].reading, Reading::stays);
  EXPECT_EQ(scene.expected[0].level, 0.25);
  EXPECT_STREQ(unit_of(scene.expected[0]), "s");
  EXPECT_EQ(scene.expected[0].name, "joint gap stays on its side of 0.25");
  EXPECT_TRUE(scene.expected[1].bodies.empty());
  EXPECT_EQ(scene.expected[1].name, "contact impulse along +Y at 1 s");
}

TEST(Expected, SceneOverridesDocument) {
  json document = with(R"([{"quantity": "speed", "at_most": 2, "tolerance": 1, "source": "the scene"}])");
  document["extras"] = json::parse(R"({"substep": {"expected": []}})");
  EXPECT_EQ(load(document).expected.size(), 1u);
  document["scenes"][0].erase("extras");
  EXPECT_TRUE(load(document).expected.empty());
}

struct Trouble {
  const char* name;
  const char* change;  // of the item below, merged into it
  const char* place;   // below /scenes/0/extras/substep/expected/0
  const char* words;
};

void PrintTo(const Trouble& trouble, std::ostream* out) {
  *out << trouble.name;
}

class RefusesExpected : public testing::TestWithParam<Trouble> {};

TEST_P(RefusesExpected, AndSaysWhereAndWhatToDo) {
  json item = json::parse(R"({"quantity": "way", "body": "rock", "direction": [1, 0, 0], "at": 2, "value": 1,
                              "tolerance": 0.1, "source": "a closed form"})");
  item.merge_patch(json::parse(GetParam().change));
  const std::string said = complaint(with(json::array({item}).dump()));
  EXPECT_THAT(said, HasSubstr(std::string("/scenes/0/extras/substep/expected/0") + GetParam().place + ": "));
  EXPECT_THAT(said, HasSubstr(GetParam().words));
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusesExpected,
    testing::Values(
        Trouble{"UnknownKey", R"({"when": 2})", "", "unknown key 'when'"},
        Trouble{"NoQuantity", R"({"quantity": null})", "", "has no 'quantity'"},
        Trouble{"UnknownQuantity", R"({"quantity": "height"})", "/quantity",
                "'height' is no quantity; give one of displacement, position"},
        Trouble{"UnknownBody", R"({"body": "rok"})", "/body",
                "there is no body 'rok'; give the name of a node with motion (crate, rock)"},
        Trouble{"UnknownBodies", R"({"body": null, "bodies": ["rock", "world"]})", "/bodies/1",
                "there is no body 'world'"},
        Trouble{"NoBodies", R"({"body": null, "bodies": []})", "/bodies", "is empty"},
        Trouble{"BothBodies", R"({"bodies": ["rock"]})", "/bodies", "give one of them"},
        Trouble{"BodyOfEnergy", R"({"quantity": "energy_change", "direction": null})", "/body",
                "has no meaning for 'energy_change'"},
        Trouble{"NoDirection", R"({"direction": null})", "", "has no 'direction'"},
        Trouble{"DirectionWithoutLength", R"({"direction": [0, 0, 0]})", "/direction", "has no length"},
        Trouble{"NeedlessDirection", R"({"quantity": "speed"})", "/direction", "leave it out"},
        Trouble{"NeedlessCentre", R"({"centre": [0, 0, 0]})", "/centre", "leave it out"},
        Trouble{"UnknownFrame", R"({"frame": "body"})", "/frame", "give world or node"},
        Trouble{"FrameOfAWay", R"({"frame": "node"})", "/frame", "for 'angular_velocity' only"},
        Trouble{"RelativeSpeed", R"({"quantity": "speed", "direction": null, "relative_to": "crate"})",
                "/relative_to", "leave it out"},
        Trouble{"NoValue", R"({"value": null})", "", "needs one of 'value', 'at_most' and 'at_least'"},
        Trouble{"TwoValues", R"({"at_most": 1})", "", "needs one of"},
        Trouble{"ValueAsText", R"({"value": "1"})", "/value", "must be a number"},
        Trouble{"NoTolerance", R"({"tolerance": null})", "", "has no 'tolerance'"},
        Trouble{"ToleranceOfZero", R"({"tolerance": 0})", "/tolerance", "must be greater than 0"},
        Trouble{"NoSource", R"({"source": null})", "", "has no 'source'"},
        Trouble{"TooLate", R"({"at": 3.5})", "/at", "after the scene's end at 3 s"},
        Trouble{"Backwards", R"({"at": null, "mean": [2, 1]})", "/mean", "must begin before it ends"},
        Trouble{"ThreeTimes", R"({"at": null, "mean": [0, 1, 2]})", "/mean", "an array of 2 times"},
        Trouble{"TwoReadings", R"({"peak": 1})", "/peak", "give one, or none"},
        Trouble{"ZerothPeak", R"({"at": null, "peak": 0})", "/peak", "at least 1"},
        Trouble{"NeedlessLevel", R"({"level": 1})", "/level", "has no meaning without 'crossing'"},
        Trouble{"ImpulseOfABody", R"({"quantity": "contact_impulse"})", "/body", "leave it out"},
        Trouble{"StaysTooLate", R"({"at": null, "stays": 1, "value": 4})", "", "after the scene's end"},
        Trouble{"CrossingTooLate", R"({"at": null, "crossing": 1, "value": 4})", "",
                "after the scene's end"}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST(Expected, RefusesMoreThanAThousand) {
  std::string items = "[";
  for (int i = 0; i < 1001; ++i)
    items += std::string(i == 0 ? "" : ",") +
             R"({"quantity": "speed", "at_most": 2, "tolerance": 1, "source": "s"})";
  EXPECT_THAT(complaint(with(items + "]")), HasSubstr("has 1001 items; at most 1000 are read"));
}

}  // namespace
}  // namespace substep
