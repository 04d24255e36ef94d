#include "sim/geometry/features.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/geometry/solids.h"

namespace substep {
namespace {

double distance(const Segment& a, const Segment& b) {
  const SegmentParameters parameters = closest_parameters(a, b);
  EXPECT_GE(parameters.on_a, 0);
  EXPECT_LE(parameters.on_a, 1);
  EXPECT_GE(parameters.on_b, 0);
  EXPECT_LE(parameters.on_b, 1);
  return (point_at(a, parameters.on_a) - point_at(b, parameters.on_b)).norm();
}

TEST(ClosestPoints, MatchKnownDistances) {
  const Segment x = {{-1, 0, 0}, {1, 0, 0}};
  EXPECT_DOUBLE_EQ(distance(x, {{0, 2, -1}, {0, 2, 1}}), 2);  // crossing
  EXPECT_DOUBLE_EQ(distance(x, {{-1, 3, 0}, {1, 3, 0}}), 3);  // parallel
  EXPECT_DOUBLE_EQ(distance(x, {{4, 4, 0}, {8, 4, 0}}), 5);   // parallel, one past the other
  EXPECT_DOUBLE_EQ(distance(x, {{4, 4, 0}, {4, 4, 0}}), 5);   // a point
  EXPECT_DOUBLE_EQ(distance({{4, 4, 0}, {4, 4, 0}}, x), 5);
  EXPECT_DOUBLE_EQ(distance({{4, 4, 0}, {4, 4, 0}}, {{4, 4, 2}, {4, 4, 2}}), 2);
  EXPECT_NEAR(distance(x, {{-1, 1, 0}, {1, 1, 1e-9}}), 1, 1e-15);          // nearly parallel
  EXPECT_DOUBLE_EQ(distance(x, {{2, -1, 1}, {2, 1, 1}}), std::sqrt(2.0));  // end to middle
}

TEST(ClosestPoints, AreCloserThanSampledPairs) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 500; ++trial) {
    const Segment a = {test::random_point(random, 1), test::random_point(random, 1)};
    Segment b = {test::random_point(random, 1), test::random_point(random, 1)};
    if (trial % 3 == 0) b.to = b.from + 0.7 * (a.to - a.from) + 1e-7 * b.to;
    const double found = distance(a, b);
    double sampled = 1e9;
    for (int i = 0; i <= 40; ++i) {
      const Vector3 point = point_at(a, i / 40.0);
      sampled = std::min(sampled, (point - point_at(b, closest_parameter(b, point))).norm());
    }
    EXPECT_LE(found, sampled + 1e-14);
  }
}

}  // namespace
}  // namespace substep
