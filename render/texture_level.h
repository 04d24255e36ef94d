#pragma once
/// A surface's image as it is averaged: for the device, and to be stored smaller than it came.

#include <cstdint>
#include <vector>

#include "render/image.h"

namespace substep::render {

/// One of an image's ever smaller copies: four numbers a texel, in 65535ths, rows from the top.
struct TextureLevel {
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> numbers;
};

/// Colours are decoded to light before anything is averaged; other images hold their numbers as they are.
TextureLevel first_level(const Texels& texels, bool is_color);

/// Half as wide and high, each texel the mean of the four it covers, in integers: the driver's own may differ
/// from machine to machine.
TextureLevel halved(const TextureLevel& level);

/// The inverse of first_level(), to the nearest code.
Texels texels_of(const TextureLevel& level, bool is_color);

}  // namespace substep::render
