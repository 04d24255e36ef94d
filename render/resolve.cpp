#include "render/resolve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

namespace substep::render {
namespace {

/// Linear light is counted in 65535ths.
constexpr int linear_one = 65535;

/// Returns x^2.4 without libm's pow, whose last bit differs between versions: x² times the fifth root of x².
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
      encoded[light] = static_cast<std::uint8_t>(code);
    }
  }
};

const Tables& tables() {
  static const Tables made;
  return made;
}

constexpr int one_surface = 255;  // all four samples are of a body and have the first one's colour

/// Returns the bits of a pixel's samples: the alpha of RenderedPixels::first.
std::uint8_t bits_of(const RenderedPixels& rendered, std::size_t pixel) {
  return rendered.first[4 * pixel + 3];
}

/// A sample of a picture.
struct Sample {
  std::size_t pixel;
  bool is_body;
  bool is_first;  ///< of the pixel's first colour
  LinearColor light;
};

/// Returns the sample in a column and row of samples.
Sample sample_at(const RenderedPixels& rendered, int x, int y) {
  const int side = rendered.samples;
  const std::size_t pixel = std::size_t{1} * (y / side) * rendered.width + x / side;
  const int bits = bits_of(rendered, pixel) >> (y % side * 2 + x % side);
  const bool is_body = (bits & 16) != 0;
  const bool is_first = (bits & 1) != 0;
  const auto& colors = !is_body ? rendered.ground : is_first ? rendered.first : rendered.second;
  const std::uint8_t* const code = &colors[4 * pixel];
  return {pixel, is_body, is_first, {linear_light(code[0]), linear_light(code[1]), linear_light(code[2])}};
}

/// Folds three rows of bytes into one, in a loop over pointers that compilers vectorize.
template <typename Fold>
void fold_rows(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, std::uint8_t* to,
               std::size_t begin, std::size_t end, const Fold& fold) {
  for (std::size_t i = begin; i < end; ++i) to[i] = fold(fold(a[i], b[i]), c[i]);
}

/// Finds the pixels of a row whose neighbourhood is one surface of nearly one colour, or has no bodies.
class UniformPixels {
 public:
  explicit UniformPixels(const RenderedPixels& rendered)
      : rendered_(rendered),
        width_(std::size_t{4} * rendered.width),
        columns_(width_ + 8),
        least_(width_),
        most_(width_) {}

  /// Prepares is_uniform() for these pixels of this row.
  void prepare(int y, int first, int end) {
    using Byte = std::uint8_t;
    fold_around(y, first, end, least_, [](Byte a, Byte b) { return std::min(a, b); });
    fold_around(y, first, end, most_, [](Byte a, Byte b) { return std::max(a, b); });
  }

  bool is_uniform(std::size_t x) const {
    if (most_[4 * x + 3] == 0) return true;
    constexpr int nearly = 16;  // smoothing an edge between such codes changes a pixel by at most 2 codes
    const auto is_even = [&](std::size_t i) { return most_[i] - least_[i] <= nearly; };
    return least_[4 * x + 3] == one_surface && is_even(4 * x) && is_even(4 * x + 1) && is_even(4 * x + 2);
  }

 private:
  /// Folds each pixel with its eight neighbours.
  template <typename Fold>
  void fold_around(int y, int first, int end, std::vector<std::uint8_t>& to, const Fold& fold) {
    const std::size_t begin = std::size_t{4} * std::max(first - 1, 0);
    const std::size_t width = std::min(4 * (std::size_t{1} + end), width_);
    std::uint8_t* const columns = columns_.data();
    fold_rows(line(y - 1), line(y), line(y + 1), columns + 4, begin, width, fold);
    if (begin == 0) std::copy_n(columns + 4, 4, columns);
    if (width == width_) std::copy_n(columns + width, 4, columns + width + 4);
    fold_rows(columns, columns + 4, columns + 8, to.data(), begin, width, fold);
  }

  const std::uint8_t* line(int y) const {
    return &rendered_.first[std::clamp(y, 0, rendered_.height - 1) * width_];
  }

  const RenderedPixels& rendered_;
  std::size_t width_;                  ///< bytes
  std::vector<std::uint8_t> columns_;  ///< over three rows, with one more pixel at each end
  std::vector<std::uint8_t> least_;    ///< over three rows and columns
  std::vector<std::uint8_t> most_;
};

/// Copies pixels of a row, from `begin` up to the one before `end`, without their alpha.
void copy_colors(const std::uint8_t* rgba, int begin, int end, std::uint8_t* rgb) {
  // Four bytes at once are cheaper than three: the next pixel overwrites the fourth.
  for (int x = begin; x + 1 < end; ++x) std::memcpy(rgb + 3 * x, rgba + 4 * x, 4);
  if (begin < end) std::memcpy(rgb + 3 * (end - 1), rgba + 4 * (end - 1), 3);
}

/// The pixels of a row from `begin` up to the one before `end`.
struct BodySpan {
  int begin = 0;
  int end = 0;
};

