// Gaps of joints of every kind, overlaps, and violations, which bad runs have and good ones lack.

#include "sim/measure/invariants.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "sim/geometry/triangle_mesh.h"
#include "sim/loading/scene_settings.h"
#include "sim/measure/measured_run.h"
#include "sim/measure/metrics.h"
#include "sim/model/usual_settings.h"
#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

/// Returns the violations' texts, separated by semicolons.
std::string joined(const std::vector<Violation>& violations) {
  std::string text;
  for (const Violation& violation : violations) text += (text.empty() ? "" : "; ") + violation.text;
  return text;
}

using Severity = Violation::Severity;
using test::all_axes;
using test::locked;
using test::range;

const Pose joint_in_world{{0.3, -0.2, 0.9}, rotation_quaternion({0.4, -0.7, 1.1})};
const Vector3 anchor{0.5, 0, 0};                   // of the body's frame
const double lever = std::sqrt(0.5 * 0.5 + 0.25);  // m: √(moment / mass), (0.5 + 2 · 0.5²) kg m² over 2 kg
const Vector3 zero = Vector3::Zero();
constexpr double rounding = 1e-12;  // measured at most 2e-16

/// Returns a body of 2 kg, with the largest moment 0.5 kg m², on a joint with the world.
Scene jointed_body(const std::vector<JointLimit>& limits) {
  Scene scene = test::empty_scene();
  test::add_body(scene, 2, {0.1, 0.25, 0.5}, joint_in_world * Pose{-anchor, Quaternion::Identity()});
  scene.joints.push_back(test::ball_joint(world_body, 1, zero, anchor));
  scene.joints[0].frame_a = joint_in_world;
  scene.joints[0].limits = limits;
  return scene;
}

/// Returns the gap after the body's frame at the joint is moved and then turned, in the joint's axes.
double gap_at(const std::vector<JointLimit>& limits, const Vector3& by, const Vector3& turn = zero) {
  const Scene scene = jointed_body(limits);
  State state = initial_state(scene);
  const Pose moved =
      joint_in_world * Pose{by, rotation_quaternion(turn)} * Pose{-anchor, Quaternion::Identity()};
  state.q[1] = {moved.position, moved.orientation};
  return JointGapMeter(scene).gap(state);
}

TEST(JointGap, CountsLockedDirections) {
  const Vector3 by(0.1, -0.2, 0.2);
  EXPECT_NEAR(gap_at({locked(false, all_axes)}, by), 0.3, rounding);
  EXPECT_NEAR(gap_at({locked(false, {false, true, true})}, by), std::sqrt(0.08), rounding);
  EXPECT_NEAR(gap_at({locked(false, {true, false, false})}, by), 0.1, rounding);
  // Axes that are locked one by one are locked together.
  EXPECT_NEAR(gap_at({locked(false, {true, false, false}), locked(false, {false, true, false})}, by),
              std::sqrt(0.05), rounding);
}

TEST(JointGap, CountsLockedAnglesTimesTheLever) {
  EXPECT_NEAR(gap_at({locked(true, all_axes)}, zero, {0.02, 0.01, -0.02}), 0.03 * lever, rounding);
  EXPECT_NEAR(gap_at({locked(true, {true, true, false})}, zero, {0.03, 0, 0}), 0.03 * lever, rounding);
  EXPECT_NEAR(gap_at({locked(true, {false, true, false})}, zero, {0, -0.03, 0}), 0.03 * lever, rounding);
}

TEST(JointGap, IgnoresFreeDirections) {
  const Vector3 by(0.1, -0.2, 0.2);
  EXPECT_NEAR(gap_at({locked(false, {false, true, true})}, {5, 0, 0}, by), 0, rounding);
  EXPECT_NEAR(gap_at({locked(true, {true, true, false})}, by, {0, 0, 2}), 0, rounding);
  JointLimit spring = locked(false, all_axes);
  spring.stiffness = 10;
  EXPECT_EQ(gap_at({spring}, by, by), 0);
  EXPECT_TRUE(JointGapMeter(jointed_body({spring})).is_empty());
}

TEST(JointGap, CountsExcessOverLimit) {
  const JointLimit between = range(false, {true, false, false}, -0.1, 0.3);
  for (const auto& [x, gap] : {std::pair{0.2, 0.0}, {0.5, 0.2}, {-0.5, 0.4}})
    EXPECT_NEAR(gap_at({between}, {x, 1, 1}), gap, rounding);
  EXPECT_NEAR(gap_at({range(false, all_axes, 1, 1)}, {0, 0, 0.7}), 0.3, rounding);
  EXPECT_NEAR(gap_at({range(true, {true, false, false}, -1, 1)}, zero, {1.2, 0, 0}), 0.2 * lever, rounding);
}

