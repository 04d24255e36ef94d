#pragma once
/// The strips below a panel's picture: curves of its run over the film's time, and their axes.

#include <string>
#include <string_view>
#include <vector>

#include "render/image.h"
#include "render/video/comparison.h"

namespace substep::render {

/// Returns the strips of these names, each once. Throws Error.
std::vector<Strip> strips_named(const std::vector<std::string>& names);

/// Returns the strip's name: "error".
std::string name_of(Strip strip);

/// Returns the quantity of a strip, for a legend.
std::string words_of(const Comparison& comparison, Strip strip);

/// Returns a run's values in a strip, by film frame.
const std::vector<double>& series_of(const Run& run, Strip strip);

/// The dashes of one of several curves: drawn and omitted lengths, pixels at 720 lines. Later curves omit
/// more, so that the curves below show.
struct Dash {
  double drawn;
  double left_out;
};
Dash dash_of(std::size_t run);

/// Returns the next of 1, 2, 5, 10, … away from 0.
double rounded_out(double value);

/// The axis of a strip, the same in all panels: decades of metres, or numbers about a mark.
struct StripAxis {
  bool is_logarithmic = true;
  int lower = -3, upper = 0;  ///< powers of ten, of a logarithmic axis
  double low = 0, high = 1;   ///< in `unit`, of others
  double mark = 0;            ///< energy at the start, or the expected value
  std::string_view unit = "m";

  double height(double value) const;      ///< in the strip: 0 at the bottom, 1 at the top
  std::string label(double value) const;  ///< of a run's value
};
StripAxis axis_of(const Comparison& comparison, Strip strip);

/// Returns the baseline that centres capitals and digits of this size in a box.
double baseline(double y, double height, double size);

/// A rectangle of a frame, pixels.
struct Box {
  int x = 0, y = 0, width = 0, height = 0;
};

struct StripBox {
  Strip kind = Strip::error;
  StripAxis axis;
  Box strip{};
  Box plot{};
};

/// Draws the strips of a film.
struct StripPainter {
  const Comparison& comparison;
  double scale = 1;        ///< of the film, 1 at 720 lines
  bool has_axis = true;    ///< whether an axis is beside each strip
  bool has_names = false;  ///< whether each strip has its name, where there are several

  /// Returns the size of text, pixels.
  double text_size(double at_720) const;

  /// Returns the width of the longest name beside an axis, pixels.
  double axis_width(const StripAxis& axis) const;

  /// Draws the parts that do not change. `has_key`: also the names of the curves.
  void draw_ground(Image& image, const StripBox& strip, std::size_t run, bool has_key) const;

  /// Draws the run's curve up to film frame k.
  void draw(Image& image, const StripBox& strip, std::size_t run, std::size_t k) const;
};

}  // namespace substep::render
