#pragma once
/// The messages about a run that went wrong; `run`, `measure`, `video` and `player` share them.

#include <string>
#include <vector>

#include "sim/measure/metrics.h"
#include "sim/model/settings.h"

namespace substep {

/// Limit of joint gaps, overlaps and displacements of standing bodies, as a fraction of the smallest body's
/// size.
inline constexpr double bounded_violation = 0.1;
/// Joint gap that causes a warning, as a fraction of the scene's size.
inline constexpr double warned_gap = 0.01;
/// Limit of the energy that undriven scenes gain and unbraked joints lose, as a fraction of energy_scale().
inline constexpr double bounded_energy = 0.1;
/// Limit of the energy drift of free bodies, as a fraction of energy_scale().
inline constexpr double free_energy = 0.01;
/// Limit of the momentum drift of bodies that touch nothing fixed, as a fraction of the momentum that they
/// have with the energy energy_scale().
inline constexpr double free_momentum = 0.01;

/// Limit of the angle by which summed rotation turns a body's momentum in A4 and A5, rad.
inline constexpr double warned_turn = 0.1;

struct Violation {
  enum class Severity {
    warning,    ///< printed; an error with --strict
    unbounded,  ///< the same, and the run is not bounded
    torn,       ///< always an error: a joint gap larger than the scene
  };
  std::string text;  ///< "joint gap 0.56 m, above 0.05 m"
  Severity severity;
};

/// True where a motor or a moving kinematic body can add energy. A drive that holds a position is a spring,
/// except one per unit of mass, which counts as a motor.
bool is_driven(const Scene& scene);

/// Returns the violations that no motion of the scene has. Gaps, penetrations and energies count beyond the
/// start's own.
std::vector<Violation> violations(const Scene& scene, const Metrics& metrics);

/// Returns these and violations by the settings: see doubt_about_substeps() and Metrics::summed_turn.
std::vector<Violation> violations(const Scene& scene, const Settings& settings, const Metrics& metrics);

/// Returns the violations' texts, separated by semicolons.
std::string joined(const std::vector<Violation>& violations);

}  // namespace substep