TEST(JointGap, TakesTheSmallerLeverOfTwoBodies) {
  Scene scene = jointed_body({locked(true, all_axes)});
  // The largest radius of gyration of the other body is 0.1 m, at the joint.
  scene.joints[0].body_a = test::add_body(scene, 1, {0.005, 0.005, 0.01}, joint_in_world);
  scene.joints[0].frame_a = Pose{};
  State state = initial_state(scene);
  state.q[2].angular = state.q[2].angular * rotation_quaternion({0.3, 0, 0});
  EXPECT_NEAR(JointGapMeter(scene).gap(state), 0.3 * 0.1, rounding);
}

// Sweeps converge slowly along six sliders of small cubes a metre apart, so that these sag.
TEST(JointGap, CountsSaggingSliders) {
  Scene scene = test::empty_scene();
  for (int i = 0; i < 6; ++i) {
    test::add_box(scene, {0.2, 0.2, 0.2}, 1, {{0.1 + i, 0, 0}, Quaternion::Identity()}, 0.6);
    Joint slider = test::ball_joint(i + 1, i, {-0.1, 0, 0}, {i > 0 ? 0.9 : 0.0, 0, 0});
    slider.limits = {locked(false, {false, true, true}), locked(true, all_axes)};
    scene.joints.push_back(slider);
  }
  const MeasuredRun swept = measured_run(scene, usual_settings(scene, Algorithm::a3), 2);
  const double sag = -swept.state.q[6].linear.y();
  EXPECT_GT(sag, 1);                       // measured 4.8
  EXPECT_GT(swept.largest_gap, sag / 12);  // measured 0.56
  const MeasuredRun exact = measured_run(scene, usual_settings(scene, Algorithm::a1), 2);
  EXPECT_LT(std::abs(exact.state.q[6].linear.y()), 1e-9);  // measured 2e-16
  EXPECT_LT(exact.largest_gap, 1e-9);                      // measured 2e-16
}

TEST(Penetration, EqualsDepthOfOverlap) {
  const Scene scene = scene_named("box_stack");
  PenetrationMeter meter(scene);
  State state = initial_state(scene);
  EXPECT_NEAR(meter.depth(state), 0, 1e-12);
  state.q.back().linear.y() -= 0.0625;
  EXPECT_NEAR(meter.depth(state), 0.0625, 1e-12);
}

TEST(Penetration, CountsOverlapOfKeptPatches) {
  const Scene scene = scene_named("box_stack");
  Simulation simulation(scene, usual_settings(scene, Algorithm::a5));
  for (int k = 0; k < 60; ++k) simulation.step();
  ASSERT_FALSE(simulation.state().patches.empty());
  State poses = initial_state(scene);
  poses.q = simulation.state().q;
  PenetrationMeter meter(scene);
  EXPECT_NEAR(meter.depth(simulation.state()), meter.depth(poses), 1e-12);  // measured 6e-17
  EXPECT_GT(meter.depth(poses), 1e-4);                                      // measured 3.8e-4
}

/// Returns two boxes of 1 m and 2 kg, 4 m apart.
Scene two_boxes() {
  Scene scene = test::weightless_scene();
  for (const double x : {0, 4}) test::add_box(scene, {1, 1, 1}, 2, {{x, 0, 0}, Quaternion::Identity()}, 0);
  return scene;
}

/// Matches the one violation of a severity.
auto is_one(Severity severity) {
  return testing::ElementsAre(testing::Field(&Violation::severity, severity));
}

