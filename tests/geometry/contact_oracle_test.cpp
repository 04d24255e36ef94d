// Compares contacts of random pairs of convex shapes with oracles that share nothing with the contact search:
// the distance by GJK where the two are apart and, where they overlap, the largest separation over all
// directions, with support functions of the tests' own.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/time_of_impact.h"
#include "sim/math/rotation.h"
#include "tests/geometry/solids.h"

namespace substep {
namespace {

using test::contacts;
using test::extent;

std::vector<Polytope> polytopes(std::mt19937& random) {
  std::vector<Polytope> result = {box({1, 1, 1}), box({2, 0.3, 1}), cylinder(1, 0.5, 0.5, 12),
                                  cylinder(1, 0.6, 0, 8), test::dodecahedron()};
  for (const int count : {4, 6, 10, 20}) result.push_back(test::random_hull(random, count));
  return result;
}

/// Returns minus the depth of the overlap of two convex shapes. The search may end at a local maximum of the
/// separation; the normals `found` are measured, too, which can only improve the result.
double searched_separation(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b,
                           const Contacts& found) {
  const auto separation = [&](const Vector3& n) { return -extent(a, pose_a, -n) - extent(b, pose_b, n); };
  // Try directions spread evenly over the sphere, and improve the best by steps that halve.
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

TEST(ContactOracle, DepthsAndDistancesAgree) {
  std::mt19937 random(2);
  std::vector<Shape> shapes = test::round_shapes();
  for (const Polytope& polytope : polytopes(random)) shapes.emplace_back(polytope);
  constexpr double margin = 0.05;
  int overlapping = 0;
  int near = 0;
  int too_deep = 0;
  const int trials = test::oracle_pairs(6000);
  for (int trial = 0; trial < trials; ++trial) {
    const Shape& a = shapes[random() % shapes.size()];
    const Shape& b = shapes[random() % shapes.size()];
    const Pose pose_a = {test::random_point(random, 1.3), test::random_orientation(random)};
    const Pose pose_b = {Vector3::Zero(), test::random_orientation(random)};
    SCOPED_TRACE(testing::Message() << trial << ": kinds " << a.index() << ' ' << b.index());
    const Contacts points = contacts(a, pose_a, b, pose_b, margin);
    ASSERT_EQ(test::complaint(points, margin), "");
    const auto size_of = [](const Shape& shape) {
      const Bounds box = bounds(shape, {});
      return box.sizes().norm();
    };
    const double size = std::min(size_of(a), size_of(b));
    const double lowest = test::lowest_distance(points);
    // Contacts exceed the true depth or distance by the preference for faces at most.
    const auto allowed = [&](double truth) { return 0.06 * std::abs(truth) + 1.2e-3 * size; };
    const double distance = separation(ConvexSolid(a, pose_a), ConvexSolid(b, pose_b), 1e-10).gap;
    if (distance > margin) {
      EXPECT_TRUE(points.empty());
    } else if (distance > 1e-9) {
      if (distance > margin - allowed(distance)) continue;
      ++near;
      ASSERT_FALSE(points.empty());
      EXPECT_NEAR(lowest, distance, allowed(distance));
    } else {
      ++overlapping;
      ASSERT_FALSE(points.empty());
      const auto* hull_a = std::get_if<Polytope>(&a);
      const auto* hull_b = std::get_if<Polytope>(&b);
      const bool are_hulls = hull_a && hull_b;
      const double depth = are_hulls ? test::brute_separation(*hull_a, pose_a, *hull_b, pose_b)
                                     : searched_separation(a, pose_a, b, pose_b, points);
      EXPECT_LE(lowest, depth + allowed(depth));
      if (lowest >= depth - allowed(depth)) continue;
      // Where a round shape overlaps by half, several directions separate; the shortest may be missed.
      EXPECT_FALSE(are_hulls);
      ++too_deep;
    }
  }
  EXPECT_LE(too_deep, trials / 4000);
  EXPECT_GT(overlapping, trials / 4);
  EXPECT_GT(near, trials / 100);
}

TEST(ContactOracle, GrazingPairsKeepTheirInvariants) {
  std::mt19937 random(2);
  const std::vector<Polytope> shapes = polytopes(random);
  constexpr double margin = 0.02;
  for (int trial = 0; trial < 4000; ++trial) {
    const Polytope& a = shapes[random() % shapes.size()];
    const Polytope& b = shapes[random() % shapes.size()];
    // Turn a face of one against a face of the other, where edges may be parallel and corners flush.
    const auto pick = [&](const Polytope& polytope, const Vector3& direction) {
      const Vector3& normal = polytope.face_normals[random() % polytope.face_count()];
      return shortest_rotation(normal, direction);
    };
    const Pose pose_b = {Vector3::Zero(), pick(b, Vector3::UnitY())};
    Pose pose_a = {Vector3(0.1 * (trial % 7), 10, 0.1 * (trial % 3)), pick(a, -Vector3::UnitY())};
    // Lower it to a tiny distance of touching, above or below.
    const double touching = test::brute_separation(a, pose_a, b, pose_b);
    double high = 10;
    for (int i = 0; i < 40 && touching > 0; ++i) {
      const double separation = test::brute_separation(a, pose_a, b, pose_b);
      if (separation <= 1e-12) break;
      pose_a.position.y() -= separation;
      high = pose_a.position.y();
    }
    const double offset = std::pow(10.0, -4 - trial % 12) * (trial % 2 == 0 ? 1 : -1);
    pose_a.position.y() = high + offset;
    const double separation = test::brute_separation(a, pose_a, b, pose_b);
    const auto points = test::contacts(a, pose_a, b, pose_b, margin);
    ASSERT_EQ(test::complaint(points, margin), "") << trial;
    if (separation < 0) {
      ASSERT_FALSE(points.empty()) << trial;
      EXPECT_LE(test::lowest_distance(points), 1e-8) << trial;
    }
  }
}

TEST(ContactOracle, SwappedPairsAreMirrored) {
  std::mt19937 random(2);
  std::vector<Shape> shapes = test::round_shapes();
  for (const Polytope& polytope : polytopes(random)) shapes.emplace_back(polytope);
  shapes.emplace_back(Plane{});
  shapes.emplace_back(test::flat_mesh(8, 0.25, 0.3));
  int found = 0;
  for (int trial = 0; trial < 6000; ++trial) {
    const Shape& a = shapes[random() % shapes.size()];
    const Shape& b = shapes[random() % shapes.size()];
    const Pose pose_a = {test::random_point(random, 1), test::random_orientation(random)};
    const Pose pose_b = {test::random_point(random, 0.2), test::random_orientation(random)};
    const auto one = contacts(a, pose_a, b, pose_b, 0.05);
    const auto other = contacts(b, pose_b, a, pose_a, 0.05);
    ASSERT_EQ(test::complaint(one, 0.05), "") << trial << ' ' << a.index() << ' ' << b.index();
    test::expect_mirrored(one, other);
    if (!one.empty()) ++found;
  }
  EXPECT_GT(found, 2000);
}

}  // namespace
}  // namespace substep
