#pragma once
/// The triangles of a glTF document's meshes, and its skins.
///
/// assimp is not used here: it drops the nodes that colliders point to, leaves out triangles silently and
/// accepts any number as a vertex. Every accessor would have to be checked down to its bytes anyway.

#include <array>
#include <cstdint>
#include <vector>

#include "sim/loading/gltf_document.h"
#include "sim/scene/scene.h"

namespace substep {

/// The joints of a skin that hold a vertex, and their weights.
struct SkinInfluence {
  std::array<std::uint16_t, 4> joints{};
  std::array<double, 4> weights{};  ///< their sum is 1, or 0 where nothing holds it
};

/// One primitive of a mesh, with no name. `normals` is empty where the file gives none. `surface` is the
/// material; −1: none.
struct GltfPrimitive : Mesh {
  std::vector<SkinInfluence> influences;  ///< empty: no skin
  bool double_sided = false;              ///< its material
};

struct GltfMesh {
  std::vector<GltfPrimitive> primitives;  ///< triangles, strips and fans; points and lines are left out

  std::size_t size() const;  ///< number of vertices plus number of triangles
};

/// A skeleton: the nodes that are its joints and, for each, mesh space → joint's space as it was modelled.
struct GltfSkin {
  std::vector<int> joints;
  std::vector<NodeTransform> joint_from_mesh;
};

/// Reads one entry per skin of the document, in its order. Throws Error.
std::vector<GltfSkin> read_skins(const GltfDocument& document);

/// Reads one entry per mesh of the document, in its order. All positions are finite and all indices in range;
/// normals are unit or absent. Warns of each omission. Throws Error.
std::vector<GltfMesh> read_meshes(const GltfDocument& document);

/// Returns a skinned primitive in its pose at the start, in world space; normals are unit, or none, and
/// tangents are left out. Throws Error, naming `node`, when a joint is out of range or a vertex overflows.
Mesh posed(const GltfDocument& document, const GltfSkin& skin, const GltfPrimitive& primitive,
           const JsonValue& node);

}  // namespace substep
