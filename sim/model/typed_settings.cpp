#include "sim/model/typed_settings.h"

#include <fmt/format.h>

#include <algorithm>

#include "sim/error.h"

namespace substep {
namespace {

/// The field of contacts that stands in for this one; null where there is none.
const SettingsField* contacts_field_of(const SettingsField& field) {
  const auto found = std::ranges::find(settings_fields, field.name, &SettingsField::stands_in_for);
  return found == settings_fields.end() ? nullptr : &*found;
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
      throw Error(fmt::format("'{}': give some of {}", key, known));
    }
    const SettingsField* const contacts = contacts_field_of(**found);
    const std::size_t slash = contacts ? value.find('/') : std::string::npos;
    ((*found)->stands_in_for.empty() ? of_all : of_contacts).emplace_back(*found, value.substr(0, slash));
    if (slash != std::string::npos) of_contacts.emplace_back(contacts, value.substr(slash + 1));
  }
  of_all.insert(of_all.end(), of_contacts.begin(), of_contacts.end());
  return of_all;
}

}  // namespace

TypedSettings typed_settings_in(std::string_view text) {
  TypedSettings typed;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(','), text.size());
    const std::string_view word = text.substr(0, end);
    const std::size_t equals = word.find('=');
    if (equals == std::string_view::npos) throw Error(fmt::format("'{}': give KEY=VALUE", word));
    typed.emplace_back(word.substr(0, equals), word.substr(equals + 1));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return typed;
}

bool is_called(const SettingsField& field, std::string_view key) {
  return key == field.name ||
         (field.symbol.size() > 1 && key == field.symbol.substr(0, field.symbol.size() - 1));
}

void set_typed(Settings& settings, const TypedSettings& typed,
               const std::vector<const SettingsField*>& fields) {
  for (const auto& [field, value] : ordered(typed, fields)) {
    if (set_typed(settings, *field, value)) continue;
    throw Error(fmt::format("'{}={}': give {}", field->name, value, kind_of(*field)));
  }
}

std::string settings_help() {
  std::string text =
      "Settings of solving. --algorithm, --step and --substeps are options of their own; all can be given "
      "in\n"
      "--set KEY=VALUE,KEY=VALUE as labels print them: --set n=4,joints=stable,tau=0.6/0.9. Panels of films "
      "and\n"
      "players take the same keys: --panel a5,n=4. A value after a slash is that of contacts.\n\n";
  for (const SettingsField& field : settings_fields) {
    const std::string symbol(field.symbol.size() > 1 ? field.symbol.substr(0, field.symbol.size() - 1) : "");
    const bool is_number = !std::holds_alternative<Algorithm Settings::*>(field.member) &&
                           !std::holds_alternative<Joints Settings::*>(field.member);
    const std::string usual =
        field.usual.empty() ? text_of(default_settings(Algorithm::a5), field) : std::string(field.usual);
    text += fmt::format("  {:<14}{:<4}{}\n{:20}{}{}; default {}\n", field.name, symbol, field.help, "",
                        kind_of(field), is_number ? fmt::format(" {}", field.range.text()) : "", usual);
  }
  return text;
}

}  // namespace substep
