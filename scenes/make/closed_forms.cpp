#include "closed_forms.h"

#include <cmath>
#include <numbers>

#include "sim/math/rotation.h"

namespace substep::scenes {
namespace {

/// Returns the first time after `start` at which the function changes its sign; `duration` if it does not.
template <typename Function>
double next_zero(const Function& function, double start, double duration) {
  constexpr double stride = 1e-4;
  const bool side = function(start + stride) < 0;
  for (int i = 1; start + stride * i < duration; ++i) {
    double low = start + stride * i;
    double high = low + stride;
    if ((function(high) < 0) == side) continue;
    for (int halving = 0; halving < 100; ++halving) {
      const double middle = (low + high) / 2;
      ((function(middle) < 0) == side ? low : high) = middle;
    }
    return (low + high) / 2;
  }
  return duration;
}

/// Returns the complete elliptic integral of the first kind, of modulus k in [0, 1).
double complete_elliptic_integral(double k) {
  // Gauss's arithmetic-geometric mean.
  double a = 1;
  double b = std::sqrt(1 - k * k);
  for (int i = 0; i < 60; ++i) {
    const double mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
  }
  return std::numbers::pi / (2 * a);
}

}  // namespace

double pendulum_period(double moment, double mass, double gravity, double lever, double amplitude) {
  return 4 * std::sqrt(moment / (mass * gravity * lever)) *
         complete_elliptic_integral(sine_cosine(amplitude / 2).sine);
}

std::vector<double> slips_on_shaken_table(double throw_length, double rate, double friction, double gravity,
                                          double duration) {
  const double peak = throw_length * rate * rate;  // of the table's acceleration
  const double limit = friction * gravity;         // of the block's acceleration
  const auto push = [&](double t) { return peak * sine_cosine(rate * t).cosine; };  // seen from the table
  std::vector<double> positions;
  double position = 0;
  double time = 0;
  while (time < duration) {
    // The block sticks until the push exceeds friction.
    if (!(std::fabs(push(time)) > limit))
      time = next_zero([&](double t) { return std::fabs(push(t)) - limit; }, time, duration);
    if (time >= duration) break;
    const double side = push(time) > 0 ? 1 : -1;
    const auto start = sine_cosine(rate * time);
    const auto speed = [&](double t) {
      return throw_length * rate * (sine_cosine(rate * t).sine - start.sine) - side * limit * (t - time);
    };
    const double end = next_zero(speed, time, duration);
    if (end >= duration) break;
    const double slip_time = end - time;
    position += throw_length * (start.cosine - sine_cosine(rate * end).cosine) -
                throw_length * rate * start.sine * slip_time - side * limit * slip_time * slip_time / 2;
    positions.push_back(position);
    time = end;
  }
  return positions;
}

}  // namespace substep::scenes
