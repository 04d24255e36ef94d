#include "golden/flip.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "golden/lanes.h"

namespace substep {
namespace {

// Constants of the paper's sections 4 and 5.
constexpr float color_exponent = 0.7F;           // q_c
constexpr float color_knee = 0.4F;               // p_c
constexpr float color_knee_value = 0.95F;        // p_t
constexpr float feature_width_degrees = 0.082F;  // w
/// Contrast sensitivity: a Gaussian a·√(π/b)·exp(−π²x²/b), x in degrees (the paper's table 1).
struct Sensitivity {
  double a, b;
};
constexpr Sensitivity achromatic{1.0, 0.0047};
constexpr Sensitivity red_green{1.0, 0.0053};
constexpr Sensitivity blue_yellow_narrow{34.1, 0.04};
constexpr Sensitivity blue_yellow_wide{13.5, 0.025};

using Matrix3f = Eigen::Matrix3f;
using lanes::all;
using lanes::Floats;
using Color = std::array<Floats, 3>;
using Kernel = std::vector<float>;  // weights at −r … r

/// Linear sRGB → CIE XYZ from the primaries of IEC 61966-2-1 and, as the authors' program has it, the white
/// D65 to five digits.
Eigen::Matrix3d absolute_xyz_from_rgb() {
  const auto xyz = [](double x, double y) { return Eigen::Vector3d(x / y, 1, (1 - x - y) / y); };
  Eigen::Matrix3d primaries;
  primaries << xyz(0.64, 0.33), xyz(0.30, 0.60), xyz(0.15, 0.06);
  const Eigen::Vector3d scale = primaries.inverse() * xyz(0.31271, 0.32902);
  return primaries * scale.asDiagonal();
}

/// XYZ is relative to white throughout.
struct ColorSpaces {
  Matrix3f xyz_from_rgb;
  Matrix3f rgb_from_xyz;

  ColorSpaces() {
    const Eigen::Matrix3d absolute = absolute_xyz_from_rgb();
    const Eigen::Vector3d white = absolute * Eigen::Vector3d::Ones();
    const Eigen::Matrix3d relative = white.cwiseInverse().asDiagonal() * absolute;
    xyz_from_rgb = relative.cast<float>();
    rgb_from_xyz = relative.inverse().cast<float>();
  }
};

Color transform(const Matrix3f& m, const Color& c) {
  return {m(0, 0) * c[0] + m(0, 1) * c[1] + m(0, 2) * c[2], m(1, 0) * c[0] + m(1, 1) * c[1] + m(1, 2) * c[2],
          m(2, 0) * c[0] + m(2, 1) * c[1] + m(2, 2) * c[2]};
}

/// YCxCz: lightness, red–green, blue–yellow; linear in RGB (the paper's section 4.1).
Color opponent(const Color& xyz) {
  return {116 * xyz[1] - 16, 500 * (xyz[0] - xyz[1]), 200 * (xyz[1] - xyz[2])};
}
Floats luminance(Floats lightness) {
  return lightness * (1.0F / 116) + 16.0F / 116;
}
Color xyz_from_opponent(const Color& c) {
  const Floats y = luminance(c[0]);
  return {y + c[1] / 500, y, y - c[2] / 200};
}

/// L*a*b*, with a* and b* scaled by 0.01 L*: colours count less in the dark (Hunt).
Color hunt_lab(const ColorSpaces& spaces, const Color& rgb) {
  constexpr float delta = 6.0F / 29;
  constexpr float knee = delta * delta * delta;
  const Color xyz = transform(spaces.xyz_from_rgb, rgb);
  Color f;
  for (std::size_t i = 0; i < 3; ++i) {
    const Floats root = lanes::cube_root(lanes::max(xyz[i], all(knee)));
    f[i] = lanes::choose(xyz[i] > knee, root, xyz[i] / (3 * delta * delta) + 4.0F / 29);
  }
  const Floats lightness = 116 * f[1] - 16;
  return {lightness, 0.01F * lightness * 500 * (f[0] - f[1]), 0.01F * lightness * 200 * (f[1] - f[2])};
}

Floats hyab(const Color& p, const Color& q) {
  const Floats a = p[1] - q[1];
  const Floats b = p[2] - q[2];
  return lanes::absolute(p[0] - q[0]) + lanes::root(a * a + b * b);
}

/// One number a pixel. Rows are padded to whole blocks, whose surplus means nothing.
struct Plane {
  static constexpr int block = 8 * lanes::width;
  int width = 0;
  int height = 0;
  int stride = 0;
  std::vector<float> values;

