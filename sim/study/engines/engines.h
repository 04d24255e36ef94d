#pragma once
/// Simulators of sweeps beside the five algorithms: physics engines and our accurate mode. No engine is
/// linked into the program: native ones, which the build selects, are loaded when a run needs them; those
/// from npm are commands, programs that read the scene as JSON and write a pose table.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "sim/measure/stepper.h"
#include "sim/model/settings.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep {

struct Engine {
  std::string name;      ///< in sweep files: "bullet-si"; letters, digits and -
  std::string label;     ///< in figures: "Bullet 3.24 SI"
  std::string settings;  ///< other settings, for captions
  bool is_ours;          ///< the accurate mode: reference_integrator.cpp
  /// Makes a stepper of a scene, with the step and, where the engine has iterations, `iterations` of the
  /// settings. Throws Error where the engine is not installed, with what to install, or where it cannot
  /// represent the scene, which is then listed as omitted. May be called from several threads at once.
  MakeStepper make;
  bool has_iterations = false;  ///< true where it reads Settings::iterations
  /// True where the engine runs in another program, so that its times cannot be compared.
  bool is_command = false;
  bool iterations_are_substeps = false;  ///< true where each iteration is a sub-step
};

/// Returns the accurate mode, then the built engines, then those on npm.
const std::vector<Engine>& engines();

/// Returns the engine of a name, or null.
const Engine* find_engine(std::string_view name);

/// Returns true where engines() of some build has the name.
bool is_engine_name(std::string_view name);

/// Returns the names of engines(), for messages: "order-4, order-8, …".
std::string engine_names();

/// A program and its arguments, in which {scene}, {settings} and {poses} stand for files: the scene as `info
/// --json` prints it; {"step", "duration", "iterations", "substeps"}; and the pose table that it writes.
using Command = std::vector<std::string>;

/// Returns the command with each word that names a file in `folder` replaced by that file's path.
Command with_files_in(Command command, const std::filesystem::path& folder);

/// Returns the engine of a command. Its label is the stem of the command's first file, which may be missing;
/// without a file that of the program.
Engine command_engine(const Command& command);

/// Runs the command on a scene for its duration and returns the states at each step. Throws Error where
/// the command lacks {poses}, cannot start, or lasts longer than `time_limit` seconds; with the exit code or
/// signal and the last line of standard error (exit code 3: the line alone); or with a fault of the table.
std::vector<State> run_command(const Command& command, const Scene& scene, const Settings& settings,
                               double time_limit = 120);

}  // namespace substep
