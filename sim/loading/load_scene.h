#pragma once
/// Loads scenes from files.

#include <filesystem>
#include <optional>
#include <vector>

#include "sim/scene/scene.h"

namespace substep {

/// Options of a scene that is made of a file of meshes.
struct MeshOptions {
  double scale = 1;            ///< metres in one unit of the file
  double density = 1000;       ///< kg/m³
  std::optional<double> mass;  ///< kg, of each body; counts in place of the density
  /// Height of the lowest point above the ground at the start, m; absent: half of the file's largest extent.
  std::optional<double> height;
  Vector3 rotation = Vector3::Zero();  ///< degrees about x, then y, then z, before it is let go
  int copies = 1;                      ///< of all that is in the file
};

/// Reads a scene: `.gltf` or `.glb` with KHR_physics_rigid_bodies and KHR_implicit_shapes, or meshes in
/// another format that assimp reads (OBJ, STL, PLY, DAE, …), each of which becomes a body above a plane. A
/// closed mesh has its exact mass properties, an open one those of its convex hull; all collide as their
/// hulls. Throws Error, also when options are given for a scene.
Scene load_scene(const std::filesystem::path& file, const std::optional<MeshOptions>& options = std::nullopt);

/// Reads a `.gltf` or `.glb` without physics as a scene whose only body is the world, with its meshes,
/// cameras and lights. Returns nothing where the file has physics, or is no glTF. Throws Error.
std::optional<Scene> load_still_scene(const std::filesystem::path& file);

/// Returns `file` and the files of a glTF's buffers and images. Reads the file anew; throws Error as
/// load_scene() does.
std::vector<std::filesystem::path> scene_files(const std::filesystem::path& file);

}  // namespace substep