  Plane(int w, int h) : width(w), height(h), stride((w + block - 1) / block * block) {
    values.resize(static_cast<std::size_t>(stride) * h);
  }
  float* row(int y) { return &values[static_cast<std::size_t>(y) * stride]; }
  const float* row(int y) const { return &values[static_cast<std::size_t>(y) * stride]; }
};

/// The sum over taps of weights[tap] · from(tap)[0 … block).
template <typename From>
void weigh_block(const Kernel& weights, const From& from, float* target) {
  std::array<Floats, Plane::block / lanes::width> sums{};
  for (std::size_t tap = 0; tap < weights.size(); ++tap) {
    const float weight = weights[tap];
    const float* source = from(tap);
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += weight * lanes::load(source + lanes::width * i);
  }
  for (std::size_t i = 0; i < sums.size(); ++i) lanes::store(target + lanes::width * i, sums[i]);
}

/// The border is repeated.
void convolve_rows(const Plane& in, const Kernel& kernel, Plane& out) {
  const auto radius = static_cast<std::ptrdiff_t>(kernel.size() / 2);
  std::vector<float> padded(static_cast<std::size_t>(in.stride) + kernel.size());
  for (int y = 0; y < in.height; ++y) {
    const float* row = in.row(y);
    std::fill_n(padded.begin(), radius, row[0]);
    std::copy_n(row, in.width, padded.begin() + radius);
    std::fill(padded.begin() + radius + in.width, padded.end(), row[in.width - 1]);
    for (int x = 0; x < in.stride; x += Plane::block) {
      weigh_block(
          kernel, [&](std::size_t tap) { return &padded[static_cast<std::size_t>(x) + tap]; },
          out.row(y) + x);
    }
  }
}

void convolve_columns(const Plane& in, const Kernel& kernel, Plane& out) {
  const int radius = static_cast<int>(kernel.size() / 2);
  // In strips, so that the rows that a kernel reaches stay in the nearest cache.
  constexpr int strip = 4 * Plane::block;
  for (int left = 0; left < in.stride; left += strip) {
    const int right = std::min(left + strip, in.stride);
    for (int y = 0; y < in.height; ++y) {
      for (int x = left; x < right; x += Plane::block) {
        const auto source = [&](std::size_t tap) {
          return in.row(std::clamp(y - radius + static_cast<int>(tap), 0, in.height - 1)) + x;
        };
        weigh_block(kernel, source, out.row(y) + x);
      }
    }
  }
}

/// A Gaussian of a contrast sensitivity, unit sum, and its weight in a sum of such: the two-dimensional
/// filter is a·√(π/b)·exp(−π²(x²+y²)/b), whose sum is that factor times the square of the one-dimensional
/// sum.
struct SensitivityFilter {
  Kernel kernel;
  double weight;
};

/// Of all channels: three standard deviations of the widest.
int sensitivity_radius(float pixels_per_degree) {
  using std::numbers::pi;
  return static_cast<int>(std::ceil(3 * std::sqrt(blue_yellow_narrow.b / (2 * pi * pi)) *
                                    static_cast<double>(pixels_per_degree)));
}

SensitivityFilter sensitivity_filter(const Sensitivity& s, float pixels_per_degree) {
  using std::numbers::pi;
  const int radius = sensitivity_radius(pixels_per_degree);
  std::vector<double> weights;
  double sum = 0;
  for (int i = -radius; i <= radius; ++i) {
    const double x = i / static_cast<double>(pixels_per_degree);
    weights.push_back(std::exp(-pi * pi * x * x / s.b));
    sum += weights.back();
  }
  for (double& w : weights) w /= sum;
  // What rounding would swallow need not be computed: the narrow filters have a third of the wide ones' taps.
  constexpr double negligible = 1e-9;
  while (weights.size() > 1 && weights.front() < negligible) {
    weights.erase(weights.begin());
    weights.pop_back();
  }
  return {Kernel(weights.begin(), weights.end()), s.a * std::sqrt(pi / s.b) * sum * sum};
}

/// A Gaussian and its first and second derivatives; the derivatives' positive weights sum to 1, their
/// negative ones to −1. In single precision as in the authors' program: on flat areas these sums cancel but
/// for their rounding, and the exponent ½ makes 3e-5 of 1e-9, so agreement to 2e-6 needs the same rounding.
struct FeatureKernels {
  Kernel gaussian, first, second;
};

FeatureKernels feature_kernels(float pixels_per_degree) {
  const float deviation = 0.5F * feature_width_degrees * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3 * deviation));
  FeatureKernels kernels;
  for (int i = -radius; i <= radius; ++i) {
    const auto x = static_cast<float>(i);
    const float g = std::exp(-x * x / (2 * deviation * deviation));
    kernels.gaussian.push_back(g);
    kernels.first.push_back(-x * g);
    kernels.second.push_back((x * x / (deviation * deviation) - 1) * g);
  }
  for (Kernel* kernel : {&kernels.gaussian, &kernels.first, &kernels.second}) {
    float positive = 0;
    float negative = 0;
    for (const float w : *kernel) (w > 0 ? positive : negative) += std::abs(w);
    for (float& w : *kernel) w /= w > 0 ? positive : negative;
  }
  return kernels;
}

