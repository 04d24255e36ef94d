#pragma once
/// Figures of runs that are made for them: drift over time, cost against size.

#include "render/report/figures.h"

namespace substep::report {

Sheet drift_sheet(const FigureSource& source);
Sheet size_sheet(const FigureSource& source);

}  // namespace substep::report
