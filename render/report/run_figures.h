#pragma once
/// Figures of runs that are made for them: drift over time, cost against size, sweeps over friction problems.

#include "render/report/figures.h"

namespace substep::report {

Sheet drift_sheet(const FigureSource& source);
Sheet size_sheet(const FigureSource& source);

/// Draws FigureSource::problems. Throws Error where there are none, more than twelve, or one cannot be read.
Sheet sweep_errors_sheet(const FigureSource& source);

}  // namespace substep::report
