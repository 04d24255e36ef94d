// Bodies that pass through others within a step, and those that only come near.

#include "sim/measure/passage_meter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "sim/geometry/triangle_mesh.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

constexpr double step = 1.0 / 60;
const Quaternion upright = Quaternion::Identity();

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
  state.v[1].linear = place.orientation * (2 * (middle - from) / step);
  PassageMeter meter(scene, state);
  state.q[1].linear = place * to;
  state.v[1].linear = place.orientation * (2 * (to - middle) / step);
  meter.add(state, step);
  return !meter.passages().empty();
}

TEST(PassageMeter, ReportsBallsThatPassThroughEachShape) {
  const Vector3 above(0.02, 2, 0.03);
  const Vector3 below(-0.05, -2, 0.01);
  EXPECT_TRUE(passes(box({3, 0.01, 3}), above, below));
  EXPECT_TRUE(passes(box({0.3, 0.3, 0.3}), above, below));
  EXPECT_TRUE(passes(cylinder(0.3, 0.2, 0.1), above, below));
  EXPECT_TRUE(passes(Cylinder{0.2, 0.3, 0.3}, above, below));
  EXPECT_TRUE(passes(Sphere{0.2}, above, below));
  EXPECT_TRUE(passes(Capsule{0.3, 0.2}, above, below));
  EXPECT_TRUE(passes(TaperedCapsule{0.3, 0.2, 0.1}, above, below));
  EXPECT_TRUE(passes(make_rectangle(3, 3, false), above, below));
  EXPECT_TRUE(passes(make_rectangle(3, 3, true), below, above));
}

TEST(PassageMeter, IgnoresBodiesBesideOrBehind) {
  const Vector3 above(0.7, 2, 0);
  const Vector3 below(0.7, -2, 0);
  EXPECT_FALSE(passes(box({1, 0.01, 1}), above, below));
  EXPECT_FALSE(passes(Cylinder{0.2, 0.5, 0.5}, above, below));
  EXPECT_FALSE(passes(Sphere{0.5}, above, below));
  EXPECT_FALSE(passes(Capsule{0.3, 0.5}, above, below));
  EXPECT_FALSE(passes(make_rectangle(1, 1, true), above, below));
  EXPECT_FALSE(passes(make_rectangle(3, 3, false), below, above));  // from behind
}

TEST(PassageMeter, IgnoresBounces) {
  // The straight way from the first place to the last leads through the wall's edge and through the ball.
  EXPECT_FALSE(passes(box({1, 0.1, 1}), {-1, 0.4, 0}, {0.7, -0.3, 0}, {{0.55, 0.17, 0}}));
  EXPECT_FALSE(passes(Sphere{0.2}, {-1, 0.1, 0}, {0.8, 0.1, 0.1}, {{-0.02, 0.3, 0}}));
}

/// A blade of 1 m that turns by 0.8 rad in a step, and a post at a distance from its middle.
bool blade_passes(double distance, double turned) {
  Scene scene = test::empty_scene();
  Collider& post = scene.colliders.emplace_back();
  post.shape = Cylinder{0.5, 0.03, 0.03};
  post.placement.position = {distance, 0, 0};
  test::add_box(scene, {1, 0.1, 0.02}, 1, {{0, 0, 0}, rotation_quaternion({0, turned - 0.4, 0})}, 0);
  State state = initial_state(scene);
  state.v[1].angular = {0, 0.8 / step, 0};
  PassageMeter meter(scene, state);
  state.q[1].angular = rotation_quaternion({0, turned + 0.4, 0});
  meter.add(state, step);
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
  state.v[1].linear = {0, -2 / step, 0};
  PassageMeter meter(scene, state);
  state.q[1].linear = {0, -1, 0};
  meter.add(state, step);
  EXPECT_TRUE(meter.passages().empty());
}

}  // namespace
}  // namespace substep
