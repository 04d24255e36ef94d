#include "sim/geometry/welded_points.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>

namespace substep {
namespace {

TEST(WeldedPoints, JoinPointsAtOnePosition) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Vector3> points = {{1, 2, 3},   {0, 0, 0},   {1, 2, 3},   {0, -0.0, 0},
                                       {nan, 0, 0}, {nan, 0, 0}, {1, 2, 3.5}, {1, 2, 3}};
  EXPECT_EQ(welded(points), (std::vector<std::uint32_t>{0, 1, 0, 1, 4, 5, 6, 0}));
  EXPECT_EQ(distinct(std::span(points).first(4)), (std::vector<Vector3>{points[0], points[1]}));
}

// Heights whose points at x = y = 0 all have the hash's low 20 bits zero: that they are found by turning its
// last steps round shows that anyone can.
std::vector<Vector3> points_of_one_slot(std::size_t count) {
  constexpr std::uint64_t factor = 0x9e3779b97f4a7c15;
  std::uint64_t inverse = 1;
  for (int i = 0; i < 6; ++i) inverse *= 2 - factor * inverse;
  std::vector<Vector3> points;
  for (std::uint64_t i = 1; points.size() < count; ++i) {
    // h ^ h >> 32 has these low bits zero where h's bits 0…19 and 32…51 are the same.
    const std::uint64_t low = i * 0x3243f6a88 & 0xfffff;
    const std::uint64_t product = i << 52 | low << 32 | low;
    const double height = std::bit_cast<double>(product * inverse);
    if (std::isfinite(height) && height != 0) points.emplace_back(0, 0, height);
  }
  return points;
}

TEST(WeldedPoints, CollidingHashesCostLittle) {
  const std::size_t count = 50'000;
  std::vector<Vector3> points = points_of_one_slot(count);
  const std::vector<Vector3> again = points;
  points.insert(points.end(), again.begin(), again.end());
  std::size_t comparisons = 0;
  const std::vector<std::uint32_t> first = welded(points, &comparisons);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    wrong += points[first[i]] != points[i] || first[i] > i || (i >= count && first[i] >= count);
  }
  EXPECT_EQ(wrong, 0U);
  // Without the sort it would be 25 000 a point.
  EXPECT_LT(comparisons, 60 * points.size());
}

}  // namespace
}  // namespace substep
