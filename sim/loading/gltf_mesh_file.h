#pragma once
/// A glTF document that describes no physics, taken as a file of meshes.

#include <string>
#include <vector>

#include "sim/loading/gltf_document.h"
#include "sim/loading/mesh_file.h"

namespace substep {

/// Returns true where the document has a mesh, but neither the physics extension nor `extras.substep`.
bool is_mesh_file(const GltfDocument& document);

/// Returns one object for each node of the scene with a mesh of triangles, at the node's pose; skinned meshes
/// have their pose at the start. Adds a warning for each omission. Throws
/// Error where there is no triangle.
MeshFile mesh_file_of(GltfDocument& document, std::vector<std::string>& warnings);

}  // namespace substep
