#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/geometry/contact.h"
#include "sim/geometry/convex_hull.h"
#include "sim/geometry/round_shapes.h"
#include "tests/geometry/solids.h"

namespace substep {
namespace {

using test::contacts;
using test::turn;
using test::upright;

TEST(RoundContacts, TaperedCapsuleAroundBallEqualsBall) {
  // A tapered capsule with one ball within the other equals the larger ball, at either end.
  const Polytope brick = box({1, 0.6, 0.8});
  std::mt19937 random(3);
  int found = 0;
  for (int trial = 0; trial < 600; ++trial) {
    const bool at_top = trial % 2 == 0;
    const Shape capsule = make_tapered_capsule(0.2, at_top ? 0.1 : 0.4, at_top ? 0.4 : 0.1);
    const Pose pose = {test::random_point(random, 0.9), test::random_orientation(random)};
    const Vector3 centre = pose * Vector3(0, at_top ? 0.1 : -0.1, 0);
    const auto points = contacts(capsule, pose, brick, {}, 0.05);
    const auto ball = contacts(Sphere{0.4}, {centre, upright}, brick, {}, 0.05);
    ASSERT_EQ(points.empty(), ball.empty()) << trial;
    if (points.empty()) continue;
    ++found;
    const double expected = test::lowest_distance(ball);
    // The preference for faces allows as much; measured at most 1.7 mm, at 33 mm from an edge.
    EXPECT_NEAR(test::lowest_distance(points), expected, 0.06 * std::abs(expected) + 1.2e-3 * 0.8) << trial;
  }
  EXPECT_GT(found, 100);
}

TEST(RoundContacts, LyingCylinderKeepsHeight) {
  // The contacts' depth follows from the radius alone, at each angle of rolling.
  const Cylinder can = make_cylinder(1, 0.5, 0.5);
  const Polytope slab = box({20, 1, 20});
  const TriangleMesh floor = test::flat_mesh(16, 0.7, 0.3);
  const Quaternion lying = turn(std::acos(0.0), {0, 0, 1});
  for (int i = 0; i < 2000; ++i) {
    const double angle = 0.0137 * i;
    const Pose pose = {{0.1, 0.499, 0.002 * i - 2}, turn(0.3, {0, 1, 0}) * turn(angle, {1, 0, 0}) * lying};
    for (const auto& points :
         {contacts(can, pose, Plane{}, {}, 0.02), contacts(can, pose, slab, {{0, -0.5, 0}, upright}, 0.02),
          contacts(can, pose, floor, {}, 0.02)}) {
      ASSERT_EQ(points.size(), 2U) << i;
      for (const ContactPoint& point : points) {
        ASSERT_NEAR(point.distance, -0.001, 1e-15) << i;  // measured 3e-16
        ASSERT_LT((point.normal - Vector3::UnitY()).norm(), 1e-15);
      }
      ASSERT_NEAR((points[0].on_a - points[1].on_a).norm(), 1, 1e-12);
    }
  }
}

TEST(RoundContacts, TiltedDiscTouchesAtLowestPoint) {
  // The rim's lowest point is r sin(tilt) + h/2 cos(tilt) below the centre, for each rotation about the
  // disc's axis. A disc parallel to 1e-5 keeps the contacts on its own axes, one of which is within 22.5° of
  // the lowest point.
  const Cylinder disc = make_cylinder(0.02, 0.5, 0.5);
  for (const double tilt : {1e-6, 2e-5, 1e-3, 0.01, 0.1, 0.5, 0.7, 0.9, 1.4}) {
    const double most_off = tilt < 1e-5 ? 0.5 * tilt * (1 - std::cos(0.3927)) : 2e-15;  // measured 4e-16
    for (int i = 0; i < 100; ++i) {
      const Quaternion turned = turn(0.37 * i, {0, 1, 0}) * turn(tilt, {1, 0, 0}) * turn(0.11 * i, {0, 1, 0});
      const double low = 0.5 * std::sin(tilt) + 0.01 * std::cos(tilt);
      const auto points = contacts(disc, {{0, low - 1e-4, 0}, turned}, Plane{}, {}, 0.02);
      ASSERT_FALSE(points.empty());
      EXPECT_NEAR(test::lowest_distance(points), -1e-4, most_off) << tilt;
    }
  }
}

TEST(RoundContacts, SlightTiltKeepsContactCount) {
  std::mt19937 random(3);
  const Cylinder can = make_cylinder(1, 0.5, 0.5);
  const Polytope slab = box({20, 1, 20});
  const TriangleMesh floor = test::flat_mesh(16, 0.5, 0);
  const Quaternion lying = turn(std::acos(0.0), {0, 0, 1});
  for (const double angle : {1e-12, 1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3}) {
    for (int trial = 0; trial < 200; ++trial) {
      const Quaternion tilt = turn(angle, test::random_point(random, 1));
      const double gap = trial % 2 == 0 ? -1e-4 : 1e-4;
      const Pose below = {{0, -0.5, 0}, upright};
      EXPECT_EQ(contacts(can, {{0.1, 0.5 + gap, 0}, tilt}, slab, below, 0.02).size(), 8U) << angle;
      EXPECT_EQ(contacts(can, {{0.1, 0.5 + gap, 0}, tilt}, floor, {}, 0.02).size(), 8U) << angle;
      EXPECT_EQ(contacts(can, {{0.1, 0.5 + gap, 0}, tilt * lying}, slab, below, 0.02).size(), 2U) << angle;
      EXPECT_EQ(contacts(can, {{0.1, 0.5 + gap, 0}, tilt * lying}, floor, {}, 0.02).size(), 2U) << angle;
      EXPECT_GE(contacts(can, {{0, 0.5 + gap, 0}, tilt}, can, below, 0.02).size(), 8U) << angle;
      EXPECT_EQ(contacts(can, {{0, 0.5 + gap, 0}, tilt * lying}, can, {below.position, lying}, 0.02).size(),
                2U)
          << angle;
    }
  }
}

TEST(RoundContacts, MeetingRimsTouchAtClosestPoints) {
  // Two discs are side by side, each tilted so that its rim's corner points at the other: only the rims meet.
  const Cylinder disc = make_cylinder(0.1, 0.5, 0.5);
  const double half = std::sqrt(0.5 * 0.5 + 0.05 * 0.05);
  // Each with its rim's corner towards the other along x.
  const double corner = std::atan2(0.05, 0.5);
  const Pose left = {{-half - 0.001, 0, 0}, turn(-corner, {0, 0, 1})};
  const Pose right = {{half + 0.001, 0, 0}, turn(corner, {0, 0, 1}) * turn(std::acos(-1.0), {0, 1, 0})};
  const auto points = contacts(disc, right, disc, left, 0.02);
  ASSERT_EQ(points.size(), 1U);
  EXPECT_NEAR(points[0].distance, 0.002, 1e-12);
  EXPECT_LT((points[0].normal - Vector3::UnitX()).norm(), 1e-6);
}

// The closest point of a convex solid lies in the direction of largest separation: no other direction may
// separate the solid from the point by more.
TEST(RevolvedSolid, ClosestPointMatchesLargestSeparation) {
  std::mt19937 random(5);
  for (const Shape& shape : test::round_shapes()) {
    SCOPED_TRACE(shape.index());
    int outside = 0;
    for (int trial = 0; trial < 200; ++trial) {
      const Pose pose = {test::random_point(random, 1), test::random_orientation(random)};
      const RevolvedSolid solid = *as_revolved(shape, pose);
      const Vector3 point = pose.position + test::random_point(random, 1);
      const auto separation = [&](const Vector3& d) { return d.dot(point) - test::extent(shape, pose, d); };
      const auto found = solid.direction_to(point);
      double largest = -infinity;
      for (int i = 0; i < 500; ++i) {
        const Vector3 far = test::random_point(random, 1);
        const Vector3 near = (found ? *found : Vector3::UnitY()) + 0.01 * far;
        largest = std::max({largest, separation(far.normalized()), separation(near.normalized())});
      }
      if (largest < 1e-3) continue;
      ++outside;
      ASSERT_TRUE(found) << trial;
      EXPECT_NEAR(found->norm(), 1, 1e-14) << trial;
      EXPECT_GT(separation(*found), largest - 1e-12) << trial;  // measured larger by 1e-10 and more
    }
    EXPECT_GT(outside, 100);  // measured 195 to 199
  }
}

}  // namespace
}  // namespace substep
