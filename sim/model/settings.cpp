#include "sim/model/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/error.h"
#include "sim/model/settings_fields.h"

namespace substep {
namespace {

// In the order of the enumerators.
constexpr std::array<std::string_view, 7> algorithm_names{"a1", "a2", "a3", "a4", "a5", "soft", "avbd"};
constexpr std::array<std::string_view, 7> algorithm_titles{"A1", "A2", "A3", "A4", "A5", "Soft Step", "AVBD"};
constexpr std::array<std::string_view, 3> joints_names{"rows", "plain", "stable"};

/// Returns the enumerator that has the name.
template <typename Value, std::size_t count>
std::optional<Value> named(const std::array<std::string_view, count>& names, std::string_view text) {
  const auto found = std::ranges::find(names, text);
  if (found == names.end()) return std::nullopt;
  return static_cast<Value>(found - names.begin());
}

std::string step_label(double step) {
  const double rate = 1 / step;
  if (std::abs(rate - std::round(rate)) < 1e-9 * rate) return fmt::format("h=1/{:.0f}", rate);
  return fmt::format("h={:g}", step);
}

/// Returns true where labels show the field: a field of its group differs from Settings{}.
bool is_labelled(const Settings& settings, const SettingsField& field) {
  if (field.label.group == 0) return true;
  return std::ranges::any_of(settings_fields, [&](const SettingsField& other) {
    return other.label.group == field.label.group && text_of(settings, other) != text_of(Settings{}, other);
  });
}

/// Returns text_of() with six digits.
std::string short_text(const Settings& settings, const SettingsField& field) {
  const auto* const number = std::get_if<double Settings::*>(&field.member);
  return number ? fmt::format("{:g}", settings.**number) : text_of(settings, field);
}

/// Returns short_text(), with the contacts' own value: "0.6/0.9".
std::string with_contacts(const Settings& settings, const SettingsField& field) {
  std::string text = short_text(settings, field);
  for (const SettingsField& other : settings_fields) {
    if (other.overrides == field.name && text_of(settings, other) != text_of(Settings{}, other))
      text += fmt::format("{}{}", other.label.symbol, short_text(settings, other));
  }
  return text;
}

}  // namespace

Settings default_settings(Algorithm algorithm) {
  constexpr int solves = 10;
  Settings settings;
  settings.algorithm = algorithm;
  settings.substeps = solves;
  settings.iterations = algorithm == Algorithm::a2 ? solves : 1;
  settings.tau = 0.6;
  settings.contact_tau = 0.9;
  settings.contact_kappa = 0.7;
  settings.joints = Joints::stable;
  if (algorithm == Algorithm::soft) settings.substeps = 4;
  if (algorithm == Algorithm::avbd) settings.iterations = solves;
  return settings;
}

Settings divided(Settings settings, int n) {
  if (settings.algorithm == Algorithm::avbd) {
    settings.iterations = n;
  } else if (settings.algorithm >= Algorithm::a3) {
    settings.substeps = n;
  } else {
    settings.step /= n;
  }
  return settings;
}

double sub_step_of(const Settings& settings) {
  return field_named("substeps").is_read_by(settings.algorithm) ? settings.step / settings.substeps
                                                                : settings.step;
}

std::string_view name(Algorithm algorithm) {
  return algorithm_names[static_cast<std::size_t>(algorithm)];
}

std::string_view title_of(Algorithm algorithm) {
  return algorithm_titles[static_cast<std::size_t>(algorithm)];
}

std::string_view name(Joints joints) {
  return joints_names[static_cast<std::size_t>(joints)];
}

std::optional<Algorithm> algorithm_named(std::string_view text) {
  const auto typed = named<Algorithm>(algorithm_names, text);
  return typed ? typed : named<Algorithm>(algorithm_titles, text);
}

std::optional<Joints> joints_named(std::string_view text) {
  return named<Joints>(joints_names, text);
}

void check(const Settings& settings) {
  for (const SettingsField& field : settings_fields) {
    if (field.is_left_out(settings)) continue;
    if (field.can_be_left_out && !field.is_read_by(settings.algorithm)) {
      throw Error("{} {}: {} does not read it", field.name, text_of(settings, field),
                  title_of(settings.algorithm));
    }
    const auto require = [&](auto value) {
      if (field.range.contains(value)) return;
      throw Error("{} {}: must be {}", field.name, value, field.range.text());
    };
    if (const auto* const number = std::get_if<double Settings::*>(&field.member)) require(settings.**number);
    if (const auto* const count = std::get_if<int Settings::*>(&field.member)) require(settings.**count);
  }
}

std::vector<SettingsPart> parts_of(const Settings& settings) {
  std::vector<SettingsPart> parts;
  for (const SettingsField& field : settings_fields) {
    if (field.name == "algorithm" || field.name == "step" || !field.overrides.empty()) continue;
    if (!field.is_read_by(settings.algorithm) || !is_labelled(settings, field)) continue;
    parts.push_back({&field, fmt::format("{}{}", field.label.symbol, with_contacts(settings, field))});
  }
  parts.push_back({&field_named("step"), step_label(settings.step)});
  return parts;
}

std::string label(const Settings& settings) {
  std::string text = fmt::format("{}  ", title_of(settings.algorithm));
  for (const SettingsPart& part : parts_of(settings)) {
    if (!text.ends_with("  ")) text += part.field->name == "step" ? "  " : " ";
    text += part.text;
  }
  return text;
}

std::string tau_text(const Settings& settings) {
  return with_contacts(settings, field_named("tau"));
}

std::string kappa_text(const Settings& settings) {
  return with_contacts(settings, field_named("kappa"));
}

}  // namespace substep
