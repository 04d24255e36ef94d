#pragma once
/// Files written whole or not at all.

#include <filesystem>
#include <string_view>

namespace substep {

/// Writes `content` to a new file beside `file` and renames it over it. Throws Error; then `file` is as it was.
void write_file(const std::filesystem::path& file, std::string_view content);

}  // namespace substep
