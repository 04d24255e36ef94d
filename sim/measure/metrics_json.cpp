#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <type_traits>
#include <utility>

#include "sim/error.h"
#include "sim/measure/json.h"
#include "sim/measure/metrics.h"
#include "sim/measure/stepper.h"
#include "sim/model/settings_fields.h"

namespace substep {
namespace {

/// Calls `field` with each key of the JSON and its member of Metrics.
template <typename Field>
void for_each_field(Metrics& x, const Field& field) {
  field("position", x.error.position);
  field("orientation", x.error.orientation);
  field("stepping_error", x.parts.stepping);
  field("solver_error", x.parts.solver);
  field("model_error", x.parts.model);
  field("residual", x.residual);
  field("row_solves", x.row_solves);
  field("joint_gap", x.joint_gap);
  field("penetration", x.penetration);
  field("energy_change", x.energy_change);
  field("energy_growth", x.energy_growth);
  field("energy_scale", x.energy_scale);
  field("moved", x.moved);
  field("momentum", x.momentum);
  field("angular_momentum", x.angular_momentum);
  field("passages", x.passages);
  field("diverged", x.diverged);
  field("bounded", x.bounded);
  field("expected", x.expected);
}

/// Calls `field` with each key of the JSON and its member of RunTimes.
template <typename Field>
void for_each_field(RunTimes& t, const Field& field) {
  field("median", t.median);
  field("smallest", t.smallest);
  field("largest", t.largest);
  field("repetitions", t.repetitions);
  field("s1", t.stages.geometry);
  field("s2", t.stages.formulation);
  field("s3", t.stages.velocities);
  field("s4", t.stages.coordinates);
}

constexpr std::array bound_keys{std::pair{Bound::equal, "value"}, std::pair{Bound::at_most, "at_most"},
                                std::pair{Bound::at_least, "at_least"}};

template <typename Value>
Json value_json(const Value& value) {
  return value;
}
Json value_json(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}
Json value_json(const std::optional<double>& value) {
  return value ? value_json(*value) : Json("none");
}
Json value_json(const Spread& value) {
  return {{"rms", value_json(value.rms)}, {"largest", value_json(value.largest)}};
}
Json value_json(const std::vector<ExpectedFigure>& expected) {
  Json list = Json::array();
  for (const ExpectedFigure& x : expected) {
    const auto* const bound =
        std::ranges::find(bound_keys, x.bound, [](const auto& pair) { return pair.first; });
    list.push_back({{"name", x.name},
                    {"unit", x.unit},
                    {bound->second, x.expected},
                    {"tolerance", x.tolerance},
                    {"measured", value_json(x.measured)},
                    {"error", value_json(x.error())}});
  }
  return list;
}

template <typename Value>
void read(const Json& json, Value& value) {
  json.get_to(value);
}
void read(const Json& json, double& value) {
  value = json.is_null() ? infinity : json.get<double>();
}
void read(const Json& json, std::optional<double>& value) {
  if (!json.is_string()) read(json, value.emplace());
}
void read(const Json& json, Spread& value) {
  read(json.at("rms"), value.rms);
  read(json.at("largest"), value.largest);
}
void read(const Json& list, std::vector<ExpectedFigure>& expected) {
  for (const Json& json : list) {
    ExpectedFigure& x = expected.emplace_back();
    json.at("name").get_to(x.name);
    json.at("unit").get_to(x.unit);
    const auto* const found =
        std::ranges::find_if(bound_keys, [&](const auto& pair) { return json.contains(pair.second); });
    const auto& [bound, key] = found == bound_keys.end() ? bound_keys.front() : *found;
    x.bound = bound;
    json.at(key).get_to(x.expected);
    json.at("tolerance").get_to(x.tolerance);
    read(json.at("measured"), x.measured);
  }
}

template <typename Object>
Json written(Object object) {
  Json json;
  for_each_field(object, [&](const char* key, const auto& value) { json[key] = value_json(value); });
  return json;
}

template <typename Object>
Object read_object(const Json& json) {
  Object object;
  try {
    for_each_field(object, [&](const char* key, auto& value) { read(json.at(key), value); });
  } catch (const Json::exception& error) {
    throw Error("not what a sweep wrote: {}", error.what());
  }
  return object;
}

}  // namespace

Json to_json(const Metrics& metrics) {
  return written(metrics);
}

Metrics metrics_in(const Json& json) {
  return read_object<Metrics>(json);
}

Json to_json(const RunTimes& times) {
  return written(times);
}

RunTimes times_in(const Json& json) {
  return read_object<RunTimes>(json);
}

Json to_json(const Settings& settings) {
  Json json;
  for (const SettingsField& field : settings_fields) {
    if (field.is_left_out(settings)) continue;
    std::visit(
        [&](auto member) {
          const auto value = settings.*member;
          if constexpr (std::is_enum_v<std::remove_const_t<decltype(value)>>) {
            json[std::string(field.name)] = name(value);
          } else {
            json[std::string(field.name)] = value;
          }
        },
        field.member);
  }
  return json;
}

Settings settings_in(const Json& json) {
  Settings settings;
  for (const SettingsField& field : settings_fields) {
    // Read older files, which lack the field, with its default.
    const bool may_lack = field.can_be_left_out || !field.overrides.empty();
    if (may_lack && !json.contains(std::string(field.name))) continue;
    const Json& value = json.at(std::string(field.name));
    std::visit(
        [&](auto member) {
          if constexpr (std::is_enum_v<std::remove_reference_t<decltype(settings.*member)>>) {
            if (set(settings, field, value.get<std::string>())) return;
            throw Error("'{}' must be {}", field.name, kind_of(field));
          } else {
            value.get_to(settings.*member);
          }
        },
        field.member);
  }
  return settings;
}

}  // namespace substep
