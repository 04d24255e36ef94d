#pragma once
/// Settings as JSON, for sidecars of goldens and for records of sweeps: the fields of settings_fields.h.

#include <nlohmann/json.hpp>

#include "sim/model/settings.h"

namespace substep {

nlohmann::ordered_json to_json(const Settings& settings);

/// Throws nlohmann's exceptions where a field is missing or of another type, Error where it names nothing.
Settings settings_in(const nlohmann::ordered_json& json);

}  // namespace substep
