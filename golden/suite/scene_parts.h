#pragma once
/// What a scene is made of, as digests that stand in a case's sidecar: so that of two scenes it can be said
/// which part of which body is another.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sim/scene/scene.h"

namespace substep::golden {

/// Of the scene as loaded: four hexadecimal digits a body (a joint) and part. Bodies follow each other as in
/// Scene::bodies.
nlohmann::ordered_json scene_parts(const Scene& scene);

/// What differs of a scene from the one whose parts were noted.
struct SceneDifference {
  bool moves = false;     ///< something that motion depends on differs
  bool is_drawn = false;  ///< something that is drawn differs
  std::string text;       ///< "mass of box_3; mesh or colour of box_1, box_2 and 5 more"; empty: nothing
};

/// `names` are those of the noted scene's bodies, as its pose log has them; empty where there is none.
SceneDifference scene_difference(const nlohmann::ordered_json& noted, const Scene& scene,
                                 const std::vector<std::string>& names);

}  // namespace substep::golden
