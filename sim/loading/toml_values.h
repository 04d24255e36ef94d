#pragma once
/// Reads values of TOML files. Errors name the file and the line.

#include <toml++/toml.h>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "sim/model/settings_fields.h"

namespace substep {

class TomlValues {
 public:
  explicit TomlValues(std::filesystem::path file) : file_(std::move(file)) {}

  const std::filesystem::path& file() const { return file_; }

  // All throw Error.
  toml::table parse() const;
  [[noreturn]] void fail(const toml::node& node, const std::string& what) const;
  /// Refuses keys that are not known, and lists those that are. `where`: "[defaults]".
  void expect_keys(const toml::table& table, std::string_view where,
                   const std::vector<std::string_view>& known) const;
  int integer(const toml::node& node, std::string_view key, int low, int high) const;
  std::string text(const toml::node& node, std::string_view key) const;
  /// Sets the field of settings without checking its range, which check() does.
  void set_field(Settings& settings, const SettingsField& field, const toml::node& node) const;
  bool flag(const toml::node& node, std::string_view key) const;
  double positive(const toml::node& node, std::string_view key) const;
  /// Returns an array that has entries.
  const toml::array& array(const toml::node& node, std::string_view key) const;
  const toml::table& table_in(const toml::node& node, std::string_view key) const;
  /// Returns the algorithms of an array that has entries.
  std::vector<Algorithm> algorithms(const toml::node& node, std::string_view key) const;

 private:
  std::filesystem::path file_;
};

}  // namespace substep
