// Compares contacts of cylinders, cones and tapered capsules with an oracle that does not use their features:
// the maximum of the separation over all directions, found by search with support functions of its own.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/geometry/contact.h"
#include "sim/geometry/convex_hull.h"
#include "sim/geometry/revolved_solid.h"
#include "sim/geometry/round_solids.h"
#include "tests/geometry/solids.h"

namespace substep {
namespace {

using test::contacts;
using test::turn;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Returns the extent of a shape along a unit direction, by definition.
double reach(const Shape& shape, const Pose& pose, const Vector3& direction) {
  const Vector3 d = pose.orientation.conjugate() * direction;
  const double flat = std::sqrt(d.x() * d.x() + d.z() * d.z());
  double local = -infinity;
  if (const auto* sphere = std::get_if<Sphere>(&shape)) {
    local = sphere->radius;
  } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    local = capsule->half_length * std::abs(d.y()) + capsule->radius;
  } else if (const auto* tapered = std::get_if<TaperedCapsule>(&shape)) {
    local = std::max(tapered->half_length * d.y() + tapered->radius_top,
                     -tapered->half_length * d.y() + tapered->radius_bottom);
  } else if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
    local = std::max(cylinder->half_height * d.y() + cylinder->radius_top * flat,
                     -cylinder->half_height * d.y() + cylinder->radius_bottom * flat);
  } else if (const auto* polytope = std::get_if<Polytope>(&shape)) {
    for (const Vector3& vertex : polytope->vertices) local = std::max(local, d.dot(vertex));
  }
  return local + direction.dot(pose.position);
}

/// Returns the distance of two convex shapes, or minus the depth of their overlap. The search may end at a
/// local maximum; the direction `found` is measured, too, which can only improve the result.
double oracle_separation(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b,
                         const std::vector<ContactPoint>& found) {
  const auto separation = [&](const Vector3& n) { return -reach(a, pose_a, -n) - reach(b, pose_b, n); };
  // Directions spread evenly over the sphere, the best of them improved by steps that halve.
  constexpr int count = 1500;
  std::vector<std::pair<double, Vector3>> starts;
  for (int i = 0; i < count; ++i) {
    const double y = 1 - (2 * i + 1.0) / count;
    const double out = std::sqrt(1 - y * y);
    const double angle = 2.399963229728653 * i;
    const Vector3 n(out * std::cos(angle), y, out * std::sin(angle));
    starts.emplace_back(separation(n), n);
  }
  std::ranges::partial_sort(starts, starts.begin() + 5,
                            [](const auto& p, const auto& q) { return p.first > q.first; });
  double best = -infinity;
  for (const ContactPoint& point : found) best = std::max(best, separation(point.normal));
  for (int i = 0; i < 5; ++i) {
    auto [value, n] = starts[static_cast<std::size_t>(i)];
    double step = 0.1;
    for (int round = 0; round < 60 && step > 1e-8; ++round) {
      const Vector3 x = n.unitOrthogonal();
      const Vector3 y = n.cross(x);
      bool better = false;
      for (int k = 0; k < 16; ++k) {
        const double angle = k * 0.39269908169872414;
        const Vector3 tried = (n + step * (std::cos(angle) * x + std::sin(angle) * y)).normalized();
        const double there = separation(tried);
        if (there <= value) continue;
        value = there;
        n = tried;
        better = true;
        break;
      }
      if (!better) step /= 2;
    }
    best = std::max(best, value);
  }
  return best;
}

struct Sized {
  Shape shape;
  double size;  ///< diameter of a ball about it
};

std::vector<Sized> round_shapes() {
  return {{make_cylinder(1, 0.5, 0.5), 1.4},         {make_cylinder(0.1, 0.5, 0.5), 1.0},
          {make_cylinder(2, 0.1, 0.1), 2.0},         {make_cylinder(1, 0.5, 0.2), 1.4},
          {make_cylinder(0.8, 0, 0.4), 1.1},         {make_tapered_capsule(1, 0.3, 0.1), 1.6},
          {make_tapered_capsule(0.3, 0.2, 0.4), 1.1}};
}

std::vector<Sized> other_shapes() {
  std::mt19937 random(9);
  std::vector<Sized> result = round_shapes();
  result.push_back({Sphere{0.4}, 0.8});
  result.push_back({Capsule{0.5, 0.2}, 1.4});
  for (const Polytope& polytope :
       {box({1, 1, 1}), box({2, 0.3, 1}), convex_hull(test::dodecahedron_points(), "d"),
        test::random_hull(random, 12)}) {
    result.push_back({polytope, 2 * polytope.bounding_radius});
  }
  return result;
}

