#include "golden/compare/flip.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "golden/compare/cells.h"
#include "golden/compare/flip_color.h"
#include "golden/compare/flip_filters.h"

namespace substep::golden {
namespace {

using cells::Floats;

/// The rows of a strip that any differing pixel is within reach of: elsewhere both pictures are seen alike,
/// to the last bit.
std::vector<bool> rows_in_reach(const render::Image& expected, const render::Image& actual, int strip,
                                int reach) {
  const int left = std::max(strip - reach, 0);
  const int right = std::min(strip + SeenRow::width + reach, expected.width);
  std::vector<bool> in_reach(static_cast<std::size_t>(expected.height));
  int marked = 0;  // the first row that is not marked yet
  for (int y = 0; y < expected.height; ++y) {
    const std::size_t bytes = 3 * static_cast<std::size_t>(right - left);
    if (std::memcmp(expected.pixel(left, y), actual.pixel(left, y), bytes) == 0) continue;
    marked = std::max(marked, y - reach);
    for (; marked <= std::min(y + reach, expected.height - 1); ++marked) {
      in_reach[static_cast<std::size_t>(marked)] = true;
    }
  }
  return in_reach;
}

/// The map's values of four pixels.
Floats value_at(const FlipColors& colors, const SeenRow& expected, const SeenRow& actual, std::size_t x) {
  const auto perceived = [&](const SeenRow& row) {
    return colors.perceived(
        {cells::load(&row.lightness[x]), cells::load(&row.red_green[x]), cells::load(&row.blue_yellow[x])});
  };
  const Floats color = colors.difference(perceived(expected), perceived(actual));
  const auto apart = [&](const SeenRow::Line& e, const SeenRow::Line& a) {
    return cells::absolute(cells::load(&e[x]) - cells::load(&a[x]));
  };
  const Floats strongest =
      cells::max(apart(expected.edges, actual.edges), apart(expected.points, actual.points));
  // To the power of q_f = ½.
  const Floats feature = cells::root(strongest * (1 / std::numbers::sqrt2_v<float>));
  return cells::power(color, 1 - feature);
}

/// The value that 99 % are at or below. Values are not negative, where floats are ordered as their bits: the
/// upper half of the bits is found by counting, then the lower.
double percentile_99(const std::vector<float>& values) {
  std::size_t rank = (values.size() * 99 - 1) / 100;
  std::vector<std::size_t> counts(1U << 16);
  const auto find = [&] {
    std::uint32_t at = 0;
    while (rank >= counts[at]) rank -= counts[at++];
    return at;
  };
  for (const float value : values) ++counts[std::bit_cast<std::uint32_t>(value) >> 16];
  const std::uint32_t upper = find();
  std::fill(counts.begin(), counts.end(), 0);
  for (const float value : values) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    if (bits >> 16 == upper) ++counts[bits & 0xffff];
  }
  return std::bit_cast<float>(upper << 16 | find());
}

}  // namespace

Flip flip(const render::Image& expected, const render::Image& actual, float pixels_per_degree) {
  const int width = expected.width;
  const int height = expected.height;
  Flip result{width, height, std::vector<float>(static_cast<std::size_t>(width) * height)};
  if (expected.rgb == actual.rgb) return result;
  const FlipColors colors;
  const FlipFilters filters(pixels_per_degree);
  SeenStrip expected_strip(expected, filters, colors);
  SeenStrip actual_strip(actual, filters, colors);
  SeenRow expected_row;
  SeenRow actual_row;
  SeenRow::Line values;
  for (int left = 0; left < width; left += SeenRow::width) {
    const std::vector<bool> in_reach = rows_in_reach(expected, actual, left, filters.reach);
    expected_strip.start(left);
    actual_strip.start(left);
    for (int y = 0; y < height; ++y) {
      if (!in_reach[static_cast<std::size_t>(y)]) continue;
      expected_strip.see(y, expected_row);
      actual_strip.see(y, actual_row);
      for (std::size_t x = 0; x < SeenRow::width; x += cells::width) {
        cells::store(&values[x], value_at(colors, expected_row, actual_row, x));
      }
      std::copy_n(values.begin(), std::min(SeenRow::width, width - left),
                  &result.map[static_cast<std::size_t>(y) * width + left]);
    }
  }
  double sum = 0;
  for (const float value : result.map) sum += value;
  result.mean = sum / static_cast<double>(result.map.size());
  result.max = *std::max_element(result.map.begin(), result.map.end());
  result.percentile_99 = percentile_99(result.map);
  return result;
}

render::Image heat_map(const Flip& flip) {
  // From black over violet and orange to pale yellow: brightness alone tells the order too.
  constexpr std::array<std::array<float, 3>, 6> stops{
      {{0, 0, 0}, {70, 15, 110}, {150, 40, 120}, {225, 85, 80}, {252, 165, 70}, {252, 253, 200}}};
  render::Image image(flip.width, flip.height);
  for (std::size_t i = 0; i < flip.map.size(); ++i) {
    const float at = std::clamp(flip.map[i], 0.0F, 1.0F) * (stops.size() - 1);
    const auto low = std::min(static_cast<std::size_t>(at), stops.size() - 2);
    const float share = at - static_cast<float>(low);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const float level = stops[low][channel] + share * (stops[low + 1][channel] - stops[low][channel]);
      image.rgb[3 * i + channel] = static_cast<std::uint8_t>(std::lround(level));
    }
  }
  return image;
}

std::string_view visibility(const Flip& flip) {
  if (flip.max < 0.1) return "invisible";
  if (flip.max < 0.3) return "subtle";
  return "visible";
}

}  // namespace substep::golden
