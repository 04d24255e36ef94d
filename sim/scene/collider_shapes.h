#pragma once
/// Collision shapes from what a glTF file describes, with the node's scale worked into them.

#include <string>
#include <vector>

#include "sim/geometry/shape.h"
#include "sim/scene/gltf_document.h"
#include "sim/scene/gltf_meshes.h"
#include "sim/scene/json_value.h"
#include "sim/scene/physics_extension.h"

namespace substep {

/// The shape of an implicit shape on a node with this scale; only its size counts, not its signs. `place` is
/// the collider, named in complaints. Boxes and cylinders take any scale; a cylinder is a prism of 32 sides.
/// Throws Error for a sphere or capsule under a scale that differs along its axes, and for a tapered capsule.
Shape implicit_shape(const ImplicitShape& shape, const Vector3& scale, const JsonValue& place,
                     std::vector<std::string>& warnings);

/// The convex hull of all meshes at `node` and below, in the frame of `node` times `scale`. Throws Error when
/// one is skinned or there is no volume.
Shape hull_of_node(const GltfDocument& document, const std::vector<GltfMesh>& meshes, int node,
                   const Vector3& scale, const JsonValue& place);

}  // namespace substep
