#pragma once
/// The report: one page of what a sweep measured, with its figures, tables and what to choose when.

#include <functional>
#include <map>
#include <string>

#include "render/report/document.h"
#include "render/report/figures.h"

namespace substep::report {

/// Scenes that have a card each; of more there is a table.
inline constexpr std::size_t most_cards = 8;

/// The page with these figures, by their names. Other figures are left out.
Document report_page(const FigureSource& source, const std::map<std::string, DrawnFigure>& pictures);

/// The page with all figures that there are. `progress` hears the share done: figures take a while.
Document make_report(const FigureSource& source, const std::function<void(double)>& progress);

}  // namespace substep::report
