#include "golden/compare/flip_color.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>

namespace substep::golden {
namespace {

// Constants of the paper's section 4.
constexpr float color_exponent = 0.7F;     // q_c
constexpr float color_knee = 0.4F;         // p_c
constexpr float color_knee_value = 0.95F;  // p_t

using cells::all;
using cells::Floats;

/// Linear sRGB → CIE XYZ from the primaries of IEC 61966-2-1 and, as the authors' program has it, the white
/// D65 to five digits.
Eigen::Matrix3d absolute_xyz_from_rgb() {
  const auto xyz = [](double x, double y) { return Eigen::Vector3d(x / y, 1, (1 - x - y) / y); };
  Eigen::Matrix3d primaries;
  primaries << xyz(0.64, 0.33), xyz(0.30, 0.60), xyz(0.15, 0.06);
  const Eigen::Vector3d scale = primaries.inverse() * xyz(0.31271, 0.32902);
  return primaries * scale.asDiagonal();
}

std::array<std::array<float, 3>, 3> rows_of(const Eigen::Matrix3d& m) {
  std::array<std::array<float, 3>, 3> rows;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      rows[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = static_cast<float>(m(i, j));
    }
  }
  return rows;
}

std::array<float, 256> decoded_levels() {
  std::array<float, 256> linear;
  for (std::size_t i = 0; i < linear.size(); ++i) {
    const float c = static_cast<float>(i) / 255;
    linear[i] = c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
  }
  return linear;
}

Floats hyab(const FlipColor& p, const FlipColor& q) {
  const Floats a = p[1] - q[1];
  const Floats b = p[2] - q[2];
  return cells::absolute(p[0] - q[0]) + cells::root(a * a + b * b);
}

}  // namespace

const std::array<float, 256>& linear_levels() {
  static const std::array<float, 256> levels = decoded_levels();
  return levels;
}

Floats luminance(Floats lightness) {
  return lightness * (1.0F / 116) + 16.0F / 116;
}

FlipColor FlipColors::Matrix::operator*(const FlipColor& c) const {
  const auto row = [&](std::size_t i) { return rows[i][0] * c[0] + rows[i][1] * c[1] + rows[i][2] * c[2]; };
  return {row(0), row(1), row(2)};
}

FlipColors::FlipColors() {
  const Eigen::Matrix3d absolute = absolute_xyz_from_rgb();
  const Eigen::Vector3d white = absolute * Eigen::Vector3d::Ones();
  const Eigen::Matrix3d relative = white.cwiseInverse().asDiagonal() * absolute;
  xyz_from_rgb_.rows = rows_of(relative);
  rgb_from_xyz_.rows = rows_of(relative.inverse());
  const FlipColor green{all(0), all(1), all(0)};
  const FlipColor blue{all(0), all(0), all(1)};
  const float largest = cells::power(hyab(hunt_lab(green), hunt_lab(blue)), all(color_exponent))[0];
  knee_ = color_knee * largest;
  below_knee_ = color_knee_value / knee_;
  above_knee_ = (1 - color_knee_value) / (largest - knee_);
}

FlipColor FlipColors::opponent(const FlipColor& rgb) const {
  const FlipColor xyz = xyz_from_rgb_ * rgb;
  return {116 * xyz[1] - 16, 500 * (xyz[0] - xyz[1]), 200 * (xyz[1] - xyz[2])};
}

FlipColor FlipColors::perceived(const FlipColor& opponent) const {
  const Floats y = luminance(opponent[0]);
  FlipColor rgb =
      rgb_from_xyz_ * FlipColor{y + opponent[1] * (1.0F / 500), y, y - opponent[2] * (1.0F / 200)};
  for (Floats& c : rgb) c = cells::min(cells::max(c, all(0)), all(1));
  return hunt_lab(rgb);
}

FlipColor FlipColors::hunt_lab(const FlipColor& rgb) const {
  constexpr float delta = 6.0F / 29;
  constexpr float knee = delta * delta * delta;
  const FlipColor xyz = xyz_from_rgb_ * rgb;
  FlipColor f;
  for (std::size_t i = 0; i < 3; ++i) {
    const Floats root = cells::cube_root(cells::max(xyz[i], all(knee)));
    f[i] = cells::choose(xyz[i] > knee, root, xyz[i] * (1 / (3 * delta * delta)) + 4.0F / 29);
  }
  const Floats lightness = 116 * f[1] - 16;
  const Floats hunt = 0.01F * lightness;
  return {lightness, hunt * 500 * (f[0] - f[1]), hunt * 200 * (f[1] - f[2])};
}

Floats FlipColors::difference(const FlipColor& p, const FlipColor& q) const {
  const Floats apart = cells::power(hyab(p, q), all(color_exponent));
  return cells::choose(apart < knee_, apart * below_knee_, color_knee_value + (apart - knee_) * above_knee_);
}

}  // namespace substep::golden
