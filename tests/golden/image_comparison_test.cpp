/// Tests comparisons of pictures by counts of pixels and by FLIP.

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

/// A pair of pictures in golden/vectors, with values that other programs measured, by their names in
/// values.csv. Values of FLIP are those of its authors' program.
struct VectorPair {
  std::string name;
  render::Image expected;
  render::Image actual;
  std::map<std::string, double> measured;
};

/// Reads values.csv: its second column is a quoted string, the others are plain numbers.
std::vector<VectorPair> vector_pairs() {
  const std::filesystem::path folder = std::filesystem::path(test::source_folder) / "golden/vectors";
  std::ifstream file(folder / "values.csv");
  std::vector<VectorPair> pairs;
  std::string head;
  std::getline(file, head);
  for (std::string line; std::getline(file, line);) {
    VectorPair& pair = pairs.emplace_back();
    pair.name = line.substr(0, line.find(','));
    pair.expected = render::read_png(folder / (pair.name + ".ref.png"));
    pair.actual = render::read_png(folder / (pair.name + ".test.png"));
    std::istringstream names(head.substr(head.find("what,") + 5));
    std::istringstream numbers(line.substr(line.rfind('"') + 2));
    std::string name;
    for (std::string value; std::getline(numbers, value, ',') && std::getline(names, name, ',');)
      pair.measured[name] = std::stod(value);
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
    EXPECT_EQ(c.max, pair.measured.at("max_abs"));
    EXPECT_EQ(c.differing, pair.measured.at("n_gt0"));
    for (const auto& [level, above] : {std::pair(2, "n_gt2"), {8, "n_gt8"}, {16, "n_gt16"}}) {
      EXPECT_EQ(compare(pair.expected, pair.actual, {.level = level, .flip = {}}).above_level,
                pair.measured.at(above));
    }
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

TEST(ImageComparison, CallsTwoLevelsOfVariationBlank) {
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
    EXPECT_NEAR(result.mean, pair.measured.at("flip_mean_f64"), 2e-6)
        << pair.name;  // measured 1.2e-6, of which 5e-7 from rounding in values.csv
    EXPECT_NEAR(result.max, pair.measured.at("flip_max"), 4e-6) << pair.name;  // measured 2.3e-6
    const float smallest = *std::min_element(result.map.begin(), result.map.end());
    EXPECT_NEAR(smallest, pair.measured.at("flip_min"), 4e-6) << pair.name;  // measured 1.1e-6
  }
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
