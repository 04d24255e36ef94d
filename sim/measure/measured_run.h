#pragma once
/// One run of a simulation and its measurements, and distances between states.

#include "sim/simulation.h"

namespace substep {

struct MeasuredRun {
  State state;                  ///< at the end, or the last finite one
  bool diverged = false;        ///< the state did not stay finite
  double largest_gap = 0;       ///< of joints after any step (JointGapMeter), m
  double energy_change = 0;     ///< of all bodies, end − start, J
  double energy_growth = 0;     ///< largest rise above the start's, after any step, J
  double largest_residual = 0;  ///< of A1, after any step
};

/// Runs for `duration` seconds, to the nearest whole step.
MeasuredRun measured_run(Simulation& simulation, double duration);
MeasuredRun measured_run(const Scene& scene, const Settings& settings, double duration);

/// Returns the largest distance between the centres of equal bodies, m.
double position_difference(const State& a, const State& b);
/// Returns the same at the ends of two runs; infinite where one of them diverged.
double position_difference(const MeasuredRun& a, const MeasuredRun& b);

/// The motion without time-step error: A1 at two small steps, extrapolated to step zero (Richardson).
struct Reference {
  State state;             ///< at the end; its centres of mass alone are extrapolated
  double uncertainty = 0;  ///< largest move of a centre when the steps are halved once more, m
};

/// Computes the reference from A1 at 2, 1 and 1/2 times the scene's step over `divisions`.
Reference reference_run(const Scene& scene, double duration, int divisions);

/// Returns the largest distance of a body's centre from the reference, m; infinite where the run diverged.
double error_of(const MeasuredRun& run, const Reference& reference);

}  // namespace substep
