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
      encoded[light] = static_cast<std::uint8_t>(code);
    }
  }
};

const Tables& tables() {
  static const Tables made;
  return made;
}

constexpr int one_surface = 255;

/// A sample: its pixel, and its number there.
struct Sample {
  std::size_t pixel;
  int number;

  Sample(const RenderedPixels& rendered, int x, int y)
      : pixel(std::size_t{1} * (y / rendered.samples) * rendered.width + x / rendered.samples),
        number(y % rendered.samples * 2 + x % rendered.samples) {}
};

/// Returns which samples of a pixel are bodies', and which of its colours they have: RenderedPixels::first.
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

/// Finds the pixels of a row that with their neighbours are all of one surface each, of nearly one colour, or
/// all without bodies.
class EvenPixels {
 public:
  explicit EvenPixels(const RenderedPixels& rendered)
      : rendered_(rendered), width_(4 * static_cast<std::size_t>(rendered.width)) {
    for (std::vector<std::uint8_t>* bytes : {&low_, &high_, &all_, &any_}) bytes->resize(width_ + 8);
    is_uneven_.resize(width_);
    is_one_.resize(width_);
    is_body_.resize(width_);
  }

  /// Prepares is() for these pixels of this row.
  void look_at(int y, int first, int end) {
    const std::uint8_t* const below = line(y - 1);
    const std::uint8_t* const here = line(y);
    const std::uint8_t* const above = line(y + 1);
    // Loops over bytes, of which a processor takes sixteen at a time; by pointers of their own, as bytes that
    // are written could be the vectors' own pointers.
    std::uint8_t* const low = low_.data();
    std::uint8_t* const high = high_.data();
    std::uint8_t* const all = all_.data();
    std::uint8_t* const any = any_.data();
    const std::size_t begin = 4 * static_cast<std::size_t>(std::max(first - 1, 0));
    const std::size_t width = std::min(4 * (static_cast<std::size_t>(end) + 1), width_);
    for (std::size_t i = begin; i < width; ++i) low[i + 4] = std::min(std::min(below[i], here[i]), above[i]);
    for (std::size_t i = begin; i < width; ++i) high[i + 4] = std::max(std::max(below[i], here[i]), above[i]);
    for (std::size_t i = begin; i < width; ++i) all[i + 4] = below[i] & here[i] & above[i];
    for (std::size_t i = begin; i < width; ++i) any[i + 4] = below[i] | here[i] | above[i];
    for (std::uint8_t* const bytes : {low, high, all, any}) {
      if (begin == 0) std::copy_n(bytes + 4, 4, bytes);
      if (width == width_) std::copy_n(bytes + width, 4, bytes + width + 4);
    }
    constexpr std::uint8_t nearly = 16;  // an edge between such codes would be smoothed by 2 of them
    std::uint8_t* const is_uneven = is_uneven_.data();
    std::uint8_t* const is_one = is_one_.data();
    std::uint8_t* const is_body = is_body_.data();
    for (std::size_t i = begin; i < width; ++i) {
      const std::uint8_t least = std::min(std::min(low[i], low[i + 4]), low[i + 8]);
      const std::uint8_t most = std::max(std::max(high[i], high[i + 4]), high[i + 8]);
      is_uneven[i] = static_cast<std::uint8_t>(most - least) > nearly ? 1 : 0;
    }
    for (std::size_t i = begin; i < width; ++i) is_one[i] = all[i] & all[i + 4] & all[i + 8];
    for (std::size_t i = begin; i < width; ++i) is_body[i] = any[i] | any[i + 4] | any[i + 8];
  }

  bool is(std::size_t x) const {
    const std::size_t i = 4 * x;
    if (is_body_[i + 3] == 0) return true;
    return is_one_[i + 3] == one_surface && (is_uneven_[i] | is_uneven_[i + 1] | is_uneven_[i + 2]) == 0;
  }

 private:
  const std::uint8_t* line(int y) const {
    return &rendered_.first[static_cast<std::size_t>(std::clamp(y, 0, rendered_.height - 1)) * width_];
  }

  const RenderedPixels& rendered_;
  std::size_t width_;  ///< bytes
  // Over a pixel and those below and above it; with one more pixel at each end.
  std::vector<std::uint8_t> low_;
  std::vector<std::uint8_t> high_;
  std::vector<std::uint8_t> all_;
  std::vector<std::uint8_t> any_;
  // Over those beside it too.
  std::vector<std::uint8_t> is_uneven_;
  std::vector<std::uint8_t> is_one_;
  std::vector<std::uint8_t> is_body_;
};

/// Copies pixels of a row, from `begin` up to the one before `end`, without their alpha.
void copy_colors(const std::uint8_t* rgba, int begin, int end, std::uint8_t* rgb) {
  // Four bytes at once are cheaper than three: the next pixel follows.
  for (int x = begin; x + 1 < end; ++x) std::memcpy(rgb + 3 * x, rgba + 4 * x, 4);
  if (begin < end) std::memcpy(rgb + 3 * (end - 1), rgba + 4 * (end - 1), 3);
}

/// The pixels of a row from the first that bodies have samples of up to the one after the last.
struct BodySpan {
  int begin = 0;
  int end = 0;
};

std::vector<BodySpan> body_spans(const RenderedPixels& rendered) {
  std::vector<BodySpan> spans;
  std::size_t pixel = 0;
  for (int y = 0; y < rendered.height; ++y, pixel += static_cast<std::size_t>(rendered.width)) {
    BodySpan span{0, rendered.width};
    while (span.begin < span.end && bits_of(rendered, pixel + static_cast<std::size_t>(span.begin)) == 0)
      ++span.begin;
    while (span.begin < span.end && bits_of(rendered, pixel + static_cast<std::size_t>(span.end - 1)) == 0)
      --span.end;
    spans.push_back(span);
  }
  return spans;
}

/// The pixels that samples of bodies in this row and the two beside it take part in.
BodySpan touched(const std::vector<BodySpan>& spans, int y, int width) {
  BodySpan result{width, 0};
  const int last = static_cast<int>(spans.size()) - 1;
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, last); ++v) {
    const BodySpan& span = spans[v];
    if (span.begin == span.end) continue;
    result.begin = std::min(result.begin, std::max(span.begin - 1, 0));
    result.end = std::max(result.end, std::min(span.end + 1, width));
  }
  if (result.begin > result.end) return {0, 0};
  return result;
}

// Two samples each way alone give an edge that is nearly upright two steps a pixel; with the neighbours'
// nearest ones, which count a third, it has four: weights 1, 3, 3, 1 along each axis.
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
  EvenPixels even(rendered);
  const std::vector<BodySpan> spans = body_spans(rendered);
  for (int y = 0; y < rendered.height; ++y) {
    const BodySpan bodies = touched(spans, y, rendered.width);
    if (rendered.samples == 2) even.look_at(y, bodies.begin, bodies.end);
    const std::size_t row = std::size_t{1} * y * rendered.width;
    std::uint8_t* const to = image.pixel(0, rendered.height - 1 - y);
    copy_colors(&rendered.ground[4 * row], 0, bodies.begin, to);
    copy_colors(&rendered.ground[4 * row], bodies.end, rendered.width, to);
    for (int x = bodies.begin; x < bodies.end; ++x) {
      if (rendered.samples == 1 || even.is(x)) {
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
