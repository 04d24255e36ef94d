#pragma once
/// From the pixels that were drawn to the picture.

#include <cstdint>
#include <span>

#include "render/image.h"

namespace substep {

/// Pixels as OpenGL gives them, 4 bytes each and the lowest row first, without their alpha.
Image top_down(std::span<const std::uint8_t> rgba, int width, int height);

/// Lays what was drawn over `image`: `rgba`, as OpenGL gives it, is `samples` (1 or 2) times as wide and
/// high, and its alpha is 0 where nothing was drawn. A pixel's samples, and with a third of their weight the
/// nearest of its neighbours', are averaged as light, not as codes, and in integers: exact everywhere.
void cover(Image& image, std::span<const std::uint8_t> rgba, int samples);

}  // namespace substep
