#pragma once
/// The triangles of a collider in a glTF file.

#include <cstddef>
#include <vector>

#include "sim/geometry/shape.h"
#include "sim/loading/gltf_document.h"
#include "sim/loading/gltf_meshes.h"
#include "sim/loading/json_value.h"

namespace substep {

/// The triangles of all meshes at a node and below.
struct NodeGeometry {
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;  ///< counter-clockwise seen from the front
  bool double_sided = false;        ///< one of its materials is
  bool skinned = false;
};

/// Returns the triangles of a mesh, unskinned, times `scale`. Throws Error where there is none.
NodeGeometry geometry_of_mesh(const GltfMesh& mesh, const Vector3& scale, const JsonValue& place);

/// Bounds the work of geometry_of_node: nodes, vertices, triangles and joints.
std::size_t geometry_size(const GltfDocument& document, const std::vector<GltfMesh>& meshes,
                          const std::vector<GltfSkin>& skins, int node);

/// Returns the triangles at and below `node` in its frame, times `scale`. Skinned meshes have their pose at
/// the start. Throws Error where there is no triangle.
NodeGeometry geometry_of_node(const GltfDocument& document, const std::vector<GltfMesh>& meshes,
                              const std::vector<GltfSkin>& skins, int node, const Vector3& scale,
                              const JsonValue& place);

}  // namespace substep
