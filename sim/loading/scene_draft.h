#pragma once
/// A scene while load_scene() makes it: the file's content, and the results of each step for later ones.

#include <cstddef>
#include <filesystem>
#include <map>
#include <vector>

#include "sim/geometry/mass_properties.h"
#include "sim/loading/gltf_document.h"
#include "sim/loading/gltf_meshes.h"
#include "sim/loading/node_transform.h"
#include "sim/loading/physics_extension.h"
#include "sim/scene/scene.h"

namespace substep {

/// A node as its body sees it. Before place_bodies, body frames are those of the bodies' nodes.
struct NodeAttachment {
  int body = world_body;
  /// To the frame of the body's node, without that node's scale; to the world's if static.
  NodeTransform in_node;
};

struct SceneDraft {
  /// Reads the document's meshes, skins and tables. Throws Error.
  SceneDraft(const std::filesystem::path& file, GltfDocument read);

  /// Sets `physics`.
  void read_physics();

  /// Returns a part of a node's KHR_physics_rigid_bodies, which must have it.
  JsonValue extension(int node, const char* part) const;

  /// Adds to the size of colliders and skins, which may share meshes, so that a small file can need much
  /// memory. Throws Error where it is too much.
  void spend(std::size_t size, const JsonValue& place);

  Scene scene;  ///< first: reading the rest adds warnings
  GltfDocument document;
  std::vector<GltfMesh> meshes;
  std::vector<GltfSkin> skins;
  PhysicsTables tables;
  std::vector<NodePhysics> physics;
  std::vector<NodeAttachment> attachments;     ///< of the nodes
  std::vector<int> body_of_node;               ///< the world's where the node carries none
  std::vector<int> node_of_body;               ///< −1 for the world
  std::vector<std::vector<int>> colliders_of;  ///< each body's, as indices
  std::vector<int> collider_of_node;           ///< −1 where the node has none
  std::map<int, MassProperties> solids;        ///< of colliders whose mesh fills less than their shape
  std::size_t most_spent = 100'000;
  std::size_t spent = 0;
};

}  // namespace substep
