#pragma once
/// A sheet of plots in the one style of all our figures: readable in print, in dark mode, and by people who
/// see colours differently (each series has a shape of its own too).

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace substep::report {

/// What a series looks like.
struct Look {
  int hue = 0;    ///< of inks.h
  int shape = 7;  ///< gnuplot's point type: 7 disc, 6 ring, 5 square, 9 triangle, 11 triangle down, 2 cross
  bool dashed = false;  ///< line
  bool line = true;     ///< points are joined
  bool points = true;
  double size = 1;  ///< of points
};

struct Series {
  std::string title;  ///< equal titles on one sheet have one entry in the legend
  Look look;
  std::vector<std::array<double, 2>> points;  ///< those that are not finite are left out
  std::vector<double> values = {};            ///< of the points, where they stand for a number of their own
};

struct Axis {
  std::string title;
  bool logarithmic = false;
  std::optional<std::array<double, 2>> range;  ///< else the data's
  std::string tics;                            ///< gnuplot's, where its own are not good
};

/// Shows a power law: a right triangle with this slope, its corner at (x, y), as wide as a factor `width` in
/// x.
struct SlopeTriangle {
  double x;
  double y;
  double width;
  double slope;
};

/// Words beside a point.
struct Note {
  double x;
  double y;
  std::string text;
  bool to_the_left = false;
  bool is_below = false;
};

struct Panel {
  std::string title;
  Axis x;
  Axis y;
  std::vector<Series> series;
  std::vector<SlopeTriangle> triangles;
  std::vector<Note> notes;
};

/// Runs that a sheet could show and does not.
struct LeftOut {
  std::string scene;
  std::string series;
  std::string reason;
  bool operator==(const LeftOut&) const = default;
};

struct Sheet {
  std::string title;
  std::vector<std::string> caption;  ///< lines: what it shows, and the settings
  std::vector<LeftOut> left_out;
  int columns = 3;      ///< of panels, at most
  double width = 1200;  ///< pixels
  double panel_height = 320;
  std::vector<Panel> panels;
};

enum class PictureFormat { svg, pdf, png };

/// For print: how wide, and what of the sheet.
struct FigureStyle {
  /// mm. As many panels stand side by side as there is room for, and all text has nearly one size. Absent:
  /// the sheet's own layout, for screens; its SVG follows the reader's dark mode.
  std::optional<double> width;
  double text =
      8;  ///< points; panels' titles and axes have this, the caption 11/12 and the title 13/12 of it
  std::string font = "DejaVu Sans";
  bool title = true;
  bool caption = true;
  bool transparent = false;  ///< ground
  double dpi = 300;          ///< of a PNG
};

/// Returns whether the point is finite, and on a logarithmic axis above 0.
bool can_be_drawn(const std::array<double, 2>& point, const Panel& panel);

/// Title and caption, then a line for each series that is left out.
std::string caption_text(const Sheet& sheet);

/// Throws Error when gnuplot is not there. The same sheet gives the same SVG, byte by byte.
std::string draw(const Sheet& sheet, PictureFormat format, const FigureStyle& style = {});

/// The figure with the panels and series alone whose titles begin with one of these words; none are given:
/// all. Throws Error where a word names nothing.
Sheet with_choice(Sheet sheet, const std::vector<std::string>& panels,
                  const std::vector<std::string>& series);

/// With these ranges of all panels' axes. Throws Error where an axis is logarithmic and a range is not above
/// 0.
Sheet with_ranges(Sheet sheet, const std::optional<std::array<double, 2>>& x,
                  const std::optional<std::array<double, 2>>& y);

}  // namespace substep::report
