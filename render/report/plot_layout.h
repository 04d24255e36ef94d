#pragma once
/// The layout of a sheet of plots, measured from its texts, so that none covers another.

#include <string>
#include <utility>
#include <vector>

#include "render/report/plot.h"

namespace substep::report {

/// An entry of the legend: a sample of the series and its title beside it.
struct LegendEntry {
  std::vector<std::string> lines;  ///< of the title
  SeriesStyle style;
  double x = 0;  ///< of the sample's left end
  double y = 0;  ///< of the first line's middle
};

/// Positions from the picture's top left corner, in units in which text has size 12 (on screens, pixels).
struct Layout {
  double width = 0;
  double height = 0;
  int columns = 1;
  double panel_width = 0;  ///< with its axes
  double panel_height = 0;
  double left_margin = 0;  ///< of a panel, for its y axis
  double top_margin = 0;
  double bottom_margin = 0;
  double title_size = 0;
  std::vector<std::string> title;  ///< lines
  double panels_top = 0;
  std::vector<LegendEntry> legend;
  double caption_top = 0;  ///< middle of the first line
  std::vector<std::string> caption;

  double left(std::size_t panel) const;  ///< edge of the panel's plot
  double right(std::size_t panel) const;
  double top(std::size_t panel) const;
  double bottom(std::size_t panel) const;
};

inline constexpr double caption_size = 11;
inline constexpr double line_height = 17;
inline constexpr double sample_width = 28;  ///< of a series in the legend
inline constexpr double sample_gap = 6;

/// Returns the width of text in the figures' font.
double width_of(const std::string& text, double size);

/// Lays out a sheet. `width`: of the picture, in units; 0: the sheet's own.
Layout layout_of(const Sheet& sheet, const FigureStyle& style, double width);

/// Returns the different titles of a sheet's series, in order of appearance, each with its first style.
std::vector<std::pair<std::string, SeriesStyle>> series_titles(const Sheet& sheet);

}  // namespace substep::report
