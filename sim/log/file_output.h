#pragma once
/// Files written whole or not at all.

#include <filesystem>
#include <string_view>

namespace substep {

/// Writes `content` to a new file beside `file` and renames it over it. Throws Error; then `file` is as it
/// was. What is not a regular file (a device, a pipe) is written to directly.
void write_file(const std::filesystem::path& file, std::string_view content);

/// Throws Error when `file` could not be made because its folder is missing or it is a folder itself: for
/// commands that work long before they write.
void require_folder_of(const std::filesystem::path& file);

/// A hidden name beside `file` that no other call gives, to write to and then rename.
std::filesystem::path partial_file(const std::filesystem::path& file);

}  // namespace substep
