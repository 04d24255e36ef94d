#pragma once
/// From the pixels that were drawn to the picture.

#include <cstdint>
#include <span>

#include "render/image.h"

namespace substep {

/// `rgba` holds rows from the bottom, 4 bytes a pixel, of a drawing `samples` times (1 or 2) as wide and high
/// as the picture. Samples of a pixel are averaged as light, not as codes, in integers: exact everywhere.
Image resolve(std::span<const std::uint8_t> rgba, int width, int height, int samples);

}  // namespace substep
