#pragma once
/// Where in a picture bodies can be seen at all.

#include <glm/mat4x4.hpp>
#include <span>
#include <vector>

#include "render/body_mesh.h"
#include "sim/model/state.h"

namespace substep {

/// Pixels, from the picture's lower left corner.
struct Rectangle {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// Rectangles that do not overlap, of square tiles, within which all of the parts lie at `poses`.
std::vector<Rectangle> areas_of(std::span<const Part> parts, std::span<const Coordinates> poses,
                                const glm::dmat4& clip_from_world, int width, int height);

}  // namespace substep
