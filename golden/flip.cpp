#include "golden/flip.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace substep {
namespace {

// Constants of the paper's sections 4 and 5.
constexpr float color_exponent = 0.7F;           // q_c
constexpr float color_knee = 0.4F;               // p_c
constexpr float color_knee_value = 0.95F;        // p_t
constexpr float feature_width_degrees = 0.082F;  // w
constexpr float feature_exponent = 0.5F;         // q_f
/// Contrast sensitivity: a Gaussian a·√(π/b)·exp(−π²x²/b), x in degrees (the paper's table 1).
struct Sensitivity {
  double a, b;
};
constexpr Sensitivity achromatic{1.0, 0.0047};
constexpr Sensitivity red_green{1.0, 0.0053};
constexpr Sensitivity blue_yellow_narrow{34.1, 0.04};
constexpr Sensitivity blue_yellow_wide{13.5, 0.025};

using Matrix3f = Eigen::Matrix3f;
using Color = std::array<float, 3>;
using Plane = std::vector<float>;
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
float luminance(float lightness) {
  return lightness * (1.0F / 116) + 16.0F / 116;
}
Color xyz_from_opponent(const Color& c) {
  const float y = luminance(c[0]);
  return {y + c[1] / 500, y, y - c[2] / 200};
}

/// L*a*b*, with a* and b* scaled by 0.01 L*: colours count less in the dark (Hunt).
Color hunt_lab(const ColorSpaces& spaces, const Color& rgb) {
  constexpr float delta = 6.0F / 29;
  const Color xyz = transform(spaces.xyz_from_rgb, rgb);
  Color f;
  for (std::size_t i = 0; i < 3; ++i) {
    f[i] = xyz[i] > delta * delta * delta ? std::cbrt(xyz[i]) : xyz[i] / (3 * delta * delta) + 4.0F / 29;
  }
  const float lightness = 116 * f[1] - 16;
  return {lightness, 0.01F * lightness * 500 * (f[0] - f[1]), 0.01F * lightness * 200 * (f[1] - f[2])};
}

float hyab(const Color& p, const Color& q) {
  return std::abs(p[0] - q[0]) + std::hypot(p[1] - q[1], p[2] - q[2]);
}

/// Along rows or columns, the border repeated.
enum class Along { rows, columns };

Plane convolve(const Plane& in, int width, int height, const Kernel& kernel, Along along) {
  Plane out(in.size());
  const int radius = static_cast<int>(kernel.size() / 2);
  if (along == Along::rows) {
    std::vector<float> padded(static_cast<std::size_t>(width) + kernel.size() - 1);
    for (int y = 0; y < height; ++y) {
      const float* row = &in[static_cast<std::size_t>(y) * width];
      std::fill_n(padded.begin(), radius, row[0]);
      std::copy_n(row, width, padded.begin() + radius);
      std::fill_n(padded.begin() + radius + width, radius, row[width - 1]);
      float* target = &out[static_cast<std::size_t>(y) * width];
      for (std::size_t tap = 0; tap < kernel.size(); ++tap) {
        const float weight = kernel[tap];
        const float* source = &padded[tap];
        for (int x = 0; x < width; ++x) target[x] += weight * source[x];
      }
    }
    return out;
  }
  for (int y = 0; y < height; ++y) {
    float* target = &out[static_cast<std::size_t>(y) * width];
    for (std::size_t tap = 0; tap < kernel.size(); ++tap) {
      const float weight = kernel[tap];
      const int from = std::clamp(y - radius + static_cast<int>(tap), 0, height - 1);
      const float* source = &in[static_cast<std::size_t>(from) * width];
      for (int x = 0; x < width; ++x) target[x] += weight * source[x];
    }
  }
  return out;
}

Plane convolve(const Plane& in, int width, int height, const Kernel& across, const Kernel& down) {
  return convolve(convolve(in, width, height, across, Along::rows), width, height, down, Along::columns);
}

/// A Gaussian of a contrast sensitivity, unit sum, and its weight in a sum of such: the two-dimensional
/// filter is a·√(π/b)·exp(−π²(x²+y²)/b), whose sum is that factor times the square of the one-dimensional
/// sum.
struct SensitivityFilter {
  Kernel kernel;
  double weight;
};

SensitivityFilter sensitivity_filter(const Sensitivity& s, float pixels_per_degree) {
  using std::numbers::pi;
  // All channels share the radius of the widest: three standard deviations.
  const int radius = static_cast<int>(std::ceil(3 * std::sqrt(blue_yellow_narrow.b / (2 * pi * pi)) *
                                                static_cast<double>(pixels_per_degree)));
  std::vector<double> weights;
  double sum = 0;
  for (int i = -radius; i <= radius; ++i) {
    const double x = i / static_cast<double>(pixels_per_degree);
    weights.push_back(std::exp(-pi * pi * x * x / s.b));
    sum += weights.back();
  }
  for (double& w : weights) w /= sum;
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

struct Planes {
  std::array<Plane, 3> opponent;
};

Planes to_opponent(const Image& image, const ColorSpaces& spaces) {
  std::array<float, 256> linear;
  for (std::size_t i = 0; i < linear.size(); ++i) {
    const float c = static_cast<float>(i) / 255;
    linear[i] = c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
  }
  Planes planes;
  const std::size_t count = static_cast<std::size_t>(image.width) * image.height;
  for (Plane& plane : planes.opponent) plane.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* p = &image.rgb[3 * i];
    const Color c = opponent(transform(spaces.xyz_from_rgb, {linear[p[0]], linear[p[1]], linear[p[2]]}));
    for (std::size_t channel = 0; channel < 3; ++channel) planes.opponent[channel][i] = c[channel];
  }
  return planes;
}

/// What the eye resolves at this distance, in the Hunt-adjusted L*a*b*.
std::vector<Color> perceived(const Planes& planes, int width, int height, const ColorSpaces& spaces,
                             float pixels_per_degree) {
  const auto blur = [&](const Plane& plane, const SensitivityFilter& filter) {
    return convolve(plane, width, height, filter.kernel, filter.kernel);
  };
  const Plane lightness = blur(planes.opponent[0], sensitivity_filter(achromatic, pixels_per_degree));
  const Plane red = blur(planes.opponent[1], sensitivity_filter(red_green, pixels_per_degree));
  const SensitivityFilter narrow = sensitivity_filter(blue_yellow_narrow, pixels_per_degree);
  const SensitivityFilter wide = sensitivity_filter(blue_yellow_wide, pixels_per_degree);
  const Plane blue_narrow = blur(planes.opponent[2], narrow);
  const Plane blue_wide = blur(planes.opponent[2], wide);
  const float share = static_cast<float>(narrow.weight / (narrow.weight + wide.weight));
  std::vector<Color> result(lightness.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    const float blue = share * blue_narrow[i] + (1 - share) * blue_wide[i];
    Color rgb = transform(spaces.rgb_from_xyz, xyz_from_opponent({lightness[i], red[i], blue}));
    for (float& c : rgb) c = std::clamp(c, 0.0F, 1.0F);
    result[i] = hunt_lab(spaces, rgb);
  }
  return result;
}

struct Features {
  Plane edges, points;  // magnitudes
};

Features features(const Planes& planes, int width, int height, const FeatureKernels& kernels) {
  Plane plane(planes.opponent[0].size());
  std::transform(planes.opponent[0].begin(), planes.opponent[0].end(), plane.begin(), luminance);
  const auto magnitude = [&](const Kernel& derivative) {
    Plane x = convolve(plane, width, height, derivative, kernels.gaussian);
    const Plane y = convolve(plane, width, height, kernels.gaussian, derivative);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::sqrt(x[i] * x[i] + y[i] * y[i]);
    return x;
  };
  return {magnitude(kernels.first), magnitude(kernels.second)};
}

/// Compresses large colour differences: [0, knee·max] → [0, 0.95], the rest → [0.95, 1].
float redistribute(float difference, float largest) {
  const float knee = color_knee * largest;
  if (difference < knee) return difference * color_knee_value / knee;
  return color_knee_value + (difference - knee) / (largest - knee) * (1 - color_knee_value);
}

}  // namespace

