#pragma once
/// What is drawn or exported: a pose log or table, or a scene that is simulated first; as typed.

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
  std::string stem;  ///< what files made of it are named after: "box_stack.a3"
};

/// How far a scene is simulated: to this frame, and to this time. Neither: for its duration.
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
  /// Adds the same without the file.
  void add_options_to(CLI::App& command);

  /// Throws Error when the output is one of the files that are read.
  void require_separate(const std::filesystem::path& output) const;

  /// A log is read, a scene simulated. Throws Error.
  LoadedRun load(const Until& until, Progress& progress) const;

  /// A glTF file without physics as it stands, as a run of one frame; nothing where the input is another.
  std::optional<LoadedRun> load_still() const;
};

}  // namespace substep::render
