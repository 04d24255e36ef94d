// Violations of runs that went wrong, and none of runs that did not.

#include "sim/measure/violations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/loading/needed_substeps.h"
#include "sim/measure/invariants.h"
#include "sim/model/usual_settings.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

using Severity = Violation::Severity;

/// Two boxes of 1 m, 4 m apart, on a joint that locks nothing unless told to.
Scene two_boxes() {
  Scene scene = test::empty_scene();
  scene.gravity.setZero();
  test::add_box(scene, {1, 1, 1}, 2, {{0, 0, 0}, Quaternion::Identity()}, 0);
  test::add_box(scene, {1, 1, 1}, 2, {{4, 0, 0}, Quaternion::Identity()}, 0);
  return scene;
}

std::vector<Severity> severities(const std::vector<Violation>& violations) {
  std::vector<Severity> result;
  result.reserve(violations.size());
  for (const Violation& violation : violations) result.push_back(violation.severity);
  return result;
}

TEST(Violations, GapsWorsenWithSize) {
  Scene scene = two_boxes();
  scene.joints.push_back(test::ball_joint(1, 2, {2, 0, 0}, {-2, 0, 0}));
  Metrics metrics;
  metrics.joint_gap = 0.05;  // size 5.7 m, a box's diagonal 1.7 m
  EXPECT_TRUE(violations(scene, metrics).empty());
  metrics.joint_gap = 0.1;
  EXPECT_THAT(severities(violations(scene, metrics)), testing::ElementsAre(Severity::warning));
  metrics.joint_gap = 0.2;
  EXPECT_THAT(severities(violations(scene, metrics)), testing::ElementsAre(Severity::unbounded));
  metrics.joint_gap = 7;
  EXPECT_THAT(severities(violations(scene, metrics)), testing::ElementsAre(Severity::torn));
}

TEST(Violations, FreeBodiesKeepMomentumAndEnergy) {
  Scene scene = two_boxes();
  scene.colliders.clear();
  scene.bodies[1].linear_velocity = {3, 0, 0};
  Metrics metrics;
  const double energy = 0.5 * 2 * 9;
  metrics.energy_change = -0.009 * energy;
  metrics.momentum = 0.009 * 6;
  metrics.angular_momentum = 0;
  EXPECT_TRUE(violations(scene, metrics).empty());
  metrics.energy_change = -0.02 * energy;
  metrics.momentum = 0.02 * 6 * std::sqrt(2.0);
  metrics.angular_momentum = 1;
  const std::string text = joined(violations(scene, metrics));
  for (const char* const what : {"energy drift", "momentum drift", "angular momentum drift"}) {
    EXPECT_THAT(text, testing::HasSubstr(what));
  }
}

TEST(Violations, A5WarnsOfTooManySubsteps) {
  Scene scene = two_boxes();
  Settings settings = default_settings(Algorithm::a5);
  settings.substeps = most_default_substeps + 1;
  EXPECT_TRUE(violations(scene, settings, {}).empty());
  scene.joints.push_back(test::ball_joint(1, 2, {2, 0, 0}, {-2, 0, 0}));
  EXPECT_EQ(violations(scene, settings, {}).size(), 1U);
  settings.substeps = most_default_substeps;
  EXPECT_TRUE(violations(scene, settings, {}).empty());
}

/// Returns the violations of a run of half a second.
std::vector<Violation> found(const Scene& scene, const Settings& settings) {
  Simulation simulation(scene, settings);
  Invariants invariants(scene, simulation.state());
  Metrics metrics;
  for (int i = 1; i <= 30; ++i) {
    simulation.step();
    invariants.follow(simulation.state(), settings.step, metrics);
    invariants.add(simulation.state(), i * settings.step, metrics);
  }
  return violations(scene, settings, metrics);
}

TEST(Violations, GravityIsNoMomentumDrift) {
  Scene scene = two_boxes();
  scene.gravity = {1, -9.81, 2};
  for (const Algorithm algorithm : test::all_algorithms) {
    EXPECT_EQ(joined(found(scene, usual_settings(scene, algorithm))), "") << name(algorithm);
  }
}

TEST(Violations, NamesBodiesThatPassThrough) {
  // A collision filter would say that they meet; a state that jumps shows what a solver that misses them
  // does.
  Scene scene = two_boxes();
  State state = initial_state(scene);
  state.v[1].linear = {480, 0, 0};
  Invariants invariants(scene, state);
  Metrics metrics;
  state.q[1].linear = {8, 0, 0};
  invariants.follow(state, 1.0 / 60, metrics);
  EXPECT_THAT(metrics.passages, testing::ElementsAre("'box 2' passes through 'box 1'"));
  EXPECT_THAT(severities(violations(scene, metrics)), testing::ElementsAre(Severity::warning));
}

}  // namespace
}  // namespace substep
