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

/// Which samples of a pixel are bodies', and which of its colours they have: Drawn::first.
std::uint8_t bits_of(const Drawn& drawn, std::size_t pixel) {
  return drawn.first[4 * pixel + 3];
}

constexpr int one_surface = 255;

/// A sample's place: its pixel, and its number there.
struct Sample {
  std::size_t pixel;
  int number;

  Sample(const Drawn& drawn, int x, int y)
      : pixel(static_cast<std::size_t>(y / drawn.samples) * static_cast<std::size_t>(drawn.width) +
              static_cast<std::size_t>(x / drawn.samples)),
        number(y % drawn.samples * 2 + x % drawn.samples) {}

  bool is_body(const Drawn& drawn) const { return (bits_of(drawn, pixel) >> (4 + number) & 1) != 0; }
  bool is_first(const Drawn& drawn) const { return (bits_of(drawn, pixel) >> number & 1) != 0; }
  const std::uint8_t* code(const Drawn& drawn) const {
    const auto& colors = !is_body(drawn) ? drawn.ground : is_first(drawn) ? drawn.first : drawn.second;
    return &colors[4 * pixel];
  }
};

/// Of each pixel of a row, whether it and its neighbours are all of one surface each, of nearly one colour,
/// or all without bodies.
class EvenPixels {
 public:
  explicit EvenPixels(const Drawn& drawn) : drawn_(drawn), width_(4 * static_cast<std::size_t>(drawn.width)) {
    for (std::vector<std::uint8_t>* line : {&low_, &high_, &all_, &any_}) line->resize(width_ + 8);
    even_.resize(static_cast<std::size_t>(drawn.width));
  }

  const std::vector<std::uint8_t>& row(int y) {
    const std::uint8_t* const below = line(y - 1);
    const std::uint8_t* const here = line(y);
    const std::uint8_t* const above = line(y + 1);
    for (std::size_t i = 0; i < width_; ++i) {
      low_[i + 4] = std::min({below[i], here[i], above[i]});
      high_[i + 4] = std::max({below[i], here[i], above[i]});
      all_[i + 4] = below[i] & here[i] & above[i];
      any_[i + 4] = below[i] | here[i] | above[i];
    }
    for (std::vector<std::uint8_t>* line : {&low_, &high_, &all_, &any_}) {
      std::copy_n(line->begin() + 4, 4, line->begin());
      std::copy_n(line->end() - 8, 4, line->end() - 4);
    }
    for (std::size_t x = 0; x < even_.size(); ++x) even_[x] = is_even(4 * x) ? 1 : 0;
    return even_;
  }

 private:
  const std::uint8_t* line(int y) const {
    return &drawn_.first[static_cast<std::size_t>(std::clamp(y, 0, drawn_.height - 1)) * width_];
  }

  /// `i`: where the pixel to the left begins.
  bool is_even(std::size_t i) const {
    if ((any_[i + 3] | any_[i + 7] | any_[i + 11]) == 0) return true;
    if ((all_[i + 3] & all_[i + 7] & all_[i + 11]) != one_surface) return false;
    constexpr int nearly = 16;  // an edge between such codes would be smoothed by 2 of them
    for (std::size_t c = i; c < i + 3; ++c) {
      const int low = std::min({low_[c], low_[c + 4], low_[c + 8]});
      const int high = std::max({high_[c], high_[c + 4], high_[c + 8]});
      if (high - low > nearly) return false;
    }
    return true;
  }

  const Drawn& drawn_;
  std::size_t width_;  ///< bytes
  // Of a pixel and those below and above it; with one more pixel at each end.
  std::vector<std::uint8_t> low_;
  std::vector<std::uint8_t> high_;
  std::vector<std::uint8_t> all_;
  std::vector<std::uint8_t> any_;
  std::vector<std::uint8_t> even_;
};

