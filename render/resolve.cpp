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

/// A sample by its pixel and its number in the pixel.
struct Sample {
  std::size_t pixel;
  int number;  ///< along the row, the lower row first

  Sample(const RenderedPixels& rendered, int x, int y)
      : pixel(std::size_t{1} * (y / rendered.samples) * rendered.width + x / rendered.samples),
        number(y % rendered.samples * 2 + x % rendered.samples) {}
};

/// Returns the bits of a pixel's samples: the alpha of RenderedPixels::first.
std::uint8_t bits_of(const RenderedPixels& rendered, std::size_t pixel) {
  return rendered.first[4 * pixel + 3];
}

bool is_body(const RenderedPixels& rendered, const Sample& sample) {
  return (bits_of(rendered, sample.pixel) >> (4 + sample.number) & 1) != 0;
}

bool is_first(const RenderedPixels& rendered, const Sample& sample) {
  return (bits_of(rendered, sample.pixel) >> sample.number & 1) != 0;
}

const std::uint8_t* code_of(const RenderedPixels& rendered, const Sample& sample) {
  const auto& colors = !is_body(rendered, sample)   ? rendered.ground
                       : is_first(rendered, sample) ? rendered.first
                                                    : rendered.second;
  return &colors[4 * sample.pixel];
}

LinearColor light_of(const std::uint8_t* code) {
  const auto& linear = tables().linear;
  return {linear[code[0]], linear[code[1]], linear[code[2]]};
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
      : rendered_(rendered), width_(std::size_t{4} * rendered.width), columns_(width_ + 8) {
    for (std::vector<std::uint8_t>& bytes : blocks_) bytes.resize(width_);
  }

  /// Prepares is_uniform() for these pixels of this row.
  void prepare(int y, int first, int end) {
    using Byte = std::uint8_t;
    fold_around(y, first, end, least, [](Byte a, Byte b) { return std::min(a, b); });
    fold_around(y, first, end, most, [](Byte a, Byte b) { return std::max(a, b); });
    fold_around(y, first, end, all, [](Byte a, Byte b) { return static_cast<Byte>(a & b); });
    fold_around(y, first, end, any, [](Byte a, Byte b) { return static_cast<Byte>(a | b); });
  }

  bool is_uniform(std::size_t x) const {
    if (blocks_[any][4 * x + 3] == 0) return true;
    constexpr int nearly = 16;  // smoothing an edge between such codes changes a pixel by at most 2 codes
    const auto is_even = [&](std::size_t i) { return blocks_[most][i] - blocks_[least][i] <= nearly; };
    return blocks_[all][4 * x + 3] == one_surface && is_even(4 * x) && is_even(4 * x + 1) &&
           is_even(4 * x + 2);
  }

 private:
  enum { least, most, all, any };

  /// Folds each pixel with its eight neighbours.
  template <typename Fold>
  void fold_around(int y, int first, int end, std::size_t kind, const Fold& fold) {
    const std::size_t begin = std::size_t{4} * std::max(first - 1, 0);
    const std::size_t width = std::min(4 * (std::size_t{1} + end), width_);
    std::uint8_t* const columns = columns_.data();
    fold_rows(line(y - 1), line(y), line(y + 1), columns + 4, begin, width, fold);
    if (begin == 0) std::copy_n(columns + 4, 4, columns);
    if (width == width_) std::copy_n(columns + width, 4, columns + width + 4);
    fold_rows(columns, columns + 4, columns + 8, blocks_[kind].data(), begin, width, fold);
  }

  const std::uint8_t* line(int y) const {
    return &rendered_.first[std::clamp(y, 0, rendered_.height - 1) * width_];
  }

  const RenderedPixels& rendered_;
  std::size_t width_;                                ///< bytes
  std::vector<std::uint8_t> columns_;                ///< over three rows, with one more pixel at each end
  std::array<std::vector<std::uint8_t>, 4> blocks_;  ///< over three rows and columns
};

/// Copies pixels of a row, from `begin` up to the one before `end`, without their alpha.
void copy_colors(const std::uint8_t* rgba, int begin, int end, std::uint8_t* rgb) {
  // Four bytes at once are cheaper than three: the next pixel overwrites the fourth.
  for (int x = begin; x + 1 < end; ++x) std::memcpy(rgb + 3 * x, rgba + 4 * x, 4);
  if (begin < end) std::memcpy(rgb + 3 * (end - 1), rgba + 4 * (end - 1), 3);
}

/// The pixels of a row from the first with samples of bodies to the one after the last.
struct BodySpan {
  int begin = 0;
  int end = 0;
};

std::vector<BodySpan> body_spans(const RenderedPixels& rendered) {
  std::vector<BodySpan> spans;
  for (int y = 0; y < rendered.height; ++y) {
    const std::size_t row = std::size_t{1} * y * rendered.width;
    const auto is_empty = [&](int x) { return bits_of(rendered, row + x) == 0; };
    BodySpan span{0, rendered.width};
    while (span.begin < span.end && is_empty(span.begin)) ++span.begin;
    while (span.begin < span.end && is_empty(span.end - 1)) --span.end;
    spans.push_back(span);
  }
  return spans;
}