Flip flip(const Image& expected, const Image& actual, float pixels_per_degree) {
  const int width = expected.width;
  const int height = expected.height;
  Flip result{width, height, Plane(static_cast<std::size_t>(width) * height)};
  // Rounding in the filters must not make equal pictures differ, nor take their time.
  if (expected.rgb == actual.rgb) return result;
  static const ColorSpaces spaces;
  const Planes expected_planes = to_opponent(expected, spaces);
  const Planes actual_planes = to_opponent(actual, spaces);
  const std::vector<Color> expected_colors =
      perceived(expected_planes, width, height, spaces, pixels_per_degree);
  const std::vector<Color> actual_colors = perceived(actual_planes, width, height, spaces, pixels_per_degree);
  const FeatureKernels kernels = feature_kernels(pixels_per_degree);
  const Features expected_features = features(expected_planes, width, height, kernels);
  const Features actual_features = features(actual_planes, width, height, kernels);

  const float largest =
      std::pow(hyab(hunt_lab(spaces, {0, 1, 0}), hunt_lab(spaces, {0, 0, 1})), color_exponent);
  double sum = 0;
  for (std::size_t i = 0; i < result.map.size(); ++i) {
    const float color =
        redistribute(std::pow(hyab(expected_colors[i], actual_colors[i]), color_exponent), largest);
    const float feature =
        std::pow(std::max(std::abs(expected_features.edges[i] - actual_features.edges[i]),
                          std::abs(expected_features.points[i] - actual_features.points[i])) /
                     std::numbers::sqrt2_v<float>,
                 feature_exponent);
    const float value = std::pow(color, 1 - feature);
    result.map[i] = value;
    sum += value;
    result.max = std::max(result.max, static_cast<double>(value));
  }
  result.mean = sum / static_cast<double>(result.map.size());
  std::vector<float> sorted = result.map;
  const auto at_99 = sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() * 99 - 1) / 100);
  std::nth_element(sorted.begin(), at_99, sorted.end());
  result.percentile_99 = *at_99;
  return result;
}

std::string_view visibility(const Flip& flip) {
  if (flip.max < 0.1) return "invisible";
  if (flip.max < 0.3) return "subtle";
  return "visible";
}

}  // namespace substep
