#include "sim/measure/settings_json.h"

#include <fmt/format.h>

#include <string>
#include <type_traits>

#include "sim/error.h"
#include "sim/model/settings_fields.h"

namespace substep {

nlohmann::ordered_json to_json(const Settings& settings) {
  nlohmann::ordered_json json;
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

Settings settings_in(const nlohmann::ordered_json& json) {
  Settings settings;
  for (const SettingsField& field : settings_fields) {
    // Files from before there was the field go on being read: it is as in Settings{}.
    const bool may_lack = field.can_be_left_out || !field.stands_in_for.empty();
    if (may_lack && !json.contains(std::string(field.name))) continue;
    const nlohmann::ordered_json& value = json.at(std::string(field.name));
    std::visit(
        [&](auto member) {
          if constexpr (std::is_enum_v<std::remove_reference_t<decltype(settings.*member)>>) {
            if (set(settings, field, value.get<std::string>())) return;
            throw Error(fmt::format("'{}' must be {}", field.name, kind_of(field)));
          } else {
            value.get_to(settings.*member);
          }
        },
        field.member);
  }
  return settings;
}

}  // namespace substep
