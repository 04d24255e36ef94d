// Gaps of joints of every kind, against displacements and turns that are set.

#include "sim/measure/joint_gap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sim/measure/measured_run.h"
#include "sim/model/usual_settings.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

const Pose joint_in_world{{0.3, -0.2, 0.9}, rotation_quaternion({0.4, -0.7, 1.1})};
const Vector3 anchor{0.5, 0, 0};  // of the body's frame

/// A body of 2 kg, with the largest moment 0.5 kg m², on a joint with the world.
Scene jointed_body(const std::vector<JointLimit>& limits) {
  Scene scene = test::empty_scene();
  Body body;
  body.name = "body";
  body.inverse_mass = 0.5;
  body.inverse_inertia = {10, 4, 2};
  body.pose = joint_in_world * Pose{-anchor, Quaternion::Identity()};
  scene.bodies.push_back(body);
  Joint joint;
  joint.name = "joint";
  joint.body_a = world_body;
  joint.body_b = 1;
  joint.frame_a = joint_in_world;
  joint.frame_b.position = anchor;
  joint.limits = limits;
  scene.joints.push_back(joint);
  return scene;
}

const double lever = std::sqrt(0.5 * 0.5 + 0.25);  // of moments 0.5 + 2 · 0.5² kg m² for 2 kg

/// Returns the gap after the body's frame at the joint is moved and then turned, in the joint's axes.
double gap_at(const std::vector<JointLimit>& limits, const Vector3& by,
              const Vector3& turn = Vector3::Zero()) {
  const Scene scene = jointed_body(limits);
  State state = initial_state(scene);
  const Pose moved =
      joint_in_world * Pose{by, rotation_quaternion(turn)} * Pose{-anchor, Quaternion::Identity()};
  state.q[1] = {moved.position, moved.orientation};
  return joint_gap(scene, state);
}

constexpr std::array all_axes{true, true, true};
constexpr double rounding = 1e-12;  // measured at most 2e-16

TEST(JointGap, CountsLockedDirections) {
  const Vector3 by(0.1, -0.2, 0.2);
  EXPECT_NEAR(gap_at({test::locked(false, all_axes)}, by), 0.3, rounding);
  EXPECT_NEAR(gap_at({test::locked(false, {false, true, true})}, by), std::sqrt(0.08), rounding);
  EXPECT_NEAR(gap_at({test::locked(false, {true, false, false})}, by), 0.1, rounding);
  // Axes that are locked one by one are locked together.
  EXPECT_NEAR(
      gap_at({test::locked(false, {true, false, false}), test::locked(false, {false, true, false})}, by),
      std::sqrt(0.05), rounding);
}

TEST(JointGap, CountsLockedAnglesTimesTheLever) {
  const Vector3 still = Vector3::Zero();
  EXPECT_NEAR(gap_at({test::locked(true, all_axes)}, still, {0.02, 0.01, -0.02}), 0.03 * lever, rounding);
  EXPECT_NEAR(gap_at({test::locked(true, {true, true, false})}, still, {0.03, 0, 0}), 0.03 * lever, rounding);
  EXPECT_NEAR(gap_at({test::locked(true, {false, true, false})}, still, {0, -0.03, 0}), 0.03 * lever,
              rounding);
}

TEST(JointGap, IgnoresFreeDirections) {
  const Vector3 by(0.1, -0.2, 0.2);
  EXPECT_NEAR(gap_at({test::locked(false, {false, true, true})}, {5, 0, 0}, by), 0, rounding);
  EXPECT_NEAR(gap_at({test::locked(true, {true, true, false})}, by, {0, 0, 2}), 0, rounding);
  JointLimit spring = test::locked(false, all_axes);
  spring.stiffness = 10;
  EXPECT_EQ(gap_at({spring}, by, by), 0);
  EXPECT_TRUE(JointGapMeter(jointed_body({spring})).is_empty());
}

TEST(JointGap, CountsExcessOverLimit) {
  const JointLimit between = test::range(false, {true, false, false}, -0.1, 0.3);
  EXPECT_NEAR(gap_at({between}, {0.2, 1, 1}), 0, rounding);
  EXPECT_NEAR(gap_at({between}, {0.5, 1, 1}), 0.2, rounding);
  EXPECT_NEAR(gap_at({between}, {-0.5, 1, 1}), 0.4, rounding);
  EXPECT_NEAR(gap_at({test::range(false, all_axes, 1, 1)}, {0, 0, 0.7}), 0.3, rounding);
  EXPECT_NEAR(gap_at({test::range(true, {true, false, false}, -1, 1)}, Vector3::Zero(), {1.2, 0, 0}),
              0.2 * lever, rounding);
}

TEST(JointGap, TakesTheSmallerLeverOfTwoBodies) {
  Scene scene = jointed_body({test::locked(true, all_axes)});
  // Its largest radius of gyration is 0.1 m, at the joint.
  Body small;
  small.name = "small";
  small.inverse_mass = 1;
  small.inverse_inertia = {200, 200, 100};
  small.pose = joint_in_world;
  scene.bodies.push_back(small);
  scene.joints[0].body_a = 2;
  scene.joints[0].frame_a = Pose{};
  State state = initial_state(scene);
  state.q[2].angular = state.q[2].angular * rotation_quaternion({0.3, 0, 0});
  EXPECT_NEAR(joint_gap(scene, state), 0.3 * 0.1, rounding);
}

// Sweeps converge slowly along six sliders of small cubes a metre apart, so that these sag.
TEST(JointGap, CountsSaggingSliders) {
  Scene scene = test::empty_scene();
  for (int i = 0; i < 6; ++i) {
    test::add_box(scene, {0.2, 0.2, 0.2}, 1, {{0.1 + i, 0, 0}, Quaternion::Identity()}, 0.6);
    Joint slider = test::ball_joint(i + 1, i, {-0.1, 0, 0}, {i > 0 ? 0.9 : 0.0, 0, 0});
    slider.limits = {test::locked(false, {false, true, true}), test::locked(true, all_axes)};
    scene.joints.push_back(slider);
  }
  const auto gap_and_sag = [&](Algorithm algorithm) {
    const MeasuredRun run = measured_run(scene, usual_settings(scene, algorithm), 2);
    return std::pair(run.largest_gap, -run.state.q[6].linear.y());
  };
  const auto [gap, sag] = gap_and_sag(Algorithm::a3);
  EXPECT_GT(sag, 1);         // measured 4.8
  EXPECT_GT(gap, sag / 12);  // measured 0.56
  const auto [exact_gap, exact_sag] = gap_and_sag(Algorithm::a1);
  EXPECT_LT(std::abs(exact_sag), 1e-9);  // measured 2e-16
  EXPECT_LT(exact_gap, 1e-9);            // measured 2e-16
}

}  // namespace
}  // namespace substep
