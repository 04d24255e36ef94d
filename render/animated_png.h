#pragma once
/// Pictures that follow each other in one PNG file, over and over.

#include <span>
#include <string>

#include "render/image.h"

namespace substep::render {

/// An animated PNG's bytes (https://www.w3.org/TR/png-3/), deterministic; who knows no animation shows the
/// first. All frames have one size; each but the first holds only the rectangle in which it differs from the
/// one before.
std::string to_animated_png(std::span<const Image> frames, int milliseconds_each);

}  // namespace substep::render
