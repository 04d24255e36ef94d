#pragma once
/// The runs that a comparison video shows side by side, and how far each is from the reference.

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "sim/model/settings.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep {

inline constexpr int video_frame_rate = 30;  ///< frame k shows the time k/30 s

struct ComparisonSettings {
  /// The step of all five, and n, m, τ, κ and the joints of A3–A5. A2 gets n·m iterations: the same number of
  /// row solves.
  Settings settings;
  double duration = 5;          ///< s
  int reference_substeps = 16;  ///< the reference is A1 at step/16
  int threads = 2;
};

/// One panel's run.
struct Run {
  Settings settings;
  bool is_reference = false;
  std::vector<std::vector<Coordinates>> poses;  ///< of each video frame; fewer when it diverged
  /// Of each video frame that the reference reached too: RMS distance of the bodies' points from where the
  /// reference has them, over each body's mass and then over the dynamic bodies, m. It sees turns too.
  std::vector<double> errors;
  double rms_error = 0;  ///< over `errors`, m
  std::int64_t row_solves = 0;
  std::optional<double> diverged;  ///< when, s
  int unsolved = 0;                ///< steps that A1 did not solve to the accuracy asked for
};

struct Comparison {
  std::vector<Run> runs;      ///< A1 … A5, then the reference
  std::vector<double> times;  ///< of each video frame's state, s: the nearest step's
  bool is_nearest = false;    ///< whether some of these are not exactly k/30 s

  const Run& reference() const { return runs.back(); }
};

/// Runs all six. `progress` gets the share done, on the calling thread; may be empty.
/// Throws Error when the settings cannot be used or the scene cannot be modelled.
Comparison simulate_comparison(const Scene& scene, const ComparisonSettings& settings,
                               const std::function<void(double)>& progress = {});

}  // namespace substep
