#include "render/video/panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "render/inks.h"
#include "sim/error.h"
#include "sim/loading/toml_values.h"
#include "sim/model/settings_fields.h"
#include "sim/study/engines/engines.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

/// Returns the settings that an algorithm, or an engine, reads.
std::vector<const SettingsField*> fields_of(PanelChoice::Kind kind) {
  std::vector<const SettingsField*> fields;
  for (const SettingsField& field : settings_fields) {
    const bool is_read = kind == PanelChoice::Kind::engine
                             ? field.name == "iterations" || field.name == "step"
                             : field.name != "algorithm";
    if (is_read) fields.push_back(&field);
  }
  return fields;
}

/// Sets the panel's settings, and its title by the key "title". Throws Error.
void set(PanelChoice& panel, TypedSettings values) {
  if (const auto title = std::ranges::find(values, "title", [](const auto& value) { return value.first; });
      title != values.end()) {
    panel.title = title->second;
    values.erase(title);
  }
  const bool is_log = panel.kind == PanelChoice::Kind::log;
  if ((is_log || panel.kind == PanelChoice::Kind::reference) && !values.empty()) {
    throw Error(fmt::format("'{}={}': a {} has its own settings, and 'title' alone can be given",
                            values[0].first, values[0].second, is_log ? "log" : "reference"));
  }
  set_typed(panel.settings, values, fields_of(panel.kind));
}

/// Returns the engine of that name, or the first whose name begins with it. Throws Error.
std::string engine_named(const std::string& text) {
  const auto begins = [&](const Engine& engine) {
    return engine.name == text || engine.name.starts_with(text + "-");
  };
  const auto found = std::ranges::find_if(engines(), begins);
  if (!text.empty() && found != engines().end()) return found->name;
  std::string known;
  for (const Engine& engine : engines()) known += ", " + engine.name;
  throw Error(fmt::format("'{}': give a1 to a5, reference, log:FILE{}", text, known));
}

PanelChoice panel_of(const std::string& show, const Command& command, const TypedSettings& values,
                     const Settings& settings) {
  PanelChoice panel;
  panel.settings = settings;
  if (!command.empty()) {
    if (!show.empty()) throw Error("give 'show' or 'command', not both");
    panel.kind = PanelChoice::Kind::engine;
    panel.command = command;
  } else if (const auto algorithm = algorithm_named(show)) {
    panel.settings.algorithm = *algorithm;
  } else if (show == "reference") {
    panel.kind = PanelChoice::Kind::reference;
  } else if (show.starts_with("log:")) {
    panel.kind = PanelChoice::Kind::log;
    panel.log = show.substr(4);
  } else {
    panel.kind = PanelChoice::Kind::engine;
    panel.engine = engine_named(show);
  }
  const bool has_iterations = std::ranges::any_of(
      values, [](const auto& v) { return is_called(field_named("iterations"), v.first); });
  set(panel, values);
  const bool has_no_substeps = panel.settings.algorithm == Algorithm::a2 ||
                               panel.settings.algorithm == Algorithm::avbd ||
                               panel.kind == PanelChoice::Kind::engine;
  if (has_no_substeps && !has_iterations) panel.settings.iterations *= panel.settings.substeps;
  if (panel.kind != PanelChoice::Kind::log) check(panel.settings);
  return panel;
}

}  // namespace

std::vector<PanelChoice> default_panels(const Settings& settings) {
  std::vector<PanelChoice> panels;
  for (const char* const show : {"a1", "a2", "a3", "a4", "a5", "reference"}) {
    panels.push_back(panel_of(show, {}, {}, settings));
  }
  return panels;
}

PanelChoice panel_in(const std::string& text, const Settings& settings) {
  try {
    std::string rest = text;
    std::string title;
    // A title may have commas.
    if (const std::size_t begin = rest.find(",title="); begin != std::string::npos) {
      title = rest.substr(begin + 7);
      rest.resize(begin);
    }
    const std::size_t end = std::min(rest.find(','), rest.size());
    const std::string show = rest.substr(0, end);
    TypedSettings values = typed_settings_in(std::string_view(rest).substr(std::min(end + 1, rest.size())));
    if (!title.empty()) values.emplace_back("title", title);
    return panel_of(show, {}, values, settings);
  } catch (const Error& error) {
    throw Error(fmt::format("panel {}: {}", text, error.what()));
  }
}

PanelFile read_panels(const fs::path& file, const Settings& settings) {
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
  if (list == nullptr || !list->is_array_of_tables()) {
    throw Error(fmt::format("{}: has no [[panel]]", file.string()));
  }
  for (const toml::node& node : *list->as_array()) {
    std::string show;
    Command command;
    TypedSettings values;
    for (const auto& [key, value] : *node.as_table()) {
      if (key.str() == "command") {
        for (const toml::node& word : toml.array(value, "command"))
          command.push_back(toml.text(word, "command"));
        command = beside(std::move(command), file.parent_path());
      } else if (key.str() == "show") {
        show = text_of(value, "show");
      } else {
        values.emplace_back(key.str(), text_of(value, key.str()));
      }
    }
    try {
      result.panels.push_back(panel_of(show, command, values, settings));
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
  return *std::ranges::find(engines(), panel.engine, &Engine::name);
}

int hue_of(const PanelChoice& panel) {
  if (panel.kind == PanelChoice::Kind::reference) return 7;
  if (panel.kind != PanelChoice::Kind::engine) return hue_of(panel.settings.algorithm);
  return hue_of_engine(panel.engine);
}

}  // namespace substep::render
