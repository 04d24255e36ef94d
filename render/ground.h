#pragma once
/// The height of the ground, and the skylight that reaches it.

#include <span>
#include <vector>

#include "render/body_mesh.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// Returns the height, m, of the world's highest horizontal plane. Without one: the world's lowest point, if
/// no body starts below it; else a height below all that bodies start at and that bodies hung on the world
/// reach. The scene alone determines the height, so that all runs and frames have equal ground.
double ground_height(const Scene& scene, std::span<const Part> parts);

/// The least and the greatest height, m, of surfaces over each cell of a square of the ground; the greatest
/// is below 0 without surfaces. Rows along x.
struct Relief {
  static constexpr int size = 128;
  double width = 1;  ///< m, of the square
  std::vector<float> lowest = std::vector<float>(static_cast<std::size_t>(size) * size, 0.0F);
  std::vector<float> highest = std::vector<float>(static_cast<std::size_t>(size) * size, -1.0F);
};

/// Returns the fraction of the sky's light that reaches the ground at the cells' centres. The space
/// between a cell's two heights counts as filled. Reflections between ground and bodies leave at least
/// `ambient_floor`.
std::vector<float> ground_openness(const Relief& relief);
inline constexpr float ambient_floor = 0.25F;

}  // namespace substep::render
