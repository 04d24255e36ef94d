#include "sim/loading/toml_values.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <variant>

#include "sim/error.h"

namespace substep {

toml::table TomlValues::parse() const {
  try {
    return toml::parse_file(file_.string());
  } catch (const toml::parse_error& error) {
    const auto line = error.source().begin.line;
    if (line == 0) throw Error("{}: cannot be read: {}", file_.string(), error.description());
    throw Error("{}:{}: {}", file_.string(), line, error.description());
  }
}

void TomlValues::fail(const toml::node& node, const std::string& what) const {
  throw Error("{}:{}: {}", file_.string(), node.source().begin.line, what);
}

void TomlValues::expect_keys(const toml::table& table, std::string_view where,
                             const std::vector<std::string_view>& known) const {
  for (const auto& [key, node] : table) {
    if (std::ranges::find(known, key.str()) != known.end()) continue;
    throw Error("{}:{}: unknown key '{}' in {}; known are {}", file_.string(), key.source().begin.line,
                key.str(), where, fmt::join(known, ", "));
  }
}

int TomlValues::integer(const toml::node& node, std::string_view key, int low, int high) const {
  const auto value = node.is_integer() ? node.value<std::int64_t>() : std::nullopt;
  if (!value || *value < low || *value > high) {
    fail(node, fmt::format("'{}' must be a whole number from {} to {}", key, low, high));
  }
  return static_cast<int>(*value);
}

std::string TomlValues::text(const toml::node& node, std::string_view key) const {
  if (!node.is_string()) fail(node, fmt::format("'{}' must be a string in quotes", key));
  return *node.value<std::string>();
}

void TomlValues::set_field(Settings& settings, const SettingsField& field, const toml::node& node) const {
  const bool is_real = std::holds_alternative<double Settings::*>(field.member);
  const bool is_number = is_real || std::holds_alternative<int Settings::*>(field.member);
  std::string text;
  if (!is_number && node.is_string()) text = *node.value<std::string>();
  if (is_number && node.is_integer()) text = fmt::to_string(*node.value<std::int64_t>());
  if (is_real && node.is_floating_point()) text = fmt::to_string(*node.value<double>());
  if (!set(settings, field, text)) fail(node, fmt::format("'{}' must be {}", field.name, kind_of(field)));
}

bool TomlValues::flag(const toml::node& node, std::string_view key) const {
  if (!node.is_boolean()) fail(node, fmt::format("'{}' must be true or false", key));
  return node.as_boolean()->get();
}

double TomlValues::positive(const toml::node& node, std::string_view key) const {
  const auto value = node.is_number() ? node.value<double>() : std::nullopt;
  if (!value || !(*value > 0 && *value < 1e6))
    fail(node, fmt::format("'{}' must be a number above 0 and below 1e6", key));
  return *value;
}

const toml::array& TomlValues::array(const toml::node& node, std::string_view key) const {
  if (!node.is_array() || node.as_array()->empty())
    fail(node, fmt::format("'{}' must be a list that is not empty", key));
  return *node.as_array();
}

const toml::table& TomlValues::table_in(const toml::node& node, std::string_view key) const {
  if (!node.is_table()) fail(node, fmt::format("'{}' must be a table", key));
  return *node.as_table();
}

std::vector<Algorithm> TomlValues::algorithms(const toml::node& node, std::string_view key) const {
  std::vector<Algorithm> result;
  for (const toml::node& entry : array(node, key)) {
    const auto algorithm = algorithm_named(text(entry, key));
    if (!algorithm) fail(entry, fmt::format("entries of '{}' must be a1, a2, a3, a4, a5, soft or avbd", key));
    result.push_back(*algorithm);
  }
  return result;
}

}  // namespace substep
