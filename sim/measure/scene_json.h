#pragma once
/// Writes a scene as JSON, complete enough to simulate it, for `info --json` and for simulators that are
/// commands.
/// scenes/format.md documents it.

#include <nlohmann/json.hpp>

#include "sim/scene/scene.h"

namespace substep {

/// Returns the scene without its appearance, as it will be simulated: SI units, null for infinite.
nlohmann::json scene_json(const Scene& scene);

}  // namespace substep
