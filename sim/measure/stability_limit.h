#pragma once
/// Finds by bisection the coarsest setting with which an algorithm stays bounded on a scene
/// (Metrics::bounded).

#include "sim/measure/metrics.h"

namespace substep {

struct StabilityLimit {
  /// The smallest number that stays bounded, as do its double and its fourfold: of sub-steps n (A3 to A5,
  /// Soft Step), of iterations (AVBD), or of parts of the scene's step (A1, A2). 0: none up to `most` does.
  int divisions = 0;
  int most = 0;
  int runs = 0;  ///< that it took
};

/// `settings` says all but n, or but the step; its step is the scene's.
StabilityLimit stability_limit(const Scene& scene, const Settings& settings, const ReferenceMotion& reference,
                               int most);

}  // namespace substep
