#pragma once
/// Meshes in files that are no scenes: OBJ, STL, PLY, DAE and whatever else assimp reads.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sim/geometry/mass_properties.h"
#include "sim/math/vector.h"
#include "sim/scene/scene.h"

namespace substep {

/// A submesh of one colour.
struct MeshPart {
  std::vector<Vector3> positions;
  std::vector<Vector3> normals;  ///< one per position, unit; or none
  std::vector<Triangle> triangles;
  std::optional<std::array<double, 3>> color;  ///< linear RGB
  int surface = -1;                            ///< index into MeshFile::surfaces; −1: `color` says it all
  VertexLooks looks;
};

struct MeshObject {
  std::string name;  ///< unique among the file's
  std::vector<MeshPart> parts;
};

struct MeshFile {
  std::vector<MeshObject> objects;  ///< at least one; each with a triangle
  std::vector<Surface> surfaces;
  std::vector<SceneImage> images;
  std::uint64_t hash = 0;  ///< of the file's bytes, as a scene's
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
