#pragma once
/// The strips below a panel's picture: curves of its run over the film's time.

#include <cstddef>
#include <string>

#include "render/image.h"
#include "render/video/colors.h"
#include "render/video/comparison.h"
#include "render/video/strip_axis.h"

namespace substep::render {

/// A curve of several: pixels that are drawn and left out in turn, at 720 lines; later ones leave out more,
/// so that those below show.
struct Dash {
  double drawn;
  double left_out;
};
Dash dash_of(std::size_t run);

/// Returns the baseline that centres capitals and digits of this size in a box.
double baseline(double y, double height, double size);

/// Pixels of a frame.
struct Box {
  int x = 0, y = 0, width = 0, height = 0;
};

struct StripBox {
  Strip kind = Strip::error;
  StripAxis axis;
  Box strip{};
  Box plot{};
};

/// Draws the strips of a film whose size is `scale` times 720 lines.
struct StripPainter {
  const Comparison& comparison;
  double scale = 1;
  bool has_axis = true;    ///< beside each strip
  bool has_names = false;  ///< in each strip, where there are several

  /// Returns the size of text, pixels.
  double text_size(double at_720) const;

  /// Returns the width of the longest name beside an axis, pixels.
  double axis_width(const StripAxis& axis) const;

  /// Draws what does not change. `has_key`: the names of the curves too.
  void draw_ground(Image& image, const StripBox& strip, std::size_t run, bool has_key) const;

  /// Draws the run's curve up to film frame k.
  void draw(Image& image, const StripBox& strip, std::size_t run, std::size_t k) const;

 private:
  double plot_x(const StripBox& strip, std::size_t k) const;
  double plot_y(const StripBox& strip, double value) const;
  void draw_grid(Image& image, const StripBox& strip) const;
  void draw_certainty(Image& image, const StripBox& strip) const;
  void draw_key(Image& image, const StripBox& strip) const;
  void draw_curve(Image& image, const StripBox& strip, std::size_t run, std::size_t end, const Color& color,
                  bool dashed) const;
  void draw_clipped(Image& image, const StripBox& strip, std::size_t run, std::size_t end) const;
  std::string value_label(const StripBox& strip, std::size_t run, std::size_t k) const;
};

}  // namespace substep::render