/// What the eye resolves of a channel: a filter for each of lightness, red–green and, in two parts,
/// blue–yellow.
struct Filters {
  SensitivityFilter lightness, red, blue_narrow, blue_wide;
  float share;  ///< of the narrow part
  FeatureKernels features;
  int halo;  ///< how far any of them reaches, pixels

  explicit Filters(float pixels_per_degree)
      : lightness(sensitivity_filter(achromatic, pixels_per_degree)),
        red(sensitivity_filter(red_green, pixels_per_degree)),
        blue_narrow(sensitivity_filter(blue_yellow_narrow, pixels_per_degree)),
        blue_wide(sensitivity_filter(blue_yellow_wide, pixels_per_degree)),
        share(static_cast<float>(blue_narrow.weight / (blue_narrow.weight + blue_wide.weight))),
        features(feature_kernels(pixels_per_degree)),
        halo(std::max(sensitivity_radius(pixels_per_degree),
                      static_cast<int>(features.gaussian.size() / 2))) {}
};

std::array<float, 256> linear_levels() {
  std::array<float, 256> linear;
  for (std::size_t i = 0; i < linear.size(); ++i) {
    const float c = static_cast<float>(i) / 255;
    linear[i] = c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
  }
  return linear;
}

/// A band of a picture with all that is computed of it. Used for one band after another: getting memory from
/// the system for each took as long as the filters.
class PictureBand {
 public:
  PictureBand(const Image& image, int rows, const ColorSpaces& spaces, const Filters& filters)
      : image_(image), spaces_(spaces), filters_(filters), opponent_{plane(rows), plane(rows), plane(rows)} {}

  /// Reads rows from `first` on; above and below the picture its border is repeated.
  void read(int first) {
    to_opponent(first);
    blur(opponent_[0], filters_.lightness, lightness_);
    blur(opponent_[1], filters_.red, red_);
    blur(opponent_[2], filters_.blue_narrow, blue_narrow_);
    blur(opponent_[2], filters_.blue_wide, blue_wide_);
    Plane& plane = opponent_[0];
    for (std::size_t i = 0; i < plane.values.size(); i += lanes::width) {
      lanes::store(&plane.values[i], luminance(lanes::load(&plane.values[i])));
    }
    convolve_rows(plane, filters_.features.gaussian, smooth_);
    find_features(filters_.features.first, edges_);
    find_features(filters_.features.second, points_);
  }

