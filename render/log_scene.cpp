#include "render/log_scene.h"

#include <fmt/format.h>

#include "sim/error.h"

namespace substep::render {

void require_log_of(const Scene& scene, const PoseLog& log, const std::filesystem::path& file) {
  if (scene.hash != log.scene_hash) {
    throw Error(fmt::format("{}: was made from another version of {}: run it again", file.string(),
                            scene.file.string()));
  }
  if (scene.bodies.size() != log.bodies.size()) {
    throw Error(fmt::format("{}: has {} bodies, {} has {}", file.string(), log.bodies.size() - 1,
                            scene.file.string(), scene.bodies.size() - 1));
  }
}

}  // namespace substep::render
