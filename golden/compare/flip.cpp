#include "golden/compare/flip.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace substep::golden {
namespace {

/// A number for every pixel. A column of the array is a row of pixels, so that neighbours in a row are
/// neighbours in memory.
using Plane = Eigen::ArrayXXf;
using Planes = std::array<Plane, 3>;
using Kernel = Eigen::ArrayXf;

/// The pixels of a row that are filtered together: as many sums as the processor's registers hold. Rows are
/// padded to a multiple of `lanes` pixels: Eigen computes four floats at once and single ones by
/// functions that round differently, and a value must not depend on where its pixel lies.
constexpr int lanes = 32;
using Lanes = Eigen::Array<float, lanes, 1>;

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
constexpr Sensitivity red_green_sensitivity{1.0, 0.0053};
constexpr Sensitivity blue_yellow_narrow{34.1, 0.04};
constexpr Sensitivity blue_yellow_wide{13.5, 0.025};

/// A band of a picture: rows from `top` on.
struct Band {
  int top, height;
};

/// Computes aᵇ for 0 ≤ a and 0 ≤ b ≤ 1. A minimum stands for a condition here and below: Eigen computes it
/// for four numbers at once.
template <typename Exponent>
Plane power(const Plane& a, const Exponent& b) {
  constexpr float smallest = 1e-37F;
  constexpr float largest = 1e38F;  // so that 0 gives 0, and numbers from `smallest` on give aᵇ
  return (b * a.max(smallest).log()).exp().min(largest * a);
}

// Colour spaces (the paper's section 4.1). XYZ is relative to the white of D65 throughout.

/// Returns the matrix from linear sRGB to CIE XYZ relative to white, from the primaries of IEC 61966-2-1 and,
/// as in the authors' program, the white D65 to five digits.
Eigen::Matrix3d relative_xyz_from_rgb() {
  const auto xyz = [](double x, double y) { return Eigen::Vector3d(x / y, 1, (1 - x - y) / y); };
  Eigen::Matrix3d primaries;
  primaries << xyz(0.64, 0.33), xyz(0.30, 0.60), xyz(0.15, 0.06);
  const Eigen::Vector3d scale = primaries.inverse() * xyz(0.31271, 0.32902);
  const Eigen::Matrix3d absolute = primaries * scale.asDiagonal();
  const Eigen::Vector3d white = absolute * Eigen::Vector3d::Ones();
  return white.cwiseInverse().asDiagonal() * absolute;
}

Planes transformed(const Eigen::Matrix3d& matrix, const Planes& c) {
  const Eigen::Matrix3f m = matrix.cast<float>();
  Planes result;
  for (int i = 0; i < 3; ++i)
    result[static_cast<std::size_t>(i)] = m(i, 0) * c[0] + m(i, 1) * c[1] + m(i, 2) * c[2];
  return result;
}

/// Converts linear RGB to YCxCz: lightness, red–green, blue–yellow; linear in RGB.
Planes opponent(const Planes& rgb) {
  const Planes xyz = transformed(relative_xyz_from_rgb(), rgb);
  return {116 * xyz[1] - 16, 500 * (xyz[0] - xyz[1]), 200 * (xyz[1] - xyz[2])};
}

/// Returns the relative luminance of an opponent colour's lightness.
Plane luminance(const Plane& lightness) {
  return lightness * (1.0F / 116) + 16.0F / 116;
}

/// Converts linear RGB to L*a*b* with a* and b* scaled by 0.01 L*: colours count less in the dark (Hunt).
Planes hunt_lab(const Planes& rgb) {
  constexpr float delta = 6.0F / 29;
  constexpr float knee = delta * delta * delta;
  Planes f = transformed(relative_xyz_from_rgb(), rgb);
  // The cube root above the knee, its tangent below.
  for (Plane& c : f)
    c = (c.max(knee).log() * (1.0F / 3)).exp() + (c.min(knee) - knee) * (1 / (3 * delta * delta));
  const Plane lightness = 116 * f[1] - 16;
  return {lightness, 5 * lightness * (f[0] - f[1]), 2 * lightness * (f[1] - f[2])};
}

/// Converts YCxCz, clipped to what a screen shows, to L*a*b* as in hunt_lab().
Planes perceived(const Planes& opponent) {
  const Plane y = luminance(opponent[0]);
  Planes rgb = transformed(relative_xyz_from_rgb().inverse(),
                           {y + opponent[1] * (1.0F / 500), y, y - opponent[2] * (1.0F / 200)});
  for (Plane& c : rgb) c = c.max(0.0F).min(1.0F);
  return hunt_lab(rgb);
}

/// Returns the HyAB distance of two perceived colours to the power q_c.
Plane compressed_distance(const Planes& p, const Planes& q) {
  const Plane distance = (p[0] - q[0]).abs() + ((p[1] - q[1]).square() + (p[2] - q[2]).square()).sqrt();
  return power(distance, color_exponent);
}

/// Maps distances of perceived colours to [0, 1]: [0, p_c of the largest] → [0, p_t], the rest → [p_t, 1].
Plane color_difference(const Planes& p, const Planes& q) {
  const Plane zero = Plane::Zero(lanes, 1);
  const Plane one = Plane::Ones(lanes, 1);
  // Green and blue are the farthest apart of a screen's colours.
  const float largest = compressed_distance(hunt_lab({zero, one, zero}), hunt_lab({zero, zero, one}))(0, 0);
  const float knee = color_knee * largest;
  const Plane distance = compressed_distance(p, q);
  // The lower of two lines: they meet at the knee, and the second is less steep.
  return (distance * (color_knee_value / knee))
      .min(color_knee_value + (distance - knee) * ((1 - color_knee_value) / (largest - knee)));
}

// Filters: a kernel has the weights at −r … r.

/// Returns how far the widest contrast sensitivity reaches, in pixels: three standard deviations.
int sensitivity_radius() {
  using std::numbers::pi;
  return static_cast<int>(std::ceil(3 * std::sqrt(blue_yellow_narrow.b / (2 * pi * pi)) *
                                    static_cast<double>(pixels_per_degree)));
}

/// A Gaussian of a contrast sensitivity, unit sum, and its weight in a sum of such: the two-dimensional
/// filter is a·√(π/b)·exp(−π²(x²+y²)/b), whose sum is that factor times the square of the one-dimensional
/// sum.
struct SensitivityFilter {
  Kernel kernel;
  double weight;
};

SensitivityFilter sensitivity_filter(const Sensitivity& s) {
  using std::numbers::pi;
  const int radius = sensitivity_radius();
  const Eigen::ArrayXd x =
      Eigen::ArrayXd::LinSpaced(2 * radius + 1, -radius, radius) / static_cast<double>(pixels_per_degree);
  const Eigen::ArrayXd weights = (-pi * pi * x.square() / s.b).exp();
  const double sum = weights.sum();
  return {(weights / sum).cast<float>(), s.a * std::sqrt(pi / s.b) * sum * sum};
}

/// Scales the positive weights to the sum 1, the negative ones to −1. Computes in single precision, as the
/// authors' program does: on flat areas these sums cancel but for their rounding, and the exponent ½ makes
/// 3e-5 of 1e-9, so agreement to 2e-6 needs the same rounding.
Kernel of_unit_sums(Kernel weights) {
  float positive = 0;
  float negative = 0;
  for (const float w : weights) (w > 0 ? positive : negative) += std::abs(w);
  for (float& w : weights) w /= w > 0 ? positive : negative;
  return weights;
}

/// A filter for each of lightness, red–green and, in two parts, blue–yellow; and a Gaussian with its first
/// and second derivatives, which find edges and points.
struct Filters {
  Filters()
      : lightness(sensitivity_filter(achromatic).kernel),
        red_green(sensitivity_filter(red_green_sensitivity).kernel),
        blue_narrow(sensitivity_filter(blue_yellow_narrow)),
        blue_wide(sensitivity_filter(blue_yellow_wide)) {
    const float deviation = 0.5F * feature_width_degrees * pixels_per_degree;
    const int radius = static_cast<int>(std::ceil(3 * deviation));
    Kernel weights(2 * radius + 1), slopes(2 * radius + 1), curvatures(2 * radius + 1);
    for (int i = -radius; i <= radius; ++i) {
      const auto x = static_cast<float>(i);
      const float g = std::exp(-x * x / (2 * deviation * deviation));
      weights[i + radius] = g;
      slopes[i + radius] = -x * g;
      curvatures[i + radius] = (x * x / (deviation * deviation) - 1) * g;
    }
    gaussian = of_unit_sums(weights);
    first = of_unit_sums(slopes);
    second = of_unit_sums(curvatures);
    reach = std::max(sensitivity_radius(), radius);
  }

