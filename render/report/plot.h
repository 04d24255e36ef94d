#pragma once
/// A sheet of plots in the style of all figures: readable in print, in dark mode and with colour blindness,
/// since each series has its own point shape.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "sim/model/settings.h"

namespace substep::report {

struct SeriesStyle {
  int hue = 0;    ///< index of render::inks
  int shape = 7;  ///< gnuplot's point type: 7 disc, 6 ring, 5 square, 9 triangle, 11 triangle down, 2 cross
  bool dashed = false;
  bool line = true;
  bool points = true;
  double size = 1;  ///< of points

  bool operator==(const SeriesStyle&) const = default;
};

/// Returns the style of an algorithm in all figures.
SeriesStyle style_of(Algorithm algorithm);

struct Series {
  std::string title;  ///< equal titles on one sheet have one entry in the legend
  SeriesStyle style;
  std::vector<std::array<double, 2>> points = {};  ///< points that are not finite are left out
  std::vector<double> values = {};                 ///< a number for each point, for the .csv; may be empty
};

struct Axis {
  std::string title;
  bool logarithmic = false;
  std::optional<std::array<double, 2>> range = {};  ///< absent: the data's
  std::string tics = {};                            ///< in gnuplot's syntax; empty: gnuplot's choice

  bool holds(double value) const { return !range || ((*range)[0] <= value && value <= (*range)[1]); }
};

/// Text to the left of a point.
struct Note {
  double x;
  double y;
  std::string text;
  bool is_below = false;
};

struct Panel {
  std::string title = {};
  Axis x = {};
  Axis y = {};
  std::vector<Series> series = {};
  /// The corner below a line of slope 1 on logarithmic axes, of a triangle that is a factor of 3 wide.
  std::optional<std::array<double, 2>> triangle = {};
  std::vector<Note> notes = {};
};

/// A series that a sheet omits.
struct LeftOut {
  std::string scene;
  std::string series;
  std::string reason;
  bool operator==(const LeftOut&) const = default;
};

struct Sheet {
  std::string title = {};
  std::vector<std::string> caption = {};  ///< lines: what the sheet shows, and the settings
  std::vector<LeftOut> left_out = {};
  int columns = 3;      ///< the most panels side by side
  double width = 1200;  ///< pixels
  double panel_height = 320;
  std::vector<Panel> panels = {};
};

enum class PictureFormat { svg, pdf, png };

/// The layout of a sheet in print.
struct FigureStyle {
  /// Width, mm. As many panels stand side by side as there is room for, and all text has nearly one size.
  /// Absent: the sheet's own layout, for screens; its SVG follows the reader's dark mode.
  std::optional<double> width = {};
  double text = 8;  ///< points, of panel titles and axes; the caption has 11/12 of it, the title 13/12
  std::string font = "DejaVu Sans";
  bool title = true;
  bool caption = true;
  bool transparent = false;  ///< no white background
  double dpi = 300;          ///< of a PNG
};

/// Returns whether the point is finite, and above 0 on each logarithmic axis.
bool can_be_drawn(const std::array<double, 2>& point, const Panel& panel);

/// Gives series of different titles that look alike different point shapes.
void separate_styles(Sheet& sheet);

/// Returns title and caption, then a line for each series that is left out.
std::string caption_text(const Sheet& sheet);

/// Draws the sheet with gnuplot. The same sheet gives the same SVG, byte by byte. Throws Error where gnuplot
/// is missing or the sheet has no panel.
std::string draw(const Sheet& sheet, PictureFormat format, const FigureStyle& style = {});

/// Returns the sheet with only those panels and series whose titles begin with one of these words; an empty
/// list keeps all. Throws Error where a word matches no title.
Sheet with_choice(Sheet sheet, const std::vector<std::string>& panels,
                  const std::vector<std::string>& series);

/// Returns the sheet with these ranges of all panels' axes. Throws Error where an axis is logarithmic and its
/// range is not above 0, and where a panel has no point in them.
Sheet with_ranges(Sheet sheet, const std::optional<std::array<double, 2>>& x,
                  const std::optional<std::array<double, 2>>& y);

}  // namespace substep::report
