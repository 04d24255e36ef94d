#pragma once
/// Measures the ranges in which algorithms work: τ against κ, mass ratio against sub-steps, step against a
/// spring's stiffness; and the convergence of row-by-row sweeps and the limits of stability.

#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "sim/measure/metrics.h"

namespace substep {

struct FrozenProblem;

/// Returns a scene of one weightless body of 1 kg that starts `height` m off a joint with the world, which
/// holds these axes, rigidly or by a spring.
Scene weight_on_a_joint(double height, const std::array<bool, 3>& axes, std::optional<double> stiffness = {});

struct StabilityPoint {
  Algorithm algorithm;
  double tau;
  double kappa;
  bool converges;  ///< a row that was off by 1 mm came closer
};

/// Returns τ on the border, above which a row is unstable. For one scalar equality row with the state u = J v
/// and β, u' = (1 − κ) u + τ β and β' = β − u'. Both eigenvalues are within the unit circle if and only if 0
/// < κ < 2 and 0 < τ < 4 − 2κ.
constexpr double stability_border(double kappa) {
  return 4 - 2 * kappa;
}

/// Runs A3, A4 and A5 on a grid over 0 < κ < 2, 0 < τ < 4 that stays 0.1 off the border: for each point one
/// weightless body on a joint, whose rows each obey that recurrence.
std::vector<StabilityPoint> stability_map();

struct MassRatioPoint {
  double ratio;  ///< of the heaviest body's mass to the lightest's
  int substeps;  ///< A1 and A2: parts that the step is taken in
  double error;  ///< RMS, over the scene's size; not finite where it diverged
  bool bounded;  ///< Metrics::bounded
};

/// Runs the scene with its heaviest body of 1, 10, … 10 000 times the lightest's mass, for `horizon` seconds
/// with n = 1, 2, 4, … `most`; A1 and A2 divide the step by n instead. `settings` has the other settings.
std::vector<MassRatioPoint> mass_ratio_map(const Scene& scene, const Settings& settings, double horizon,
                                           int most);

struct StabilityLimit {
  /// The smallest number that stays bounded: of sub-steps n (A3 to A5, Soft Step), of iterations (AVBD), or
  /// of parts of the scene's step (A1, A2). 0: no power of two up to `most` and its next two do.
  int divisions = 0;
  int most = 0;
  int runs = 0;  ///< made for the search
};

/// Finds by bisection the coarsest setting with which an algorithm stays bounded on a scene
/// (Metrics::bounded). `settings` holds all but the number that is searched; its step is the scene's.
StabilityLimit stability_limit(const Scene& scene, const Settings& settings, const ReferenceMotion& reference,
                               int most);

struct NeededSubsteps {
  double ratio;  ///< of the heaviest body's mass to the lightest's
  int substeps;  ///< StabilityLimit::divisions; 0: none up to `most` holds
};

/// Finds by bisection the fewest sub-steps (iterations of AVBD) that stay bounded, for the same mass ratios.
std::vector<NeededSubsteps> needed_substeps(const Scene& scene, const Settings& settings, double horizon,
                                            int most);

struct StiffnessPoint {
  double step;       ///< s
  double stiffness;  ///< N/m, of a spring without damping under 1 kg
  double energy;     ///< after 1 s, over the start's; not finite where it diverged. Exactly 1 is correct
};

/// Runs a weight on a spring, for steps of 1/30 to 1/480 s and stiffnesses of 1 to 1e8 N/m.
std::vector<StiffnessPoint> stiffness_map(const Settings& settings);

/// Returns the scene with more copies of its last body, each jointed to the one before like the last. Throws
/// Error where the last joint is not between the last two bodies.
Scene lengthened_chain(const Scene& scene, int links);

/// Reads a problem's file. Throws Error that names the file, the position and the fault.
FrozenProblem load_frozen_problem(const std::filesystem::path& file);

/// The residual after a number of sweeps: ConeError::natural_map.
struct SweepError {
  int sweeps;
  double error;
};

/// Returns the errors after 1, 2, 4, … sweeps from zero, until one is at most `tolerance`; at most 4096.
std::vector<SweepError> sweep_errors(const FrozenProblem& problem, double tolerance);

}  // namespace substep
