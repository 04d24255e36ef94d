// Equalities of the report: A5 is A4 refactored (claim 5), A3 with stable joints is small-step XPBD (claim
// 16), and a sub-step's map predicts the growth of runs. `substep report claims` measures the rest.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/error.h"
#include "sim/measure/claims_measurement.h"
#include "sim/measure/substep_map.h"
#include "sim/measure/validity_maps.h"
#include "sim/simulation.h"
#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

/// Returns the largest distance between the bodies of A4, with these settings, and A5 after `duration`, m.
double difference_of_a5(const Scene& scene, Settings settings, double duration) {
  const MeasuredRun a4 = measured_run(scene, settings, duration);
  settings.algorithm = Algorithm::a5;
  return position_difference(a4, measured_run(scene, settings, duration));
}

double difference_of_a5(const Scene& scene, double duration, double contact_tau = 0,
                        double contact_kappa = 0) {
  Settings settings = test::sub_stepped(Algorithm::a4, 4, 0.6, 0.9, Joints::plain);
  settings.iterations = 2;
  settings.contact_tau = contact_tau;
  settings.contact_kappa = contact_kappa;
  return difference_of_a5(scene, settings, duration);
}

TEST(Claim5, HoldsForContacts) {
  Scene scene = test::floor_scene(0.4);
  test::add_box(scene, {1, 1, 1}, 1, {{0, 0.6, 0}, rotation_quaternion({0.1, 0.2, 0.05})}, 0.4);
  scene.bodies[1].linear_velocity = {1, 0, 0.3};
  // Contacts amplify rounding in each step, so the time is short: 10 steps, 6 of them with contact.
  // Measured: 2.8e-12 m.
  EXPECT_LT(difference_of_a5(scene, 10.0 / 60), 1e-11);
}

// A joint beside contacts: A5's sum of velocities follows the joint's τ and κ, contacts have their own.
TEST(Claim5, HoldsWithStabilizationOfContacts) {
  const Scene scene = scene_named("powered_wheel");
  EXPECT_LT(difference_of_a5(scene, 0.25, 1.1, 0.7), 1e-11);
  const auto end = [&](double tau, double kappa) {
    Settings settings{.algorithm = Algorithm::a5, .substeps = 4, .iterations = 2, .tau = 0.6, .kappa = 0.9};
    settings.contact_tau = tau;
    settings.contact_kappa = kappa;
    return test::run(scene, settings, 0.25);
  };
  EXPECT_GT(position_difference(end(1.1, 0.7), end(0, 0)), 1e-6);
}

// A hit on a stop takes more sweeps, so both algorithms have to find it in the same sub-steps.
TEST(Claim5, HoldsForHitStops) {
  Scene scene = test::weightless_scene();
  test::add_body(scene, 2, Vector3::Constant(0.1));
  test::add_body(scene, 3, Vector3::Constant(0.1), test::at(0, 1, 0));
  scene.bodies[1].linear_velocity = {2, 0, 0};
  Joint& slider = scene.joints.emplace_back(test::ball_joint(2, 1, {0, -0.5, 0}, {0, 0.5, 0}));
  slider.limits = {test::locked(false, {false, true, true}), test::locked(true, test::all_axes),
                   test::range(false, {true, false, false}, -0.3, 0.5)};
  const auto difference = [&](int n, double tau, double kappa) {
    return difference_of_a5(scene, test::sub_stepped(Algorithm::a4, n, tau, kappa, Joints::plain), 2);
  };
  EXPECT_LT(difference(1, 1.4, 0.5), 1e-11);  // measured 0
  EXPECT_LT(difference(10, 1, 1), 1e-11);     // measured 2e-14
}

Settings a3(int n, int m, double step) {
  return {.step = step, .substeps = n, .iterations = m, .joints = Joints::stable};
}

TEST(SmallStepXpbd, EqualsA3InEveryIteration) {
  // Measured: 3.1e-12 and 1.0e-12 m, rounding that the motion amplifies. Claim 16 has one iteration.
  EXPECT_LT(claims::distance_from_xpbd(scene_named("rod_chain"), a3(3, 2, 1.0 / 97), 2), 1e-11);
  EXPECT_LT(claims::distance_from_xpbd(scene_named("heavy_chain"), a3(5, 3, 1.0 / 60), 2), 1e-11);
}

