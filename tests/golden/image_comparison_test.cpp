#include "golden/compare/image_comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tests/golden/vectors.h"

namespace substep::golden {
namespace {

TEST(ImageComparison, CountsAreThoseOfTheVectors) {
  const auto pairs = vector_pairs();
  ASSERT_EQ(pairs.size(), 13U);
  for (const VectorPair& pair : pairs) {
    const ImageComparison c = compare(pair.expected, pair.actual);
    EXPECT_EQ(c.pixels, 64 * 64) << pair.name;
    EXPECT_EQ(c.max, pair.max_difference) << pair.name;
    EXPECT_EQ(c.differing, pair.above_0) << pair.name;
    for (const auto& [level, above] : {std::pair(2, pair.above_2), {8, pair.above_8}, {16, pair.above_16}}) {
      ImageTolerance tolerance;
      tolerance.level = level;
      EXPECT_EQ(compare(pair.expected, pair.actual, tolerance).above_level, above) << pair.name;
    }
  }
}

TEST(ImageComparison, VectorsFailTheGateTheyShould) {
  const std::map<std::string, Judgement> expected{
      {"00_identical", Judgement::exact},        {"01_solid_shift", Judgement::count},
      {"02_shift_1px", Judgement::hard},         {"03_noise_pm8", Judgement::count},
      {"04_missing_object", Judgement::hard},    {"05_edge_aliasing", Judgement::hard},
      {"06_hue_shift", Judgement::count},        {"07_bright_plus1", Judgement::within},
      {"08_swapped_lr", Judgement::hard},        {"09_box_moved_3px", Judgement::hard},
      {"10_edge_msaa4_vs_16", Judgement::count}, {"11_black_white", Judgement::hard},
      {"12_one_pixel_magenta", Judgement::hard}};
  for (const VectorPair& pair : vector_pairs()) {
    const Judgement judgement = compare(pair.expected, pair.actual).judgement;
    EXPECT_EQ(judgement, expected.at(pair.name)) << pair.name << ": " << name(judgement);
  }
}

render::Image grey(int width, int height, std::uint8_t level = 100) {
  render::Image image(width, height);
  for (auto& value : image.rgb) value = level;
  return image;
}

TEST(ImageComparison, OtherSizesFailAtOnce) {
  const ImageComparison c = compare(grey(64, 32), grey(32, 64));
  EXPECT_EQ(c.judgement, Judgement::size);
  EXPECT_EQ(c.pixels, 0);
}

TEST(ImageComparison, SaysWhere) {
  const render::Image expected = grey(100, 70);
  render::Image actual = expected;
  actual.pixel(97, 65)[1] = 140;
  actual.pixel(40, 66)[2] = 95;
  const ImageComparison c = compare(expected, actual);
  EXPECT_EQ(c.differing, 2);
  EXPECT_EQ(c.max, 40);
  EXPECT_EQ(c.max_x, 97);
  EXPECT_EQ(c.max_y, 65);
  EXPECT_EQ(c.left, 40);
  EXPECT_EQ(c.right, 97);
  EXPECT_EQ(c.top, 65);
  EXPECT_EQ(c.bottom, 66);
  EXPECT_EQ(c.judgement, Judgement::within);
}

TEST(ImageComparison, EachGateHoldsAtItsLimitAndFailsAboveIt) {
  const render::Image expected = grey(96, 96);
  const auto with = [&](int pixels, int by) {
    render::Image image = expected;
    for (int i = 0; i < pixels; ++i) image.pixel(i % 32, i / 32)[0] = static_cast<std::uint8_t>(100 + by);
    return image;
  };
  const auto judged = [&](const render::Image& actual, const ImageTolerance& tolerance) {
    return compare(expected, actual, tolerance).judgement;
  };
  EXPECT_EQ(judged(with(1, 64), {}), Judgement::within);
  EXPECT_EQ(judged(with(1, 65), {}), Judgement::hard);
  EXPECT_EQ(judged(with(20, 4), {}), Judgement::within);
  EXPECT_EQ(judged(with(21, 4), {}), Judgement::count);
  EXPECT_EQ(judged(with(21, 3), {}), Judgement::within);
}

TEST(ImageComparison, BlankIsAlmostOneColor) {
  render::Image image = grey(20, 20);
  EXPECT_TRUE(is_blank(image));
  image.pixel(3, 3)[0] = 102;
  EXPECT_TRUE(is_blank(image));
  image.pixel(3, 3)[0] = 103;
  EXPECT_FALSE(is_blank(image));
}

}  // namespace
}  // namespace substep::golden
