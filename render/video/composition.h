#pragma once
/// The layout and drawing of a film's frame: title, panels with their headers, pictures and strips, and key.

#include <string>
#include <utility>
#include <vector>

#include "render/image.h"
#include "render/text.h"
#include "render/video/comparison.h"
#include "render/video/strips.h"
#include "render/video/titles.h"

namespace substep::render {

/// A piece of text and its colour.
using KeyEntry = std::pair<std::string, Color>;

/// Returns the given title, or the scene's name with blanks: "rod chain".
std::string film_title(const Scene& scene, const std::string& given);

/// Returns the panels in each row of a frame of this size, such that pictures of the usual shape are as large
/// as can be. Later rows may have one less, whose panels are wider. `above`: height that each row spends on
/// headers and strips.
std::vector<int> rows_for(int count, int width, int height, int above);

/// Throws Error for sizes that films cannot have: below 180 pixels, above 7680×4320 or odd (H.264 needs even
/// ones).
void check_film_size(int width, int height);

class Composition {
 public:
  /// Lays out panels for a frame of this size and draws the parts that do not change. `key` stands below the
  /// panels. Throws Error when the size cannot be used, or leaves no room for the pictures.
  Composition(const Comparison& comparison, const std::string& title, int width, int height,
              const std::vector<KeyEntry>& key = {}, const std::vector<Strip>& strips = {});

  int picture_width(std::size_t run = 0) const { return panels_[run].picture.width; }
  int picture_height() const { return picture_height_; }

  /// Returns film frame k with these pictures of the runs, in their order.
  Image frame(int k, const std::vector<Image>& pictures) const;

 private:
  struct Panel {
    Box header, picture;
    std::vector<StripBox> strips;
  };

  int scaled(double at_720, double least) const;
  std::vector<std::string> legend() const;
  void lay_out();
  void lay_out_strips(Panel& panel, int y, int height) const;
  void lay_out_key(const std::vector<KeyEntry>& key);
  void draw_title(const std::string& title);
  double header_factor() const;
  void draw_header(std::size_t run, double factor);
  void draw_key();
  /// Returns whether the frame's number has room beside the clock.
  bool has_count() const { return width_ >= 900 * scale_; }
  std::string count_text(std::size_t k) const;
  void draw_clock(Image& image, std::size_t k) const;
  void draw_notice(Image& image, std::size_t run, const std::string& text, bool over_all) const;
  void draw_end(Image& image, std::size_t run, std::size_t k) const;

  const Comparison& comparison_;
  Titles titles_;
  int width_;
  int height_;
  double scale_;  ///< 1 at 720 lines
  StripPainter painter_;
  TextStyle legend_style_;
  TextStyle count_style_;
  TextStyle key_style_;                     ///< of the key, in any colour
  std::vector<std::vector<KeyEntry>> key_;  ///< its lines
  int key_height_ = 0;
  double axis_width_ = 0;      ///< of the longest name beside a strip, pixels
  std::vector<Strip> strips_;  ///< of each panel, from the top
  int picture_height_ = 0;
  Box title_;
  std::vector<Panel> panels_;
  Image background_;
};

}  // namespace substep::render
