#pragma once
/// Computes normals of meshes without them.

#include <string>
#include <vector>

#include "sim/scene/scene.h"

namespace substep {

/// Returns the triangles with normals that are smooth but at creases: a corner's normal is the mean, by area,
/// over the triangles at its position that are inclined to its own by less than 40°. Triangles without area
/// are left out.
Mesh smoothly_drawn_mesh(const std::vector<Vector3>& positions, const std::vector<Triangle>& triangles,
                         const std::string& name, int surface, const VertexLooks& looks = {});

}  // namespace substep
