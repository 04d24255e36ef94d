#pragma once
/// The report: one page of what a sweep measured, with its figures, tables and what to choose when.

#include <functional>
#include <map>
#include <string>

#include "render/report/document.h"
#include "render/report/figures.h"

namespace substep::report {

/// The most scenes for which each has a card; more are a table.
inline constexpr std::size_t most_cards = 8;

/// Returns the page with these figures, by their names, and without others.
Document report_page(const FigureSource& source, const std::map<std::string, DrawnFigure>& pictures);

/// Returns the page with all figures of the source. `progress` receives the fraction done.
Document make_report(const FigureSource& source, const std::function<void(double)>& progress);

}  // namespace substep::report
