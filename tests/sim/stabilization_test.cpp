// One scalar equality row under τ and κ: u' = (1−κ)u + τβ, β' = β − u'. Stable if and only if 0 < κ < 2 and
// 0 < τ < 4 − 2κ.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

/// A weight on a hinge-less guide: one ball joint off by 1 mm in y, so that each row is the scalar
/// recurrence.
bool stays(Algorithm algorithm, double tau, double kappa) {
  Scene scene = test::empty_scene();
  scene.gravity.setZero();
  Body body;
  body.name = "weight";
  body.inverse_mass = 1;
  body.inverse_inertia = Vector3::Constant(10);
  body.pose.position = {0, 0.001, 0};
  scene.bodies.push_back(body);
  scene.joints.push_back(test::ball_joint(1, 0, Vector3::Zero(), Vector3::Zero()));
  Settings settings;
  settings.algorithm = algorithm;
  settings.substeps = 8;
  settings.tau = tau;
  settings.kappa = kappa;
  Simulation simulation(scene, settings);
  for (int i = 0; i < 200; ++i) simulation.step();
  return std::abs(simulation.state().q[1].linear.y()) < 0.001;
}

TEST(Stabilization, IsStableWhereTheClosedFormSays) {
  int stable = 0;
  int unstable = 0;
  for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    for (double kappa = 0.1; kappa < 2; kappa += 0.2) {
      for (double tau = 0.1; tau < 4; tau += 0.2) {
        const double border = 4 - 2 * kappa;
        if (std::abs(tau - border) < 0.05) continue;
        const bool expected = tau < border;
        EXPECT_EQ(stays(algorithm, tau, kappa), expected)
            << name(algorithm) << " τ " << tau << " κ " << kappa;
        ++(expected ? stable : unstable);
      }
    }
  }
  EXPECT_GT(stable, 200);
  EXPECT_GT(unstable, 200);
}

}  // namespace
}  // namespace substep
