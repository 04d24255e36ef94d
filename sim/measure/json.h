#pragma once
/// Converts settings, metrics and times to JSON and back, for sidecars of goldens and for records of sweeps.
/// Also converts scenes to JSON. Numbers that are not finite are null, and read back as infinite.

#include "sim/loading/json_value.h"

namespace substep {

struct Metrics;
struct RunTimes;
struct Scene;
struct Settings;

/// Returns the settings as an object with the fields of settings_fields.h.
Json to_json(const Settings& settings);
Json to_json(const Metrics& metrics);
Json to_json(const RunTimes& times);

/// Returns the settings. Throws nlohmann's exceptions for a missing or wrong field, Error for an unknown
/// name.
Settings settings_in(const Json& json);
/// Throw Error for JSON that to_json() does not return.
Metrics metrics_in(const Json& json);
RunTimes times_in(const Json& json);

/// Returns the scene without its appearance, as it is simulated, complete enough for `info --json` and for
/// simulators that are commands: SI units, null for infinite. scenes/format.md documents it.
Json scene_json(const Scene& scene);

}  // namespace substep
