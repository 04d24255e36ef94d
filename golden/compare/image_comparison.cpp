#include "golden/compare/image_comparison.h"

#include <algorithm>
#include <cstdlib>

namespace substep::golden {
namespace {

constexpr int difference_gain = 16;
constexpr int blank_range = 2;

/// The differences of all pixels, before a tolerance is applied.
struct Figures {
  ImageComparison comparison;
  std::array<std::int64_t, 256> histogram{};  ///< pixels by their largest channel difference
};

Figures measure(const render::Image& expected, const render::Image& actual) {
  Figures figures;
  ImageComparison& c = figures.comparison;
  c.pixels = std::int64_t{expected.width} * expected.height;
  c.left = expected.width;
  c.top = expected.height;
  std::int64_t sum = 0;
  for (int y = 0; y < expected.height; ++y) {
    const std::uint8_t* e = expected.pixel(0, y);
    const std::uint8_t* a = actual.pixel(0, y);
    for (int x = 0; x < expected.width; ++x, e += 3, a += 3) {
      const std::array<int, 3> channels{std::abs(e[0] - a[0]), std::abs(e[1] - a[1]), std::abs(e[2] - a[2])};
      const int largest = std::max({channels[0], channels[1], channels[2]});
      ++figures.histogram[static_cast<std::size_t>(largest)];
      if (largest == 0) continue;
      sum += channels[0] + channels[1] + channels[2];
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
  c.mean = static_cast<double>(sum) / (3.0 * static_cast<double>(c.pixels));
  return figures;
}

std::int64_t count_above(const std::array<std::int64_t, 256>& histogram, int level) {
  std::int64_t count = 0;
  for (int i = std::max(level, -1) + 1; i < 256; ++i) count += histogram[static_cast<std::size_t>(i)];
  return count;
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
  const Figures figures = measure(expected, actual);
  result = figures.comparison;
  for (std::size_t i = 0; i < ImageComparison::levels.size(); ++i) {
    result.above[i] = count_above(figures.histogram, ImageComparison::levels[i]);
  }
  result.above_level = count_above(figures.histogram, tolerance.level);
  result.judgement = result.max > tolerance.hard            ? Judgement::hard
                     : result.above_level > tolerance.count ? Judgement::count
                                                            : Judgement::within;
  return result;
}

render::Image difference_image(const render::Image& expected, const render::Image& actual) {
  render::Image difference(expected.width, expected.height);
  for (std::size_t i = 0; i < difference.rgb.size(); ++i) {
    const int d = std::abs(expected.rgb[i] - actual.rgb[i]) * difference_gain;
    difference.rgb[i] = static_cast<std::uint8_t>(std::min(d, 255));
  }
  return difference;
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
