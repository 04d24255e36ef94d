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

/// Returns the end of the motion without time-step error: A1 at the scene's step over `divisions` and at half
/// of that, extrapolated to step zero (Richardson). Only centres of mass are extrapolated.
State reference_run(const Scene& scene, double duration, int divisions);

/// Returns the largest distance of a body's centre from the reference, m; infinite where the run diverged.
double error_of(const MeasuredRun& run, const State& reference);

}  // namespace substep
