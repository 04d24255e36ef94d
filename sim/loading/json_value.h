#pragma once
/// A value of a JSON document with its path, which every message names, and a strict parser.

#include <fmt/format.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sim/error.h"
#include "sim/math/vector.h"

namespace substep {

/// A JSON document, whose objects keep the order of their keys.
using Json = nlohmann::ordered_json;

/// The file that JSON values are read from.
struct JsonFile {
  std::string name;                   ///< as messages name it
  std::vector<std::string> warnings;  ///< in the order in which values are read
};

/// A value and its path. All readers throw Error ("scene.gltf: /nodes/3/mesh: …") when the value is not what
/// they return. The document and the file must outlive it.
class JsonValue {
 public:
  JsonValue(const Json& value, JsonFile& file, std::string path = "")
      : value_(&value), file_(&file), path_(std::move(path)) {}

  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> text, Args&&... args) const {
    throw Error(place() + ": " + fmt::format(text, std::forward<Args>(args)...));
  }
  template <typename... Args>
  void warn(fmt::format_string<Args...> text, Args&&... args) const {
    file_->warnings.push_back(path_ + ": " + fmt::format(text, std::forward<Args>(args)...));
  }

  const Json& json() const { return *value_; }
  const std::string& path() const { return path_; }
  /// Returns another value under the same path.
  JsonValue with(const Json& value) const { return {value, *file_, path_}; }
  /// Returns file and path, with which messages begin.
  std::string place() const { return file_->name + ": " + (path_.empty() ? "/" : path_); }

  // These read an object.
  std::optional<JsonValue> find(const char* key) const;
  JsonValue require(const char* key) const;
  /// Throws Error where the object has a key that is not among `known`.
  void allow_only(const std::vector<std::string_view>& known) const;
  /// Warns of each key that is not among `known`, `name`, `extensions` and `extras`.
  void warn_of_unknown(const std::vector<std::string_view>& known) const;
  /// Returns the object `extensions/<name>`, if the value has it.
  std::optional<JsonValue> extension(const char* name) const {
    const std::optional<JsonValue> extensions = find("extensions");
    return extensions ? extensions->find(name) : std::nullopt;
  }
  /// Returns the object `extras/substep`, if the value has it. Other programs may keep anything in extras.
  std::optional<JsonValue> settings() const;
  /// Returns the items of the array `key`; none where it is absent.
  std::vector<JsonValue> items(const char* key) const {
    const std::optional<JsonValue> list = find(key);
    return list ? list->items() : std::vector<JsonValue>{};
  }
  /// Returns `key` as `reader` reads it, or `otherwise` where it is absent.
  template <typename Type>
  Type get(const char* key, Type otherwise, Type (JsonValue::*reader)() const) const {
    const std::optional<JsonValue> value = find(key);
    return value ? ((*value).*reader)() : otherwise;
  }
  /// Sets `target` to `key` as `reader` reads it; leaves it where the key is absent.
  template <typename Target, typename Type>
  void read(const char* key, Target& target, Type (JsonValue::*reader)() const) const {
    if (const std::optional<JsonValue> value = find(key)) target = ((*value).*reader)();
  }

  /// Returns the items of an array.
  std::vector<JsonValue> items() const;

  double number() const;
  double positive() const;
  double non_negative() const;
  bool boolean() const;
  const std::string& text() const;
  /// Returns the value that the text names among `choices`.
  template <typename Type>
  Type one_of(const std::vector<std::pair<const char*, Type>>& choices) const {
    std::string known;
    for (const auto& [name, value] : choices) {
      if (text() == name) return value;
      known += fmt::format("{}{}", known.empty() ? "" : ", ", name);
    }
    fail("unknown '{}'; known are {}", text(), known);
  }
  /// Returns the object's `name` without control characters; `otherwise` where it is absent or empty.
  std::string name(const std::string& otherwise) const;
  std::uint64_t integer(std::uint64_t largest) const;
  /// Reads an index into a list of `size` items, which messages call `what`.
  int index(std::size_t size, const char* what) const;
  /// Reads `key` of an object as index() does; −1 where it is absent.
  int find_index(const char* key, std::size_t size, const char* what) const {
    const std::optional<JsonValue> value = find(key);
    return value ? value->index(size, what) : -1;
  }
  /// Reads an array of `size` numbers, which messages describe as `what` where it is given.
  std::vector<double> numbers(std::size_t size, std::string_view what = "") const;
  Vector3 vector3() const { return Vector3(numbers(3).data()); }
  /// Reads x, y, z, w as in glTF. Its length may be off by 1 %, as truncated decimals are, and is set to 1.
  Quaternion rotation() const;

 private:
  const Json* value_;
  JsonFile* file_;
  std::string path_;
};

/// Returns the value of `text`. Throws nlohmann's exception for text that is no JSON, and Error that begins
/// with `what` for a duplicate key, of which the parser would keep the last value, and for a nesting that
/// recursive code could not follow. The check goes before: a parser with a callback walks a whole array
/// again after each object in it, which takes seconds in a file of 50,000 nodes.
Json parse_json(std::string_view text, const std::string& what);

}  // namespace substep
