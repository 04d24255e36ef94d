#pragma once
/// The report: one page of a sweep's measurements, with figures, tables and recommendations.

#include <functional>
#include <map>
#include <string>

#include "render/report/document.h"
#include "render/report/figures.h"

namespace substep::report {

/// Largest number of scenes that get a card each; more scenes share a table.
inline constexpr std::size_t most_cards = 8;

/// Returns the page with only the figures in `pictures`, which has them by name.
Document report_page(const FigureSource& source, const std::map<std::string, RenderedFigure>& pictures);

/// Returns the page with all figures of the source. `progress` receives the fraction done.
Document make_report(const FigureSource& source, const std::function<void(double)>& progress);

}  // namespace substep::report
