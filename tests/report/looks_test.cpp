#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include "render/inks.h"

namespace substep::render {
namespace {

using Colour = std::array<double, 3>;

Colour times(const std::array<Colour, 3>& matrix, const Colour& x) {
  Colour result{};
  for (std::size_t i = 0; i < 3; ++i)
    result[i] = matrix[i][0] * x[0] + matrix[i][1] * x[1] + matrix[i][2] * x[2];
  return result;
}

/// Linear light of "#rrggbb".
Colour linear(const std::string& hex) {
  Colour result{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double c = std::stoi(hex.substr(1 + 2 * i, 2), nullptr, 16) / 255.0;
    result[i] = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  }
  return result;
}

/// CIE L*a*b* under D65.
Colour lab(Colour light) {
  for (double& c : light) c = std::clamp(c, 0.0, 1.0);
  Colour xyz = times({{{0.4125, 0.3576, 0.1804}, {0.2127, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9503}}}, light);
  const Colour white{0.9505, 1, 1.0888};
  for (std::size_t i = 0; i < 3; ++i) {
    const double t = xyz[i] / white[i];
    xyz[i] = t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116;
  }
  return {116 * xyz[1] - 16, 500 * (xyz[0] - xyz[1]), 200 * (xyz[1] - xyz[2])};
}

/// The smallest distance of two inks as all, protanopes and deuteranopes see them (Machado, Oliveira and
/// Fernandes 2009).
double distance(int a, int b) {
  const std::array<std::array<Colour, 3>, 3> eyes{
      {{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
       {{{0.1523, 1.0526, -0.2049}, {0.1145, 0.7863, 0.0992}, {-0.0039, -0.0481, 1.0520}}},
       {{{0.3673, 0.8606, -0.2280}, {0.2801, 0.6725, 0.0474}, {-0.0118, 0.0429, 0.9689}}}}};
  double least = INFINITY;
  for (const auto& eye : eyes) {
    const Colour x = lab(times(eye, linear(inks.at(static_cast<std::size_t>(a)).light)));
    const Colour y = lab(times(eye, linear(inks.at(static_cast<std::size_t>(b)).light)));
    least = std::min(least, std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]));
  }
  return least;
}

TEST(Inks, EnginesDifferForTheColourBlind) {
  std::map<std::string, int> hues{
      {"A1", hue_of(Algorithm::a1)}, {"A3", hue_of(Algorithm::a3)}, {"A5", hue_of(Algorithm::a5)}};
  for (const char* const engine : {"ode-step", "mujoco-euler", "bullet-si", "rapier", "jolt", "mujoco3"})
    hues[engine] = hue_of_engine(engine);
  for (auto a = hues.begin(); a != hues.end(); ++a) {
    for (auto b = hues.begin(); b != a; ++b) {
      // The closest are A5 and Jolt, 18.3; then A3 and ODE, 24.8. Purple and grey, as before, were 8.5 apart.
      EXPECT_GT(distance(a->second, b->second), 18) << a->first << " " << b->first;
    }
  }
}

}  // namespace
}  // namespace substep::render
