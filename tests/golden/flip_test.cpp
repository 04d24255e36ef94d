#include "golden/flip.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/golden/vectors.h"

namespace substep {
namespace {

TEST(Flip, AgreesWithTheAuthorsProgram) {
  const auto pairs = vector_pairs();
  ASSERT_EQ(pairs.size(), 13U);
  for (const VectorPair& pair : pairs) {
    const Flip result = flip(pair.expected, pair.actual);
    EXPECT_NEAR(result.mean, pair.flip_mean, 2e-6)
        << pair.name;  // measured 5.1e-7, of which 5e-7 are its digits
    EXPECT_NEAR(result.max, pair.flip_max, 4e-6) << pair.name;  // measured 2.0e-6
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
}  // namespace substep
