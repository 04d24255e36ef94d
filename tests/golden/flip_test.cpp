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
  EXPECT_EQ(visibility(result), "invisible");
}

TEST(Flip, SaysHowVisible) {
  const auto pairs = vector_pairs();
  const auto word = [&](std::size_t i) { return visibility(flip(pairs.at(i).expected, pairs.at(i).actual)); };
  EXPECT_EQ(word(7), "invisible");  // one level everywhere
  EXPECT_EQ(word(5), "subtle");     // a hard edge instead of a soft one
  EXPECT_EQ(word(4), "visible");    // an object is missing
}

}  // namespace
}  // namespace substep::golden
