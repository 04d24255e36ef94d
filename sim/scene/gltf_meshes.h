#pragma once
/// The triangles of a glTF document's meshes, read by assimp from a copy of the document that holds nothing
/// else.

#include <string>
#include <vector>

#include "sim/geometry/mass_properties.h"
#include "sim/scene/gltf_document.h"
#include "sim/vector.h"

namespace substep {

/// One primitive of a mesh. `normals` is empty where the file gives none.
struct GltfPrimitive {
  std::vector<Vector3> positions;
  std::vector<Vector3> normals;
  std::vector<Triangle> triangles;
  int material = -1;  ///< −1: none
};

struct GltfMesh {
  std::vector<GltfPrimitive> primitives;  ///< triangles, strips and fans; points and lines are left out
};

/// One entry per mesh of the document, in its order. All positions are finite and all indices in range;
/// normals are unit or absent. Adds to `warnings` what was left out. Throws Error.
std::vector<GltfMesh> read_meshes(const GltfDocument& document, std::vector<std::string>& warnings);

}  // namespace substep
