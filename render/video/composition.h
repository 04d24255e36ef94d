#pragma once
/// One frame of a comparison video: the title, six panels with their labels, pictures and error strips.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "render/image.h"
#include "render/video/comparison.h"

namespace substep {

/// Dark and calm, so that the six accents stand out; these are told apart by the colour-blind too (after
/// Okabe and Ito, lightened for the dark ground).
using Color = std::array<std::uint8_t, 3>;
Color accent(Algorithm algorithm);
inline constexpr Color reference_accent{205, 211, 220};

/// "1.23 m", "45.6 mm", "7.8 µm": three digits at most, for reading, not for files.
std::string length_label(double metres);

/// Decades of the error axis, the same in all panels.
struct ErrorScale {
  int lower = -3;  ///< powers of ten, m
  int upper = 0;

  double height(double metres) const;  ///< of an error in the strip: 0 at the bottom, 1 at the top
};
ErrorScale error_scale(const Comparison& comparison);

class Composition {
 public:
  /// Lays out panels for a frame of this size and draws what does not change. Throws Error when the size is
  /// below 320×180, above 7680×4320 or odd (H.264 wants even).
  Composition(const Comparison& comparison, const std::string& title, int width, int height);

  int picture_width() const { return picture_width_; }
  int picture_height() const { return picture_height_; }

  /// `pictures` are those of the runs at this video frame, in their order.
  Image frame(int k, const std::vector<Image>& pictures) const;

 private:
  struct Box {
    int x = 0, y = 0, width = 0, height = 0;
  };
  struct Panel {
    Box header, picture, strip, plot;
  };

  double text_size(double at_720) const;
  Color color_of(std::size_t run) const;
  double plot_x(const Panel& panel, std::size_t k) const;
  void lay_out();
  void draw_background(const std::string& title);
  void draw_header(const Panel& panel, std::size_t run);
  void draw_grid(const Panel& panel, bool labels);
  void draw_curve(Image& image, const Panel& panel, std::size_t run, std::size_t end,
                  const Color& color) const;
  void draw_clock(Image& image, std::size_t k) const;
  void draw_strip(Image& image, std::size_t run, std::size_t k) const;
  void draw_fate(Image& image, std::size_t run, std::size_t k) const;

  const Comparison& comparison_;
  int width_;
  int height_;
  double scale_;  ///< 1 at 720 lines
  ErrorScale error_scale_;
  int picture_width_ = 0;
  int picture_height_ = 0;
  Box title_;
  std::vector<Panel> panels_;
  Image background_;
};

}  // namespace substep
