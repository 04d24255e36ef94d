#include "golden/compare/image_comparison.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace substep::golden {
namespace {

constexpr int difference_gain = 16;
constexpr int blank_range = 2;

/// The differences of all pixels, before a tolerance is applied.
struct Figures {
  ImageComparison comparison;
  std::array<std::int64_t, 256> histogram{};  ///< pixels by their largest channel difference
};

/// The pixels of row y, whose channels are e and a, from x = `begin` to `end`. Returns the sum of their
/// channels' differences.
int compare_pixels(const std::uint8_t* e, const std::uint8_t* a, int y, int begin, int end,
                   Figures& figures) {
  ImageComparison& c = figures.comparison;
  int sum = 0;
  for (int x = begin; x < end; ++x) {
    const int r = std::abs(e[3 * x] - a[3 * x]);
    const int g = std::abs(e[3 * x + 1] - a[3 * x + 1]);
    const int b = std::abs(e[3 * x + 2] - a[3 * x + 2]);
    const int largest = std::max({r, g, b});
    ++figures.histogram[static_cast<std::size_t>(largest)];
    if (largest == 0) continue;
    sum += r + g + b;
    c.left = std::min(c.left, x);
    c.right = std::max(c.right, x);
    if (largest > c.max) {
      c.max = largest;
      c.max_x = x;
      c.max_y = y;
    }
  }
  return sum;
}

Figures measure(const render::Image& expected, const render::Image& actual) {
  Figures figures;
  ImageComparison& c = figures.comparison;
  c.pixels = std::int64_t{expected.width} * expected.height;
  const int width = expected.width;
  const int height = expected.height;
  constexpr int side = ImageComparison::tile_size;
  const int tiles_across = (width + side - 1) / side;
  const std::size_t row_bytes = static_cast<std::size_t>(width) * 3;
  std::vector<std::int64_t> tile_sums(static_cast<std::size_t>(tiles_across));
  std::int64_t sum = 0;
  c.left = width;
  c.top = height;
  for (int band = 0; band < height; band += side) {
    const int band_end = std::min(band + side, height);
    std::fill(tile_sums.begin(), tile_sums.end(), 0);
    for (int y = band; y < band_end; ++y) {
      const std::uint8_t* e = expected.pixel(0, y);
      const std::uint8_t* a = actual.pixel(0, y);
      if (std::memcmp(e, a, row_bytes) == 0) {
        figures.histogram[0] += width;
        continue;
      }
      c.top = std::min(c.top, y);
      c.bottom = y;
      for (int tile = 0; tile < tiles_across; ++tile) {
        const int end = std::min((tile + 1) * side, width);
        tile_sums[static_cast<std::size_t>(tile)] += compare_pixels(e, a, y, tile * side, end, figures);
      }
    }
    for (int tile = 0; tile < tiles_across; ++tile) {
      const std::int64_t tile_sum = tile_sums[static_cast<std::size_t>(tile)];
      sum += tile_sum;
      const int across = std::min(side, width - tile * side);
      const double mean = static_cast<double>(tile_sum) / (3.0 * across * (band_end - band));
      if (mean > c.tile_mean) {
        c.tile_mean = mean;
        c.tile_x = tile * side;
        c.tile_y = band;
      }
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

Judgement judge(const ImageComparison& c, const ImageTolerance& tolerance) {
  if (c.max > tolerance.hard) return Judgement::hard;
  if (c.above_level > tolerance.count) return Judgement::count;
  if (c.mean > tolerance.mean) return Judgement::mean;
  if (c.tile_mean > tolerance.tile_mean) return Judgement::tile;
  return Judgement::within;
}

}  // namespace

std::string_view name(Judgement judgement) {
  constexpr std::array<std::string_view, 7> names{
      "exact", "within tolerance", "size", "hard limit", "pixel count", "mean", "worst tile"};
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
  result.judgement = judge(result, tolerance);
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
