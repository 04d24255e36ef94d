#include "golden/compare/image_comparison.h"

#include <algorithm>
#include <cstdlib>

namespace substep::golden {
namespace {

constexpr int blank_range = 2;

/// Returns what differs between two pictures of one size, without a judgement.
ImageComparison measure(const render::Image& expected, const render::Image& actual, int level) {
  ImageComparison c;
  c.pixels = std::int64_t{expected.width} * expected.height;
  c.left = expected.width;
  c.top = expected.height;
  for (int y = 0; y < expected.height; ++y) {
    const std::uint8_t* e = expected.pixel(0, y);
    const std::uint8_t* a = actual.pixel(0, y);
    for (int x = 0; x < expected.width; ++x, e += 3, a += 3) {
      const int largest = std::max({std::abs(e[0] - a[0]), std::abs(e[1] - a[1]), std::abs(e[2] - a[2])});
      if (largest == 0) continue;
      ++c.differing;
      if (largest > level) ++c.above_level;
      c.left = std::min(c.left, x);
      c.right = std::max(c.right, x);
      c.top = std::min(c.top, y);
      c.bottom = y;
      if (largest <= c.max) continue;
      c.max = largest;
      c.max_x = x;
      c.max_y = y;
    }
  }
  return c;
}

}  // namespace

std::string_view name(Judgement judgement) {
  constexpr std::array<std::string_view, 5> names{"exact", "within tolerance", "size", "hard limit",
                                                  "pixel count"};
  return names[static_cast<std::size_t>(judgement)];
}

ImageComparison compare(const render::Image& expected, const render::Image& actual,
                        const ImageTolerance& tolerance) {
  ImageComparison result;
  if (expected.width != actual.width || expected.height != actual.height) {
    result.judgement = Judgement::size;
    return result;
  }
  result.pixels = std::int64_t{expected.width} * expected.height;
  // With both pictures at hand, comparing them is what comparing their hashes stands for, and faster.
  if (expected.rgb == actual.rgb) return result;
  result = measure(expected, actual, tolerance.level);
  result.judgement = result.max > tolerance.hard            ? Judgement::hard
                     : result.above_level > tolerance.count ? Judgement::count
                                                            : Judgement::within;
  return result;
}

bool is_blank(const render::Image& image) {
  std::array<std::uint8_t, 3> low{255, 255, 255};
  std::array<std::uint8_t, 3> high{0, 0, 0};
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    low[i % 3] = std::min(low[i % 3], image.rgb[i]);
    high[i % 3] = std::max(high[i % 3], image.rgb[i]);
  }
  for (std::size_t channel = 0; channel < 3; ++channel) {
    if (high[channel] > low[channel] + blank_range) return false;
  }
  return true;
}

}  // namespace substep::golden
