#pragma once
/// Converts metrics and times to JSON and back, for finished jobs of sweeps. Numbers that are not finite are
/// null, and read back as infinite.

#include <nlohmann/json.hpp>

#include "sim/measure/metrics.h"
#include "sim/measure/stage_times.h"

namespace substep {

nlohmann::ordered_json to_json(const Metrics& metrics);
nlohmann::ordered_json to_json(const RunTimes& times);

/// Throw Error for what the functions above would not have written.
Metrics metrics_in(const nlohmann::ordered_json& json);
RunTimes times_in(const nlohmann::ordered_json& json);

}  // namespace substep
