#pragma once
/// From the pixels that were drawn to the picture.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/image.h"

namespace substep {

/// Linear light of an sRGB code, in 65535ths.
std::uint16_t linear_light(std::uint8_t code);

/// Pixels as OpenGL gives them, 4 bytes each and the lowest row first, without their alpha.
Image top_down(std::span<const std::uint8_t> rgba, int width, int height);

/// Lays what was drawn over `image`: `rgba`, as OpenGL gives it, is `samples` (1 or 2) times as wide and
/// high, and its alpha is 0 where nothing was drawn. A pixel's samples, and with a third of their weight the
/// nearest of its neighbours', are averaged as light, not as codes, and in integers: exact everywhere.
void cover(Image& image, std::span<const std::uint8_t> rgba, int samples);

/// Samples with surfaces over them that light passes through: per sample red, green and blue light times
/// what is covered, and what is covered, all in 65535ths.
using Veiled = std::vector<std::array<std::uint16_t, 4>>;

/// What was drawn, as OpenGL gives it: covered where alpha is not 0.
Veiled veiled(std::span<const std::uint8_t> rgba);

/// Lays a surface over the samples: its colours' codes, and its alpha in 255ths.
void lay_over(Veiled& samples, std::span<const std::uint8_t> rgba);

/// As the other cover().
void cover(Image& image, const Veiled& veiled, int samples);

}  // namespace substep
