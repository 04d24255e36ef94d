#pragma once
/// The metrics of one run of a scene: errors against the reference and their parts, invariants, and cost; and
/// the messages about a run that went wrong.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/measure/expectations.h"
#include "sim/measure/motion.h"
#include "sim/model/settings.h"

namespace substep {

/// The parts of a run's error, as RMS distances between motions in m: by the time step h/n, by solving rows
/// one after another, and by the approximations of A4 and A5.
struct ErrorParts {
  double stepping = 0;  ///< A1 at h/n from the reference
  std::optional<double>
      solver;  ///< A2 and AVBD from A1 at h; A3 (same n, m, joints), Soft Step from A1 at h/n
  std::optional<double> model;  ///< A4 or A5 from A3 with the same settings
};

struct Metrics {
  // To the reference's horizon. Not finite where the run ended before it.
  MotionDifference error;
  ErrorParts parts;
  /// One (sub-)step against A1's solution of the same constraints from the same state: mass-weighted
  /// difference of velocities, m/s; at up to 60 of the run's states. A1 has τ = 1: with another τ
  /// the difference of biases is part of it.
  Spread residual;
  std::int64_t row_solves = 0;

  // Over the scene's whole duration, at the instants of the samples.
  double joint_gap = 0;      ///< largest of the joints, see JointGapMeter, m
  double penetration = 0;    ///< largest depth of one collider in another, m
  double energy_change = 0;  ///< end − start, J
  double energy_growth = 0;  ///< largest rise above the start's, J
  double energy_scale = 0;   ///< of the start's speeds and a fall by the scene's size, see energy_scale(), J
  double moved = 0;          ///< largest distance of a body's centre from its start, m
  std::optional<double>
      momentum;  ///< largest change beyond gravity's, N·s; of scenes that touch nothing fixed
  std::optional<double> angular_momentum;  ///< the same about the common centre of mass, N·m·s
  /// Estimate of the largest angle by which A4 and A5 turn a body and its momentum wrongly, rad: a step's
  /// rotation is that of the sum of its velocities.
  double summed_turn = 0;
  std::vector<std::string> passages;  ///< "'ball' passes through 'wall'", see PassageMeter
  std::optional<double> diverged;     ///< when, s
  /// Figures of the scene's whole duration, after every step, that are known without a reference.
  std::vector<ExpectedFigure> expected;
  /// True where the run stays finite, its RMS error is at most a tenth of the scene's size, and violations()
  /// returns nothing unbounded or torn. Where the reference stands still, no body may move by more than a
  /// tenth of the smallest body's size.
  bool bounded = false;
};

/// Runs the scene for its duration and compares it with the reference. The result is the same in every run
/// and on every machine. With `parts` it also makes the runs that split the error.
Metrics measure(const Scene& scene, const Settings& settings, const ReferenceMotion& reference,
                bool parts = true);

/// Measures any stepper, without parts of the error and without a residual.
Metrics measure(const Scene& scene, Stepper& stepper, double step, const ReferenceMotion& reference);

/// Returns true where all bodies start at rest and stay at rest in the reference.
bool stands(const Scene& scene, const ReferenceMotion& reference);

struct Violation {
  enum class Severity {
    warning,    ///< printed; an error with --strict
    unbounded,  ///< a warning, and the run counts as not bounded
    torn,       ///< always an error: a joint gap larger than the scene
  };
  std::string text;  ///< "joint gap 0.56 m, above 0.05 m"
  Severity severity;
};

/// Returns true where a motor or a moving kinematic body can add energy. A drive that holds a position is a
/// spring, except one per unit of mass, which counts as a motor.
bool is_driven(const Scene& scene);

/// Returns the figures of a run that are beyond their limits. Gaps, penetrations and energies count from
/// those of the start.
std::vector<Violation> violations(const Scene& scene, const Metrics& metrics);

/// Returns the violations of a run and those by its settings: doubt_about_substeps(), Metrics::summed_turn.
std::vector<Violation> violations(const Scene& scene, const Settings& settings, const Metrics& metrics);

}  // namespace substep