  int stride() const { return opponent_[0].stride; }

  /// The perceived colours of four pixels.
  Color lab(int x, int y) const {
    const Floats blue = filters_.share * lanes::load(blue_narrow_.row(y) + x) +
                        (1 - filters_.share) * lanes::load(blue_wide_.row(y) + x);
    Color rgb = transform(spaces_.rgb_from_xyz, xyz_from_opponent({lanes::load(lightness_.row(y) + x),
                                                                   lanes::load(red_.row(y) + x), blue}));
    for (Floats& c : rgb) c = lanes::min(lanes::max(c, all(0)), all(1));
    return hunt_lab(spaces_, rgb);
  }
  Floats edge(int x, int y) const { return lanes::load(edges_.row(y) + x); }
  Floats point(int x, int y) const { return lanes::load(points_.row(y) + x); }

 private:
  Plane plane(int rows) const { return Plane(image_.width, rows); }

  void to_opponent(int first) {
    std::array<std::vector<float>, 3> rgb;
    for (auto& channel : rgb) channel.resize(static_cast<std::size_t>(stride()));
    for (int y = 0; y < opponent_[0].height; ++y) {
      const std::uint8_t* p = image_.pixel(0, std::clamp(first + y, 0, image_.height - 1));
      for (std::size_t x = 0; x < static_cast<std::size_t>(image_.width); ++x) {
        for (std::size_t channel = 0; channel < 3; ++channel) rgb[channel][x] = linear_[p[3 * x + channel]];
      }
      for (int x = 0; x < stride(); x += lanes::width) {
        const Color c = opponent(
            transform(spaces_.xyz_from_rgb, {lanes::load(rgb[0].data() + x), lanes::load(rgb[1].data() + x),
                                             lanes::load(rgb[2].data() + x)}));
        for (std::size_t channel = 0; channel < 3; ++channel) {
          lanes::store(opponent_[channel].row(y) + x, c[channel]);
        }
      }
    }
  }

  void blur(const Plane& in, const SensitivityFilter& filter, Plane& out) {
    convolve_rows(in, filter.kernel, scratch_);
    convolve_columns(scratch_, filter.kernel, out);
  }

  void find_features(const Kernel& derivative, Plane& magnitude) {
    convolve_rows(opponent_[0], derivative, scratch_);
    convolve_columns(scratch_, filters_.features.gaussian, magnitude);
    convolve_columns(smooth_, derivative, scratch_);
    for (std::size_t i = 0; i < magnitude.values.size(); i += lanes::width) {
      const Floats a = lanes::load(&magnitude.values[i]);
      const Floats b = lanes::load(&scratch_.values[i]);
      lanes::store(&magnitude.values[i], lanes::root(a * a + b * b));
    }
  }

  const Image& image_;
  const ColorSpaces& spaces_;
  const Filters& filters_;
  std::array<float, 256> linear_ = linear_levels();
  std::array<Plane, 3> opponent_;
  Plane lightness_ = opponent_[0], red_ = opponent_[0], blue_narrow_ = opponent_[0],
        blue_wide_ = opponent_[0];
  Plane smooth_ = opponent_[0], edges_ = opponent_[0], points_ = opponent_[0], scratch_ = opponent_[0];
};

/// Compresses large colour differences: [0, knee·max] → [0, 0.95], the rest → [0.95, 1].
Floats redistribute(Floats difference, float largest) {
  const float knee = color_knee * largest;
  return lanes::choose(difference < knee, difference * color_knee_value / knee,
                       color_knee_value + (difference - knee) / (largest - knee) * (1 - color_knee_value));
}

