#pragma once
/// Makes a scene of meshes that fall on a plane.

#include "sim/loading/gltf_document.h"
#include "sim/loading/load_scene.h"
#include "sim/loading/mesh_file.h"

namespace substep {

/// Returns a scene with a body for each object and copy, above the world's plane y = 0. Throws Error.
Scene mesh_scene(const std::filesystem::path& file, MeshFile meshes, const MeshOptions& options);

/// Returns true where the document has a mesh, but neither the physics extension nor `extras.substep`.
bool is_mesh_file(const GltfDocument& document);

/// Returns one object for each node of the scene with a mesh of triangles, at the node's pose; skinned meshes
/// have their pose at the start. Warns of each omission. Throws Error where there is no triangle.
MeshFile mesh_file_of(GltfDocument& document);

}  // namespace substep
