#pragma once
/// A glTF document that describes no physics, taken as a file of meshes.

#include <string>
#include <vector>

#include "sim/loading/gltf_document.h"
#include "sim/loading/mesh_file.h"

namespace substep {

/// Whether the document neither names the physics extension nor has settings of ours, but draws a mesh.
bool is_mesh_file(const GltfDocument& document);

/// One object for each node of the scene that has a mesh of triangles, placed as its nodes place it; what is
/// skinned has the form that its skeleton gives it at the start. Adds to `warnings` what was left out. Throws
/// Error where there is no triangle.
MeshFile mesh_file_of(GltfDocument& document, std::vector<std::string>& warnings);

}  // namespace substep
