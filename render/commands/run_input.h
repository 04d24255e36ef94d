#pragma once
/// The typed input of commands that draw or export: a pose log or table, or a scene that is simulated first.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>

#include "sim/commands/options.h"
#include "sim/commands/progress.h"
#include "sim/log/pose_log.h"
#include "sim/scene/scene.h"

namespace substep::render {

struct LoadedRun {
  Scene scene;
  PoseLog log;
  std::string stem;  ///< the name of files that are made of it: "box_stack.a3"
};

/// The end of a simulation: a frame, a time, or without both the scene's duration.
struct Until {
  std::optional<int> frame;
  std::optional<double> time;
};

struct RunInput {
  std::filesystem::path file;
  std::optional<std::filesystem::path> scene;
  SolverOptions solver;
  SceneOptions mesh;

  /// Adds the file as the command's argument, --scene and the options of solving and of meshes.
  void add_to(CLI::App& command);
  /// Adds the options without the file.
  void add_options_to(CLI::App& command);

  /// Throws Error when the output is one of the files that are read.
  void require_separate(const std::filesystem::path& output) const;

  /// Reads the log, or simulates the scene. Throws Error.
  LoadedRun load(const Until& until, Progress& progress) const;

  /// Returns a run of one frame that shows a glTF file without physics; nothing for other inputs.
  std::optional<LoadedRun> load_still() const;
};

}  // namespace substep::render