  Kernel lightness, red_green;
  SensitivityFilter blue_narrow, blue_wide;
  Kernel gaussian, first, second;
  int reach = 0;  ///< of the widest of them, pixels
};

/// Convolves every row of pixels, with (1, 0) for (dx, dy), or every column, with (0, 1). `from` has `reach`
/// more pixels at each of their ends than the result.
Plane filtered(const Plane& from, const Kernel& kernel, int reach, int dx, int dy) {
  const Eigen::Index start = reach - kernel.size() / 2;
  Plane result(from.rows() - 2 * reach * dx, from.cols() - 2 * reach * dy);
  for (Eigen::Index y = 0; y < result.cols(); ++y) {
    for (Eigen::Index x = 0; x < result.rows(); x += lanes) {
      Lanes sum = Lanes::Zero();
      for (Eigen::Index tap = start; tap < start + kernel.size(); ++tap) {
        sum += kernel[tap - start] * from.block<lanes, 1>(x + dx * tap, y + dy * tap);
      }
      result.col(y).segment<lanes>(x) = sum;
    }
  }
  return result;
}

/// A band of a picture as an observer perceives it.
struct Perceived {
  Planes color;         ///< after contrast-sensitivity filters
  Plane edges, points;  ///< strengths
};

/// Returns the linear RGB of a band and of `reach` pixels around it. Beyond the picture its border is
/// repeated.
Planes linear_rgb(const render::Image& image, const Band& band, int reach) {
  std::array<float, 256> linear;
  for (std::size_t i = 0; i < linear.size(); ++i) {
    const float c = static_cast<float>(i) / 255;  // IEC 61966-2-1
    linear[i] = c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
  }
  const int padded_width = (image.width + lanes - 1) / lanes * lanes;
  Planes rgb;
  rgb.fill(Plane(padded_width + 2 * reach, band.height + 2 * reach));
  for (int y = 0; y < rgb[0].cols(); ++y) {
    for (int x = 0; x < rgb[0].rows(); ++x) {
      const std::uint8_t* pixel = image.pixel(std::clamp(x - reach, 0, image.width - 1),
                                              std::clamp(band.top - reach + y, 0, image.height - 1));
      for (std::size_t c = 0; c < 3; ++c) rgb[c](x, y) = linear[pixel[c]];
    }
  }
  return rgb;
}

/// Filters each opponent colour by its contrast sensitivity, and finds edges and points by derivatives.
Perceived perceive(const render::Image& image, const Band& band, const Filters& filters) {
  const int reach = filters.reach;
  const Planes colors = opponent(linear_rgb(image, band, reach));
  const auto filter_rows = [&](const Plane& from, const Kernel& kernel) {
    return filtered(from, kernel, reach, 1, 0);
  };
  const auto filter_columns = [&](const Plane& from, const Kernel& kernel) {
    return filtered(from, kernel, reach, 0, 1);
  };
  const auto blur = [&](const Plane& from, const Kernel& kernel) {
    return filter_columns(filter_rows(from, kernel), kernel);
  };
  const auto narrow = static_cast<float>(filters.blue_narrow.weight /
                                         (filters.blue_narrow.weight + filters.blue_wide.weight));
  const Plane blue_yellow = narrow * blur(colors[2], filters.blue_narrow.kernel) +
                            (1 - narrow) * blur(colors[2], filters.blue_wide.kernel);
  const Plane light = luminance(colors[0]);
  const Plane smooth = filter_rows(light, filters.gaussian);
  const auto strength = [&](const Kernel& derivative) -> Plane {
    const Plane across = filter_columns(filter_rows(light, derivative), filters.gaussian);
    return (across.square() + filter_columns(smooth, derivative).square()).sqrt();
  };
  return {perceived({blur(colors[0], filters.lightness), blur(colors[1], filters.red_green), blue_yellow}),
          strength(filters.first), strength(filters.second)};
}

/// Returns the FLIP error of each pixel, 0 to 1.
Plane visible_difference(const Perceived& before, const Perceived& after) {
  const Plane strongest = (before.edges - after.edges).abs().max((before.points - after.points).abs());
  // The feature difference to the power of q_f = ½.
  const Plane feature = (strongest * (1 / std::numbers::sqrt2_v<float>)).sqrt();
  return power(color_difference(before.color, after.color), Plane(1 - feature));
}

}  // namespace

