#pragma once
/// A scene as JSON, complete enough to simulate it: `info --json`, and what simulators that are commands get.
/// scenes/format.md documents it.

#include <nlohmann/json.hpp>

#include "sim/scene/scene.h"

namespace substep {

/// Returns all that the scene holds but its look, as it will be simulated: SI units, null for infinite.
nlohmann::json scene_json(const Scene& scene);

}  // namespace substep