/// `light(x, y)`: of a sample, rows from below. `to`: the pixel's place in the picture.
template <typename Light>
void average(int width, int height, int x, int y, const Light& light, std::uint8_t* to) {
  // Two samples each way alone give an edge that is nearly upright two steps a pixel; with the neighbours'
  // nearest ones, which count a third, it has four.
  constexpr std::array<int, 4> weights{1, 3, 3, 1};
  constexpr int one = 64;
  std::array<int, 3> sum{};
  for (int row = 0; row < 4; ++row) {
    const int v = std::clamp(2 * y + row - 1, 0, 2 * height - 1);
    for (int column = 0; column < 4; ++column) {
      const int u = std::clamp(2 * x + column - 1, 0, 2 * width - 1);
      const int weight = weights[static_cast<std::size_t>(row)] * weights[static_cast<std::size_t>(column)];
      const std::array<std::uint16_t, 3> here = light(u, v);
      for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * here[c];
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    to[c] = tables().encoded[static_cast<std::size_t>((sum[c] + one / 2) / one)];
  }
}

std::array<std::uint16_t, 3> light_of(const std::uint8_t* code) {
  const auto& linear = tables().linear;
  return {linear[code[0]], linear[code[1]], linear[code[2]]};
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

Image resolved(const Drawn& drawn) {
  Image image(drawn.width, drawn.height);
  const auto light = [&](int u, int v) { return light_of(Sample(drawn, u, v).code(drawn)); };
  EvenPixels even_pixels(drawn);
  for (int y = 0; y < drawn.height; ++y) {
    const std::vector<std::uint8_t>& even = even_pixels.row(y);
    std::uint8_t* to = image.pixel(0, drawn.height - 1 - y);
    std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(drawn.width);
    for (int x = 0; x < drawn.width; ++x, ++pixel, to += 3) {
      if (drawn.samples == 1 || even[static_cast<std::size_t>(x)] != 0) {
        const auto& colors = bits_of(drawn, pixel) == 0 ? drawn.ground : drawn.first;
        std::copy_n(&colors[4 * pixel], 3, to);
      } else {
        average(drawn.width, drawn.height, x, y, light, to);
      }
    }
  }
  return image;
}

std::uint16_t linear_light(std::uint8_t code) {
  return tables().linear[code];
}

Veiled veiled(const Drawn& drawn) {
  Veiled result;
  result.reserve(drawn.ground.size() / 4 * static_cast<std::size_t>(drawn.samples * drawn.samples));
  for (int y = 0; y < drawn.samples * drawn.height; ++y) {
    for (int x = 0; x < drawn.samples * drawn.width; ++x) {
      result.push_back(light_of(Sample(drawn, x, y).code(drawn)));
    }
  }
  return result;
}

void lay_over(Veiled& samples, const Drawn& layer, std::span<const std::uint8_t> opacities) {
  constexpr int opaque = 255;
  std::size_t index = 0;
  for (int y = 0; y < layer.samples * layer.height; ++y) {
    for (int x = 0; x < layer.samples * layer.width; ++x, ++index) {
      const Sample sample(layer, x, y);
      if (!sample.is_body(layer)) continue;
      const int alpha = opacities[4 * sample.pixel + (sample.is_first(layer) ? 0 : 1)];
      const std::array<std::uint16_t, 3> over = light_of(sample.code(layer));
      for (std::size_t c = 0; c < 3; ++c) {
        const int sum = over[c] * alpha + samples[index][c] * (opaque - alpha);
        samples[index][c] = static_cast<std::uint16_t>((sum + opaque / 2) / opaque);
      }
    }
  }
}

Image resolved(const Veiled& veiled, int width, int height, int samples) {
  Image image(width, height);
  const auto light = [&](int u, int v) {
    return veiled[static_cast<std::size_t>(v) * static_cast<std::size_t>(samples * width) +
                  static_cast<std::size_t>(u)];
  };
  for (int y = 0; y < height; ++y) {
    std::uint8_t* to = image.pixel(0, height - 1 - y);
    for (int x = 0; x < width; ++x, to += 3) {
      if (samples == 2) {
        average(width, height, x, y, light, to);
        continue;
      }
      const std::array<std::uint16_t, 3> own = light(x, y);
      for (std::size_t c = 0; c < 3; ++c) to[c] = tables().encoded[own[c]];
    }
  }
  return image;
}

}  // namespace substep
