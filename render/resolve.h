#pragma once
/// Averages rendered samples to the pixels of a picture.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/image.h"

namespace substep::render {

/// Returns the linear light of an sRGB code, in 65535ths.
std::uint16_t linear_light(std::uint8_t code);

/// Returns the sRGB code that is nearest to linear light, in 65535ths.
std::uint8_t nearest_code(std::uint16_t light);

/// Returns pixels as OpenGL gives them, 4 bytes each and the lowest row first, without their alpha.
Image top_down(std::span<const std::uint8_t> rgba, int width, int height);

/// A rendered picture as OpenGL gives it: 4 bytes a pixel, the lowest row first.
struct RenderedPixels {
  int width = 0;
  int height = 0;
  int samples = 1;  ///< along a pixel's side: 1 or 2
  /// Ground and sky; undefined where bodies cover a pixel wholly.
  std::span<const std::uint8_t> ground;
  /// Bodies. Bit i of its alpha: sample i is of this colour; bit 4 + i: sample i is a body's. Samples are
  /// counted along the row, the lower row first; one sample alone is all four.
  std::span<const std::uint8_t> first;
  std::span<const std::uint8_t> second;  ///< the other bodies' samples
};

/// Averages each pixel's samples, and the nearest samples of its neighbours at a third of the weight, in
/// linear light and in integers: the same on every machine. Copies pixels amid one surface of nearly one
/// colour, or amid ground and sky.
Image resolved(const RenderedPixels& rendered);

/// Red, green and blue in 65535ths.
using LinearColor = std::array<std::uint16_t, 3>;

/// The light of each sample, row by row from below.
using SampleLight = std::vector<LinearColor>;
SampleLight light_of_samples(const RenderedPixels& rendered);

/// Lays the bodies of `layer` over the samples. `opacities`: 4 bytes a pixel, first those of both colours, in
/// 255ths.
void lay_over(SampleLight& samples, const RenderedPixels& layer, std::span<const std::uint8_t> opacities);

/// Averages samples like resolved(RenderedPixels), but copies no pixel.
Image resolved(const SampleLight& light, int width, int height, int samples);

}  // namespace substep::render
