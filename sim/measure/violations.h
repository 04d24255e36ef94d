#pragma once
/// What is wrong with a run, in words: one list for `run`, `measure`, `video` and `player`.

#include <string>
#include <vector>

#include "sim/measure/metrics.h"
#include "sim/model/settings.h"

namespace substep {

/// Of the smallest body's size: joints, contacts and what stands may give way by no more.
inline constexpr double bounded_violation = 0.1;
/// Of the scene's size: a joint that gives way by more is worth a warning.
inline constexpr double warned_gap = 0.01;
/// Of energy_scale(): what nothing drives gains no more, and jointed bodies that nothing brakes lose no more.
inline constexpr double bounded_energy = 0.1;
/// Of energy_scale(): the energy of bodies that neither touch nor are joined drifts by no more.
inline constexpr double free_energy = 0.01;
/// Of what bodies with the energy energy_scale() can have: the momentum of what touches nothing fixed drifts
/// by no more.
inline constexpr double free_momentum = 0.01;
/// A5 with next-frame joints gets worse with more sub-steps than this (report's claim 6).
inline constexpr int most_substeps_of_a5 = 100;

struct Violation {
  enum class Severity {
    warning,    ///< is said, and an error with --strict
    unbounded,  ///< the same, and the run is not bounded
    torn,       ///< an error always: a joint gap larger than the scene
  };
  std::string text;  ///< "joint gap 0.56 m, above 0.05 m"
  Severity severity;
};

/// Returns what no motion of the scene does. Gaps, penetrations and energies count beyond the start's own.
std::vector<Violation> violations(const Scene& scene, const Metrics& metrics);

/// Returns the same and what is known to be wrong with the settings.
std::vector<Violation> violations(const Scene& scene, const Settings& settings, const Metrics& metrics);

/// Their texts, with semicolons between them.
std::string joined(const std::vector<Violation>& violations);

}  // namespace substep
