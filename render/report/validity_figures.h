#pragma once
/// Maps of where runs are right: mass ratio, stiffness, τ and κ, of one row and of coupled ones.

#include "render/report/figures.h"

namespace substep::report {

Sheet mass_ratio_sheet(const FigureSource& source);
Sheet stiffness_sheet(const FigureSource& source);
Sheet stability_sheet(const FigureSource& source);
Sheet coupled_rows_sheet(const FigureSource& source);

}  // namespace substep::report
