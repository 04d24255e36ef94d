#pragma once
/// What is drawn or exported: a pose log, or a scene that is simulated first; as typed.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>

#include "sim/commands/options.h"
#include "sim/commands/progress.h"
#include "sim/log/pose_log.h"
#include "sim/scene/scene.h"

namespace substep {

struct LoadedRun {
  Scene scene;
  PoseLog log;
  std::string stem;  ///< what files made of it are named after: "box_stack.a3"
};

struct RunInput {
  std::filesystem::path file;
  std::optional<std::filesystem::path> scene;
  SolverOptions solver;
  SceneOptions mesh;

  /// Adds the file as the command's argument, --scene and the options of solving and of meshes.
  void add_to(CLI::App& command);

  /// Throws Error when the output is one of the files that are read.
  void require_separate(const std::filesystem::path& output) const;

  /// A scene is simulated up to `last_frame`, or for its duration. Throws Error.
  LoadedRun load(std::optional<int> last_frame, Progress& progress) const;
};

}  // namespace substep
