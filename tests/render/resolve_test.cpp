#include "render/resolve.h"

#include <gtest/gtest.h>

#include <vector>

namespace substep {
namespace {

using Pixels = std::vector<std::uint8_t>;

TEST(Resolve, OneSampleIsCopiedTopRowFirst) {
  const Pixels bottom_up{1, 2, 3, 255, 4, 5, 6, 255};  // two rows of one pixel
  const Image image = resolve(bottom_up, 1, 2, 1);
  EXPECT_EQ(image.rgb, (Pixels{4, 5, 6, 1, 2, 3}));
}

TEST(Resolve, EqualSamplesKeepTheirCode) {
  for (int code = 0; code < 256; ++code) {
    const Pixels samples(16, static_cast<std::uint8_t>(code));
    const Image image = resolve(samples, 1, 1, 2);
    EXPECT_EQ(image.rgb, Pixels(3, static_cast<std::uint8_t>(code)));
  }
}

TEST(Resolve, SamplesAreAveragedAsLight) {
  Pixels samples(16, 0);
  const auto mean = [&samples] { return static_cast<int>(resolve(samples, 1, 1, 2).rgb[0]); };
  // sRGB's codes of a quarter, half and three quarters of white: 1.055 x^(1/2.4) − 0.055, times 255.
  samples[0] = 255;
  EXPECT_EQ(mean(), 137);
  samples[4] = 255;
  EXPECT_EQ(mean(), 188);
  samples[8] = 255;
  EXPECT_EQ(mean(), 225);
}

}  // namespace
}  // namespace substep
