#include "sim/loading/json_value.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "sim/loading/file_bytes.h"

namespace substep {
namespace {

std::string kind(const Json& value) {
  if (value.is_null()) return "null";
  return fmt::format("{} {}", value.is_object() || value.is_array() ? "an" : "a", value.type_name());
}

/// Finds a duplicate key or too deep nesting in a JSON text, without making values.
class JsonCheck : public nlohmann::detail::json_sax_acceptor<Json> {
 public:
  bool start_object(std::size_t) { return open(); }
  bool start_array(std::size_t) { return open(); }
  bool end_object() { return close(); }
  bool end_array() { return close(); }
  bool key(std::string& name) {
    last_ = name.substr(0, 60);
    if (keys_.back().insert(name).second) return true;
    fault = fmt::format("the key '{}' stands twice in one object", last_);
    return false;
  }

  std::string fault;  ///< empty: none

 private:
  bool open() {
    constexpr std::size_t deepest = 64;
    keys_.emplace_back();
    if (keys_.size() <= deepest) return true;
    fault = fmt::format("its JSON is nested deeper than {} levels after the key '{}'", deepest, last_);
    return false;
  }
  bool close() {
    keys_.pop_back();
    return true;
  }

  std::vector<std::set<std::string>> keys_;  ///< of each open object; empty for an array
  std::string last_;
};

}  // namespace

std::optional<JsonValue> JsonValue::find(const char* key) const {
  if (!value_->is_object()) fail("must be an object, but is {}", kind(*value_));
  const auto found = value_->find(key);
  if (found == value_->end()) return std::nullopt;
  return JsonValue(*found, *file_, path_ + '/' + key);
}

JsonValue JsonValue::require(const char* key) const {
  const std::optional<JsonValue> value = find(key);
  if (!value) fail("has no '{}', which it needs", key);
  return *value;
}

void JsonValue::allow_only(const std::vector<std::string_view>& known) const {
  if (!value_->is_object()) fail("must be an object, but is {}", kind(*value_));
  for (const auto& [key, unused] : value_->items()) {
    if (std::ranges::find(known, key) == known.end()) {
      fail("unknown key '{}'; known are {}", key, fmt::join(known, ", "));
    }
  }
}

void JsonValue::warn_of_unknown(const std::vector<std::string_view>& known) const {
  constexpr std::size_t longest = 60;
  if (!value_->is_object()) return;  // its reader refuses it
  for (const auto& [key, unused] : value_->items()) {
    const bool is_general = key == "name" || key == "extensions" || key == "extras";
    if (is_general || std::ranges::find(known, key) != known.end()) continue;
    warn("unknown key '{}' is ignored; known are {}", printable(key.substr(0, longest)),
         fmt::join(known, ", "));
  }
}

std::optional<JsonValue> JsonValue::settings() const {
  const std::optional<JsonValue> extras = find("extras");
  return extras && extras->json().is_object() ? extras->find("substep") : std::nullopt;
}

std::vector<JsonValue> JsonValue::items() const {
  if (!value_->is_array()) fail("must be an array, but is {}", kind(*value_));
  std::vector<JsonValue> items;
  items.reserve(value_->size());
  for (std::size_t i = 0; i < value_->size(); ++i) {
    items.emplace_back((*value_)[i], *file_, fmt::format("{}/{}", path_, i));
  }
  return items;
}

double JsonValue::number() const {
  if (!value_->is_number()) fail("must be a number, but is {}", kind(*value_));
  return value_->get<double>();  // finite: the parser refuses what overflows a double
}

double JsonValue::positive() const {
  const double value = number();
  if (!(value > 0)) fail("must be greater than 0, but is {}", value);
  return value;
}

double JsonValue::non_negative() const {
  const double value = number();
  if (!(value >= 0)) fail("must not be negative, but is {}", value);
  return value;
}

bool JsonValue::boolean() const {
  if (!value_->is_boolean()) fail("must be true or false, but is {}", kind(*value_));
  return value_->get<bool>();
}

const std::string& JsonValue::text() const {
  if (!value_->is_string()) fail("must be a string, but is {}", kind(*value_));
  return value_->get_ref<const std::string&>();
}

std::string JsonValue::name(const std::string& otherwise) const {
  constexpr std::size_t longest = 1000;  // bytes; every body, submesh and warning has a copy
  const std::optional<JsonValue> given = find("name");
  if (!given || given->text().empty()) return otherwise;
  if (given->text().size() > longest) {
    given->fail("has {} bytes; the longest name that is read has {}", given->text().size(), longest);
  }
  return printable(given->text());
}

std::uint64_t JsonValue::integer(std::uint64_t largest) const {
  if (!value_->is_number()) fail("must be a whole number, but is {}", kind(*value_));
  if (!value_->is_number_unsigned()) fail("must be a whole number from 0, but is {}", value_->dump());
  const auto value = value_->get<std::uint64_t>();
  if (value > largest) fail("is {}, which is more than {}", value, largest);
  return value;
}

int JsonValue::index(std::size_t size, const char* what) const {
  const std::uint64_t value = integer(~std::uint64_t{0});
  if (value >= size) fail("there is no {} {}: the file has {}", what, value, size);
  return static_cast<int>(value);
}

std::vector<double> JsonValue::numbers(std::size_t size, std::string_view what) const {
  if (!value_->is_array() || value_->size() != size) fail("must be an array of {} numbers{}", size, what);
  std::vector<double> numbers(size);
  for (std::size_t i = 0; i < size; ++i) {
    const Json& item = (*value_)[i];
    numbers[i] = item.is_number() ? item.get<double>() : items()[i].number();  // which fails
  }
  return numbers;
}

Quaternion JsonValue::rotation() const {
  Quaternion rotation(numbers(4, " (x, y, z, w)").data());
  const double length = rotation.norm();
  if (!(std::fabs(length - 1) < 0.01)) {
    fail("must be a unit quaternion (x, y, z, w), but its length is {}", length);
  }
  rotation.coeffs() /= length;
  return rotation;
}

Json parse_json(std::string_view text, const std::string& what) {
  JsonCheck check;
  Json::sax_parse(text, &check);
  if (!check.fault.empty()) throw Error(what + ": " + check.fault);
  return Json::parse(text);
}

}  // namespace substep
