#include "render/video/panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "render/inks.h"
#include "sim/error.h"
#include "sim/loading/toml_values.h"
#include "sim/model/settings_fields.h"
#include "sim/model/usual_settings.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

/// A panel as typed, or as a table of a file.
struct TypedPanel {
  std::string show = {};
  Command command = {};
  std::string title = {};
  TypedSettings values = {};
};

/// Sets those of the panel's settings that its algorithm, or its engine, reads. Throws Error.
void set(PanelChoice& panel, const TypedSettings& values) {
  const bool is_log = panel.kind == PanelChoice::Kind::log;
  if ((is_log || panel.kind == PanelChoice::Kind::reference) && !values.empty()) {
    throw Error("'{}={}': a {} has its own settings, and 'title' alone can be given", values[0].first,
                values[0].second, is_log ? "log" : "reference");
  }
  std::vector<const SettingsField*> fields;
  for (const SettingsField& field : settings_fields) {
    const bool is_read = panel.kind == PanelChoice::Kind::engine
                             ? field.name == "iterations" || field.name == "step"
                             : field.name != "algorithm";
    if (is_read) fields.push_back(&field);
  }
  set_typed(panel.settings, values, fields);
}

/// Returns the engine of that name, or the first whose name begins with it and a hyphen. Throws Error.
std::string engine_named(const std::string& text) {
  const auto begins = [&](const Engine& engine) {
    return engine.name == text || engine.name.starts_with(text + "-");
  };
  const auto found = std::ranges::find_if(engines(), begins);
  if (found != engines().end()) return found->name;
  throw Error("'{}': give a1 to a5, soft, avbd, reference, log:FILE, {}", text, engine_names());
}

PanelChoice panel_of(const TypedPanel& typed, const PanelDefaults& defaults) {
  const std::string& show = typed.show;
  const std::optional<Algorithm> algorithm = algorithm_named(show);
  PanelChoice panel;
  panel.settings = defaults.settings(algorithm.value_or(Algorithm::a3));
  panel.title = typed.title;
  if (!typed.command.empty()) {
    if (!show.empty()) throw Error("give 'show' or 'command', not both");
    panel.kind = PanelChoice::Kind::engine;
    panel.command = typed.command;
  } else if (show == "reference") {
    panel.kind = PanelChoice::Kind::reference;
  } else if (show.starts_with("log:")) {
    panel.kind = PanelChoice::Kind::log;
    panel.log = show.substr(4);
  } else if (!algorithm) {
    panel.kind = PanelChoice::Kind::engine;
    panel.engine = engine_named(show);
  }
  const auto has = [&](const char* field) {
    return std::ranges::any_of(typed.values,
                               [&](const auto& v) { return is_called(field_named(field), v.first); });
  };
  set(panel, typed.values);
  const bool is_counted = algorithm == Algorithm::a2 || algorithm == Algorithm::avbd
                              ? defaults.has_counts || has("substeps")
                              : panel.kind == PanelChoice::Kind::engine;
  if (is_counted && !has("iterations")) {
    const Settings counted = defaults.settings(Algorithm::a3);
    const int substeps = has("substeps") ? panel.settings.substeps : counted.substeps;
    panel.settings.iterations = iterations_at_equal_rows(substeps, counted.iterations);
  }
  if (panel.kind != PanelChoice::Kind::log) check(panel.settings);
  return panel;
}

}  // namespace

std::vector<PanelChoice> default_panels(const PanelDefaults& defaults) {
  std::vector<PanelChoice> panels;
  for (const char* const show : {"a1", "a2", "a3", "a4", "a5", "reference"})
    panels.push_back(panel_of({.show = show}, defaults));
  return panels;
}

PanelChoice panel_in(const std::string& text, const PanelDefaults& defaults) {
  try {
    TypedPanel typed;
    std::string rest = text;
    // A title may have commas.
    if (const std::size_t begin = rest.find(",title="); begin != std::string::npos) {
      typed.title = rest.substr(begin + 7);
      rest.resize(begin);
    }
    typed.show = rest.substr(0, rest.find(','));
    rest.erase(0, typed.show.size() + 1);
    typed.values = typed_settings_in(rest);
    return panel_of(typed, defaults);
  } catch (const Error& error) {
    throw Error("panel {}: {}", text, error.what());
  }
}

PanelFile read_panels(const fs::path& file, const PanelDefaults& defaults) {
  const TomlValues toml(file);
  const toml::table root = toml.parse();
  toml.expect_keys(root, "the film's file", {"title", "panel"});
  const auto text_of = [&](const toml::node& value, std::string_view key) {
    if (const auto* const text = value.as_string()) return **text;
    if (value.is_number()) return fmt::format("{}", *value.value<double>());
    toml.fail(value, fmt::format("'{}' must be a number or text", key));
  };
  PanelFile result;
  if (const auto* node = root.get("title")) result.title = toml.text(*node, "title");
  const toml::node* const list = root.get("panel");
  if (list == nullptr || !list->is_array_of_tables()) throw Error("{}: has no [[panel]]", file.string());
  for (const toml::node& node : *list->as_array()) {
    TypedPanel typed;
    for (const auto& [key, value] : *node.as_table()) {
      if (key.str() == "command") {
        for (const toml::node& word : toml.array(value, "command"))
          typed.command.push_back(toml.text(word, "command"));
        typed.command = with_files_in(std::move(typed.command), file.parent_path());
      } else if (key.str() == "show") {
        typed.show = text_of(value, "show");
      } else if (key.str() == "title") {
        typed.title = text_of(value, "title");
      } else {
        typed.values.emplace_back(key.str(), text_of(value, key.str()));
      }
    }
    try {
      if (typed.show.empty() && typed.command.empty()) throw Error("give 'show' or 'command'");
      result.panels.push_back(panel_of(typed, defaults));
    } catch (const Error& error) {
      toml.fail(node, error.what());
    }
    PanelChoice& panel = result.panels.back();
    if (panel.log.is_relative() && !panel.log.empty()) panel.log = file.parent_path() / panel.log;
  }
  return result;
}

Engine engine_of(const PanelChoice& panel) {
  if (!panel.command.empty()) return command_engine(panel.command);
  return *find_engine(panel.engine);
}

int hue_of(const PanelChoice& panel) {
  if (panel.kind == PanelChoice::Kind::reference) return 7;
  if (panel.kind != PanelChoice::Kind::engine) return hue_of(panel.settings.algorithm);
  return hue_of_engine(panel.engine);
}

}  // namespace substep::render
