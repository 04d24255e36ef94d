#pragma once
/// Figures of what each approximation of A4 and A5 costs.

#include "render/report/figures.h"

namespace substep::report {

Sheet ablation_sheet(const FigureSource& source);

}  // namespace substep::report