TEST(RoundContacts, AgreeWithEveryDirection) {
  // Random pairs of a round shape and any other: contacts exist only where the oracle finds overlap, and
  // depths equal the oracle's up to the preference for faces.
  const int trials = test::oracle_pairs(1500);
  std::mt19937 random(2);
  const std::vector<Sized> ones = round_shapes();
  const std::vector<Sized> others = other_shapes();
  constexpr double margin = 0.05;
  int overlapping = 0;
  int apart = 0;
  double worst_apart = 0;
  int too_deep = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const Sized& a = ones[random() % ones.size()];
    const Sized& b = others[random() % others.size()];
    const Pose pose_a = {test::random_point(random, 1.1), test::random_orientation(random)};
    const Pose pose_b = {Vector3::Zero(), test::random_orientation(random)};
    const auto points = contacts(a.shape, pose_a, b.shape, pose_b, margin);
    ASSERT_EQ(test::complaint(points, margin), "") << trial;
    const double separation = oracle_separation(a.shape, pose_a, b.shape, pose_b, points);
    const double size = std::min(a.size, b.size);
    const double lowest = test::lowest_distance(points);
    const double allowed = 0.06 * std::abs(separation) + 1.2e-3 * size;
    if (separation >= margin + 1e-9) {
      EXPECT_TRUE(points.empty()) << trial << " apart " << separation << " found " << lowest;
    } else if (separation > 1e-9) {
      ++apart;
      if (separation > margin - allowed) continue;
      ASSERT_FALSE(points.empty()) << trial << " apart " << separation << " kinds " << a.shape.index() << ' '
                                   << b.shape.index();
      EXPECT_LE(std::abs(lowest - separation), allowed) << trial << ' ' << separation;
      worst_apart = std::max(worst_apart, std::abs(lowest - separation) / allowed);
    } else if (separation < -1e-9) {
      ++overlapping;
      ASSERT_FALSE(points.empty()) << trial << " deep " << separation;
      EXPECT_LE(lowest, separation + allowed) << trial << ' ' << a.shape.index() << ' ' << b.shape.index();
      if (lowest < separation - allowed) ++too_deep;
    }
  }
  // Half a shape deep there are several ways out, and the shortest may be missed.
  EXPECT_LE(too_deep, trials / 4000);  // measured 0 of 1500, 1 of 40,000
  EXPECT_LT(worst_apart, 1);           // measured 0.33
  EXPECT_GT(overlapping, trials / 5);
  EXPECT_GT(apart, trials / 100);
}

TEST(RoundContacts, EnclosingBallDecides) {
  // A tapered capsule with one ball within the other is the larger ball, whichever end it is.
  const Polytope brick = box({1, 0.6, 0.8});
  std::mt19937 random(3);
  int found = 0;
  for (int trial = 0; trial < 600; ++trial) {
    const bool at_top = trial % 2 == 0;
    const Shape capsule = make_tapered_capsule(0.2, at_top ? 0.1 : 0.4, at_top ? 0.4 : 0.1);
    const Pose pose = {test::random_point(random, 0.9), test::random_orientation(random)};
    const Vector3 centre = pose * Vector3(0, at_top ? 0.1 : -0.1, 0);
    const auto points = contacts(capsule, pose, brick, {}, 0.05);
    const auto ball = contacts(Sphere{0.4}, {centre, Quaternion::Identity()}, brick, {}, 0.05);
    ASSERT_EQ(points.empty(), ball.empty()) << trial;
    if (points.empty()) continue;
    ++found;
    const double expected = test::lowest_distance(ball);
    // The preference for faces allows as much; measured at most 1.7 mm, at 33 mm from an edge.
    EXPECT_NEAR(test::lowest_distance(points), expected, 0.06 * std::abs(expected) + 1.2e-3 * 0.8) << trial;
  }
  EXPECT_GT(found, 100);
}

