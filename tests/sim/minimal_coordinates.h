#pragma once
/// Motion in minimal coordinates, by equations independent of the solver.

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "sim/math/vector.h"

namespace substep::test {

/// Steps y' = rate(y) by the classical Runge-Kutta method of order 4.
inline void runge_kutta(const std::function<std::vector<double>(const std::vector<double>&)>& rate, double h,
                        std::vector<double>& y) {
  const auto shifted = [&](double factor, const std::vector<double>& slope) {
    std::vector<double> point = y;
    for (std::size_t i = 0; i < y.size(); ++i) point[i] += factor * slope[i];
    return point;
  };
  const std::vector<double> one = rate(y);
  const std::vector<double> two = rate(shifted(h / 2, one));
  const std::vector<double> three = rate(shifted(h / 2, two));
  const std::vector<double> four = rate(shifted(h, three));
  for (std::size_t i = 0; i < y.size(); ++i) y[i] += h / 6 * (one[i] + 2 * two[i] + 2 * three[i] + four[i]);
}

/// The governor of scenes/governor.md. Its coordinates: the shaft's angle, the arms' from the vertical, the
/// slider's height under the top; then their rates.
struct GovernorEquations {
  static constexpr double gravity = 9.81;
  static constexpr double bar = 0.3, slider = 3, ball = 5;  // kg
  static constexpr double thin = bar * 0.0001 / 6;          // moment of a bar about itself, kg m²
  static constexpr double centre = (bar * 0.5 + ball) / (bar + ball);

  double of_ball = 0.4 * ball * 0.075 * 0.075;  ///< moment about its centre, kg m²
  double speed = 1;                             ///< of 2π rad/s, at the start
  double stiffness = 8e5;
  double damping = 4e4;

  double long_way() const { return thin + of_ball; }  ///< an arm's moment about itself
  double arm() const { return bar * (1 + 0.0001) / 12 + bar * 0.25 + of_ball + ball; }  ///< about its hinge

  std::vector<double> start() const {
    return {0, std::numbers::pi / 6, -std::sqrt(0.75), 2 * std::numbers::pi * speed, 0, 0};
  }

  double inertia(double angle) const {
    const double s = std::sin(angle), c = std::cos(angle);
    return thin + slider * 0.02 / 12 + 2 * (arm() * s * s + long_way() * c * c);
  }

  std::vector<double> rate(const std::vector<double>& y) const {
    const double s = std::sin(y[1]), c = std::cos(y[1]);
    const double growth = 4 * (arm() - long_way()) * s * c * y[4];  // of the inertia
    // A spring from half an arm to the slider.
    const double x = 0.5 * s, z = -0.5 * c - y[2];
    const double length = std::hypot(x, z);
    const double by_arm = (x * 0.5 * c + z * 0.5 * s) / length;
    const double by_slider = -z / length;
    const double force = stiffness * (0.5 - length) - damping * (by_arm * y[4] + by_slider * y[5]);
    return {y[3],
            y[4],
            y[5],
            -growth * y[3] / inertia(y[1]),
            ((arm() - long_way()) * s * c * y[3] * y[3] - (bar * 0.5 + ball) * gravity * s + force * by_arm) /
                arm(),
            -gravity + 2 * force * by_slider / slider};
  }

  /// Returns the centres of shaft, slider, left and right arm.
  std::vector<Vector3> centres(const std::vector<double>& y) const {
    const Vector3 out(std::cos(y[0]), 0, -std::sin(y[0]));
    const Vector3 down(0, -centre * std::cos(y[1]), 0);
    const Vector3 top(0, 1.55, 0);
    const Vector3 side = centre * std::sin(y[1]) * out;
    return {top - Vector3(0, 0.5, 0), top + Vector3(0, y[2], 0), top + down - side, top + down + side};
  }

  /// Returns the kinetic and potential energy without the springs', J.
  double energy(const std::vector<double>& y) const {
    return inertia(y[1]) * y[3] * y[3] / 2 + arm() * y[4] * y[4] + slider * y[5] * y[5] / 2 +
           gravity * (slider * y[2] - 2 * (bar + ball) * centre * std::cos(y[1]));
  }
};

}  // namespace substep::test
