#include "sim/model/settings_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <type_traits>
#include <utility>

#include "sim/error.h"

namespace substep {
namespace {

/// Stands for a value of any type, to count what Settings takes.
struct AnyValue {
  template <typename Value>
  operator Value() const;  // NOLINT: never called
};

template <std::size_t... i>
constexpr bool has_fields(std::index_sequence<i...> /*count*/) {
  return requires {
    Settings{(static_cast<void>(i), AnyValue{})...};
  };
}

static_assert(has_fields(std::make_index_sequence<settings_fields.size()>{}) &&
                  !has_fields(std::make_index_sequence<settings_fields.size() + 1>{}),
              "settings_fields lists other fields than Settings has");

template <typename Value>
bool read(std::string_view text, Value& value) {
  Value result{};
  const auto end = std::from_chars(text.data(), text.data() + text.size(), result);
  if (end.ec != std::errc{} || end.ptr != text.data() + text.size()) return false;
  if (!std::isfinite(static_cast<double>(result))) return false;
  value = result;
  return true;
}

template <typename Value>
bool choose(const std::optional<Value>& chosen, Value& value) {
  if (chosen) value = *chosen;
  return chosen.has_value();
}

bool read(std::string_view text, Algorithm& value) {
  return choose(algorithm_named(text), value);
}
bool read(std::string_view text, Joints& value) {
  return choose(joints_named(text), value);
}

/// After the field was set by its name.
void set_for_all(Settings& settings, const SettingsField& field) {
  if (std::ranges::none_of(settings_fields,
                           [&](const SettingsField& other) { return other.stands_in_for == field.name; }))
    return;
  for (const SettingsField& other : settings_fields) {
    if (other.group == field.group && !other.stands_in_for.empty())
      settings.*std::get<double Settings::*>(other.member) = 0;
  }
}

std::string kind_of(double /*value*/) {
  return "a number";
}
std::string kind_of(int /*value*/) {
  return "a whole number";
}
std::string kind_of(Algorithm /*value*/) {
  return "a1, a2, a3, a4, a5, soft or avbd";
}
std::string kind_of(Joints /*value*/) {
  return "rows, plain or stable";
}

}  // namespace

bool SettingsField::Range::contains(double value) const {
  return (value > low || (has_low && value == low)) && (value < high || (has_high && value == high));
}

bool SettingsField::is_left_out(const Settings& settings) const {
  return can_be_left_out && text_of(settings, *this) == text_of(Settings{}, *this);
}

std::string SettingsField::Range::text() const {
  if (has_low && has_high && std::isfinite(high)) return fmt::format("from {} to {}{}", low, high, unit);
  std::string text = fmt::format("{} {}", has_low ? "at least" : "above", low);
  if (std::isfinite(high)) text += fmt::format(" and {} {}", has_high ? "at most" : "below", high);
  return fmt::format("{}{}", text, unit);
}

std::string text_of(const Settings& settings, const SettingsField& field) {
  return std::visit(
      [&](auto member) -> std::string {
        const auto value = settings.*member;
        if constexpr (std::is_enum_v<std::remove_const_t<decltype(value)>>) {
          return std::string(name(value));
        } else {
          return fmt::format("{}", value);
        }
      },
      field.member);
}

bool set(Settings& settings, const SettingsField& field, std::string_view text) {
  const bool is_read = std::visit([&](auto member) { return read(text, settings.*member); }, field.member);
  if (is_read) set_for_all(settings, field);
  return is_read;
}

std::optional<double> fraction_in(std::string_view text) {
  const std::size_t slash = text.find('/');
  double above = 0;
  double below = 1;
  if (!read(text.substr(0, slash), above)) return std::nullopt;
  if (slash != std::string_view::npos && !read(text.substr(slash + 1), below)) return std::nullopt;
  if (below == 0) return std::nullopt;
  return above / below;
}

bool set_typed(Settings& settings, const SettingsField& field, std::string_view text) {
  const auto* const number = std::get_if<double Settings::*>(&field.member);
  if (number == nullptr) return set(settings, field, text);
  const auto value = fraction_in(text);
  if (!value) return false;
  settings.** number = *value;
  set_for_all(settings, field);
  return true;
}

void copy(Settings& settings, const SettingsField& field, const Settings& from) {
  std::visit([&](auto member) { settings.*member = from.*member; }, field.member);
  set_for_all(settings, field);
}

std::string kind_of(const SettingsField& field) {
  return std::visit([](auto member) { return kind_of(Settings{}.*member); }, field.member);
}

const SettingsField& field_named(std::string_view name) {
  const auto found = std::ranges::find(settings_fields, name, &SettingsField::name);
  if (found == settings_fields.end()) throw Error(fmt::format("settings have no '{}'", name));
  return *found;
}

}  // namespace substep
