#pragma once
/// Convergence of row-by-row sweeps on friction problems of files.

#include <filesystem>
#include <vector>

#include "sim/direct/frozen_problem.h"

namespace substep {

/// Reads a problem's file. Throws Error that names the file, the position and the fault.
FrozenProblem load_frozen_problem(const std::filesystem::path& file);

/// The natural map's error after a number of sweep_rows().
struct SweepError {
  int sweeps;
  double error;
};

/// Returns the errors after 1, 2, 4, … sweeps from zero, until one is at most `tolerance`, or after 4096
/// sweeps.
std::vector<SweepError> sweep_errors(const FrozenProblem& problem, double tolerance);

}  // namespace substep
