#pragma once
/// Time of the solver alone, of several procedures that are put beside each other. Differs from run to run.

#include <vector>

#include "sim/simulation.h"

namespace substep {

/// Time of the solver alone (s3, s4) in each step, in seconds, of several procedures step by step in turn.
std::vector<std::vector<double>> solver_times(const Scene& scene, const std::vector<Settings>& all,
                                              const std::vector<Procedure>& procedures, int steps);

double median(std::vector<double> values);

}  // namespace substep
