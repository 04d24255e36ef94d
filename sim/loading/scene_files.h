#pragma once
/// Lists the files that a scene is read from.

#include <filesystem>
#include <vector>

namespace substep {

/// Returns `file` and the files of a glTF's buffers. Reads the file anew; throws Error as load_scene() does.
std::vector<std::filesystem::path> scene_files(const std::filesystem::path& file);

}  // namespace substep
