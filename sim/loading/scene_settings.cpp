#include "sim/loading/scene_settings.h"

#include <cmath>
#include <optional>

#include "sim/loading/needed_substeps.h"
#include "sim/model/settings_fields.h"

namespace substep {
namespace {

std::optional<JsonValue> settings_of(const JsonValue& object) {
  const auto extras = object.find("extras");
  if (!extras || !extras->json().is_object())
    return std::nullopt;  // others may keep anything in their extras
  return extras->find("substep");
}

void read_from(const JsonValue& object, Scene& scene) {
  const auto settings = settings_of(object);
  if (!settings) return;
  settings->allow_only({"gravity", "duration", "step", "substeps", "poster", "gyroscopic", "expected"});
  scene.gravity = get(*settings, "gravity", scene.gravity, &JsonValue::vector3);
  if (std::abs(scene.gravity.z()) > 0.99 * scene.gravity.norm()) {
    scene.warnings.push_back(
        settings->path() +
        "/gravity: is along z, but +Y is up in glTF and in pictures: turn a scene whose +Z is up by a node "
        "above all others with the rotation [-0.7071068, 0, 0, 0.7071068]");
  }
  scene.duration = get(*settings, "duration", scene.duration, &JsonValue::positive);
  scene.step = get(*settings, "step", scene.step, &JsonValue::positive);
  if (settings->find("poster")) scene.poster = get(*settings, "poster", 0.0, &JsonValue::non_negative);
  scene.gyroscopic = get(*settings, "gyroscopic", scene.gyroscopic, &JsonValue::boolean);
}

void read_substeps_from(const JsonValue& object, Scene& scene) {
  const auto settings = settings_of(object);
  const auto substeps = settings ? settings->find("substeps") : std::nullopt;
  if (!substeps) return;
  const auto most = static_cast<std::uint64_t>(field_named("substeps").range.high);
  scene.substeps = static_cast<int>(substeps->integer(most));
  if (scene.substeps < 1) substeps->fail("must be 1 or more");
}

}  // namespace

void read_settings(const GltfDocument& document, Scene& scene) {
  read_from(document.root(), scene);
  if (document.scene >= 0) read_from(document.item_of("scenes", document.scene), scene);
}

void read_substeps(const GltfDocument& document, Scene& scene) {
  scene.substeps = needed_substeps(scene);
  read_substeps_from(document.root(), scene);
  if (document.scene >= 0) read_substeps_from(document.item_of("scenes", document.scene), scene);
}

}  // namespace substep