TEST(Violations, GapsWorsenWithSize) {
  Scene scene = two_boxes();
  scene.joints.push_back(test::ball_joint(1, 2, {2, 0, 0}, {-2, 0, 0}));
  Metrics metrics;
  metrics.joint_gap = 0.05;  // size 5.7 m, a box's diagonal 1.7 m
  EXPECT_TRUE(violations(scene, metrics).empty());
  for (const auto& [gap, severity] :
       {std::pair{0.1, Severity::warning}, {0.2, Severity::unbounded}, {7, Severity::torn}}) {
    metrics.joint_gap = gap;
    EXPECT_THAT(violations(scene, metrics), is_one(severity)) << gap;
  }
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
  // Motors and springs add energy to a scene that starts at rest.
  scene.bodies[1].linear_velocity = zero;
  metrics.energy_growth = energy;
  EXPECT_THAT(joined(violations(scene, metrics)), testing::Not(testing::HasSubstr("momentum")));
  metrics.energy_change = -0.02 * energy;
  metrics.momentum = 0.02 * 6 * std::sqrt(2.0);
  metrics.angular_momentum = 1;
  const std::string text = joined(violations(scene, metrics));
  for (const char* const what : {"energy drift", "momentum drift", "angular momentum drift"})
    EXPECT_THAT(text, testing::HasSubstr(what));
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

/// Returns the metrics of a run of half a second.
Metrics measured(const Scene& scene, const Settings& settings) {
  Simulation simulation(scene, settings);
  Invariants invariants(scene, simulation.state());
  Metrics metrics;
  for (int i = 1; i <= 30; ++i) {
    simulation.step();
    invariants.follow(simulation.state(), settings.step, metrics);
    invariants.add(simulation.state(), i * settings.step, metrics);
  }
  return metrics;
}

TEST(Violations, WarnsWhereSummedRotationTurnsMomentum) {
  Scene scene = test::weightless_scene();
  test::add_box(scene, {0.4, 0.9, 1.3}, 2, {zero, Quaternion::Identity()}, 0);
  const Vector3 inertia =
      2.0 / 12 * Vector3(0.9 * 0.9 + 1.3 * 1.3, 0.4 * 0.4 + 1.3 * 1.3, 0.4 * 0.4 + 0.9 * 0.9);
  for (const Vector3& spin : {Vector3(60, 33, -47), Vector3(9, 5, -7)}) {
    scene.bodies[1].angular_velocity = spin;
    const double momentum = inertia.cwiseProduct(spin).norm();
    for (const Algorithm algorithm : test::all_algorithms) {
      const bool sums = algorithm == Algorithm::a4 || algorithm == Algorithm::a5;
      const Settings settings = usual_settings(scene, algorithm);
      const Metrics metrics = measured(scene, settings);
      const double turned = metrics.angular_momentum.value() / momentum;
      SCOPED_TRACE(
          fmt::format("{} turned by {} rad, warned of {}", name(algorithm), turned, metrics.summed_turn));
      // The estimate is of second order in the step: measured 1.5 times the turn of 2 mrad, 4.5 times that of
      // 0.11 rad.
      if (sums) {
        EXPECT_GT(metrics.summed_turn, turned);
        EXPECT_LT(metrics.summed_turn, 6 * turned);
      }
      const std::string warning = joined(violations(scene, settings, metrics));
      EXPECT_EQ(warning.find("summed rotation") != std::string::npos, sums && turned > 0.1) << warning;
    }
  }
}

TEST(Violations, GravityIsNoMomentumDrift) {
  Scene scene = two_boxes();
  scene.gravity = {1, -9.81, 2};
  for (const Algorithm algorithm : test::all_algorithms) {
    const Settings settings = usual_settings(scene, algorithm);
    EXPECT_EQ(joined(violations(scene, settings, measured(scene, settings))), "") << name(algorithm);
  }
}

TEST(Violations, NamesBodiesThatPassThrough) {
  // A state that jumps shows a solver that misses a contact.
  Scene scene = two_boxes();
  State state = initial_state(scene);
  state.v[1].linear = {480, 0, 0};
  Invariants invariants(scene, state);
  Metrics metrics;
  state.q[1].linear = {8, 0, 0};
  invariants.follow(state, 1.0 / 60, metrics);
  EXPECT_THAT(metrics.passages, testing::ElementsAre("'box 2' passes through 'box 1'"));
  EXPECT_THAT(violations(scene, metrics), is_one(Severity::warning));
}

constexpr double frame_step = 1.0 / 60;

Scene scene_with(const Shape& obstacle, const Pose& place) {
  Scene scene = test::empty_scene();
  Collider& fixed = scene.colliders.emplace_back();
  fixed.shape = obstacle;
  fixed.placement = place;
  test::add_ball(scene, 0.1, 1, Vector3::Zero());
  return scene;
}

/// Returns true where the ball is seen to pass from one position to another, straight or by a bounce. The
/// obstacle is turned and shifted alike.
bool passes(const Shape& obstacle, const Vector3& from, const Vector3& to,
            const std::vector<Vector3>& bounce = {}) {
  const Pose place{{0.4, -3, 2}, rotation_quaternion({0.3, -1.1, 0.7})};
  const Scene scene = scene_with(obstacle, place);
  State state = initial_state(scene);
  state.q[1].linear = place * from;
  const Vector3 middle = bounce.empty() ? 0.5 * (from + to) : bounce[0];
  state.v[1].linear = place.orientation * (2 * (middle - from) / frame_step);
  PassageMeter meter(scene, state);
  state.q[1].linear = place * to;
  state.v[1].linear = place.orientation * (2 * (to - middle) / frame_step);
  meter.add(state, frame_step);
  return !meter.passages().empty();
}

TEST(PassageMeter, ReportsBallsThatPassThroughEachShape) {
  const Vector3 above(0.02, 2, 0.03);
  const Vector3 below(-0.05, -2, 0.01);
  const Shape shapes[] = {
      box({3, 0.01, 3}), box({0.3, 0.3, 0.3}), cylinder(0.3, 0.2, 0.1),       Cylinder{0.2, 0.3, 0.3},
      Sphere{0.2},       Capsule{0.3, 0.2},    TaperedCapsule{0.3, 0.2, 0.1}, make_rectangle(3, 3, false)};
  for (const Shape& shape : shapes) EXPECT_TRUE(passes(shape, above, below)) << shape.index();
  EXPECT_TRUE(passes(make_rectangle(3, 3, true), below, above));
}

TEST(PassageMeter, IgnoresBodiesBesideOrBehind) {
  const Vector3 above(0.7, 2, 0);
  const Vector3 below(0.7, -2, 0);
  const Shape shapes[] = {box({1, 0.01, 1}), Cylinder{0.2, 0.5, 0.5}, Sphere{0.5}, Capsule{0.3, 0.5},
                          make_rectangle(1, 1, true)};
  for (const Shape& shape : shapes) EXPECT_FALSE(passes(shape, above, below)) << shape.index();
  EXPECT_FALSE(passes(make_rectangle(3, 3, false), below, above));  // from behind
}

TEST(PassageMeter, IgnoresBounces) {
  // The straight line from first to last position leads through the wall's edge and through the ball.
  EXPECT_FALSE(passes(box({1, 0.1, 1}), {-1, 0.4, 0}, {0.7, -0.3, 0}, {{0.55, 0.17, 0}}));
  EXPECT_FALSE(passes(Sphere{0.2}, {-1, 0.1, 0}, {0.8, 0.1, 0.1}, {{-0.02, 0.3, 0}}));
}

/// Returns true where a 1 m blade that turns by 0.8 rad in a step is seen to pass a post off its middle.
bool blade_passes(double distance, double turned) {
  Scene scene = test::empty_scene();
  Collider& post = scene.colliders.emplace_back();
  post.shape = Cylinder{0.5, 0.03, 0.03};
  post.placement.position = {distance, 0, 0};
  test::add_box(scene, {1, 0.1, 0.02}, 1, {{0, 0, 0}, rotation_quaternion({0, turned - 0.4, 0})}, 0);
  State state = initial_state(scene);
  state.v[1].angular = {0, 0.8 / frame_step, 0};
  PassageMeter meter(scene, state);
  state.q[1].angular = rotation_quaternion({0, turned + 0.4, 0});
  meter.add(state, frame_step);
  return !meter.passages().empty();
}

TEST(PassageMeter, FollowsArcsOfTurns) {
  // A chord of the arc would be 4 cm closer to the middle.
  for (const double turned : {-0.3, -0.1, 0.0, 0.2}) {
    EXPECT_FALSE(blade_passes(0.52, turned)) << turned;
    EXPECT_TRUE(blade_passes(0.4, turned)) << turned;
  }
}

TEST(PassageMeter, IgnoresPairsThatJointsSilence) {
  Scene scene = scene_with(box({3, 0.01, 3}), {});
  scene.joints.push_back(test::ball_joint(0, 1, Vector3::Zero(), Vector3::Zero()));
  scene.joints[0].silent_colliders = {0};
  State state = initial_state(scene);
  state.q[1].linear = {0, 1, 0};
  state.v[1].linear = {0, -2 / frame_step, 0};
  PassageMeter meter(scene, state);
  state.q[1].linear = {0, -1, 0};
  meter.add(state, frame_step);
  EXPECT_TRUE(meter.passages().empty());
}

}  // namespace
}  // namespace substep
