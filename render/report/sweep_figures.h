#pragma once
/// Figures of what a sweep measured: work and errors.

#include "render/report/figures.h"

namespace substep::report {

Sheet work_rows_sheet(const FigureSource& source, bool contacts);
Sheet work_time_sheet(const FigureSource& source, bool contacts);
Sheet engines_sheet(const FigureSource& source, bool contacts);
/// Draws errors against the step, also of engines whose CPU times cannot be compared.
Sheet engine_steps_sheet(const FigureSource& source, bool contacts);
/// Draws one scene's errors against the cost of its runs, and marks the chosen ones.
Sheet choice_sheet(const std::vector<SweepRecord>& own);
Sheet order_sheet(const FigureSource& source);
Sheet slopes_sheet(const FigureSource& source);
Sheet equal_rows_sheet(const FigureSource& source);

}  // namespace substep::report
