#pragma once
/// The choice of a film's panels.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "sim/model/settings.h"
#include "sim/study/engines/engines.h"

namespace substep::render {

struct PanelChoice {
  enum class Kind { algorithm, engine, log, reference };

  Kind kind = Kind::algorithm;
  Settings settings;          ///< of an algorithm; of an engine the step and the iterations
  std::string engine;         ///< name in engines(); empty: a command
  Command command;            ///< of an engine without a name, see engines.h
  std::filesystem::path log;  ///< a finished run: a pose log or table
  std::string author;         ///< name of another program that wrote the log; else empty
  std::string title;          ///< typed; empty: the settings that differ from other panels
  int shade = 0;              ///< number of earlier panels with the same colour
};

/// The settings that panels omit.
struct PanelDefaults {
  std::function<Settings(Algorithm)> settings;  ///< of engines and the reference: A3's
  bool has_counts = false;                      ///< n or m is given for all panels
};

/// Returns panels of A1 to A5, and of the reference.
std::vector<PanelChoice> default_panels(const PanelDefaults& defaults);

/// Reads a typed panel: "a5,n=4,joints=stable", "bullet-si", "log:run.csv" or "reference", each with
/// ",title=…" at its end; "bullet" is the first engine whose name begins so. Settings have the names of
/// settings_fields.h or of labels: "substeps" or "n". Engines get n·m iterations, the row solves of A3 to A5;
/// A2 and AVBD too where n or m is given. Throws Error.
PanelChoice panel_in(const std::string& text, const PanelDefaults& defaults);

struct PanelFile {
  std::string title;  ///< of the film; empty: the scene's name
  std::vector<PanelChoice> panels;
};

/// Reads a TOML file with a `title` and tables [[panel]], each with `show` ("a5", "bullet",
/// "log:run.poses.txt", "reference") or `command` (["python3", "mine.py", "{scene}", "{settings}",
/// "{poses}"]) and panel_in()'s keys. Logs, and files of commands, are beside the file. Throws Error.
PanelFile read_panels(const std::filesystem::path& file, const PanelDefaults& defaults);

/// Returns the engine of an engine's panel.
Engine engine_of(const PanelChoice& panel);
/// Returns the index of the panel's colour in `inks`.
int hue_of(const PanelChoice& panel);

}  // namespace substep::render
