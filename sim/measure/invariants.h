#pragma once
/// Measures of a run that must stay zero or constant, without a reference.

#include <vector>

#include "sim/measure/joint_gap.h"
#include "sim/measure/measured_run.h"
#include "sim/measure/metrics.h"
#include "sim/measure/passage_meter.h"

namespace substep {

/// Gathers `joint_gap`, `penetration`, `energy_change`, `energy_growth`, `moved` and the momenta of Metrics
/// along a run.
class Invariants {
 public:
  Invariants(const Scene& scene, const State& start);  ///< the scene must outlive it
  void add(const State& state, double time, Metrics& metrics);
  /// Gathers `passages` and `summed_turn`, for which it needs the state after each step of `step` seconds.
  void follow(const State& state, double step, Metrics& metrics);

 private:
  const Scene& scene_;
  PenetrationMeter meter_;
  JointGapMeter joints_;
  PassageMeter passage_;
  bool is_free_;
  State start_;
  std::vector<Vector3> local_spins_;   ///< after the last step, rad/s, by body
  std::vector<Vector3> summed_turns_;  ///< so far, in the world, rad, by body
  double energy_;
  Momentum momentum_;
};

/// Returns the largest distance of a body's centre from its start, m.
double moved(const Scene& scene, const State& start, const State& state);

/// Returns the kinetic energy at the start plus the energy of a fall by the scene's size, J.
double energy_scale(const Scene& scene);

}  // namespace substep
