// The half-approximations between A3 and A4: the ends of the ablation are the algorithms themselves.

#include "sim/measure/ablation.h"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

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

State climb(const Scene& scene, Approximation approximation, const Settings& settings, int steps) {
  Simulation simulation(scene, settings, ablation_procedure(approximation));
  for (int i = 0; i < steps; ++i) simulation.step();
  return simulation.state();
}

State run(const Scene& scene, Algorithm algorithm, Settings settings, int steps) {
  settings.algorithm = algorithm;
  Simulation simulation(scene, settings);
  for (int i = 0; i < steps; ++i) simulation.step();
  return simulation.state();
}

TEST(Ablation, WithoutApproximationIsA3ToTheBit) {
  for (const Scene& scene : {tumbling_chain(), sliding_box()}) {
    for (const Joints joints : {Joints::rows, Joints::plain, Joints::stable}) {
      Settings settings;
      settings.joints = joints;
      settings.iterations = 2;
      settings.tau = 0.7;
      settings.kappa = 0.9;
      settings.contact_tau = 1.1;
      settings.contact_kappa = 0.8;
      EXPECT_EQ(hash(climb(scene, Approximation::exact, settings, 60)),
                hash(run(scene, Algorithm::a3, settings, 60)));
    }
  }
}

TEST(Ablation, WithAllOfA4sIsA4) {
  for (const Joints joints : {Joints::rows, Joints::plain, Joints::stable}) {
    Settings settings;
    settings.joints = joints;
    settings.tau = 0.7;
    settings.kappa = 0.9;
    const State all = climb(tumbling_chain(), Approximation::all_of_a4, settings, 60);
    const State a4 = run(tumbling_chain(), Algorithm::a4, settings, 60);
    EXPECT_LT(position_difference(all, a4), 1e-12) << name(joints);  // measured 0
    EXPECT_GT(position_difference(a4, run(tumbling_chain(), Algorithm::a3, settings, 60)), 1e-4);
  }
  const Settings settings;
  const State all = climb(sliding_box(), Approximation::all_of_a4, settings, 20);
  EXPECT_LT(position_difference(all, run(sliding_box(), Algorithm::a4, settings, 20)), 1e-12);  // measured 0
}

// Each approximation changes the motion. The frozen Jacobian costs most, and more alone than with its bias
// update.
TEST(Ablation, EachApproximationHasACostOfItsOwn) {
  const Scene scene = tumbling_chain();
  const Settings settings;
  const State a3 = run(scene, Algorithm::a3, settings, 60);
  const auto cost = [&](Approximation approximation) {
    return position_difference(climb(scene, approximation, settings, 60), a3);
  };
  const double all = cost(Approximation::all_of_a4);  // measured 0.032 m
  for (const Approximation approximation :
       {Approximation::bias_update, Approximation::summed_rotation, Approximation::current_jacobian_bias}) {
    EXPECT_GT(cost(approximation), 1e-6) << name(approximation);
    EXPECT_LT(cost(approximation), 0.2 * all) << name(approximation);  // measured 0.019, 0.012, 0.041
  }
  EXPECT_GT(cost(Approximation::frozen_jacobian), all);  // measured 2.9 times as dear
}

}  // namespace
}  // namespace substep
