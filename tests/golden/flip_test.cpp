#include "golden/compare/flip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "tests/golden/vectors.h"

namespace substep::golden {
namespace {

TEST(Flip, AgreesWithTheAuthorsProgram) {
  const auto pairs = vector_pairs();
  ASSERT_EQ(pairs.size(), 13U);
  for (const VectorPair& pair : pairs) {
    const Flip result = flip(pair.expected, pair.actual);
    EXPECT_NEAR(result.mean, pair.flip_mean, 2e-6)
        << pair.name;  // measured 1.2e-6, of which 5e-7 are its digits
    EXPECT_NEAR(result.max, pair.flip_max, 4e-6) << pair.name;  // measured 2.3e-6
    const float smallest = *std::min_element(result.map.begin(), result.map.end());
    EXPECT_NEAR(smallest, pair.flip_min, 4e-6) << pair.name;  // measured 1.1e-6
  }
}

TEST(Flip, EqualImagesAreExactlyZero) {
  const VectorPair pair = vector_pairs().at(3);
  const Flip result = flip(pair.actual, pair.actual);
  EXPECT_EQ(result.mean, 0);
  EXPECT_EQ(result.max, 0);
  EXPECT_EQ(result.percentile_99, 0);
  EXPECT_EQ(visibility(result), "invisible");
}

render::Image noise(int width, int height, unsigned seed) {
  render::Image image(width, height);
  for (std::uint8_t& level : image.rgb) {
    seed = seed * 1664525 + 1013904223;
    level = static_cast<std::uint8_t>(seed >> 24);
  }
  return image;
}

/// Compares the map with one that leaves out nothing: single differing pixels all over the picture make every
/// part be computed, and beyond their reach the map must not change by a bit.
TEST(Flip, LeavesOutOnlyWhatIsZero) {
  constexpr int width = 700;
  constexpr int height = 300;
  constexpr int reach = 10;  // of the widest filter at 67 pixels per degree
  const render::Image expected = noise(width, height, 1);
  render::Image actual = expected;
  const render::Image other = noise(40, 30, 2);
  for (int y = 0; y < other.height; ++y) {
    std::copy_n(other.pixel(0, y), 3 * other.width, actual.pixel(430, 120 + y));
  }
  const Flip sparse = flip(expected, actual);
  // Apart from each other by less than twice the reach, down every 45th column.
  for (int x = 5; x < width; x += 45) {
    for (int y = 0; y < height; y += 2 * reach) actual.pixel(x, y)[1] ^= 128;
  }
  const Flip full = flip(expected, actual);
  int zeros = 0;
  int others = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int from_column = std::abs((x - 5 + 22) % 45 - 22);
      if (from_column <= reach) continue;
      const auto i = static_cast<std::size_t>(y) * width + x;
      ASSERT_EQ(sparse.map[i], full.map[i]) << x << ", " << y;
      ++(sparse.map[i] == 0 ? zeros : others);
    }
  }
  EXPECT_GT(zeros, 100'000);
  EXPECT_GT(others, 1'000);
  EXPECT_GT(full.mean, 2 * sparse.mean);  // measured 3.25
}

TEST(Flip, IsLargerFromCloser) {
  const VectorPair pair = vector_pairs().at(3);
  EXPECT_GT(flip(pair.expected, pair.actual, default_pixels_per_degree / 2).mean,
            1.1 * flip(pair.expected, pair.actual).mean);  // measured 1.76
}

TEST(Flip, SaysHowVisible) {
  const auto pairs = vector_pairs();
  const auto word = [&](std::size_t i) { return visibility(flip(pairs.at(i).expected, pairs.at(i).actual)); };
  EXPECT_EQ(word(7), "invisible");  // one level everywhere
  EXPECT_EQ(word(5), "subtle");     // a hard edge instead of a soft one
  EXPECT_EQ(word(4), "visible");    // an object is missing
}

TEST(Flip, PercentileLeavesOutOnePixel) {
  const VectorPair pair = vector_pairs().at(12);  // one pixel of 4096, seen in its surroundings
  const Flip result = flip(pair.expected, pair.actual);
  EXPECT_LT(result.percentile_99, 0.5 * result.max);
  const auto above =
      std::count_if(result.map.begin(), result.map.end(), [&](float v) { return v > result.percentile_99; });
  EXPECT_LE(above, 41);  // 1 % of 4096
}

}  // namespace
}  // namespace substep::golden