/// Returns the pixels of row y that samples of bodies in this row and the two beside it affect.
BodySpan touched(const std::vector<BodySpan>& spans, int y, int width) {
  BodySpan result{width, 0};
  const int last = static_cast<int>(spans.size()) - 1;
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, last); ++v) {
    if (spans[v].begin == spans[v].end) continue;
    result.begin = std::min(result.begin, std::max(spans[v].begin - 1, 0));
    result.end = std::max(result.end, std::min(spans[v].end + 1, width));
  }
  return result.begin < result.end ? result : BodySpan{};
}

// Two samples each way give a nearly vertical edge two steps a pixel. The neighbours' nearest samples at a
// third of the weight make it four: weights 1, 3, 3, 1 along each axis.
constexpr int all_weights = 64;

/// A weighted sum of samples' light.
struct WeightedLight {
  std::array<int, 3> sum{};

  void add(const LinearColor& light, int weight) {
    for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * light[c];
  }

  /// Writes the mean as sRGB codes.
  void encode(std::uint8_t* to) const {
    for (std::size_t c = 0; c < 3; ++c) to[c] = tables().encoded[(sum[c] + all_weights / 2) / all_weights];
  }
};

/// Averages a pixel of two samples each way, neighbour by neighbour.
void average(const RenderedPixels& rendered, int x, int y, std::uint8_t* to) {
  WeightedLight mean;
  for (int v = -1; v <= 1; ++v) {
    for (int u = -1; u <= 1; ++u) {
      const int row = std::clamp(y + v, 0, rendered.height - 1);
      const int column = std::clamp(x + u, 0, rendered.width - 1);
      const std::size_t pixel = std::size_t{1} * row * rendered.width + column;
      const int bits = bits_of(rendered, pixel);
      if (bits == 0 || bits == one_surface) {
        // Along each axis its own two samples weigh 3 each, a neighbour's nearest one 1.
        mean.add(light_of(bits == 0 ? &rendered.ground[4 * pixel] : &rendered.first[4 * pixel]),
                 (u == 0 ? 6 : 1) * (v == 0 ? 6 : 1));
        continue;
      }
      for (int j = v < 0 ? 1 : 0; j < (v > 0 ? 1 : 2); ++j) {
        for (int i = u < 0 ? 1 : 0; i < (u > 0 ? 1 : 2); ++i) {
          // Beyond the border the nearest sample is repeated.
          const Sample sample(rendered, std::clamp(2 * (x + u) + i, 0, 2 * rendered.width - 1),
                              std::clamp(2 * (y + v) + j, 0, 2 * rendered.height - 1));
          mean.add(light_of(code_of(rendered, sample)), (u == 0 ? 3 : 1) * (v == 0 ? 3 : 1));
        }
      }
    }
  }
  mean.encode(to);
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
  for (int y = 0; y < rendered.height; ++y) {
    const BodySpan bodies = touched(spans, y, rendered.width);
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
        average(rendered, x, y, to + 3 * x);
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
      result.push_back(light_of(code_of(rendered, Sample(rendered, x, y))));
    }
  }
  return result;
}

void lay_over(SampleLight& samples, const RenderedPixels& layer, std::span<const std::uint8_t> opacities) {
  constexpr int opaque = 255;
  std::size_t index = 0;
  for (int y = 0; y < layer.samples * layer.height; ++y) {
    for (int x = 0; x < layer.samples * layer.width; ++x, ++index) {
      const Sample sample(layer, x, y);
      if (!is_body(layer, sample)) continue;
      const int alpha = opacities[4 * sample.pixel + (is_first(layer, sample) ? 0 : 1)];
      const LinearColor over = light_of(code_of(layer, sample));
      for (std::size_t c = 0; c < 3; ++c) {
        const int sum = over[c] * alpha + samples[index][c] * (opaque - alpha);
        samples[index][c] = static_cast<std::uint16_t>((sum + opaque / 2) / opaque);
      }
    }
  }
}

Image resolved(const SampleLight& light, int width, int height, int samples) {
  constexpr std::array<int, 4> weights{1, 3, 3, 1};
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    std::uint8_t* const to = image.pixel(0, height - 1 - y);
    for (int x = 0; x < width; ++x) {
      WeightedLight mean;
      if (samples == 1) {
        mean.add(light[std::size_t{1} * y * width + x], all_weights);
      }
      for (int row = 0; samples == 2 && row < 4; ++row) {
        const int v = std::clamp(2 * y + row - 1, 0, 2 * height - 1);
        for (int column = 0; column < 4; ++column) {
          const int u = std::clamp(2 * x + column - 1, 0, 2 * width - 1);
          mean.add(light[std::size_t{2} * v * width + u], weights[row] * weights[column]);
        }
      }
      mean.encode(to + 3 * x);
    }
  }
  return image;
}

}  // namespace substep::render
