#include "render/resolve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace substep {
namespace {

using Pixels = std::vector<std::uint8_t>;

TEST(Resolve, TheLowestRowComesLast) {
  const Pixels bottom_up{1, 2, 3, 255, 4, 5, 6, 255};  // two rows of one pixel
  EXPECT_EQ(top_down(bottom_up, 1, 2).rgb, (Pixels{4, 5, 6, 1, 2, 3}));
  Image image(1, 2);
  cover(image, bottom_up, 1);
  EXPECT_EQ(image.rgb, (Pixels{4, 5, 6, 1, 2, 3}));
}

TEST(Resolve, EqualSamplesKeepTheirCode) {
  for (int code = 0; code < 256; ++code) {
    Pixels samples(16, static_cast<std::uint8_t>(code));
    for (std::size_t i = 3; i < samples.size(); i += 4) samples[i] = 255;
    Image image(1, 1);
    cover(image, samples, 2);
    EXPECT_EQ(image.rgb, Pixels(3, static_cast<std::uint8_t>(code)));
  }
}

/// A pixel of `below` under samples of which the first `drawn` are of the code `over`.
int covered(int below, int drawn, int over) {
  Pixels samples(16, 0);
  for (int i = 0; i < drawn; ++i) {
    std::fill_n(&samples[static_cast<std::size_t>(4 * i)], 3, static_cast<std::uint8_t>(over));
    samples[static_cast<std::size_t>(4 * i + 3)] = 255;
  }
  Image image(1, 1);
  image.rgb.assign(3, static_cast<std::uint8_t>(below));
  cover(image, samples, 2);
  return image.rgb[0];
}

TEST(Resolve, SamplesAreAveragedAsLight) {
  // sRGB's codes of a quarter, half and three quarters of white: 1.055 x^(1/2.4) − 0.055, times 255.
  EXPECT_EQ(covered(0, 1, 255), 137);
  EXPECT_EQ(covered(0, 2, 255), 188);
  EXPECT_EQ(covered(0, 3, 255), 225);
  EXPECT_EQ(covered(255, 3, 0), 137);
}

TEST(Resolve, AnUprightEdgeHasFourStepsAPixel) {
  // Three pixels in a row; the first `drawn` columns of samples are white, the ground is black.
  std::vector<int> middle;
  for (int drawn = 0; drawn <= 6; ++drawn) {
    Pixels samples(std::size_t{6} * 2 * 4, 0);
    for (std::size_t i = 0; i < 12; ++i) {
      if (static_cast<int>(i % 6) < drawn) std::fill_n(&samples[4 * i], 4, std::uint8_t{255});
    }
    Image image(3, 1);
    cover(image, samples, 2);
    middle.push_back(image.pixel(1, 0)[0]);
  }
  // sRGB's codes of 0, 0, 1/8, 1/2, 7/8, 1, 1.
  EXPECT_EQ(middle, (std::vector<int>{0, 0, 99, 188, 240, 255, 255}));
}

TEST(Resolve, NothingDrawnLeavesThePixel) {
  for (const int below : {0, 1, 77, 254, 255}) EXPECT_EQ(covered(below, 0, 255), below);
}

}  // namespace
}  // namespace substep
