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

/// A value of any type, to count the members of Settings.
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
              "settings_fields and Settings have different numbers of fields");

/// Returns the value that the whole text is; nothing for any other text.
template <typename Value>
std::optional<Value> read(std::string_view text) {
  if constexpr (std::is_same_v<Value, Algorithm>) {
    return algorithm_named(text);
  } else if constexpr (std::is_same_v<Value, Joints>) {
    return joints_named(text);
  } else {
    Value value{};
    const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool is_all = end.ec == std::errc{} && end.ptr == text.data() + text.size();
    return is_all && std::isfinite(static_cast<double>(value)) ? std::optional(value) : std::nullopt;
  }
}

/// Returns the field of contacts that overrides this one; null where there is none.
const SettingsField* contacts_field_of(const SettingsField& field) {
  const auto found = std::ranges::find(settings_fields, field.name, &SettingsField::overrides);
  return found == settings_fields.end() ? nullptr : &*found;
}

/// Resets contacts' values in the group of a field of all rows to 0, which stands for the field's value.
void set_for_all(Settings& settings, const SettingsField& field) {
  if (!contacts_field_of(field)) return;
  for (const SettingsField& other : settings_fields) {
    if (other.label.group == field.label.group && !other.overrides.empty())
      settings.*std::get<double Settings::*>(other.member) = 0;
  }
}

/// Returns the field's symbol in labels without its "="; empty where it has none.
std::string_view short_key(const SettingsField& field) {
  const std::string_view symbol = field.label.symbol;
  return symbol.substr(0, std::max<std::size_t>(symbol.size(), 1) - 1);
}

/// Splits values of joints and of contacts, and puts the fields that reset others first.
std::vector<std::pair<const SettingsField*, std::string>> ordered(
    const TypedSettings& typed, const std::vector<const SettingsField*>& fields) {
  std::vector<std::pair<const SettingsField*, std::string>> of_all;
  std::vector<std::pair<const SettingsField*, std::string>> of_contacts;
  for (const auto& setting : typed) {
    const std::string& key = setting.first;
    const std::string& value = setting.second;
    const auto found =
        std::ranges::find_if(fields, [&](const SettingsField* field) { return is_called(*field, key); });
    if (found == fields.end()) {
      std::string known;
      for (const SettingsField* field : fields)
        known += fmt::format("{}{}", known.empty() ? "" : ", ", field->name);
      throw Error("'{}': give some of {}", key, known);
    }
    const SettingsField* const contacts = contacts_field_of(**found);
    const std::size_t slash = contacts ? value.find('/') : std::string::npos;
    if (contacts && slash != value.rfind('/'))
      throw Error("'{}={}': give a number, or two as in 0.6/0.9", key, value);
    ((*found)->overrides.empty() ? of_all : of_contacts).emplace_back(*found, value.substr(0, slash));
    if (slash != std::string::npos) of_contacts.emplace_back(contacts, value.substr(slash + 1));
  }
  of_all.insert(of_all.end(), of_contacts.begin(), of_contacts.end());
  for (const auto& setting : of_all) {
    if (std::ranges::count(of_all, setting.first, [](const auto& other) { return other.first; }) > 1)
      throw Error("'{}': is given twice", setting.first->name);
  }
  return of_all;
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
  const auto set_member = [&](auto member) {
    const auto value = read<std::remove_reference_t<decltype(settings.*member)>>(text);
    if (value) settings.*member = *value;
    return value.has_value();
  };
  const bool is_read = std::visit(set_member, field.member);
  if (is_read) set_for_all(settings, field);
  return is_read;
}

std::optional<double> fraction_in(std::string_view text) {
  const std::size_t slash = text.find('/');
  const auto numerator = read<double>(text.substr(0, slash));
  const auto denominator = read<double>(slash == std::string_view::npos ? "1" : text.substr(slash + 1));
  if (!numerator || !denominator || *denominator == 0) return std::nullopt;
  return *numerator / *denominator;
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
  if (std::holds_alternative<int Settings::*>(field.member)) return "a whole number";
  if (std::holds_alternative<Algorithm Settings::*>(field.member)) return "a1, a2, a3, a4, a5, soft or avbd";
  if (std::holds_alternative<Joints Settings::*>(field.member)) return "rows, plain or stable";
  return "a number";
}

const SettingsField& field_named(std::string_view name) {
  const auto found = std::ranges::find(settings_fields, name, &SettingsField::name);
  if (found == settings_fields.end()) throw Error("settings have no '{}'", name);
  return *found;
}

TypedSettings typed_settings_in(std::string_view text) {
  TypedSettings typed;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(','), text.size());
    const std::string_view setting = text.substr(0, end);
    const std::size_t equals = setting.find('=');
    if (equals == std::string_view::npos) throw Error("'{}': give KEY=VALUE", setting);
    typed.emplace_back(setting.substr(0, equals), setting.substr(equals + 1));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return typed;
}

bool is_called(const SettingsField& field, std::string_view key) {
  return key == field.name || (!key.empty() && key == short_key(field));
}

void set_typed(Settings& settings, const TypedSettings& typed,
               const std::vector<const SettingsField*>& fields) {
  for (const auto& [field, value] : ordered(typed, fields)) {
    if (set_typed(settings, *field, value)) continue;
    throw Error("'{}={}': give {}", field->name, value, kind_of(*field));
  }
}

std::string settings_help() {
  std::string text =
      R"(Settings of solving. --algorithm, --step and --substeps are options of their own; all but the algorithm
can be given in --set KEY=VALUE,KEY=VALUE as labels print them: --set n=4,joints=stable,tau=0.6/0.9. Panels
of films and players take the same keys: --panel a5,n=4. τ and κ take a second value, of contacts, after a
slash; in other numbers a slash is a fraction: step=1/60.

)";
  for (const SettingsField& field : settings_fields) {
    const bool is_number = !std::holds_alternative<Algorithm Settings::*>(field.member) &&
                           !std::holds_alternative<Joints Settings::*>(field.member);
    const std::string usual =
        field.usual.empty() ? text_of(default_settings(Algorithm::a5), field) : std::string(field.usual);
    text += fmt::format("  {:<14}{:<10}{}\n{:26}{}{}; default {}\n", field.name, short_key(field), field.help,
                        "", kind_of(field), is_number ? fmt::format(" {}", field.range.text()) : "", usual);
  }
  return text;
}

}  // namespace substep
