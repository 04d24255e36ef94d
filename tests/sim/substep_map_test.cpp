// Compares the spectral radius of a sub-step's map with the closed form of one row, and with runs of A3.

#include "sim/measure/substep_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "sim/error.h"
#include "sim/measure/validity_maps.h"
#include "sim/simulation.h"
#include "tests/scene_files.h"

namespace substep {
namespace {

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

// A3's own runs grow by the map's radius in each sub-step, whatever the sub-step is.
TEST(SubstepMap, MatchesRuns) {
  const Scene scene = growing_governor();
  for (const Joints joints : {Joints::plain, Joints::rows}) {
    const double radius = substep_radius(scene, {}, 1, joints);
    EXPECT_GT(radius, 1.005);
    for (const double step : {1.0 / 60, 1.0 / 6000}) {
      Settings settings;
      settings.algorithm = Algorithm::a3;
      settings.step = step;
      settings.substeps = 10;
      settings.tau = settings.kappa = 1;
      settings.joints = joints;
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
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a2}) {
    settings.algorithm = algorithm;
    EXPECT_FALSE(substep_radius(chain, settings)) << name(algorithm);
  }
  settings.algorithm = Algorithm::a3;
  for (const char* const scene : {"governor", "box_stack", "powered_wheel", "tumbling_body"})
    EXPECT_FALSE(substep_radius(scene_named(scene), settings)) << scene;
}

}  // namespace
}  // namespace substep
