#pragma once
/// Figures through the program gnuplot.

#include <string>

namespace substep::report {

/// What gnuplot prints for a script. Throws Error when it is not there or fails.
std::string gnuplot(const std::string& script);

}  // namespace substep::report
