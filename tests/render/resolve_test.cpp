#include "render/resolve.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <vector>

namespace substep::render {
namespace {

using Pixels = std::vector<std::uint8_t>;

/// Returns pixels of one grey, four bytes each.
Pixels grey(std::size_t pixels, int code, int alpha = 0) {
  Pixels result(4 * pixels, static_cast<std::uint8_t>(code));
  for (std::size_t i = 3; i < result.size(); i += 4) result[i] = static_cast<std::uint8_t>(alpha);
  return result;
}

constexpr int all_samples = 0xff;  // every sample is a body's and has the first colour

TEST(Resolve, EqualSamplesKeepTheirCode) {
  for (int code = 0; code < 256; ++code) {
    // This holds for each of the three colours that samples take.
    for (const int bits : {0x00, 0xff, 0xf0, 0x53, 0x31}) {
      const Pixels same = grey(1, code, bits);
      const RenderedPixels rendered{1, 1, 2, same, same, same};
      EXPECT_EQ(resolved(rendered).rgb, Pixels(3, static_cast<std::uint8_t>(code)));
      EXPECT_EQ(resolved(light_of_samples(rendered), 1, 1, 2).rgb,
                Pixels(3, static_cast<std::uint8_t>(code)));
    }
  }
}

/// Returns the code of a pixel of `below` whose first `drawn` samples have the code `over`, as first or
/// second colour.
int covered(int below, int drawn, int over, bool is_second = false) {
  const int samples = (1 << drawn) - 1;
  const Pixels ground = grey(1, below);
  const Pixels first = grey(1, is_second ? 77 : over, is_second ? samples << 4 : samples << 4 | samples);
  const Pixels second = grey(1, over);
  return resolved(RenderedPixels{1, 1, 2, ground, first, second}).rgb[0];
}

TEST(Resolve, AveragesSamplesAsLight) {
  // sRGB's codes of a quarter, half and three quarters of white: 1.055 x^(1/2.4) − 0.055, times 255.
  for (const bool is_second : {false, true}) {
    EXPECT_EQ(covered(0, 1, 255, is_second), 137);
    EXPECT_EQ(covered(0, 2, 255, is_second), 188);
    EXPECT_EQ(covered(0, 3, 255, is_second), 225);
    EXPECT_EQ(covered(255, 3, 0, is_second), 137);
  }
}

TEST(Resolve, UprightEdgeHasFourStepsAPixel) {
  // Three pixels in a row; the first `drawn` columns of samples are white, the ground is black.
  std::vector<int> middle;
  for (int drawn = 0; drawn <= 6; ++drawn) {
    Pixels first = grey(3, 255);
    for (int x = 0; x < 6; ++x) {
      if (x < drawn) first[4 * (static_cast<std::size_t>(x) / 2) + 3] |= x % 2 == 0 ? 0x55 : 0xaa;
    }
    const Pixels ground = grey(3, 0);
    middle.push_back(resolved(RenderedPixels{3, 1, 2, ground, first, ground}).pixel(1, 0)[0]);
  }
  // sRGB's codes of 0, 0, 1/8, 1/2, 7/8, 1, 1.
  EXPECT_EQ(middle, (std::vector<int>{0, 0, 99, 188, 240, 255, 255}));
}

TEST(Resolve, AgreesWithAveragingEachSample) {
  // 40 × 30 pixels of random colours and bits. The light of samples is averaged in all of them.
  std::mt19937 numbers(1);  // NOLINT(bugprone-random-generator-seed): the same in every run
  Pixels first(std::size_t{40} * 30 * 4);
  Pixels second(first.size());
  Pixels ground(first.size());
  for (Pixels* pixels : {&first, &second, &ground}) {
    for (std::uint8_t& byte : *pixels) byte = static_cast<std::uint8_t>(numbers());
  }
  for (std::size_t i = 3; i < first.size(); i += 8) first[i] = first[i] < 128 ? 0 : all_samples;
  const RenderedPixels rendered{40, 30, 2, ground, first, second};
  EXPECT_EQ(resolved(rendered).rgb, resolved(light_of_samples(rendered), 40, 30, 2).rgb);
}

TEST(Resolve, LaysBlendedSurfacesOverBodiesAndGround) {
  // Half of white over ground, half of black over a body, averaged in linear light: code 188.
  const Pixels black = grey(3, 0);
  Pixels bodies = grey(3, 255);
  Pixels layer = grey(3, 255);
  bodies[7] = layer[3] = all_samples;
  layer[7] = 0xf0;  // of the second colour
  const Pixels opacities{128, 0, 0, 0, 0, 128, 0, 0, 0, 0, 0, 0};
  SampleLight samples = light_of_samples(RenderedPixels{3, 1, 1, black, bodies, black});
  lay_over(samples, RenderedPixels{3, 1, 1, black, layer, black}, opacities);
  const Image image = resolved(samples, 3, 1, 1);
  for (const int x : {0, 1}) EXPECT_NEAR(image.pixel(x, 0)[0], 188, 1);
  EXPECT_EQ(image.pixel(2, 0)[0], 0);
}

}  // namespace
}  // namespace substep::render
