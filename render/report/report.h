#pragma once
/// The report: one page of what a sweep measured, with its figures, tables and what to choose when.

#include "render/report/document.h"
#include "render/report/figures.h"

namespace substep {

/// `progress` hears the share done: figures take a while.
Document make_report(const FigureSource& source, const std::function<void(double)>& progress);

}  // namespace substep
