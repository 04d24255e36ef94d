#pragma once
/// The metrics of one scene's runs as tables.

#include <string>
#include <vector>

#include "sim/measure/metrics.h"
#include "sim/measure/stage_times.h"
#include "sim/measure/text_table.h"

namespace substep {

struct MeasuredSettings {
  Settings settings;
  Metrics metrics;
  std::optional<RunTimes> times;
};

struct SceneMeasurement {
  std::string scene;
  double size = 0;      ///< m
  double duration = 0;  ///< s
  std::string modelled;
  ReferenceMotion reference;  ///< of its motion nothing is printed
  std::vector<MeasuredSettings> runs;
};

/// How it was made, how uncertain it is and until when, on a line.
std::string reference_text(const ReferenceMotion& reference);

/// Tables of the runs, a line each, below what they were measured against; a third one, of a line for each
/// figure that is known of the scene, where there is one. For a terminal.
std::string to_table(const SceneMeasurement& measurement);
std::string to_markdown(const SceneMeasurement& measurement);
/// A line a run: row solves, time, error, what gave way. Times have ~: they differ from run to run.
TextTable brief_table(const SceneMeasurement& measurement);
/// {"scene", "size", "duration", "reference": {…}, "runs": [{…}]}, SI units. What is not finite is
/// null; what a run does not have is "none".
std::string to_json(const SceneMeasurement& measurement);

}  // namespace substep
