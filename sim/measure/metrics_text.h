#pragma once
/// The metrics of one scene's runs as tables.

#include <string>
#include <vector>

#include "sim/measure/metrics.h"
#include "sim/measure/stepper.h"
#include "sim/measure/text_table.h"

namespace substep {

struct MeasuredSettings {
  Settings settings;        ///< of a run that another program made, the step alone
  std::string author = {};  ///< of such a run
  Metrics metrics;
  std::optional<RunTimes> times;
};

struct SceneMeasurement {
  std::string scene;
  double size = 0;      ///< m
  double duration = 0;  ///< s
  bool stands = false;  ///< all bodies stay at rest in the reference
  bool driven = false;  ///< a motor or a moving kinematic body adds energy
  std::string modelled;
  ReferenceMotion reference;  ///< its motion is not printed
  std::vector<MeasuredSettings> runs;
};

/// Returns one line: the uncertainty and the horizon of a reference, with its method where `names_method`.
std::string reference_text(const ReferenceMotion& reference, bool names_method = true);

/// Returns "A5  n=10 m=1 stable  h=1/60", or the author.
std::string label(const MeasuredSettings& run);

/// Returns the reference, the settings, a table of at most seven columns with a row for each run, and of up
/// to five runs at most four missed known figures. `all` returns every metric instead, in wider tables.
std::string to_text(const SceneMeasurement& measurement, bool all, bool as_markdown);
/// Returns the first table of the short form alone, rows named by their settings. Times have ~: they differ
/// from run to run.
TextTable brief_table(const SceneMeasurement& measurement);

}  // namespace substep
