#pragma once
/// Parses JSON strictly.

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sim/error.h"

namespace substep {

/// Finds an object with a duplicate key in a JSON text, without making values.
template <typename Json>
class KeysStandOnce : public nlohmann::json_sax<Json> {
 public:
  bool key(std::string& name) override {
    if (open_.back().insert(name).second) return true;
    twice_ = name;
    return false;
  }
  bool start_object(std::size_t) override {
    open_.emplace_back();
    return true;
  }
  bool end_object() override {
    open_.pop_back();
    return true;
  }
  bool start_array(std::size_t) override { return true; }
  bool end_array() override { return true; }
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(typename Json::number_integer_t) override { return true; }
  bool number_unsigned(typename Json::number_unsigned_t) override { return true; }
  bool number_float(typename Json::number_float_t, const std::string&) override { return true; }
  bool string(std::string&) override { return true; }
  bool binary(typename Json::binary_t&) override { return true; }
  // Text that is no JSON is for the parser to refuse.
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override {
    return false;
  }

  /// The duplicate key, or nothing.
  [[nodiscard]] const std::optional<std::string>& twice() const { return twice_; }

 private:
  std::vector<std::set<std::string>> open_;
  std::optional<std::string> twice_;
};

/// Returns the value of `text`. Throws nlohmann's exception for text that is no JSON, and Error that begins
/// with `what` for a duplicate key, of which the parser would keep the last value. Keys are checked before: a
/// parser with a callback walks a whole array again after each object in it, which takes seconds in a file of
/// 50,000 nodes.
template <typename Json>
Json parse_json(std::string_view text, const std::string& what) {
  KeysStandOnce<Json> keys;
  Json::sax_parse(text, &keys);
  if (keys.twice()) {
    throw Error(
        fmt::format("{}: the key '{}' stands twice in one object", what, keys.twice()->substr(0, 60)));
  }
  return Json::parse(text);
}

}  // namespace substep
