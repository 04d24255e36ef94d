#pragma once
/// Compares a picture with the golden one: how much and where they differ.
///
/// Rules in their order; the first that applies decides:
///
///  1. size      width and height must be equal;
///  2. exact     pictures with equal pixels are equal, whatever the bytes of their files;
///  3. hard      no channel of any pixel may differ by more than `hard` levels;
///  4. count     at most `count` pixels may have a channel that differs by more than `level` levels;
///  5. within    what is left differs within the tolerance.
///
/// Levels are steps of the 8-bit sRGB code, 0 to 255.

#include <cstdint>
#include <optional>
#include <string_view>

#include "render/image.h"

namespace substep::golden {

struct ImageTolerance {
  int hard = 64;
  int level = 3;
  std::int64_t count = 20;
  /// The largest FLIP error of a pixel, which decides in place of rules 3 and 4 where it is given: two
  /// renderers that round edges differently look the same. The caller computes it.
  std::optional<double> flip;
};

enum class Judgement { exact, within, size, hard, count };

/// "exact", "within tolerance", "size", "hard limit", "pixel count".
std::string_view name(Judgement judgement);

inline bool passes(Judgement judgement) {
  return judgement == Judgement::exact || judgement == Judgement::within;
}

struct ImageComparison {
  Judgement judgement = Judgement::exact;
  std::int64_t pixels = 0;       ///< in each image; 0 when the sizes differ
  std::int64_t differing = 0;    ///< pixels
  std::int64_t above_level = 0;  ///< pixels with a channel that differs by more than the tolerance's level
  int max = 0;                   ///< largest difference of a channel, levels
  int max_x = 0, max_y = 0;      ///< the first pixel that has it, from the top left
  int left = 0, top = 0, right = -1, bottom = -1;  ///< the box of differing pixels, both ends included
};

ImageComparison compare(const render::Image& expected, const render::Image& actual,
                        const ImageTolerance& tolerance = {});

/// Returns true where no channel varies by more than two levels.
bool is_blank(const render::Image& image);

}  // namespace substep::golden
