#include "sim/model/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>
#include <utility>

#include "sim/error.h"
#include "sim/model/settings_fields.h"

namespace substep {
namespace {

constexpr std::array<std::pair<Algorithm, std::string_view>, 7> algorithm_names{{{Algorithm::a1, "a1"},
                                                                                 {Algorithm::a2, "a2"},
                                                                                 {Algorithm::a3, "a3"},
                                                                                 {Algorithm::a4, "a4"},
                                                                                 {Algorithm::a5, "a5"},
                                                                                 {Algorithm::soft, "soft"},
                                                                                 {Algorithm::avbd, "avbd"}}};
constexpr std::array<std::pair<Algorithm, std::string_view>, 7> algorithm_titles{
    {{Algorithm::a1, "A1"},
     {Algorithm::a2, "A2"},
     {Algorithm::a3, "A3"},
     {Algorithm::a4, "A4"},
     {Algorithm::a5, "A5"},
     {Algorithm::soft, "Soft Step"},
     {Algorithm::avbd, "AVBD"}}};
constexpr std::array<std::pair<Joints, std::string_view>, 3> joints_names{
    {{Joints::rows, "rows"}, {Joints::plain, "plain"}, {Joints::stable, "stable"}}};

template <typename Names, typename Value>
std::string_view name_in(const Names& names, Value value) {
  for (const auto& [candidate, text] : names) {
    if (candidate == value) return text;
  }
  return "?";
}

std::string step_label(double step) {
  const double rate = 1 / step;
  if (std::abs(rate - std::round(rate)) < 1e-9 * rate) return fmt::format("h=1/{:.0f}", rate);
  return fmt::format("h={:g}", step);
}

/// Returns true where a label has the field: it, or another of its group, differs from Settings{}.
bool is_said(const Settings& settings, const SettingsField& field) {
  if (field.group == 0) return true;
  return std::ranges::any_of(settings_fields, [&](const SettingsField& other) {
    return other.group == field.group && text_of(settings, other) != text_of(Settings{}, other);
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
    if (other.stands_in_for == field.name && text_of(settings, other) != text_of(Settings{}, other))
      text += fmt::format("{}{}", other.symbol, short_text(settings, other));
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
  return name_in(algorithm_names, algorithm);
}

std::string_view title_of(Algorithm algorithm) {
  return name_in(algorithm_titles, algorithm);
}
std::string_view name(Joints joints) {
  return name_in(joints_names, joints);
}

std::optional<Algorithm> algorithm_named(std::string_view text) {
  for (const auto& names : {algorithm_names, algorithm_titles}) {
    for (const auto& [value, candidate] : names) {
      if (candidate == text) return value;
    }
  }
  return std::nullopt;
}

std::optional<Joints> joints_named(std::string_view text) {
  for (const auto& [value, candidate] : joints_names) {
    if (candidate == text) return value;
  }
  return std::nullopt;
}

void check(const Settings& settings) {
  for (const SettingsField& field : settings_fields) {
    if (field.is_left_out(settings)) continue;
    if (field.can_be_left_out && !field.is_read_by(settings.algorithm)) {
      throw Error(fmt::format("{} {}: {} does not read it", field.name, text_of(settings, field),
                              title_of(settings.algorithm)));
    }
    std::visit(
        [&](auto member) {
          const auto value = settings.*member;
          if constexpr (std::is_arithmetic_v<std::remove_const_t<decltype(value)>>) {
            if (field.range.contains(value)) return;
            throw Error(fmt::format("{} {}: must be {}", field.name, value, field.range.text()));
          }
        },
        field.member);
  }
}

std::vector<SettingsPart> parts_of(const Settings& settings) {
  std::vector<SettingsPart> parts;
  for (const SettingsField& field : settings_fields) {
    if (field.name == "algorithm" || field.name == "step" || !field.stands_in_for.empty()) continue;
    if (!field.is_read_by(settings.algorithm) || !is_said(settings, field)) continue;
    parts.push_back({&field, fmt::format("{}{}", field.symbol, with_contacts(settings, field))});
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
