#pragma once
/// The ground: where it lies, and what stands close to it.

#include <array>
#include <span>
#include <vector>

#include "render/body_mesh.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep {

/// Height of the world's horizontal plane; in a scene without one, that of the lowest thing of the world
/// where it is below all bodies at the start; else low enough for all that joints hold to the world to swing
/// above it. It follows from the scene alone: all runs of it, and all their frames, stand on the same ground.
double ground_height(const Scene& scene, std::span<const Part> parts);

/// How much of the sky the bodies leave to the ground around them, on a square grid; bodies count as rows of
/// balls.
struct GroundOcclusion {
  static constexpr int size = 128;
  double corner_x = 0;
  double corner_z = 0;
  double width = 1;             ///< m, of the square
  std::vector<float> openness;  ///< 0–1 at the cells' centres, rows along x
};

/// For the square from (low_x, low_z) of side `width`.
GroundOcclusion ground_occlusion(std::span<const Part> parts, std::span<const Coordinates> poses,
                                 double height, double low_x, double low_z, double width);

}  // namespace substep