TEST(SmallStepXpbd, RefusesScenesOutOfPlane) {
  EXPECT_THROW(claims::distance_from_xpbd(scene_named("bricard"), a3(1, 1, 1.0 / 60), 1), Error);
}

/// u' = (1−κ)u + τβ, β' = β − u'.
double closed_form(double tau, double kappa) {
  const double half_trace = 1 - (kappa + tau) / 2;
  const double determinant = 1 - kappa;
  const double root = half_trace * half_trace - determinant;
  return root < 0 ? std::sqrt(determinant) : std::abs(half_trace) + std::sqrt(root);
}

TEST(SubstepMap, OneRowMatchesClosedForm) {
  const Scene weight = weight_on_a_joint(0, {true, true, true});
  for (const double kappa : {0.3, 0.9, 1.0, 1.7}) {
    for (const double tau : {0.1, 0.6, 1.0, 2.5}) {
      for (const Joints joints : {Joints::rows, Joints::plain}) {
        EXPECT_NEAR(substep_radius(weight, {tau, kappa}, 1, joints), closed_form(tau, kappa), 1e-7)
            << tau << " " << kappa;
      }
    }
  }
}

/// Returns the governor with rods at the position where the map grows most, without gravity, nearly at rest.
Scene growing_governor() {
  Scene scene = positions_of(without_springs(scene_named("governor")), 7, 0.1).at(5);
  scene.gravity.setZero();
  for (std::size_t i = 1; i < scene.bodies.size(); ++i)
    scene.bodies[i].linear_velocity = 1e-11 * Vector3(1, -0.5 * static_cast<double>(i), 0.3);
  return scene;
}

// Runs of A3 grow by the map's radius in each sub-step of any length.
TEST(SubstepMap, MatchesRuns) {
  const Scene scene = growing_governor();
  for (const Joints joints : {Joints::plain, Joints::rows}) {
    const double radius = substep_radius(scene, {}, 1, joints);
    EXPECT_GT(radius, 1.005);
    for (const double step : {1.0 / 60, 1.0 / 6000}) {
      const Settings settings{.step = step, .substeps = 10, .joints = joints};
      Simulation simulation(scene, settings);
      // The largest angular speed in 50 steps: it swings as it grows.
      const auto peak = [&] {
        double largest = 0;
        for (int i = 0; i < 50; ++i) {
          simulation.step();
          for (const Velocity& v : simulation.state().v) largest = std::max(largest, v.angular.norm());
        }
        return largest;
      };
      for (int i = 0; i < 50; ++i) simulation.step();
      const double before = peak();
      peak();
      const double growth = std::log(peak() / before) / 1000;  // sub-steps
      EXPECT_NEAR(growth, std::log(radius), 0.05 * growth) << step << " " << name(joints);
    }
  }
}

TEST(SubstepMap, RefusesSoftJoints) {
  EXPECT_THROW(substep_radius(scene_named("governor"), {}, 1, Joints::plain), Error);
  EXPECT_THROW(substep_radius(scene_named("box_stack"), {}, 1, Joints::plain), Error);
  EXPECT_THROW(substep_radius(scene_named("powered_wheel"), {}, 1, Joints::plain), Error);
}

TEST(SubstepMap, ExistsForRigidJoints) {
  const Scene chain = scene_named("rod_chain");
  Settings settings = default_settings(Algorithm::a5);
  settings.tau = 1;
  settings.iterations = 2;
  EXPECT_EQ(substep_radius(chain, settings),
            substep_radius(chain, {.kappa = settings.kappa}, 2, settings.joints));
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a2, Algorithm::soft, Algorithm::avbd}) {
    settings.algorithm = algorithm;
    EXPECT_FALSE(substep_radius(chain, settings)) << name(algorithm);
  }
  settings.algorithm = Algorithm::a3;
  for (const char* const scene : {"governor", "box_stack", "powered_wheel", "tumbling_body"})
    EXPECT_FALSE(substep_radius(scene_named(scene), settings)) << scene;
}

}  // namespace
}  // namespace substep
