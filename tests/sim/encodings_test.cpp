// Base64, hashes, the settings that follow a scene, and scenes that cannot be modelled.

#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "sim/math/base64.h"
#include "sim/math/fnv1a.h"
#include "sim/model/model.h"
#include "sim/model/settings.h"
#include "sim/model/usual_settings.h"
#include "tests/error_message.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

// RFC 4648's test values, and both digits that are neither letters nor numbers.
TEST(Base64, MatchesRfc4648) {
  const std::pair<std::string, std::string> pairs[] = {{"", ""},
                                                       {"f", "Zg=="},
                                                       {"fo", "Zm8="},
                                                       {"foo", "Zm9v"},
                                                       {"foob", "Zm9vYg=="},
                                                       {"foobar", "Zm9vYmFy"},
                                                       {"\xfb\xff", "+/8="}};
  for (const auto& [bytes, text] : pairs) {
    EXPECT_EQ(base64(bytes), text);
    std::optional<char> invalid;
    EXPECT_EQ(base64_decoded(text, invalid), bytes);
    EXPECT_FALSE(invalid) << text;
  }
}

TEST(Base64, NamesInvalidByte) {
  std::optional<char> invalid;
  base64_decoded("Zm9v Zm9v", invalid);
  EXPECT_EQ(invalid, ' ');
}

// Fowler, Noll and Vo's own test values.
TEST(Fnv1a, MatchesPublishedValues) {
  EXPECT_EQ(fnv1a(""), 0xcbf29ce484222325);
  EXPECT_EQ(fnv1a("a"), 0xaf63dc4c8601ec8c);
  EXPECT_EQ(fnv1a("foobar"), 0x85944171f73967e8);
}

TEST(Fnv1a, IsContinued) {
  EXPECT_EQ(fnv1a("bar", fnv1a("foo")), fnv1a("foobar"));
  // The lowest byte is the first: 'f', 'o', 'o'.
  EXPECT_EQ(fnv1a_of_number(0x6f6f66, 3, fnv1a_start), fnv1a("foo"));
  EXPECT_EQ(fnv1a_of_number(0xff, 1, fnv1a_start), fnv1a("\xff"));
}

TEST(Settings, FollowScene) {
  Scene scene;
  EXPECT_EQ(usual_settings(scene, Algorithm::a5).substeps, default_settings(Algorithm::a5).substeps);
  scene.step = 0.02;
  scene.substeps = 45;
  const Settings a2 = usual_settings(scene, Algorithm::a2);
  EXPECT_EQ(a2.step, 0.02);
  EXPECT_EQ(a2.iterations, 45);
  const Settings a3 = usual_settings(scene, Algorithm::a3);
  EXPECT_EQ(a3.substeps, 45);
  EXPECT_EQ(a3.iterations, 1);
}

TEST(Model, RefusesInvalidParts) {
  using Change = std::function<void(Scene&)>;
  const auto shape = [](const Shape& other) -> Change {
    return [other](Scene& scene) { scene.colliders[1].shape = other; };
  };
  const auto drive = [](const JointDrive& added) -> Change {
    return [added](Scene& scene) { scene.joints[0].drives.push_back(added); };
  };
  const std::string body = "body 1 (box 1) needs ";
  const std::string collider = "collider 1 needs ";
  const std::string joint = "joint 0 (joint) needs ";
  const std::pair<std::string, Change> changes[] = {
      {"it needs the world", [](Scene& scene) { scene = Scene{}; }},
      {"it needs the world", [](Scene& scene) { scene.bodies[0].inverse_mass = 1; }},
      {"the world needs", [](Scene& scene) { scene.bodies[0].pose.position.x() = 1; }},
      {"the world needs", [](Scene& scene) { scene.bodies[0].linear_velocity.x() = 1; }},
      {"its gravity needs", [](Scene& scene) { scene.gravity.x() = infinity; }},
      {body, [](Scene& scene) { scene.bodies[1].inverse_mass = infinity; }},
      {body, [](Scene& scene) { scene.bodies[1].inverse_inertia.x() = -1; }},
      {body, [](Scene& scene) { scene.bodies[1].linear_velocity.x() = std::nan(""); }},
      {body, [](Scene& scene) { scene.bodies[1].pose.orientation = Quaternion(2, 0, 0, 0); }},
      {collider, [](Scene& scene) { scene.colliders[1].body = 2; }},
      {collider, [](Scene& scene) { scene.colliders[1].material.static_friction = std::nan(""); }},
      {collider, shape(Polytope{})},
      {collider, shape(TriangleMesh{})},
      {collider, shape(Plane{})},
      {collider, shape(Sphere{-1})},
      {collider, shape(Sphere{std::nan("")})},
      {collider, shape(Capsule{-1, 1})},
      {collider, shape(Cylinder{0.5, 0, 0})},
      {joint, [](Scene& scene) { scene.joints[0].body_b = 2; }},
      {joint, [](Scene& scene) { scene.joints[0].body_b = 1; }},
      {joint, [](Scene& scene) { scene.joints[0].silent_colliders = {2}; }},
      {joint, [](Scene& scene) { scene.joints[0].limits[0].min = 1; }},
      {joint, [](Scene& scene) { scene.joints[0].limits[0].axes = {}; }},
      {joint, drive({.axis = 5, .damping = 1})},
      {joint, drive({.stiffness = -1, .damping = 2})},
      {joint, drive({.velocity_target = std::nan(""), .damping = 1})},
      {joint, drive({})}};
  Scene valid = test::box_stack(1);
  valid.joints.push_back(test::ball_joint(1, 0, Vector3::Zero(), {0, 0.5, 0}));
  EXPECT_NO_THROW(build_model(valid));
  for (const auto& [words, change] : changes) {
    Scene scene = valid;
    change(scene);
    const std::string message = test::message_of([&] { build_model(scene); });
    EXPECT_NE(message.find(": " + words), std::string::npos) << words << "is not in '" << message << "'";
  }
}

TEST(Model, LeavesOutJointsBetweenHeldBodies) {
  Scene scene = test::box_stack(1);
  scene.joints.push_back(test::ball_joint(1, 0, Vector3::Zero(), {0, 0.5, 0}));
  EXPECT_EQ(build_model(scene).locks.size(), 1U);
  scene.bodies[1].inverse_mass = 0;
  scene.bodies[1].inverse_inertia.setZero();
  EXPECT_EQ(build_model(scene).locks.size(), 0U);
  EXPECT_FALSE(has_loop(scene, Springs::count));
}

TEST(Simulation, RefusesInvalidStates) {
  const Scene scene = test::box_stack(1);
  Simulation simulation(scene, default_settings(Algorithm::a5));
  const std::pair<std::string, std::function<void(State&)>> changes[] = {
      {"the state has 2 poses and 1 velocities, ", [](State& state) { state.v.pop_back(); }},
      {"body 1 (box 1) in the state needs", [](State& state) { state.q[1].linear.y() = std::nan(""); }},
      {"body 1 (box 1) in the state needs", [](State& state) { state.v[1].angular.x() = infinity; }},
      {"body 0 (world) in the state needs", [](State& state) { state.q[0].angular.coeffs().setZero(); }}};
  for (const auto& [words, change] : changes) {
    State state = simulation.state();
    change(state);
    const std::string message = test::message_of([&] { simulation.set_state(state); });
    EXPECT_NE(message.find("test: " + words), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace substep
