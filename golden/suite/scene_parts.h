#pragma once
/// Digests of a scene's parts, kept in a case's sidecar: they tell which part of which body differs between
/// two scenes.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sim/scene/scene.h"

namespace substep::golden {

/// Returns four hexadecimal digits for each part of each body and joint of the scene as loaded, in the order
/// of Scene::bodies.
nlohmann::ordered_json scene_parts(const Scene& scene);

/// The differences between a scene and the noted parts of another.
struct SceneDifference {
  bool moves = false;     ///< something that motion depends on differs
  bool is_drawn = false;  ///< something that is drawn differs
  std::string text;       ///< "mass of box_3; mesh or colour of box_1, box_2 and 5 more"; empty: nothing
};

/// Compares a scene with noted digests. `names` are the noted bodies' names from its pose log; empty without
/// one.
SceneDifference scene_difference(const nlohmann::ordered_json& noted, const Scene& scene,
                                 const std::vector<std::string>& names);

}  // namespace substep::golden
