#pragma once
/// A value of a JSON document with its path, which every message names.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/math/vector.h"

namespace substep {

/// All readers throw Error ("scene.gltf: /nodes/3/mesh: …") when the value is not what they return. The
/// document and the file name must outlive it.
class JsonValue {
 public:
  JsonValue(const nlohmann::json& value, const std::string& file, std::string path = "")
      : value_(&value), file_(&file), path_(std::move(path)) {}

  [[noreturn]] void fail(const std::string& what) const;

  const nlohmann::json& json() const { return *value_; }
  const std::string& path() const { return path_; }
  const std::string& file() const { return *file_; }

  /// Of an object.
  std::optional<JsonValue> find(const char* key) const;
  JsonValue require(const char* key) const;
  /// Fails when the object has a key that is not among `known`.
  void allow_only(const std::vector<std::string_view>& known) const;
  /// Warns of each key that is not among `known`, `name`, `extensions` and `extras`.
  void warn_of_unknown(const std::vector<std::string_view>& known, std::vector<std::string>& warnings) const;
  /// Returns the object `extensions/<name>`, if the value has it.
  std::optional<JsonValue> extension(const char* name) const;

  /// Of an array.
  std::vector<JsonValue> items() const;

  double number() const;
  double positive() const;
  double non_negative() const;
  bool boolean() const;
  const std::string& text() const;
  /// Returns the object's `name` without control characters; `otherwise` where it is absent or empty.
  std::string name(const std::string& otherwise) const;
  std::uint64_t integer(std::uint64_t largest) const;
  /// Reads an index into a list of `size` items, which messages call `what`.
  int index(std::size_t size, const char* what) const;
  Vector3 vector3() const;
  /// Reads x, y, z, w as in glTF. Its length may be off by 1 %, as truncated decimals are, and is set to 1.
  Quaternion rotation() const;

 private:
  double number_at(std::size_t index) const;

  const nlohmann::json* value_;
  const std::string* file_;
  std::string path_;
};

/// Returns `key` of `object` as `reader` reads it, or `otherwise` where it is absent.
template <typename Type>
Type get(const JsonValue& object, const char* key, Type otherwise, Type (JsonValue::*reader)() const) {
  const std::optional<JsonValue> value = object.find(key);
  return value ? ((*value).*reader)() : otherwise;
}

}  // namespace substep
