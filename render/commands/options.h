#pragma once
/// Command-line options that several commands of render share.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/video/comparison.h"
#include "sim/commands/options.h"
#include "sim/commands/output.h"
#include "sim/log/pose_log.h"

namespace substep::render {

/// Returns the finite number that the text is; nothing for other text.
std::optional<double> finite_number_in(std::string_view text);

/// Returns a check that an option's number is finite and from `low` to `high`. CLI::Range lets NaN pass.
CLI::Validator number_from(double low, double high);

/// Returns the width, in mm, of "one-column", "two-columns" or a number of millimetres. Throws Error, which
/// names --width.
double print_width_in(const std::string& text);

/// The options of a film's or player's panels and times.
struct ComparisonOptions {
  SceneOptions scene;
  SolverOptions solver;
  std::string title;       ///< --title, or after settings() that of --panels; empty: the scene's name
  double speed = 1;        ///< s of the scene in a second of film
  double frame_rate = 30;  ///< frames in a second of film

  /// Adds the options of the solver, of panels and of time.
  void add_settings_to(CLI::App& command);
  /// Adds the options of panels, of the reference and of threads.
  void add_panels_to(CLI::App& command);

  /// Returns the settings, by default with A1 to A5 and the reference. Warns of the cost of A1. Throws Error.
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

/// Prints a row for each run, the reference and, where no frame is at `end`, s, the time of the last one.
void print_table(const Comparison& comparison, double end = 0);

/// Prints a line on stderr for each violation of each run.
void warn_of(const Scene& scene, const Comparison& comparison);

struct LoadedRun {
  Scene scene;
  PoseLog log;
  std::string stem;  ///< beginning of the names of the run's output files: "box_stack.a3"
};

/// The end of a simulation: a frame, a time, or without both the scene's duration.
struct RunEnd {
  std::optional<int> frame;
  std::optional<double> time;
};

/// The input of commands that draw or export: a pose log or table, or a scene that is simulated first.
struct RunInput {
  std::filesystem::path file;
  std::optional<std::filesystem::path> scene;
  SolverOptions solver;
  SceneOptions mesh;

  /// Adds --scene and the options of the solver and of meshes.
  void add_options_to(CLI::App& command);

  /// Throws Error when the output is one of the files that are read.
  void require_separate(const std::filesystem::path& output) const;

  /// Reads the log, or simulates the scene. Throws Error.
  LoadedRun load(const RunEnd& end, Progress& progress) const;

  /// Returns a run of one frame that shows a glTF file without physics; nothing for other inputs.
  std::optional<LoadedRun> load_still() const;

 private:
  std::vector<CLI::Option*> options_of_solver_;  ///< of scenes alone
};

}  // namespace substep::render
