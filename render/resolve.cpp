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
struct Weighted {
  std::array<int, 3> light{};
  int drawn = 0;
};

/// A row of samples, each added to its column.
void add_row(std::vector<Weighted>& columns, const std::uint8_t* sample, int weight) {
  const Tables& table = tables();
  for (Weighted& column : columns) {
    if (sample[3] != 0) {
      column.drawn += weight;
      for (std::size_t c = 0; c < 3; ++c) column.light[c] += weight * table.linear[sample[c]];
    }
    sample += 4;
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
  const auto width = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(samples);
  const int height = image.height * samples;
  // Two samples each way alone give an edge that is nearly upright two steps a pixel; with the neighbours'
  // nearest ones, which count a third, it has four.
  constexpr std::array<int, 4> weights{1, 3, 3, 1};
  const int reach = samples == 1 ? 0 : 1;
  const int one = samples == 1 ? 9 : 64;
  std::vector<Weighted> columns(width);
  for (int y = 0; y < image.height; ++y) {
    std::ranges::fill(columns, Weighted{});
    for (int row = -reach; row < samples + reach; ++row) {
      const int v = std::clamp((image.height - 1 - y) * samples + row, 0, height - 1);
      add_row(columns, &rgba[static_cast<std::size_t>(v) * width * 4],
              weights[static_cast<std::size_t>(row + 1)]);
    }
    std::uint8_t* to = image.pixel(0, y);
    for (int x = 0; x < image.width; ++x, to += 3) {
      Weighted sum;
      for (int i = -reach; i < samples + reach; ++i) {
        const Weighted& column =
            columns[static_cast<std::size_t>(std::clamp(x * samples + i, 0, static_cast<int>(width) - 1))];
        if (column.drawn == 0) continue;
        const int weight = weights[static_cast<std::size_t>(i + 1)];
        sum.drawn += weight * column.drawn;
        for (std::size_t c = 0; c < 3; ++c) sum.light[c] += weight * column.light[c];
      }
      if (sum.drawn == 0) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        const int light = sum.light[c] + (one - sum.drawn) * tables().linear[to[c]];
        to[c] = tables().encoded[static_cast<std::size_t>((light + one / 2) / one)];
      }
    }
  }
}

}  // namespace substep
