#pragma once
/// The height of the ground, and the skylight that reaches it.

#include <span>
#include <vector>

#include "render/body_mesh.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// Returns the height of the world's horizontal plane; in a scene without one, that of the lowest thing of
/// the world where it is below all bodies at the start; else low enough for all that joints hold to the world
/// to swing above it. It follows from the scene alone: all runs of it, and all their frames, stand on the
/// same ground.
double ground_height(const Scene& scene, std::span<const Part> parts);

/// The least and the greatest height, m, of surfaces over each cell of a square piece of the ground; where
/// there is none, the greatest is below 0. Rows along x.
struct Relief {
  static constexpr int size = 128;
  double width = 1;  ///< m, of the square
  std::vector<float> lowest = std::vector<float>(static_cast<std::size_t>(size) * size, 0.0F);
  std::vector<float> highest = std::vector<float>(static_cast<std::size_t>(size) * size, -1.0F);
};

/// Returns the fraction of the sky's light that reaches the ground at the cells' centres. All between a
/// cell's two heights counts as filled. Reflections between ground and bodies leave at least `ambient_floor`.
std::vector<float> ground_openness(const Relief& relief);
inline constexpr float ambient_floor = 0.25F;

}  // namespace substep::render
