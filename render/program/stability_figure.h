#pragma once
/// The stability map of τ and κ as a picture, drawn by the program gnuplot.

#include <string>
#include <vector>

#include "sim/measure/stability_map.h"

namespace substep {

/// An SVG file: a panel for each algorithm with its points, stable or not, and the closed form's border.
/// Throws Error when gnuplot is not there or fails.
std::string stability_figure(const std::vector<StabilityPoint>& points);

}  // namespace substep
