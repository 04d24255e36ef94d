#include "sim/loading/scene_settings.h"

namespace substep {
namespace {

void read_from(const JsonValue& object, Scene& scene) {
  const auto extras = object.find("extras");
  if (!extras || !extras->json().is_object()) return;  // others may keep anything in their extras
  const auto settings = extras->find("substep");
  if (!settings) return;
  settings->allow_only({"gravity", "duration", "step", "poster", "gyroscopic", "expected"});
  scene.gravity = get(*settings, "gravity", scene.gravity, &JsonValue::vector3);
  scene.duration = get(*settings, "duration", scene.duration, &JsonValue::positive);
  scene.step = get(*settings, "step", scene.step, &JsonValue::positive);
  if (settings->find("poster")) scene.poster = get(*settings, "poster", 0.0, &JsonValue::non_negative);
  scene.gyroscopic = get(*settings, "gyroscopic", scene.gyroscopic, &JsonValue::boolean);
}

}  // namespace

void read_settings(const GltfDocument& document, Scene& scene) {
  read_from(document.root(), scene);
  if (document.scene >= 0) read_from(document.item_of("scenes", document.scene), scene);
}

}  // namespace substep
