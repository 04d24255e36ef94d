#pragma once
/// What is simulated side by side for a film or a player, as typed.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "render/video/comparison.h"
#include "sim/commands/options.h"

namespace substep::render {

struct ComparisonOptions {
  SceneOptions scene;
  SolverOptions solver;
  std::string title;  ///< --title's, or after settings() that of the --panels file; empty: the scene's name
  double speed = 1;   ///< s of the scene in a second of film
  double frame_rate = 30;

  /// Adds the scene as the command's argument, and the options of solving, of panels and of time.
  void add_to(CLI::App& command);
  /// All but the scene and the title: for commands that show several scenes.
  void add_settings_to(CLI::App& command);
  /// Adds the options of panels alone.
  void add_panels_to(CLI::App& command);

  /// The panels asked for, or the five and the reference; notes what A1 will cost. Throws Error.
  ComparisonSettings settings(const Scene& scene);

 private:
  std::vector<std::string> panels_;
  std::optional<std::filesystem::path> panels_file_;
  bool no_reference_ = false;
  int reference_substeps_ = ComparisonSettings{}.reference_substeps;
  std::string start_ = "0";
  std::optional<std::string> end_;
  CacheOption cache_;
  int threads_ = ComparisonSettings{}.threads;
};

/// A line for each run: its errors and its row solves, what became of it; and what the reference is.
void print_table(const Comparison& comparison);

/// Prints a line on stderr for each violation of each run.
void warn_of(const Scene& scene, const Comparison& comparison);

}  // namespace substep::render
