#pragma once
/// Which files a scene is read from.

#include <filesystem>
#include <vector>

namespace substep {

/// `file` and the buffers of a glTF that are files beside it. Reads the file anew; throws Error as load_scene
/// does.
std::vector<std::filesystem::path> scene_files(const std::filesystem::path& file);

}  // namespace substep
