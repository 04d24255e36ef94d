#pragma once
/// Figures through the program gnuplot.

#include <string>

namespace substep::report {

/// Returns what gnuplot prints for a script. Throws Error where gnuplot is missing or fails.
std::string gnuplot(const std::string& script);

}  // namespace substep::report
