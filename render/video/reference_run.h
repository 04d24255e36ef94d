#pragma once
/// The reference that errors are measured from: two runs of different steps.

#include <optional>
#include <string>
#include <vector>

#include "render/video/comparison.h"
#include "render/video/recorded_run.h"

namespace substep::render {

/// One of the two runs of the reference.
struct ReferenceAttempt {
  std::vector<std::vector<Coordinates>> poses;
  std::optional<double> ended;     ///< time of its early end, s
  std::optional<double> unsolved;  ///< time of the first unsolved step, s
  int unsolved_steps = 0;

  bool is_whole(const FrameClock& clock) const {
    return !ended && !unsolved && poses.size() == clock.steps.size();
  }
};

/// Returns whether the scene's forces are smooth, so that the reference integrator can run it.
bool has_smooth_reference(const Scene& scene, double step);

/// Returns whether two refinements agree within 1e-9 of the scene's size: smaller steps would show nothing
/// new.
bool is_settled(const Scene& scene, const std::vector<Coordinates>& one,
                const std::vector<Coordinates>& other);

/// Simulates one of the two runs, with steps of `step` / `divisions`, or takes it from the cache.
/// `is_smooth` selects the reference integrator, else A1. A1 stops at the first frame that differs from
/// `like`'s; such a run is not cached.
ReferenceAttempt simulate_reference(const Scene& scene, const FrameClock& clock, double step, int divisions,
                                    bool is_smooth, const ReferenceCache& cache, Tally& tally,
                                    const ReferenceAttempt* like = nullptr);

/// Returns the finer run as reference, up to the time at which the two runs diverge. `times`: of the kept
/// steps, s.
ReferenceRun reference_of(const Scene& scene, const ReferenceAttempt& coarse, ReferenceAttempt fine,
                          const std::vector<double>& times, const std::string& method);

}  // namespace substep::render
