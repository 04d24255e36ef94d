#pragma once
/// The colour spaces of FLIP (flip.h), four pixels at once.

#include <array>
#include <cstdint>

#include "golden/compare/cells.h"

namespace substep::golden {

/// Three numbers of each of four pixels.
using FlipColor = std::array<cells::Floats, 3>;

/// Of 8-bit sRGB (IEC 61966-2-1), 0 to 1.
const std::array<float, 256>& linear_levels();

/// XYZ is relative to the white of D65 throughout.
class FlipColors {
 public:
  FlipColors();

  /// Linear RGB → YCxCz: lightness, red–green, blue–yellow; linear in RGB (the paper's section 4.1).
  FlipColor opponent(const FlipColor& rgb) const;

  /// YCxCz, clipped to what a screen shows → L*a*b*, with a* and b* scaled by 0.01 L*: colours count less in
  /// the dark (Hunt).
  FlipColor perceived(const FlipColor& opponent) const;

  /// Differences of perceived colours (HyAB) to the power 0.7, then [0, 0.4 of the largest] → [0, 0.95] and
  /// the rest → [0.95, 1]: large differences are compressed.
  cells::Floats difference(const FlipColor& p, const FlipColor& q) const;

 private:
  struct Matrix {
    std::array<std::array<float, 3>, 3> rows;
    FlipColor operator*(const FlipColor& c) const;
  };
  FlipColor hunt_lab(const FlipColor& rgb) const;

  Matrix xyz_from_rgb_;
  Matrix rgb_from_xyz_;
  float knee_;        ///< of the compression
  float below_knee_;  ///< its slope
  float above_knee_;
};

/// Relative luminance of an opponent colour's lightness.
cells::Floats luminance(cells::Floats lightness);

}  // namespace substep::golden
