#pragma once
/// Makes a scene of meshes that fall on a plane.

#include <filesystem>

#include "sim/loading/load_scene.h"
#include "sim/loading/mesh_file.h"
#include "sim/scene/scene.h"

namespace substep {

/// Returns a scene with a body for each object and copy, above the world's plane y = 0. Throws Error.
Scene mesh_scene(const std::filesystem::path& file, const MeshFile& meshes, const MeshOptions& options);

}  // namespace substep