TEST(RoundContacts, AreMirroredAndKeepTheirInvariants) {
  std::mt19937 random(2);
  std::vector<Sized> shapes = other_shapes();
  shapes.push_back({Plane{}, 1});
  shapes.push_back({test::flat_mesh(8, 0.25, 0.3), 1});
  int found = 0;
  for (int trial = 0; trial < 6000; ++trial) {
    const Shape& a = shapes[random() % shapes.size()].shape;
    const Shape& b = shapes[random() % shapes.size()].shape;
    const Pose pose_a = {test::random_point(random, 1), test::random_orientation(random)};
    const Pose pose_b = {test::random_point(random, 0.2), test::random_orientation(random)};
    const auto one = contacts(a, pose_a, b, pose_b, 0.05);
    const auto other = contacts(b, pose_b, a, pose_a, 0.05);
    ASSERT_EQ(test::complaint(one, 0.05), "") << trial << ' ' << a.index() << ' ' << b.index();
    ASSERT_EQ(one.size(), other.size());
    if (!one.empty()) ++found;
    for (std::size_t i = 0; i < one.size(); ++i) {
      ASSERT_EQ(one[i].on_a, other[i].on_b);
      ASSERT_EQ(one[i].normal, -other[i].normal);
      ASSERT_EQ(one[i].distance, other[i].distance);
    }
  }
  EXPECT_GT(found, 2000);
}

TEST(RoundContacts, LyingCylinderKeepsItsHeight) {
  // However far it has rolled and however it is turned: the contacts' depth is that of its radius.
  const Cylinder can = make_cylinder(1, 0.5, 0.5);
  const Polytope slab = box({20, 1, 20});
  const TriangleMesh floor = test::flat_mesh(16, 0.7, 0.3);
  const Quaternion lying = turn(std::acos(0.0), {0, 0, 1});
  for (int i = 0; i < 2000; ++i) {
    const double angle = 0.0137 * i;
    const Pose pose = {{0.1, 0.499, 0.002 * i - 2}, turn(0.3, {0, 1, 0}) * turn(angle, {1, 0, 0}) * lying};
    for (const auto& points : {contacts(can, pose, Plane{}, {}, 0.02),
                               contacts(can, pose, slab, {{0, -0.5, 0}, Quaternion::Identity()}, 0.02),
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

TEST(RoundContacts, TiltedDiscTouchesAtItsLowestPoint) {
  // Euler's disk: the rim's lowest point has the depth r sin(tilt) below the centre, whatever the turn. A
  // disc that is parallel to 1e-5 keeps the points of its own axes, of which one is at least at cos(22.5°) of
  // it.
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

TEST(RoundContacts, SlightTiltKeepsNumber) {
  std::mt19937 random(3);
  const Cylinder can = make_cylinder(1, 0.5, 0.5);
  const Polytope slab = box({20, 1, 20});
  const TriangleMesh floor = test::flat_mesh(16, 0.5, 0);
  const Quaternion lying = turn(std::acos(0.0), {0, 0, 1});
  for (const double angle : {1e-12, 1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3}) {
    for (int trial = 0; trial < 200; ++trial) {
      const Quaternion tilt = turn(angle, test::random_point(random, 1));
      const double gap = trial % 2 == 0 ? -1e-4 : 1e-4;
      const Pose below = {{0, -0.5, 0}, Quaternion::Identity()};
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
  // Two discs on edge, one upright and one across it: only their rims meet, at a known place.
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

/// From a point outside a convex solid its closest point lies in the direction in which the two are farthest
/// apart: no other direction may separate them by more.
template <typename Solid>
void expect_directions_of_largest_separation(const Solid& shape) {
  std::mt19937 random(5);
  int outside = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Pose pose = {test::random_point(random, 1), test::random_orientation(random)};
    const RevolvedSolid solid(shape, pose);
    const Vector3 point = pose.position + test::random_point(random, 1);
    const auto separation = [&](const Vector3& d) { return d.dot(point) - reach(shape, pose, d); };
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

TEST(RevolvedSolid, ClosestPointMatchesLargestSeparation) {
  expect_directions_of_largest_separation(Sphere{0.3});
  expect_directions_of_largest_separation(Capsule{0.3, 0.2});
  expect_directions_of_largest_separation(make_tapered_capsule(0.6, 0.3, 0.1));
  expect_directions_of_largest_separation(make_tapered_capsule(0.6, 0.1, 0.3));
  expect_directions_of_largest_separation(make_cylinder(0.6, 0.3, 0.3));
  expect_directions_of_largest_separation(make_cylinder(0.6, 0.35, 0.1));
  expect_directions_of_largest_separation(make_cylinder(0.4, 0.1, 0.5));
  expect_directions_of_largest_separation(make_cylinder(0.6, 0.3, 0));
}

}  // namespace
}  // namespace substep
