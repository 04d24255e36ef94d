#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/geometry/closest_points.h"
#include "sim/geometry/contact.h"
#include "sim/geometry/convex_hull.h"
#include "tests/geometry/solids.h"

namespace substep {
namespace {

/// Returns the distance of two polytopes that do not overlap, over all their features.
double brute_distance(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b) {
  double least = std::numeric_limits<double>::infinity();
  const auto edge = [](const Polytope& polytope, const Pose& pose, std::size_t e) -> Segment {
    return {pose * polytope.vertices[polytope.edges[e][0]], pose * polytope.vertices[polytope.edges[e][1]]};
  };
  for (std::size_t i = 0; i < a.edges.size(); ++i) {
    for (std::size_t j = 0; j < b.edges.size(); ++j) {
      const Segment one = edge(a, pose_a, i);
      const Segment other = edge(b, pose_b, j);
      const SegmentParameters parameters = closest_parameters(one, other);
      least = std::min(least, (point_at(one, parameters.on_a) - point_at(other, parameters.on_b)).norm());
    }
  }
  const auto vertices_over = [&](const Polytope& p, const Pose& pose_p, const Polytope& q,
                                 const Pose& pose_q) {
    for (const Vector3& vertex : q.vertices) {
      const Vector3 local = pose_p.inverse() * (pose_q * vertex);
      for (std::size_t f = 0; f < p.face_count(); ++f) {
        const double height = p.face_normals[f].dot(local) - p.face_offsets[f];
        if (height > 0 && is_over(p, f, local)) least = std::min(least, height);
      }
    }
  };
  vertices_over(a, pose_a, b, pose_b);
  vertices_over(b, pose_b, a, pose_a);
  return least;
}

std::vector<Polytope> solids(std::mt19937& random) {
  std::vector<Polytope> result = {box({1, 1, 1}), box({2, 0.3, 1}), cylinder(1, 0.5, 0.5, 12),
                                  cylinder(1, 0.6, 0, 8), convex_hull(test::dodecahedron_points(), "d")};
  for (const int count : {4, 6, 10, 20}) result.push_back(test::random_hull(random, count));
  return result;
}

TEST(ContactFuzz, RandomHullsAgreeWithEveryAxis) {
  std::mt19937 random(1);
  const std::vector<Polytope> shapes = solids(random);
  constexpr double margin = 0.05;
  int overlapping = 0;
  int near = 0;
  double deepest_excess = 0;
  double shallowest_excess = 0;
  const int trials = test::oracle_pairs(6000);
  for (int trial = 0; trial < trials; ++trial) {
    const Polytope& a = shapes[random() % shapes.size()];
    const Polytope& b = shapes[random() % shapes.size()];
    const Pose pose_a = {test::random_point(random, 1.5), test::random_orientation(random)};
    const Pose pose_b = {Vector3::Zero(), test::random_orientation(random)};
    const auto points = test::contacts(a, pose_a, b, pose_b, margin);
    ASSERT_EQ(test::complaint(points, margin), "") << trial;
    const double separation = test::brute_separation(a, pose_a, b, pose_b);
    const double size = 2 * std::min(a.bounding_radius, b.bounding_radius);
    const double lowest = test::lowest_distance(points);
    if (separation > margin) {
      EXPECT_TRUE(points.empty()) << trial;
    } else if (separation <= 0) {
      ++overlapping;
      ASSERT_FALSE(points.empty()) << trial;
      // No direction separates them by less than the true one; ours may be longer by the preference for
      // faces.
      const double allowed = 0.06 * std::abs(separation) + 1.2e-3 * size;
      EXPECT_GE(lowest, separation - allowed) << trial;
      EXPECT_LE(lowest, separation + allowed) << trial;
      deepest_excess = std::max(deepest_excess, (separation - lowest) / allowed);
      shallowest_excess = std::max(shallowest_excess, (lowest - separation) / allowed);
    } else {
      const double distance = brute_distance(a, pose_a, b, pose_b);
      if (distance < margin * 0.999) {
        ++near;
        ASSERT_FALSE(points.empty()) << trial;
        EXPECT_LE(lowest, distance + 0.06 * distance + 1.2e-3 * size) << trial;
      }
    }
  }
  EXPECT_GT(overlapping, trials / 3);
  EXPECT_GT(near, trials / 120);
  RecordProperty("deepest_excess", std::to_string(deepest_excess));
  RecordProperty("shallowest_excess", std::to_string(shallowest_excess));
}

TEST(ContactFuzz, GrazingPairsKeepTheirInvariants) {
  std::mt19937 random(2);
  const std::vector<Polytope> shapes = solids(random);
  constexpr double margin = 0.02;
  for (int trial = 0; trial < 4000; ++trial) {
    const Polytope& a = shapes[random() % shapes.size()];
    const Polytope& b = shapes[random() % shapes.size()];
    // Right angles and faces against faces, where axes are parallel and corners flush …
    const auto pick = [&](const Polytope& polytope, const Vector3& direction) {
      const Vector3& normal = polytope.face_normals[random() % polytope.face_count()];
      return Quaternion::FromTwoVectors(normal, direction);
    };
    const Pose pose_b = {Vector3::Zero(), pick(b, Vector3::UnitY())};
    Pose pose_a = {Vector3(0.1 * (trial % 7), 10, 0.1 * (trial % 3)), pick(a, -Vector3::UnitY())};
    // … let down to within a hair of touching, above or below.
    const double touching = test::brute_separation(a, pose_a, b, pose_b);
    double high = 10;
    for (int i = 0; i < 40 && touching > 0; ++i) {
      const double separation = test::brute_separation(a, pose_a, b, pose_b);
      if (separation <= 1e-12) break;
      pose_a.position.y() -= separation;
      high = pose_a.position.y();
    }
    const double hair = std::pow(10.0, -4 - trial % 12) * (trial % 2 == 0 ? 1 : -1);
    pose_a.position.y() = high + hair;
    const double separation = test::brute_separation(a, pose_a, b, pose_b);
    const auto points = test::contacts(a, pose_a, b, pose_b, margin);
    ASSERT_EQ(test::complaint(points, margin), "") << trial;
    if (separation < 0) {
      ASSERT_FALSE(points.empty()) << trial;
      EXPECT_LE(test::lowest_distance(points), 1e-8) << trial;
    }
  }
}

}  // namespace
}  // namespace substep
