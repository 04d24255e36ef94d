/// Pictures compared by counts of pixels and by FLIP.

#include "golden/compare/image_comparison.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "golden/compare/flip.h"
#include "tests/folders.h"

namespace substep::golden {
namespace {

/// A pair of pictures in golden/vectors, with values that other programs measured.
struct VectorPair {
  std::string name;
  render::Image expected;
  render::Image actual;
  double flip_mean = 0;  ///< of the map of FLIP's authors' program, accumulated in double precision
  double flip_min = 0;
  double flip_max = 0;
  int max_difference = 0;
  int above_0 = 0, above_2 = 0, above_8 = 0, above_16 = 0;
};

/// Reads values.csv: its second column is a quoted string, the others are plain numbers.
std::vector<VectorPair> vector_pairs() {
  const std::filesystem::path folder = std::filesystem::path(test::source_folder) / "golden/vectors";
  std::ifstream file(folder / "values.csv");
  std::vector<VectorPair> pairs;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    VectorPair pair;
    pair.name = line.substr(0, line.find(','));
    std::istringstream numbers(line.substr(line.rfind('"') + 2));
    std::vector<double> values;
    for (std::string value; std::getline(numbers, value, ',');) values.push_back(std::stod(value));
    pair.flip_mean = values.at(1);
    pair.flip_min = values.at(5);
    pair.flip_max = values.at(6);
    pair.max_difference = static_cast<int>(values.at(8));
    pair.above_0 = static_cast<int>(values.at(9));
    pair.above_2 = static_cast<int>(values.at(10));
    pair.above_8 = static_cast<int>(values.at(11));
    pair.above_16 = static_cast<int>(values.at(12));
    pair.expected = render::read_png(folder / (pair.name + ".ref.png"));
    pair.actual = render::read_png(folder / (pair.name + ".test.png"));
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

TEST(ImageComparison, CountsPixelsOfTestVectors) {
  const std::map<std::string, Judgement> expected{
      {"00_identical", Judgement::exact},        {"01_solid_shift", Judgement::count},
      {"02_shift_1px", Judgement::hard},         {"03_noise_pm8", Judgement::count},
      {"04_missing_object", Judgement::hard},    {"05_edge_aliasing", Judgement::hard},
      {"06_hue_shift", Judgement::count},        {"07_bright_plus1", Judgement::within},
      {"08_swapped_lr", Judgement::hard},        {"09_box_moved_3px", Judgement::hard},
      {"10_edge_msaa4_vs_16", Judgement::count}, {"11_black_white", Judgement::hard},
      {"12_one_pixel_magenta", Judgement::hard}};
  const auto pairs = vector_pairs();
  ASSERT_EQ(pairs.size(), 13U);
  for (const VectorPair& pair : pairs) {
    SCOPED_TRACE(pair.name);
    const ImageComparison c = compare(pair.expected, pair.actual);
    EXPECT_EQ(c.judgement, expected.at(pair.name)) << name(c.judgement);
    EXPECT_EQ(c.pixels, 64 * 64);
    EXPECT_EQ(c.max, pair.max_difference);
    EXPECT_EQ(c.differing, pair.above_0);
    for (const auto& [level, above] : {std::pair(2, pair.above_2), {8, pair.above_8}, {16, pair.above_16}})
      EXPECT_EQ(compare(pair.expected, pair.actual, {.level = level, .flip = {}}).above_level, above);
  }
}

render::Image grey(int width, int height, std::uint8_t level = 100) {
  render::Image image(width, height);
  for (auto& value : image.rgb) value = level;
  return image;
}

TEST(ImageComparison, RejectsOtherSizes) {
  const ImageComparison c = compare(grey(64, 32), grey(32, 64));
  EXPECT_EQ(c.judgement, Judgement::size);
  EXPECT_EQ(c.pixels, 0);
}

TEST(ImageComparison, FindsBoxAndLargestDifference) {
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

TEST(ImageComparison, FailsAboveHardAndCountLimits) {
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

TEST(ImageComparison, TakesAVariationOfTwoLevelsForBlank) {
  render::Image image = grey(20, 20);
  EXPECT_TRUE(is_blank(image));
  image.pixel(3, 3)[0] = 102;
  EXPECT_TRUE(is_blank(image));
  image.pixel(3, 3)[0] = 103;
  EXPECT_FALSE(is_blank(image));
}

TEST(Flip, AgreesWithAuthorsProgram) {
  const auto pairs = vector_pairs();
  ASSERT_EQ(pairs.size(), 13U);
  for (const VectorPair& pair : pairs) {
    const Flip result = flip(pair.expected, pair.actual);
    EXPECT_NEAR(result.mean, pair.flip_mean, 2e-6)
        << pair.name;  // measured 1.2e-6, of which 5e-7 from rounding in values.csv
    EXPECT_NEAR(result.max, pair.flip_max, 4e-6) << pair.name;  // measured 2.3e-6
    const float smallest = *std::min_element(result.map.begin(), result.map.end());
    EXPECT_NEAR(smallest, pair.flip_min, 4e-6) << pair.name;  // measured 1.1e-6
  }
}

TEST(Flip, GivesZeroForEqualImages) {
  const VectorPair pair = vector_pairs().at(3);
  const Flip result = flip(pair.actual, pair.actual);
  EXPECT_EQ(result.mean, 0);
  EXPECT_EQ(result.max, 0);
  EXPECT_EQ(visibility(result), "invisible");
}

TEST(Flip, NamesVisibility) {
  const auto pairs = vector_pairs();
  const auto word = [&](std::size_t i) { return visibility(flip(pairs.at(i).expected, pairs.at(i).actual)); };
  EXPECT_EQ(word(7), "invisible");  // one level everywhere
  EXPECT_EQ(word(5), "subtle");     // a hard edge instead of a soft one
  EXPECT_EQ(word(4), "visible");    // an object is missing
}

}  // namespace
}  // namespace substep::golden
