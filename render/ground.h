#pragma once
/// The ground: where it lies, and what stands close to it.

#include <span>
#include <vector>

#include "render/body_mesh.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// Height of the world's horizontal plane; in a scene without one, that of the lowest thing of the world
/// where it is below all bodies at the start; else low enough for all that joints hold to the world to swing
/// above it. It follows from the scene alone: all runs of it, and all their frames, stand on the same ground.
double ground_height(const Scene& scene, std::span<const Part> parts);

/// What stands above a square piece of the ground: of each cell, the least and the greatest height of
/// surfaces over it, m; where there is none, the greatest is below 0. Rows along x.
struct Relief {
  static constexpr int size = 128;
  double width = 1;  ///< m, of the square
  std::vector<float> lowest = std::vector<float>(static_cast<std::size_t>(size) * size, 0.0F);
  std::vector<float> highest = std::vector<float>(static_cast<std::size_t>(size) * size, -1.0F);
};

/// Part of the sky's light that reaches the ground at the cells' centres, 0–1. All between a cell's two
/// heights counts as filled. What the ground and the bodies reflect to each other lets no place be darker
/// than `ambient_floor`.
std::vector<float> ground_openness(const Relief& relief);
inline constexpr float ambient_floor = 0.25F;

}  // namespace substep::render
