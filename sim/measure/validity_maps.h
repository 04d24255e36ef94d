#pragma once
/// Measures the ranges in which algorithms work: mass ratio against sub-steps, step against a spring's
/// stiffness, AVBD's β against masses.
/// For τ against κ see stability_map.h.

#include <vector>

#include "sim/measure/metrics.h"

namespace substep {

struct MassRatioPoint {
  double ratio;  ///< of the heaviest body's mass to the lightest's
  int substeps;  ///< A1 and A2: parts that the step is taken in
  double error;  ///< RMS, over the scene's size; not finite where it blew up
  bool bounded;  ///< Metrics::bounded
};

/// Runs the scene with its heaviest body of 1, 10, … 10 000 times the lightest's mass, for `horizon` seconds
/// with n = 1, 2, 4, … `most`; A1 and A2 divide the step by n instead. `settings` has the other settings.
std::vector<MassRatioPoint> mass_ratio_map(const Scene& scene, const Settings& settings, double horizon,
                                           int most);

struct NeededSubsteps {
  double ratio;  ///< of the heaviest body's mass to the lightest's
  int substeps;  ///< StabilityLimit::divisions; 0: none up to `most` holds
};

/// Finds by bisection the fewest sub-steps (iterations of AVBD) that stay bounded, for the same mass ratios.
std::vector<NeededSubsteps> needed_substeps(const Scene& scene, const Settings& settings, double horizon,
                                            int most);

struct AvbdPoint {
  double mass;   ///< of a box, kg
  double beta;   ///< N/m²
  double moved;  ///< largest displacement of a box in 5 s, m
  bool falls;    ///< a box turned by more than half a radian or moved by more than its size, or it diverged
};

/// Runs the lowest three boxes of a stack in AVBD, with masses of 10⁻³ to 10⁶ kg and β of 1 to 10¹⁰.
std::vector<AvbdPoint> avbd_map(const Scene& stack, const Settings& settings);

struct StiffnessPoint {
  double step;       ///< s
  double stiffness;  ///< N/m, of a spring without damping under 1 kg
  double energy;     ///< after 1 s, over the start's; not finite where it blew up. Exactly 1 is right
};

/// Runs a weight on a spring, for steps of 1/30 to 1/480 s and stiffnesses of 1 to 1e8 N/m.
std::vector<StiffnessPoint> stiffness_map(const Settings& settings);

/// Returns the scene with more copies of its last body, each jointed to the one before like the last, to
/// measure the cost of a chain's length. Throws Error where the last joint is not between the last two
/// bodies.
Scene lengthened_chain(const Scene& scene, int links);

/// Returns the cost of each approximation, in the order of `approximations`: the largest distance of a body
/// from its position in A3 at the horizon, m.
std::vector<double> ablation_costs(const Scene& scene, int substeps, double horizon);

/// Violations and energy of a run at one time.
struct HistoryPoint {
  double time;
  double joint_gap;
  double penetration;
  double energy_change;
};
/// Returns joint gap, penetration and energy at the end of each of the scene's steps, until the run diverges.
std::vector<HistoryPoint> history(const Scene& scene, const Settings& settings);

}  // namespace substep
