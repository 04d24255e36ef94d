#pragma once
/// What must stay zero or constant along a run, whatever it is compared with.

#include <string>

#include "sim/measure/joint_gap.h"
#include "sim/measure/measured_run.h"
#include "sim/measure/metrics.h"

namespace substep {

/// Of joints, of contacts and of what stands: more than this share of the smallest body's size is nonsense.
inline constexpr double bounded_violation = 0.1;

/// Gathers `joint_gap`, `penetration`, `energy_change`, `energy_growth`, `moved` and the momenta of Metrics
/// along a run.
class Invariants {
 public:
  Invariants(const Scene& scene, const State& start);  ///< the scene must outlive it
  void add(const State& state, double time, Metrics& metrics);

 private:
  const Scene& scene_;
  PenetrationMeter meter_;
  JointGapMeter joints_;
  bool is_free_;
  State start_;
  double energy_;
  Momentum momentum_;
};

/// Largest distance of a body's centre from its start, m.
double moved(const Scene& scene, const State& start, const State& state);

/// Of what moves at the start, and of a fall by the scene's size, J.
double energy_scale(const Scene& scene);

/// Which of the invariants that were gathered are beyond all sense, in words: joints or contacts that give
/// way by more than `bounded_violation` beyond what they do at the start, and where nothing drives the scene
/// an energy of motion and height that rose by more than a tenth of its scale, what taking back the start's
/// own violations lifts, and what springs held at the start. Empty: none.
std::string out_of_bounds(const Scene& scene, const Metrics& metrics);

}  // namespace substep
