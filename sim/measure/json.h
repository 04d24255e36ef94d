#pragma once
/// Converts settings, metrics and times to JSON and back, for sidecars of goldens and for records of sweeps.
/// Also converts scenes to JSON. Numbers that are not finite are null, and read back as infinite.

#include <nlohmann/json.hpp>

namespace substep {

struct Metrics;
struct RunTimes;
struct Scene;
struct Settings;

/// Returns the settings as an object with the fields of settings_fields.h.
nlohmann::ordered_json to_json(const Settings& settings);
nlohmann::ordered_json to_json(const Metrics& metrics);
nlohmann::ordered_json to_json(const RunTimes& times);

/// Throws nlohmann's exceptions if a field is missing or of another type, and Error for an unknown name.
Settings settings_in(const nlohmann::ordered_json& json);
/// Throw Error for JSON that to_json() does not return.
Metrics metrics_in(const nlohmann::ordered_json& json);
RunTimes times_in(const nlohmann::ordered_json& json);

/// Returns the scene without its appearance, as it is simulated, complete enough for `info --json` and for
/// simulators that are commands: SI units, null for infinite. scenes/format.md documents it.
nlohmann::ordered_json scene_json(const Scene& scene);

}  // namespace substep
