#pragma once
/// A scene while load_scene() makes it: the file's content, and the results of each step for later steps.

#include <cstddef>
#include <map>
#include <vector>

#include "sim/geometry/mass_properties.h"
#include "sim/loading/gltf_document.h"
#include "sim/loading/gltf_meshes.h"
#include "sim/loading/physics_extension.h"
#include "sim/scene/scene.h"

namespace substep {

/// A node as its body sees it. Before place_bodies(), body frames are those of the bodies' nodes.
struct NodeAttachment {
  int body = world_body;
  /// To the frame of the body's node, without that node's scale; to the world's if static.
  NodeTransform in_node;
};

struct SceneDraft {
  /// Reads the document's meshes, skins and tables. Throws Error.
  explicit SceneDraft(GltfDocument read);

  JsonValue node_json(std::size_t node) const { return document.item_of("nodes", node); }
  /// Returns a part of a node's KHR_physics_rigid_bodies, which must have it.
  JsonValue extension(int node, const char* part) const {
    return node_json(node).extension("KHR_physics_rigid_bodies")->require(part);
  }

  /// Adds to the size of colliders and skins, which may share meshes, so that a small file can need much
  /// memory. Throws Error where it is too much.
  void spend(std::size_t size, const JsonValue& place);

  GltfDocument document;
  std::vector<GltfMesh> meshes;
  std::vector<GltfSkin> skins;
  PhysicsTables tables;
  Scene scene;
  std::vector<NodePhysics> physics;
  std::vector<NodeAttachment> attachments;     ///< of the nodes
  std::vector<int> node_of_body;               ///< −1 for the world
  std::vector<std::vector<int>> colliders_of;  ///< each body's, as indices
  std::vector<int> collider_of_node;           ///< −1 where the node has none
  std::map<int, MassProperties> solids;        ///< of colliders whose mesh fills less than their shape
  std::size_t most_spent = 100'000;
  std::size_t spent = 0;
};

// The steps, in the order in which they are called. All throw Error.

/// Adds the world and one body for each node with a motion, and finds each node's body and its pose in that
/// body's node. The pose is composed from the body's node downwards, not through the world, so that it has no
/// rounding of the world's coordinates.
void add_bodies(SceneDraft& draft);

/// Adds the colliders, each in the frame of its body's node.
void add_colliders(SceneDraft& draft);

/// Sets the bodies' masses, frames and velocities, and moves their colliders into those frames. Refuses
/// numbers that are fine one by one and overflow together.
void place_bodies(SceneDraft& draft);

/// Adds the joints.
void add_joints(SceneDraft& draft);

/// Warns of bodies at rest with "mass": 0 that no joint holds: they float.
void warn_of_floating_bodies(const SceneDraft& draft);

/// Adds the drawn meshes, their surfaces and bodies, and moves the meshes out of the draft.
void add_visuals(SceneDraft& draft);

}  // namespace substep
