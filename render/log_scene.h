#pragma once
/// Whether a pose log's poses fit a scene.

#include <filesystem>

#include "sim/log/pose_log.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// Throws Error where `log`, read from `file`, was made from another scene, or another version of it.
void require_log_of(const Scene& scene, const PoseLog& log, const std::filesystem::path& file);

}  // namespace substep::render
