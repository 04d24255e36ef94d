// Contacts and friction against closed forms.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

constexpr double gravity = 9.81;

/// A cube of 0.2 m on a plane at 30°, sunk by nothing.
Scene incline(double friction) {
  Scene scene = test::floor_scene(friction);
  const Pose slope{Vector3::Zero(), rotation_quaternion({0, 0, -std::acos(-1.0) / 6})};
  scene.colliders[0].placement = slope;
  test::add_box(scene, {0.2, 0.2, 0.2}, 1, {slope * Vector3(0, 0.1, 0), slope.orientation}, friction);
  return scene;
}

Settings settings_of(Algorithm algorithm, double step) {
  Settings settings;
  settings.algorithm = algorithm;
  settings.step = step;
  settings.substeps = 4;
  settings.iterations = algorithm == Algorithm::a2 ? 30 : 4;
  return settings;
}

// Normals and friction together give the impulse of the block's weight over a step, straight up.
TEST(Incline, ContactsCarryTheBlock) {
  const Scene scene = incline(0.8);
  for (const Algorithm algorithm : test::all_algorithms) {
    Settings settings = settings_of(algorithm, 1.0 / 60);
    settings.contact_kappa = 0.7;  // A5 scales its impulses by κ
    if (algorithm >= Algorithm::a3) settings.iterations = 32;
    Simulation simulation(scene, settings);
    EXPECT_TRUE(simulation.contact_impulses().empty());
    for (int i = 0; i < 120; ++i) simulation.step();
    const std::vector<ContactImpulse> impulses = simulation.contact_impulses();
    // A patch gives one impulse, where its pressure has its centre: below the block's centre of mass.
    const bool by_points = algorithm == Algorithm::a1;
    ASSERT_EQ(impulses.size(), by_points ? 4u : 1u) << name(algorithm);
    Vector3 sum = Vector3::Zero();
    for (const ContactImpulse& contact : impulses) {
      const double sign = contact.a == 1 ? 1 : -1;
      sum += sign * contact.impulse;
      // Under the block's corners, or straight below its centre of mass.
      const double distance = by_points ? std::sqrt(0.03) : 0.1 / std::cos(std::acos(-1.0) / 6);
      EXPECT_NEAR((contact.place - simulation.state().q[1].linear).norm(), distance, 1e-3);
    }
    const Vector3 weight(0, gravity / 60, 0);
    EXPECT_LT((sum - weight).norm(), 0.002 * weight.norm()) << name(algorithm);
  }
}

TEST(Stack, A1KeepsTenBoxesAtRest) {
  Scene scene = test::floor_scene(0.6);
  for (int i = 0; i < 10; ++i)
    test::add_box(scene, {1, 1, 1}, 1, {{0, 0.5 + i, 0}, Quaternion::Identity()}, 0.6);
  Settings settings = settings_of(Algorithm::a1, 1.0 / 60);
  const MeasuredRun run = measured_run(scene, settings, 5);
  EXPECT_LT(position_difference(run.state, initial_state(scene)), 1e-6);
  EXPECT_LT(run.largest_residual, 1e-9);
}

TEST(Stack, A1KeepsHeavyTopAtRest) {
  Scene scene = test::floor_scene(0.6);
  for (int i = 0; i < 10; ++i) {
    test::add_box(scene, {1, 1, 1}, i == 9 ? 1000 : 1, {{0, 0.5 + i, 0}, Quaternion::Identity()}, 0.6);
  }
  Settings settings = settings_of(Algorithm::a1, 1.0 / 60);
  const MeasuredRun run = measured_run(scene, settings, 10);
  EXPECT_LT(position_difference(run.state, initial_state(scene)), 1e-3);
  EXPECT_LT(run.largest_residual, 1e-9);
}

}  // namespace
}  // namespace substep
