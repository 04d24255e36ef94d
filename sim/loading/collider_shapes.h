#pragma once
/// Collision shapes from what a glTF file describes, with the node's scale worked into them.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim/geometry/shape.h"
#include "sim/loading/gltf_document.h"
#include "sim/loading/gltf_meshes.h"
#include "sim/loading/json_value.h"
#include "sim/loading/physics_extension.h"

namespace substep {

/// The shape of an implicit shape on a node with this scale; only its size counts, not its signs. `place` is
/// the collider, named in complaints. A sphere or capsule under a scale that differs along its axes becomes
/// the hull of points on it, with a warning; `faceted` keeps that hull, unscaled, for the next scale. A
/// finite or two-sided plane becomes a triangle mesh. Throws Error where the scale leaves no volume.
Shape implicit_shape(const ImplicitShape& shape, const Vector3& scale, std::optional<Polytope>& faceted,
                     const JsonValue& place, std::vector<std::string>& warnings);

/// The triangles of all meshes at a node and below.
struct NodeGeometry {
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;  ///< counter-clockwise seen from the front
  bool double_sided = false;        ///< one of its materials is
  bool skinned = false;
};

/// The triangles of a mesh, unskinned, times `scale`. Throws Error when there is none.
NodeGeometry geometry_of_mesh(const GltfMesh& mesh, const Vector3& scale, const JsonValue& place);

/// How much geometry_of_node has to do: nodes, vertices, triangles and joints.
std::size_t geometry_size(const GltfDocument& document, const std::vector<GltfMesh>& meshes,
                          const std::vector<GltfSkin>& skins, int node);

/// In the frame of `node` times `scale`. What is skinned has the form that its skeleton gives it at the
/// start. Throws Error when there is no triangle.
NodeGeometry geometry_of_node(const GltfDocument& document, const std::vector<GltfMesh>& meshes,
                              const std::vector<GltfSkin>& skins, int node, const Vector3& scale,
                              const JsonValue& place);

/// The convex hull of points or, where that has more vertices than a contact can afford, that of the
/// outermost points in evenly spread directions.
struct SimplifiedHull {
  Polytope hull;
  std::string warning;  ///< how much it leaves out; empty where it is the hull
};

/// `what` is at the front of complaints. Throws Error where there is no volume.
SimplifiedHull simplified_hull(std::span<const Vector3> points, const std::string& what);

}  // namespace substep
