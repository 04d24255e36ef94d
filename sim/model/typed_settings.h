#pragma once
/// Settings as people type them and labels print them: "n=4,joints=stable,tau=0.6/0.9".

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sim/model/settings_fields.h"

namespace substep {

/// Keys and values, in the order typed.
using TypedSettings = std::vector<std::pair<std::string, std::string>>;

/// Splits "n=4,joints=stable". Throws Error where a part is no KEY=VALUE.
TypedSettings typed_settings_in(std::string_view text);

/// Returns true where `key` is the field's name ("substeps") or its symbol in labels ("n").
bool is_called(const SettingsField& field, std::string_view key);

/// Sets the fields from their texts without checking ranges. Their order does not matter: τ and κ of contacts
/// come last, since τ and κ of all rows reset them. "tau=0.6/0.9" sets τ of joints and of contacts. Throws
/// Error for a value that cannot be read, and for a key that is none of `fields`, which it lists.
void set_typed(Settings& settings, const TypedSettings& typed,
               const std::vector<const SettingsField*>& fields);

/// Explains all fields, one a line: key, symbol, meaning, range, default.
std::string settings_help();

}  // namespace substep
