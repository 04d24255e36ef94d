#pragma once
/// What vertices of surfaces with more than a colour have for their look.

#include <array>
#include <vector>

#include "sim/scene/scene.h"

namespace substep::render {

/// As the graphics buffer holds it.
struct LookVertex {
  std::array<float, 4> coordinates{};      ///< two sets
  std::array<float, 4> color{1, 1, 1, 1};  ///< linear RGBA
  std::array<float, 4> tangent{};          ///< in the body frame; w: handedness; 0: none
  std::array<float, 2> density{};          ///< units of each set of coordinates in a metre of the surface
};

/// Of a mesh whose vertices lie at `positions` and have `normals` in the body frame, to which `linear` took
/// them. Tangents that the mesh has not follow from the coordinates with which its normal texture is laid.
std::vector<LookVertex> look_vertices(const Mesh& mesh, const Matrix3& linear,
                                      const std::vector<Vector3>& positions,
                                      const std::vector<Vector3>& normals, int set_of_normals);

/// Whether drawing the scene needs more than a colour and a finish for each surface.
bool needs_looks(const Scene& scene);

}  // namespace substep::render
