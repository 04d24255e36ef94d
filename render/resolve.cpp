#include "render/resolve.h"

#include <algorithm>
#include <array>
#include <cmath>

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
  const Tables& table = tables();
  const int width = image.width * samples;
  const int height = image.height * samples;
  // Two samples each way alone give an edge that is nearly upright two steps a pixel; with the neighbours'
  // nearest ones, which count a third, it has four.
  constexpr std::array<int, 4> weights{1, 3, 3, 1};
  const int reach = samples == 1 ? 0 : 1;
  const int one = samples == 1 ? 9 : 64;
  for (int y = 0; y < image.height; ++y) {
    std::uint8_t* to = image.pixel(0, y);
    for (int x = 0; x < image.width; ++x, to += 3) {
      std::array<int, 3> light{};
      int drawn = 0;
      for (int row = -reach; row < samples + reach; ++row) {
        const int v = std::clamp((image.height - 1 - y) * samples + row, 0, height - 1);
        const std::uint8_t* const line =
            &rgba[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) * 4];
        for (int column = -reach; column < samples + reach; ++column) {
          const std::uint8_t* sample =
              line + std::ptrdiff_t{4} * std::clamp(x * samples + column, 0, width - 1);
          if (sample[3] == 0) continue;
          const int weight =
              weights[static_cast<std::size_t>(row + 1)] * weights[static_cast<std::size_t>(column + 1)];
          drawn += weight;
          for (std::size_t c = 0; c < 3; ++c) light[c] += weight * table.linear[sample[c]];
        }
      }
      if (drawn == 0) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        const int sum = light[c] + (one - drawn) * table.linear[to[c]];
        to[c] = table.encoded[static_cast<std::size_t>((sum + one / 2) / one)];
      }
    }
  }
}

}  // namespace substep
