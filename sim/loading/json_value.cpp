#include "sim/loading/json_value.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/error.h"
#include "sim/loading/file_bytes.h"

namespace substep {
namespace {

std::string kind(const nlohmann::json& value) {
  if (value.is_null()) return "null";
  return fmt::format("{} {}", value.is_object() || value.is_array() ? "an" : "a", value.type_name());
}

}  // namespace

void JsonValue::fail(const std::string& what) const {
  throw Error(fmt::format("{}: {}: {}", *file_, path_.empty() ? "/" : path_, what));
}

std::optional<JsonValue> JsonValue::find(const char* key) const {
  if (!value_->is_object()) fail("must be an object, but is " + kind(*value_));
  const auto found = value_->find(key);
  if (found == value_->end()) return std::nullopt;
  std::string path;
  path.reserve(path_.size() + 1 + found.key().size());
  path.append(path_).append(1, '/').append(key);
  return JsonValue(*found, *file_, std::move(path));
}

JsonValue JsonValue::require(const char* key) const {
  const std::optional<JsonValue> value = find(key);
  if (!value) fail(fmt::format("has no '{}', which it needs", key));
  return *value;
}

void JsonValue::allow_only(const std::vector<std::string_view>& known) const {
  if (!value_->is_object()) fail("must be an object, but is " + kind(*value_));
  for (const auto& [key, unused] : value_->items()) {
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      fail(fmt::format("unknown key '{}'; known are {}", key, fmt::join(known, ", ")));
    }
  }
}

void JsonValue::warn_of_unknown(const std::vector<std::string_view>& known,
                                std::vector<std::string>& warnings) const {
  constexpr std::array<std::string_view, 3> general{"name", "extensions", "extras"};
  constexpr std::size_t longest = 60;
  if (!value_->is_object()) return;  // its reader refuses it
  for (const auto& [key, unused] : value_->items()) {
    if (std::ranges::find(known, key) != known.end() || std::ranges::find(general, key) != general.end())
      continue;
    warnings.push_back(fmt::format("{}: unknown key '{}' is ignored; known are {}", path_,
                                   printable(key.substr(0, longest)), fmt::join(known, ", ")));
  }
}

std::optional<JsonValue> JsonValue::extension(const char* name) const {
  const std::optional<JsonValue> extensions = find("extensions");
  return extensions ? extensions->find(name) : std::nullopt;
}

std::vector<JsonValue> JsonValue::items() const {
  if (!value_->is_array()) fail("must be an array, but is " + kind(*value_));
  std::vector<JsonValue> items;
  items.reserve(value_->size());
  for (std::size_t i = 0; i < value_->size(); ++i) {
    items.emplace_back((*value_)[i], *file_, fmt::format("{}/{}", path_, i));
  }
  return items;
}

double JsonValue::number() const {
  if (!value_->is_number()) fail("must be a number, but is " + kind(*value_));
  return value_->get<double>();  // finite: the parser refuses what overflows a double
}

double JsonValue::number_at(std::size_t index) const {
  const nlohmann::json& item = (*value_)[index];
  if (!item.is_number()) items()[index].number();  // fails and names the place
  return item.get<double>();
}

double JsonValue::positive() const {
  const double value = number();
  if (!(value > 0)) fail(fmt::format("must be greater than 0, but is {}", value));
  return value;
}

double JsonValue::non_negative() const {
  const double value = number();
  if (!(value >= 0)) fail(fmt::format("must not be negative, but is {}", value));
  return value;
}

bool JsonValue::boolean() const {
  if (!value_->is_boolean()) fail("must be true or false, but is " + kind(*value_));
  return value_->get<bool>();
}

const std::string& JsonValue::text() const {
  if (!value_->is_string()) fail("must be a string, but is " + kind(*value_));
  return value_->get_ref<const std::string&>();
}

std::string JsonValue::name(const std::string& otherwise) const {
  constexpr std::size_t longest = 1000;  // bytes; every body, piece and warning has a copy
  const std::optional<JsonValue> given = find("name");
  if (!given || given->text().empty()) return otherwise;
  if (given->text().size() > longest) {
    given->fail(
        fmt::format("has {} bytes; the longest name that is read has {}", given->text().size(), longest));
  }
  return printable(given->text());
}

std::uint64_t JsonValue::integer(std::uint64_t largest) const {
  if (!value_->is_number_unsigned()) {
    if (value_->is_number()) fail(fmt::format("must be a whole number from 0, but is {}", value_->dump()));
    fail("must be a whole number, but is " + kind(*value_));
  }
  const std::uint64_t value = value_->get<std::uint64_t>();
  if (value > largest) fail(fmt::format("is {}, which is more than {}", value, largest));
  return value;
}

int JsonValue::index(std::size_t size, const char* what) const {
  const std::uint64_t value = integer(~std::uint64_t{0});
  if (value >= size) fail(fmt::format("there is no {} {}: the file has {}", what, value, size));
  return static_cast<int>(value);
}

Vector3 JsonValue::vector3() const {
  if (!value_->is_array() || value_->size() != 3) fail("must be an array of 3 numbers");
  return {number_at(0), number_at(1), number_at(2)};
}

Quaternion JsonValue::rotation() const {
  if (!value_->is_array() || value_->size() != 4) fail("must be an array of 4 numbers (x, y, z, w)");
  Quaternion rotation(number_at(3), number_at(0), number_at(1), number_at(2));
  const double length = rotation.norm();
  if (!(std::fabs(length - 1) < 0.01)) {
    fail(fmt::format("must be a unit quaternion (x, y, z, w), but its length is {}", length));
  }
  rotation.coeffs() /= length;
  return rotation;
}

}  // namespace substep
