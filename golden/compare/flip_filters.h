#pragma once
/// What the eye resolves of a picture (flip.h): the filters, and the rows of a picture seen through them.

#include <array>
#include <vector>

#include "golden/compare/cells.h"
#include "golden/compare/flip_color.h"
#include "render/image.h"

namespace substep::golden {

/// Weights at −r … r, each in all lanes.
using FlipKernel = std::vector<cells::Floats>;

/// A filter for each of lightness, red–green and, in two parts, blue–yellow; and a Gaussian with its first
/// and second derivatives, by which edges and points are found.
struct FlipFilters {
  explicit FlipFilters(float pixels_per_degree);

  FlipKernel lightness, red_green, blue_narrow, blue_wide;
  float narrow_share = 0;  ///< of the narrow part in blue–yellow
  FlipKernel gaussian, first, second;
  int reach = 0;  ///< how far any of them reaches, pixels
};

/// One row of a strip as it is seen.
struct SeenRow {
  static constexpr int width = 128;
  using Line = std::array<float, width>;
  Line lightness, red_green, blue_yellow;  ///< opponent colour
  Line edges, points;                      ///< how strong
};

/// A strip of a picture, `SeenRow::width` wide. Every filter is applied to rows first and to columns then;
/// the rows within reach are kept, so that going down a strip each is filtered once.
class SeenStrip {
 public:
  SeenStrip(const render::Image& image, const FlipFilters& filters, const FlipColors& colors);

  /// Goes to the strip from column `left` on. Beyond the picture its border is repeated.
  void start(int left);
  void see(int y, SeenRow& row);

 private:
  enum Plane { lightness, red_green, blue_narrow, blue_wide, smooth, first, second, planes };

  void filter_row(int y);
  float* line(Plane plane, int y);

  const render::Image& image_;
  const FlipFilters& filters_;
  const FlipColors& colors_;
  int left_ = 0;
  std::vector<int> rows_;      ///< which row of the picture a kept one is; −1: none
  std::vector<float> kept_;    ///< rows filtered along themselves, for each plane
  std::vector<float> pixels_;  ///< one row before that, with what is within reach of it
  std::vector<const float*> sources_, smooth_sources_;  ///< the rows that a kernel weighs
};

}  // namespace substep::golden
