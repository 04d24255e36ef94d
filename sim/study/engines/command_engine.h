#pragma once
/// Simulators that are commands: another program reads the scene as JSON and writes a pose table.

#include <filesystem>
#include <string>
#include <vector>

#include "sim/model/settings.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"
#include "sim/study/engines/engines.h"

namespace substep {

/// A program and its arguments, in which {scene}, {settings} and {poses} stand for files: the scene as `info
/// --json` prints it; {"step", "duration", "iterations", "substeps"}; and the pose table
/// that the program writes.
using Command = std::vector<std::string>;

/// Returns the command with arguments that name a file in `folder` as that file.
Command beside(Command command, const std::filesystem::path& folder);

/// Returns the engine of a command, which is named after the file that it runs.
Engine command_engine(const Command& command);

/// Runs the command on a scene for its duration and returns the states at each step. The table is read only
/// where the program ends with exit code 0. Throws Error with the exit code and the last line
/// that the program wrote to standard error, or after `time_limit` seconds, or with what is wrong in the
/// table.
std::vector<State> run_command(const Command& command, const Scene& scene, const Settings& settings,
                               double time_limit = 120);

}  // namespace substep
