#pragma once
/// Meshes of files without a scene: OBJ, STL, PLY, DAE and more by assimp, and glTF by mesh_scene.cpp.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sim/scene/scene.h"

namespace substep {

/// The meshes of one node of a file.
struct MeshObject {
  std::string name;          ///< unique among the file's
  std::vector<Mesh> meshes;  ///< each with at least one triangle; without normals where the file gives none
};

struct MeshFile {
  std::vector<MeshObject> objects;  ///< at least one, each with a mesh
  std::vector<Surface> surfaces;
  std::vector<SceneImage> images;     ///< of glTF files alone
  std::vector<std::string> warnings;  ///< of a missing material file
  std::uint64_t hash = 0;             ///< of the file's bytes, computed like a scene's
};

/// Returns true where assimp reads files with this extension (".obj").
bool is_mesh_extension(const std::string& extension);

/// Reads a mesh file: one object for each of its nodes with meshes, in the units of the file, placed as its
/// nodes place them. Positions are finite and indices in range.
///
/// assimp's readers for its fifty formats crash or hang on damaged files. So they run in a child process,
/// with limits on time and memory that grow with the file; it reads nothing but the file and, for its
/// colours, `.mtl` files in its folder or below. Throws Error.
MeshFile read_mesh_file(const std::filesystem::path& file);

}  // namespace substep
