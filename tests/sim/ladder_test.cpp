// The half-rungs between A3 and A4: the ends of the ladder are the algorithms themselves.

#include "sim/ladder.h"

#include <gtest/gtest.h>

#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

using test::position_difference;

Scene tumbling_chain() {
  Scene scene = test::chain(3, 0.3);
  scene.joints[2].limits.push_back(test::locked(true, {true, true, false}));
  scene.bodies[1].angular_velocity = {0.5, 1, 0};
  scene.bodies[3].angular_velocity = {1, -0.5, 2};
  return scene;
}

/// A box that falls on its edge and slides: contacts with friction.
Scene sliding_box() {
  Scene scene = test::floor_scene(0.4);
  test::add_box(scene, {1, 1, 1}, 1, {{0, 0.6, 0}, rotation_quaternion({0.1, 0.2, 0.05})}, 0.4);
  scene.bodies[1].linear_velocity = {1, 0, 0.3};
  return scene;
}

State climb(const Scene& scene, Rung rung, const Settings& settings, int steps) {
  Simulation simulation(scene, settings, ladder_procedure(rung));
  for (int i = 0; i < steps; ++i) simulation.step();
  return simulation.state();
}

State run(const Scene& scene, Algorithm algorithm, Settings settings, int steps) {
  settings.algorithm = algorithm;
  Simulation simulation(scene, settings);
  for (int i = 0; i < steps; ++i) simulation.step();
  return simulation.state();
}

TEST(Ladder, WithoutApproximationIsA3ToTheBit) {
  for (const Scene& scene : {tumbling_chain(), sliding_box()}) {
    for (const Joints joints : {Joints::rows, Joints::plain, Joints::stable}) {
      Settings settings;
      settings.joints = joints;
      settings.iterations = 2;
      settings.tau = 0.7;
      settings.kappa = 0.9;
      EXPECT_EQ(hash(climb(scene, Rung::exact, settings, 60)), hash(run(scene, Algorithm::a3, settings, 60)));
    }
  }
}

TEST(Ladder, WithAllOfA4sIsA4) {
  for (const Joints joints : {Joints::rows, Joints::plain, Joints::stable}) {
    Settings settings;
    settings.joints = joints;
    settings.tau = 0.7;
    settings.kappa = 0.9;
    const State all = climb(tumbling_chain(), Rung::all_of_a4, settings, 60);
    const State a4 = run(tumbling_chain(), Algorithm::a4, settings, 60);
    EXPECT_LT(position_difference(all, a4), 1e-12) << name(joints);  // measured 0
    EXPECT_GT(position_difference(a4, run(tumbling_chain(), Algorithm::a3, settings, 60)), 1e-4);
  }
  const Settings settings;
  const State all = climb(sliding_box(), Rung::all_of_a4, settings, 20);
  EXPECT_LT(position_difference(all, run(sliding_box(), Algorithm::a4, settings, 20)), 1e-12);  // measured 0
}

// Every switch switches something; the frozen Jacobian is the dear one, and dearer alone than with the bias
// update that belongs to it.
TEST(Ladder, EachApproximationHasAPriceOfItsOwn) {
  const Scene scene = tumbling_chain();
  const Settings settings;
  const State a3 = run(scene, Algorithm::a3, settings, 60);
  const auto price = [&](Rung rung) { return position_difference(climb(scene, rung, settings, 60), a3); };
  const double all = price(Rung::all_of_a4);  // measured 0.032 m
  for (const Rung rung : {Rung::bias_update, Rung::summed_rotation, Rung::current_jacobian_bias}) {
    EXPECT_GT(price(rung), 1e-6) << name(rung);
    EXPECT_LT(price(rung), 0.2 * all) << name(rung);  // measured 0.019, 0.012, 0.041
  }
  EXPECT_GT(price(Rung::frozen_jacobian), all);  // measured 2.9 times as dear
}

}  // namespace
}  // namespace substep
