// A1's friction is the same in every direction: its limit is a disc, and it points against the slip.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/direct/mlcp.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

constexpr double friction = 0.5;
constexpr double gravity = 9.81;
constexpr double pi = std::numbers::pi;

Quaternion turn(double degrees) {
  return rotation_quaternion({0, degrees * pi / 180, 0});
}

/// A flat block on a plane, turned by `block` about the plane's normal, pushed along the plane by `push`
/// times the largest friction in the direction `heading`. The push is a part of gravity, so it acts at the
/// centre of mass. All of it stands on a plane at `slope`.
Scene pushed_block(double push, double heading, double block, const Quaternion& slope) {
  Scene scene = test::floor_scene(friction);
  scene.colliders[0].placement.orientation = slope;
  const auto [sine, cosine] = sine_cosine(heading * pi / 180);
  const double along = push * friction * gravity;
  scene.gravity = slope * Vector3(along * cosine, -gravity, along * sine);
  test::add_box(scene, {0.6, 0.1, 0.4}, 3, {slope * Vector3(0, 0.05, 0), slope * turn(block)}, friction);
  return scene;
}

Vector3 heading_of(double heading, const Quaternion& slope) {
  const auto [sine, cosine] = sine_cosine(heading * pi / 180);
  return slope * Vector3(cosine, 0, sine);
}

constexpr double blocks[] = {0, 22, 30, 45, 70};
const Quaternion slopes[] = {Quaternion::Identity(), rotation_quaternion({0.2, 0.1, -0.35})};

TEST(FrictionDirection, ABlockPushedBeyondFrictionMovesAlikeInSixteenDirections) {
  Settings settings;
  settings.algorithm = Algorithm::a1;
  constexpr int steps = 60;
  // The excess over friction, stepped by h: velocities first, then coordinates.
  const double expected = 0.06 * friction * gravity * settings.step * settings.step * steps * (steps + 1) / 2;
  double worst = 0;
  double worst_aside = 0;
  for (const Quaternion& slope : slopes) {
    for (const double block : blocks) {
      for (int k = 0; k < 16; ++k) {
        const Scene scene = pushed_block(1.06, 22.5 * k, block, slope);
        const MeasuredRun run = measured_run(scene, settings, steps * settings.step);
        const Vector3 moved = run.state.q[1].linear - scene.bodies[1].pose.position;
        const Vector3 heading = heading_of(22.5 * k, slope);
        EXPECT_NEAR(moved.dot(heading), expected, 0.02 * expected) << "block " << block << ", heading " << k;
        EXPECT_LE(run.largest_residual, MlcpSolver::tolerance);
        worst = std::max(worst, std::abs(moved.dot(heading) / expected - 1));
        worst_aside = std::max(worst_aside, (moved - moved.dot(heading) * heading).norm() / expected);
      }
    }
  }
  EXPECT_LT(worst, 1e-9);        // measured 2.4e-11, of the distance
  EXPECT_LT(worst_aside, 1e-9);  // measured 1.9e-10
}

TEST(FrictionDirection, ABlockPushedLessThanFrictionStaysInSixteenDirections) {
  Settings settings;
  settings.algorithm = Algorithm::a1;
  double worst = 0;
  for (const Quaternion& slope : slopes) {
    for (const double block : blocks) {
      for (int k = 0; k < 16; ++k) {
        const Scene scene = pushed_block(0.96, 22.5 * k, block, slope);
        const State state = test::run(scene, settings, 1);
        worst = std::max(worst, (state.q[1].linear - scene.bodies[1].pose.position).norm());
      }
    }
  }
  EXPECT_LT(worst, 1e-12);  // measured 1.7e-14 m
}

}  // namespace
}  // namespace substep
