// A1, A2 and A3 are of first order on six joint scenes, once steps are small enough for their iterations. The
// ablation equals A3 without approximations, and A4 with all approximations of A4.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "sim/measure/ablation.h"
#include "sim/measure/metrics.h"
#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

struct Case {
  const char* scene;
  double duration;  ///< s
  int iterations;   ///< of A2 and A3
  int divisions;    ///< of the scene's step: h of A1 and A2, h/n of A3; the finer run has twice as many
};

void PrintTo(const Case& x, std::ostream* out) {
  *out << x.scene;
}

class Order : public testing::TestWithParam<Case> {};

TEST_P(Order, IsOneInA1ToA3) {
  const Case& x = GetParam();
  Scene scene = scene_named(x.scene);
  scene.duration = x.duration;
  const ReferenceMotion reference = reference_motion(scene, x.duration);
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a2, Algorithm::a3}) {
    const auto error_at = [&](int divisions) {
      Settings settings;
      settings.algorithm = algorithm;
      settings.step = algorithm == Algorithm::a3 ? scene.step : scene.step / divisions;
      settings.substeps = divisions;
      settings.iterations = x.iterations;
      const MotionDifference error = measure(scene, settings, reference, false).error;
      EXPECT_GT(error.position.rms + error.orientation.rms, 100 * reference.uncertainty().position);
      return error.position.rms > 0 ? error.position.rms : error.orientation.rms;
    };
    const double order = std::log2(error_at(x.divisions) / error_at(2 * x.divisions));
    RecordProperty(std::string(name(algorithm)), std::to_string(order));
    EXPECT_NEAR(order, 1, 0.05) << name(algorithm);  // measured 0.987 to 1.027
  }
}

// A heavy chain's end weighs a thousand times as much as a link: the solver's error falls below the step's
// only with 64 iterations.
INSTANTIATE_TEST_SUITE_P(JointScenes, Order,
                         testing::Values(Case{"pendulum", 1, 1, 64}, Case{"rod_chain", 1, 1, 128},
                                         Case{"heavy_chain", 0.25, 64, 512}, Case{"heavy_top", 1, 1, 64},
                                         Case{"joint_kinds", 0.25, 16, 64}, Case{"squeezer", 0.5, 4, 128}));

Scene tumbling_chain() {
  Scene scene = test::chain(3, 0.3);
  scene.joints[2].limits.push_back(test::locked(true, {true, true, false}));
  scene.bodies[1].angular_velocity = {0.5, 1, 0};
  scene.bodies[3].angular_velocity = {1, -0.5, 2};
  return scene;
}

/// Returns a box that falls on its edge and slides: contacts with friction.
Scene sliding_box() {
  Scene scene = test::floor_scene(0.4);
  test::add_box(scene, {1, 1, 1}, 1, {{0, 0.6, 0}, rotation_quaternion({0.1, 0.2, 0.05})}, 0.4);
  scene.bodies[1].linear_velocity = {1, 0, 0.3};
  return scene;
}

using test::run;

/// Returns the state after a run of A3 with an approximation.
State ablated(const Scene& scene, const Approximation& approximation, const Settings& settings,
              double duration) {
  Simulation simulation = ablated_simulation(scene, settings, approximation);
  return measured_run(simulation, duration).state;
}

Settings of_a4(Settings settings) {
  settings.algorithm = Algorithm::a4;
  return settings;
}

TEST(Ablation, EqualsA3WithoutApproximation) {
  for (const Scene& scene : {tumbling_chain(), sliding_box()}) {
    for (const Joints joints : {Joints::rows, Joints::plain, Joints::stable}) {
      const Settings settings{.iterations = 2,
                              .tau = 0.7,
                              .kappa = 0.9,
                              .contact_tau = 1.1,
                              .contact_kappa = 0.8,
                              .joints = joints};
      EXPECT_EQ(hash(ablated(scene, approximations.front(), settings, 1)), hash(run(scene, settings, 1)));
    }
  }
}

TEST(Ablation, EqualsA4WithAllApproximations) {
  for (const Joints joints : {Joints::rows, Joints::plain, Joints::stable}) {
    const Settings settings{.tau = 0.7, .kappa = 0.9, .joints = joints};
    const State all = ablated(tumbling_chain(), approximations.back(), settings, 1);
    const State a4 = run(tumbling_chain(), of_a4(settings), 1);
    EXPECT_LT(position_difference(all, a4), 1e-12) << name(joints);  // measured 0
    EXPECT_GT(position_difference(a4, run(tumbling_chain(), settings, 1)), 1e-4);
  }
  const State all = ablated(sliding_box(), approximations.back(), {}, 1.0 / 3);
  EXPECT_LT(position_difference(all, run(sliding_box(), of_a4({}), 1.0 / 3)), 1e-12);  // measured 0
}

TEST(Ablation, SlidesAsA3WithFrozenJacobian) {
  // A sliding box does not rotate: its Jacobians are constant, only its biases change.
  Scene scene = test::floor_scene(0.4);
  test::add_box(scene, {1, 0.2, 1}, 1, {{0, 0.1, 0}, Quaternion::Identity()}, 0.4);
  scene.bodies[1].linear_velocity = {1, 0, 0.3};
  const State frozen = ablated(scene, approximations[2], {}, 0.5);
  const State exact = run(scene, {}, 0.5);
  EXPECT_LT(position_difference(frozen, exact), 1e-12);  // measured 3e-17
}

TEST(Ablation, ApproximationsDifferInCost) {
  // ablation_costs() runs for a second, 60 steps.
  const std::vector<double> costs = ablation_costs(tumbling_chain(), 4, 1);
  const double all = costs.back();  // measured 0.032 m
  for (std::size_t i = 1; i + 1 < costs.size(); ++i) {
    if (approximations[i].frozen_jacobian) {
      // A frozen Jacobian costs most, and more alone than with its bias update.
      EXPECT_GT(costs[i], all);  // measured 2.9 times `all`
    } else {
      EXPECT_GT(costs[i], 1e-6) << approximations[i].name;
      EXPECT_LT(costs[i], 0.2 * all) << approximations[i].name;  // measured 0.019, 0.012, 0.041
    }
  }
}

}  // namespace
}  // namespace substep