Flip flip(const render::Image& expected, const render::Image& actual) {
  const int width = expected.width;
  Flip result{width, expected.height, std::vector<float>(static_cast<std::size_t>(width) * expected.height)};
  if (expected.rgb == actual.rgb) return result;
  const Filters filters;
  // A band of rows at a time: its planes stay in the processor's cache.
  constexpr int band_height = 64;
  for (int y = 0; y < expected.height; y += band_height) {
    const Band band{y, std::min(band_height, expected.height - y)};
    const Plane values =
        visible_difference(perceive(expected, band, filters), perceive(actual, band, filters));
    for (int row = 0; row < band.height; ++row) {
      std::copy_n(values.col(row).data(), width, &result.map[static_cast<std::size_t>(y + row) * width]);
    }
  }
  double sum = 0;
  for (const float value : result.map) sum += value;
  result.mean = sum / static_cast<double>(result.map.size());
  result.max = *std::max_element(result.map.begin(), result.map.end());
  return result;
}

render::Image heat_map(const Flip& flip) {
  // Go from black over violet and orange to pale yellow: brightness alone shows the order, too.
  constexpr std::array<std::array<float, 3>, 6> stops{
      {{0, 0, 0}, {70, 15, 110}, {150, 40, 120}, {225, 85, 80}, {252, 165, 70}, {252, 253, 200}}};
  render::Image image(flip.width, flip.height);
  for (std::size_t i = 0; i < flip.map.size(); ++i) {
    const float position = std::clamp(flip.map[i], 0.0F, 1.0F) * (stops.size() - 1);
    const auto low = std::min(static_cast<std::size_t>(position), stops.size() - 2);
    const float fraction = position - static_cast<float>(low);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const float level = stops[low][channel] + fraction * (stops[low + 1][channel] - stops[low][channel]);
      image.rgb[3 * i + channel] = static_cast<std::uint8_t>(std::lround(level));
    }
  }
  return image;
}

std::string_view visibility(const Flip& flip) {
  if (flip.max < 0.1) return "invisible";
  if (flip.max < 0.3) return "subtle";
  return "visible";
}

}  // namespace substep::golden
