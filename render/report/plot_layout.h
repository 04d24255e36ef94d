#pragma once
/// Where the parts of a sheet of plots stand: measured from their text, so that none covers another.

#include <string>
#include <vector>

#include "render/report/plot.h"

namespace substep::report {

/// An entry of the legend: a sample of the series and its title beside it.
struct LegendEntry {
  std::vector<std::string> lines;  ///< of the title
  Look look;
  double x = 0;  ///< of the sample's left end
  double y = 0;  ///< of the first line's middle
};

/// In units of which the text's size is 12 (on screens, pixels), from the top left corner.
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

  double left(std::size_t panel) const;  ///< of the panel's plot
  double right(std::size_t panel) const;
  double top(std::size_t panel) const;
  double bottom(std::size_t panel) const;
};

inline constexpr double caption_size = 11;
inline constexpr double line_height = 17;
inline constexpr double sample_width = 28;  ///< of a series in the legend
inline constexpr double sample_gap = 6;

/// Width of text in the figures' font.
double width_of(const std::string& text, double size);

/// `width`: of the picture, in units; 0: as wide as the sheet says.
Layout layout_of(const Sheet& sheet, const FigureStyle& style, double width);

/// The series of a sheet, each title once, in the order in which they come. Lines are not set.
std::vector<std::pair<std::string, Look>> series_titles(const Sheet& sheet);

}  // namespace substep::report
