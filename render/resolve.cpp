#include "render/resolve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace substep {
namespace {

/// Linear light is counted in 65535ths.
constexpr int linear_one = 65535;

/// x^2.4 without libm's pow, whose last bit differs between versions: x² times the fifth root of x².
double power_2_4(double x) {
  if (x <= 0) return 0;
  const double square = x * x;
  double root = 1;  // above the root: Newton's steps for a convex function fall towards it
  for (int i = 0; i < 60; ++i) root -= (root - square / (root * root * root * root)) / 5;
  return square * root;
}

struct Tables {
  std::array<std::uint16_t, 256> linear{};             ///< of each sRGB code
  std::array<std::uint8_t, linear_one + 1> encoded{};  ///< nearest sRGB code of each linear value

  Tables() {
    for (std::size_t code = 0; code < 256; ++code) {
      const double s = static_cast<double>(code) / 255;
      const double light = s <= 0.04045 ? s / 12.92 : power_2_4((s + 0.055) / 1.055);
      linear[code] = static_cast<std::uint16_t>(std::lround(light * linear_one));
    }
    std::size_t code = 0;
    for (int light = 0; light <= linear_one; ++light) {
      while (code < 255 && 2 * light > linear[code] + linear[code + 1]) ++code;
      encoded[static_cast<std::size_t>(light)] = static_cast<std::uint8_t>(code);
    }
  }
};

const Tables& tables() {
  static const Tables made;
  return made;
}

/// Samples' light and how much of the pixel they cover, both times their weights.
template <typename Number>
struct Weighted {
  std::array<Number, 3> light{};
  Number drawn = 0;
};

/// A row of samples, each added to its column.
void add_row(std::vector<Weighted<int>>& columns, std::span<const std::uint8_t> rgba, std::size_t first,
             int weight) {
  const Tables& table = tables();
  const std::uint8_t* sample = &rgba[first * 4];
  for (Weighted<int>& column : columns) {
    if (sample[3] != 0) {
      column.drawn += weight;
      for (std::size_t c = 0; c < 3; ++c) column.light[c] += weight * table.linear[sample[c]];
    }
    sample += 4;
  }
}

void add_row(std::vector<Weighted<std::int64_t>>& columns, const Veiled& veiled, std::size_t first,
             int weight) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto& sample = veiled[first + i];
    columns[i].drawn += weight * sample[3];
    for (std::size_t c = 0; c < 3; ++c) columns[i].light[c] += weight * sample[c];
  }
}

/// `covered` is what a sample that is wholly covered counts.
template <typename Number, typename Samples>
void cover_with(Image& image, const Samples& given, int samples, Number covered) {
  const auto width = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(samples);
  const int height = image.height * samples;
  // Two samples each way alone give an edge that is nearly upright two steps a pixel; with the neighbours'
  // nearest ones, which count a third, it has four.
  constexpr std::array<int, 4> weights{1, 3, 3, 1};
  const int reach = samples == 1 ? 0 : 1;
  const Number one = (samples == 1 ? 9 : 64) * covered;
  std::vector<Weighted<Number>> columns(width);
  for (int y = 0; y < image.height; ++y) {
    std::ranges::fill(columns, Weighted<Number>{});
    for (int row = -reach; row < samples + reach; ++row) {
      const int v = std::clamp((image.height - 1 - y) * samples + row, 0, height - 1);
      add_row(columns, given, static_cast<std::size_t>(v) * width,
              weights[static_cast<std::size_t>(row + 1)]);
    }
    std::uint8_t* to = image.pixel(0, y);
    for (int x = 0; x < image.width; ++x, to += 3) {
      Weighted<Number> sum;
      for (int i = -reach; i < samples + reach; ++i) {
        const Weighted<Number>& column =
            columns[static_cast<std::size_t>(std::clamp(x * samples + i, 0, static_cast<int>(width) - 1))];
        if (column.drawn == 0) continue;
        const int weight = weights[static_cast<std::size_t>(i + 1)];
        sum.drawn += weight * column.drawn;
        for (std::size_t c = 0; c < 3; ++c) sum.light[c] += weight * column.light[c];
      }
      if (sum.drawn == 0) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        const Number light = sum.light[c] * covered + (one - sum.drawn) * tables().linear[to[c]];
        to[c] = tables().encoded[static_cast<std::size_t>((light + one / 2) / one)];
      }
    }
  }
}

}  // namespace

Image top_down(std::span<const std::uint8_t> rgba, int width, int height) {
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* from = &rgba[static_cast<std::size_t>(height - 1 - y) * width * 4];
    std::uint8_t* to = image.pixel(0, y);
    for (int x = 0; x < width; ++x, to += 3, from += 4) std::copy_n(from, 3, to);
  }
  return image;
}

void cover(Image& image, std::span<const std::uint8_t> rgba, int samples) {
  cover_with<int>(image, rgba, samples, 1);
}

std::uint16_t linear_light(std::uint8_t code) {
  return tables().linear[code];
}

Veiled veiled(std::span<const std::uint8_t> rgba) {
  Veiled result(rgba.size() / 4);
  for (std::size_t i = 0; i < result.size(); ++i) {
    const std::uint8_t* const sample = &rgba[4 * i];
    if (sample[3] == 0) continue;
    for (std::size_t c = 0; c < 3; ++c) result[i][c] = tables().linear[sample[c]];
    result[i][3] = linear_one;
  }
  return result;
}

void lay_over(Veiled& samples, std::span<const std::uint8_t> rgba) {
  constexpr int opaque = 255;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::uint8_t* const layer = &rgba[4 * i];
    const int alpha = layer[3];
    if (alpha == 0) continue;
    for (std::size_t c = 0; c < 4; ++c) {
      const int over = c < 3 ? tables().linear[layer[c]] : linear_one;
      const int sum = over * alpha + samples[i][c] * (opaque - alpha);
      samples[i][c] = static_cast<std::uint16_t>((sum + opaque / 2) / opaque);
    }
  }
}

void cover(Image& image, const Veiled& veiled, int samples) {
  cover_with<std::int64_t>(image, veiled, samples, linear_one);
}

}  // namespace substep
