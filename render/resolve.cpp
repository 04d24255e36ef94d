#include "render/resolve.h"

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
      linear[code] = static_cast<std::uint16_t>(light * linear_one + 0.5);
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

Image resolve(std::span<const std::uint8_t> rgba, int width, int height, int samples) {
  Image image(width, height);
  const Tables& table = tables();
  const std::size_t row_bytes = static_cast<std::size_t>(width) * samples * 4;
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* row = &rgba[row_bytes * static_cast<std::size_t>((height - 1 - y) * samples)];
    std::uint8_t* to = image.pixel(0, y);
    for (int x = 0; x < width; ++x, to += 3, row += 4 * samples) {
      for (int c = 0; c < 3; ++c) {
        if (samples == 1) {
          to[c] = row[c];
        } else {
          const std::uint8_t* above = row + row_bytes;
          const int sum = table.linear[row[c]] + table.linear[row[c + 4]] + table.linear[above[c]] +
                          table.linear[above[c + 4]];
          to[c] = table.encoded[static_cast<std::size_t>((sum + 2) / 4)];
        }
      }
    }
  }
  return image;
}

}  // namespace substep
