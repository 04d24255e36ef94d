#pragma once
/// What each panel of a film shows.

#include <filesystem>
#include <string>
#include <vector>

#include "sim/model/settings.h"
#include "sim/study/engines/command_engine.h"

namespace substep::render {

struct PanelChoice {
  enum class Kind { algorithm, engine, log, reference };

  Kind kind = Kind::algorithm;
  Settings settings;          ///< of an algorithm; of an engine the step and the iterations
  std::string engine;         ///< its name in engines(); empty: a command
  Command command;            ///< that simulates, see command_engine.h
  std::filesystem::path log;  ///< a finished run: a pose log or table
  std::string author;         ///< of a run that another program made
  std::string title;          ///< words of one's own; empty: what the rest says
  int shade = 0;              ///< of its ink: the number of earlier panels with the same
};

/// A1 to A5 with these settings, then the reference. A2 gets n·m iterations: as many row solves.
std::vector<PanelChoice> default_panels(const Settings& settings);

/// As typed: "a5,n=4,joints=stable", "bullet-si", "log:run.csv", "reference", each with ",title=…" at
/// its end; "bullet" is the first engine of that name. Settings go by the names of settings_fields.h, or as
/// labels have them: "substeps" or "n". What is not given is as in `settings`; A2, AVBD and engines
/// get n·m iterations, as many as A3 to A5 spend. Throws Error.
PanelChoice panel_in(const std::string& text, const Settings& settings);

struct PanelFile {
  std::string title;  ///< of the film; empty: the scene's name
  std::vector<PanelChoice> panels;
};

/// A TOML file of tables [[panel]], each with `show` ("a5", "bullet", "log:run.poses.txt", "reference") or
/// `command` (["python3", "mine.py", "{scene}", "{settings}", "{poses}"]) and panel_in()'s keys; and a
/// `title`. Logs, and files of commands, are looked for beside the file. Throws Error.
PanelFile read_panels(const std::filesystem::path& file, const Settings& settings);

/// The engine of an engine's panel.
Engine engine_of(const PanelChoice& panel);
/// What stands first, in the panel's colour: "A5", "Bullet SI", "Reference".
std::string name_of(const PanelChoice& panel);
/// How it was run: "n=4 m=1 stable  h=1/60".
std::string settings_of(const PanelChoice& panel);
/// Index of `inks`.
int hue_of(const PanelChoice& panel);

}  // namespace substep::render