/// Returns for each row the pixels that samples of bodies in it and in the two rows beside it affect.
std::vector<BodySpan> body_spans(const RenderedPixels& rendered) {
  std::vector<BodySpan> spans(rendered.height);
  for (int y = 0; y < rendered.height; ++y) {
    const std::size_t row = std::size_t{1} * y * rendered.width;
    const auto is_empty = [&](int x) { return bits_of(rendered, row + x) == 0; };
    int begin = 0;
    int end = rendered.width;
    while (begin < end && is_empty(begin)) ++begin;
    while (begin < end && is_empty(end - 1)) --end;
    if (begin == end) continue;
    begin = std::max(begin - 1, 0);
    end = std::min(end + 1, rendered.width);
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, rendered.height - 1); ++v) {
      const bool is_first = spans[v].end == 0;
      spans[v].begin = is_first ? begin : std::min(spans[v].begin, begin);
      spans[v].end = std::max(spans[v].end, end);
    }
  }
  return spans;
}

/// Averages a pixel of two samples each way, and writes it as sRGB codes. `light_at` returns the light of the
/// sample in a column and row of samples.
template <typename LightAt>
void average(int x, int y, int width, int height, const LightAt& light_at, std::uint8_t* to) {
  // Two samples each way give a nearly vertical edge two steps a pixel. The neighbours' nearest samples at a
  // third of the weight make it four.
  constexpr std::array<int, 4> weights{1, 3, 3, 1};
  constexpr int all_weights = 64;
  std::array<int, 3> sum{};
  for (int row = 0; row < 4; ++row) {
    const int v = std::clamp(2 * y + row - 1, 0, 2 * height - 1);
    for (int column = 0; column < 4; ++column) {
      const int u = std::clamp(2 * x + column - 1, 0, 2 * width - 1);
      const LinearColor light = light_at(u, v);
      for (std::size_t c = 0; c < 3; ++c) sum[c] += weights[row] * weights[column] * light[c];
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    to[c] = nearest_code(static_cast<std::uint16_t>((sum[c] + all_weights / 2) / all_weights));
  }
}

}  // namespace

Image top_down(std::span<const std::uint8_t> rgba, int width, int height) {
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    copy_colors(&rgba[static_cast<std::size_t>(height - 1 - y) * width * 4], 0, width, image.pixel(0, y));
  }
  return image;
}

Image resolved(const RenderedPixels& rendered) {
  Image image(rendered.width, rendered.height);
  UniformPixels uniform(rendered);
  const std::vector<BodySpan> spans = body_spans(rendered);
  const auto light_at = [&](int u, int v) { return sample_at(rendered, u, v).light; };
  for (int y = 0; y < rendered.height; ++y) {
    const BodySpan bodies = spans[y];
    if (rendered.samples == 2) uniform.prepare(y, bodies.begin, bodies.end);
    const std::size_t row = std::size_t{1} * y * rendered.width;
    std::uint8_t* const to = image.pixel(0, rendered.height - 1 - y);
    copy_colors(&rendered.ground[4 * row], 0, bodies.begin, to);
    copy_colors(&rendered.ground[4 * row], bodies.end, rendered.width, to);
    for (int x = bodies.begin; x < bodies.end; ++x) {
      if (rendered.samples == 1 || uniform.is_uniform(x)) {
        const auto& colors = bits_of(rendered, row + x) == 0 ? rendered.ground : rendered.first;
        std::memcpy(to + 3 * x, &colors[4 * (row + x)], 3);
      } else {
        average(x, y, rendered.width, rendered.height, light_at, to + 3 * x);
      }
    }
  }
  return image;
}

std::uint16_t linear_light(std::uint8_t code) {
  return tables().linear[code];
}

std::uint8_t nearest_code(std::uint16_t light) {
  return tables().encoded[light];
}

SampleLight light_of_samples(const RenderedPixels& rendered) {
  SampleLight result;
  result.reserve(rendered.ground.size() / 4 * rendered.samples * rendered.samples);
  for (int y = 0; y < rendered.samples * rendered.height; ++y) {
    for (int x = 0; x < rendered.samples * rendered.width; ++x) {
      result.push_back(sample_at(rendered, x, y).light);
    }
  }
  return result;
}

void lay_over(SampleLight& samples, const RenderedPixels& layer, std::span<const std::uint8_t> opacities) {
  constexpr int opaque = 255;
  std::size_t index = 0;
  for (int y = 0; y < layer.samples * layer.height; ++y) {
    for (int x = 0; x < layer.samples * layer.width; ++x, ++index) {
      const Sample over = sample_at(layer, x, y);
      if (!over.is_body) continue;
      const int alpha = opacities[4 * over.pixel + (over.is_first ? 0 : 1)];
      for (std::size_t c = 0; c < 3; ++c) {
        const int sum = over.light[c] * alpha + samples[index][c] * (opaque - alpha);
        samples[index][c] = static_cast<std::uint16_t>((sum + opaque / 2) / opaque);
      }
    }
  }
}

Image resolved(const SampleLight& light, int width, int height, int samples) {
  Image image(width, height);
  const auto light_at = [&](int u, int v) { return light[std::size_t{1} * v * samples * width + u]; };
  for (int y = 0; y < height; ++y) {
    std::uint8_t* const row = image.pixel(0, height - 1 - y);
    for (int x = 0; x < width; ++x) {
      std::uint8_t* const to = row + 3 * x;
      if (samples == 2) {
        average(x, y, width, height, light_at, to);
      } else {
        std::ranges::transform(light_at(x, y), to, nearest_code);
      }
    }
  }
  return image;
}

}  // namespace substep::render