/// The values of four pixels of the map.
Floats difference(const PictureBand& expected, const PictureBand& actual, int x, int y, float largest) {
  const Floats apart = hyab(expected.lab(x, y), actual.lab(x, y));
  const Floats color = redistribute(lanes::power(apart, all(color_exponent)), largest);
  const Floats edges = lanes::absolute(expected.edge(x, y) - actual.edge(x, y));
  const Floats points = lanes::absolute(expected.point(x, y) - actual.point(x, y));
  // To the power of q_f = ½.
  const Floats feature = lanes::root(lanes::max(edges, points) / std::numbers::sqrt2_v<float>);
  return lanes::power(color, 1 - feature);
}

/// Equal rows have no difference, and rounding in the filters must not make one.
bool are_equal(const Image& a, const Image& b, int first, int last) {
  first = std::max(first, 0);
  last = std::min(last, a.height - 1);
  return std::equal(a.pixel(0, first), a.pixel(a.width - 1, last) + 3, b.pixel(0, first));
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

Flip flip(const Image& expected, const Image& actual, float pixels_per_degree) {
  const int width = expected.width;
  const int height = expected.height;
  Flip result{width, height, std::vector<float>(static_cast<std::size_t>(width) * height)};
  if (expected.rgb == actual.rgb) return result;
  const ColorSpaces spaces;
  const Filters filters(pixels_per_degree);
  const Color green{all(0), all(1), all(0)};
  const Color blue{all(0), all(0), all(1)};
  const float largest =
      lanes::power(hyab(hunt_lab(spaces, green), hunt_lab(spaces, blue)), all(color_exponent))[0];
  // Bands whose planes stay in the cache, each with the rows that filters reach above and below it.
  constexpr int band = 64;
  PictureBand expected_band(expected, band + 2 * filters.halo, spaces, filters);
  PictureBand actual_band(actual, band + 2 * filters.halo, spaces, filters);
  std::vector<float> row(static_cast<std::size_t>(expected_band.stride()));
  for (int top = 0; top < height; top += band) {
    if (are_equal(expected, actual, top - filters.halo, top + band + filters.halo - 1)) continue;
    expected_band.read(top - filters.halo);
    actual_band.read(top - filters.halo);
    for (int y = top; y < std::min(top + band, height); ++y) {
      for (int x = 0; x < expected_band.stride(); x += lanes::width) {
        lanes::store(row.data() + x,
                     difference(expected_band, actual_band, x, filters.halo + y - top, largest));
      }
      std::copy_n(row.begin(), width, result.map.begin() + static_cast<std::ptrdiff_t>(y) * width);
    }
  }
  double sum = 0;
  for (const float value : result.map) sum += value;
  result.mean = sum / static_cast<double>(result.map.size());
  result.max = *std::max_element(result.map.begin(), result.map.end());
  result.percentile_99 = percentile_99(result.map);
  return result;
}

Image heat_map(const Flip& flip) {
  // From black over violet and orange to pale yellow: brightness alone tells the order too.
  constexpr std::array<std::array<float, 3>, 6> stops{
      {{0, 0, 0}, {70, 15, 110}, {150, 40, 120}, {225, 85, 80}, {252, 165, 70}, {252, 253, 200}}};
  Image image(flip.width, flip.height);
  for (std::size_t i = 0; i < flip.map.size(); ++i) {
    const float at = std::clamp(flip.map[i], 0.0F, 1.0F) * (stops.size() - 1);
    const auto low = std::min(static_cast<std::size_t>(at), stops.size() - 2);
    const float share = at - static_cast<float>(low);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const float level = stops[low][channel] + share * (stops[low + 1][channel] - stops[low][channel]);
      image.rgb[3 * i + channel] = static_cast<std::uint8_t>(level + 0.5F);
    }
  }
  return image;
}

std::string_view visibility(const Flip& flip) {
  if (flip.max < 0.1) return "invisible";
  if (flip.max < 0.3) return "subtle";
  return "visible";
}

}  // namespace substep
