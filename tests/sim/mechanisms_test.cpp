// A1 and the reference integrator on closed loops and stiff springs: against equations of motion in minimal
// coordinates, written here by hand and stepped by Runge and Kutta's method. They share no line with the
// solver.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <ostream>
#include <string>
#include <vector>

#include "sim/loading/load_scene.h"
#include "sim/measure/motion.h"
#include "sim/simulation.h"
#include "tests/scene_files.h"

namespace substep {
namespace {

constexpr double gravity = 9.81;

/// Centres of the bodies that move, in the order of the scene's file.
using Centres = std::vector<Vector3>;

/// A mechanism in minimal coordinates.
struct Mechanism {
  const char* scene;
  std::vector<double> start;
  std::function<std::vector<double>(const std::vector<double>&)> rate;
  std::function<Centres(const std::vector<double>&)> centres;
};

/// The classical method of order 4.
void runge_kutta(const Mechanism& mechanism, double h, std::vector<double>& y) {
  const auto shifted = [&](double factor, const std::vector<double>& slope) {
    std::vector<double> point = y;
    for (std::size_t i = 0; i < y.size(); ++i) point[i] += factor * slope[i];
    return point;
  };
  const std::vector<double> one = mechanism.rate(y);
  const std::vector<double> two = mechanism.rate(shifted(h / 2, one));
  const std::vector<double> three = mechanism.rate(shifted(h / 2, two));
  const std::vector<double> four = mechanism.rate(shifted(h, three));
  for (std::size_t i = 0; i < y.size(); ++i) y[i] += h / 6 * (one[i] + 2 * two[i] + 2 * three[i] + four[i]);
}

/// At multiples of 1/60 s, with so many steps in each.
std::vector<Centres> motion_of(const Mechanism& mechanism, int steps, double duration) {
  std::vector<double> y = mechanism.start;
  std::vector<Centres> motion{mechanism.centres(y)};
  for (int k = 1; k <= std::lround(60 * duration); ++k) {
    for (int i = 0; i < steps; ++i) runge_kutta(mechanism, 1.0 / 60 / steps, y);
    motion.push_back(mechanism.centres(y));
  }
  return motion;
}

double distance(const Centres& centres, const State& state) {
  double largest = 0;
  for (std::size_t i = 0; i < centres.size(); ++i)
    largest = std::max(largest, (centres[i] - state.q[i + 1].linear).norm());
  return largest;
}

// Bricard's mechanism, threefold symmetric with right angles. With its angles from the start a (at corners 1,
// 3, 5) and b (2, 4, 6) it closes where F = sin a + sin b + sin a sin b = 0. Its coordinate u runs along that
// curve: a' = ∂F/∂b u', b' = −∂F/∂a u'. Of the chain of rods 1 to 5 from corner 1 the moments' part is m(a,
// b) of a quadratic form in the angles' rates.

struct RodState {
  Vector3 centre;
  Vector3 velocity;
  Vector3 spin;
  Quaternion turn;
};

constexpr std::array<int, 5> hinge_axes{1, 2, 0, 1, 2};
const std::array<Vector3, 6> corners{{{0, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, -1, 1}, {0, -1, 1}, {0, 0, 1}}};

std::array<RodState, 5> bricard_rods(double a, double b, double rate_a, double rate_b) {
  std::array<RodState, 5> rods;
  Vector3 corner(0, 2.3, 0);
  Vector3 corner_velocity = Vector3::Zero();
  Vector3 spin = Vector3::Zero();
  Quaternion turn = Quaternion::Identity();
  for (int i = 0; i < 5; ++i) {
    const Vector3 axis = turn * Vector3::Unit(hinge_axes[i]);
    spin += (i % 2 == 0 ? rate_a : rate_b) * axis;
    turn = turn * Quaternion(Eigen::AngleAxisd((i % 2 == 0 ? a : b), Vector3::Unit(hinge_axes[i])));
    const Vector3 along = turn * (corners[i + 1] - corners[i]);
    rods[i] = {corner + along / 2, corner_velocity + spin.cross(along / 2), spin, turn};
    corner += along;
    corner_velocity += spin.cross(along);
  }
  return rods;
}

double bricard_mass(double a, double b) {
  const double rate_a = std::cos(b) * (1 + std::sin(a));
  const double rate_b = -std::cos(a) * (1 + std::sin(b));
  double mass = 0;
  const auto rods = bricard_rods(a, b, rate_a, rate_b);
  for (int i = 0; i < 5; ++i) {
    const Vector3 local = rods[i].turn.conjugate() * rods[i].spin;
    const Vector3 along = corners[i + 1] - corners[i];
    for (int k = 0; k < 3; ++k) mass += local[k] * local[k] * (along[k] != 0 ? 0.02 : 1.01) / 12;
    mass += rods[i].velocity.squaredNorm();
  }
  return mass;
}

double bricard_potential(double a, double b) {
  double height = 0;
  for (const RodState& rod : bricard_rods(a, b, 0, 0)) height += rod.centre.y();
  return gravity * height;
}

/// Along the curve, by the central difference of order 8.
double along_curve(double (*value)(double, double), double a, double b) {
  constexpr std::array weights{4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
  constexpr double shift = 0.01;
  const double da = shift * std::cos(b) * (1 + std::sin(a));
  const double db = -shift * std::cos(a) * (1 + std::sin(b));
  double sum = 0;
  for (int k = 1; k <= 4; ++k)
    sum += weights[k - 1] * (value(a + k * da, b + k * db) - value(a - k * da, b - k * db)) / shift;
  return sum;
}

Mechanism bricard() {
  return {"bricard",
          {0, 0, 0},
          [](const std::vector<double>& y) {
            const double rate_a = std::cos(y[1]) * (1 + std::sin(y[0]));
            const double rate_b = -std::cos(y[0]) * (1 + std::sin(y[1]));
            const double force = -along_curve(bricard_potential, y[0], y[1]) -
                                 0.5 * along_curve(bricard_mass, y[0], y[1]) * y[2] * y[2];
            return std::vector<double>{rate_a * y[2], rate_b * y[2], force / bricard_mass(y[0], y[1])};
          },
          [](const std::vector<double>& y) {
            Centres centres;
            for (const RodState& rod : bricard_rods(y[0], y[1], 0, 0)) centres.push_back(rod.centre);
            return centres;
          }};
}

// Four-bar cells: all cranks turn by one angle from the upright, and the couplers go with their ends.
Mechanism four_bar() {
  constexpr int cells = 4;
  constexpr double width = 0.04;
  constexpr double moment = (cells + 1) * ((1 + width * width) / 12 + 0.25) + cells;
  constexpr double weight = gravity * ((cells + 1) * 0.5 + cells);
  return {"four_bar",
          {std::numbers::pi / 6, 0},
          [](const std::vector<double>& y) {
            return std::vector<double>{y[1], weight / moment * std::sin(y[0])};
          },
          [](const std::vector<double>& y) {
            const Vector3 end(std::sin(y[0]), std::cos(y[0]), 0);
            Centres centres;
            for (int i = 0; i <= cells; ++i) centres.push_back(Vector3(i, 1.35, 0) + end / 2);
            for (int i = 0; i < cells; ++i) centres.push_back(Vector3(i + 0.5, 1.35, 0) + end);
            return centres;
          }};
}

// The governor: the shaft's angle, the arms' from the vertical, the slider's height under the top; then their
// rates.
Mechanism governor() {
  constexpr double bar = 0.3, slider = 3, ball = 5;
  constexpr double thin = bar * 0.0001 / 6, of_ball = 0.4 * ball * 0.075 * 0.075;  // moments about axes
  constexpr double long_way = thin + of_ball;
  constexpr double arm = bar * (1 + 0.0001) / 12 + bar * 0.25 + of_ball + ball;  // about its hinge
  const double root = std::sqrt(0.75);
  return {"governor",
          {0, std::numbers::pi / 6, -root, 2 * std::numbers::pi, 0, 0},
          [](const std::vector<double>& y) {
            const double s = std::sin(y[1]), c = std::cos(y[1]);
            const double inertia = thin + slider * 0.02 / 12 + 2 * (arm * s * s + long_way * c * c);
            const double growth = 4 * (arm - long_way) * s * c * y[4];  // of it
            // A spring from half an arm to the slider.
            const double x = 0.5 * s, z = -0.5 * c - y[2];
            const double length = std::hypot(x, z);
            const double by_arm = (x * 0.5 * c + z * 0.5 * s) / length;
            const double by_slider = -z / length;
            const double force = 8e5 * (0.5 - length) - 4e4 * (by_arm * y[4] + by_slider * y[5]);
            return std::vector<double>{
                y[3],
                y[4],
                y[5],
                -growth * y[3] / inertia,
                ((arm - long_way) * s * c * y[3] * y[3] - (bar * 0.5 + ball) * gravity * s + force * by_arm) /
                    arm,
                -gravity + 2 * force * by_slider / slider};
          },
          [](const std::vector<double>& y) {
            constexpr double centre = (bar * 0.5 + ball) / (bar + ball);
            const Vector3 out(std::cos(y[0]), 0, -std::sin(y[0]));
            const Vector3 down(0, -centre * std::cos(y[1]), 0);
            const Vector3 top(0, 1.55, 0);
            const Vector3 side = centre * std::sin(y[1]) * out;
            return Centres{top - Vector3(0, 0.5, 0), top + Vector3(0, y[2], 0), top + down - side,
                           top + down + side};
          }};
}

double largest_error(const Scene& scene, const std::vector<Centres>& exact, int rate) {
  Settings settings;
  settings.algorithm = Algorithm::a1;
  settings.step = 1.0 / rate;
  Simulation simulation(scene, settings);
  double largest = 0;
  for (std::size_t k = 1; k < exact.size(); ++k) {
    for (int i = 0; i < rate / 60; ++i) {
      EXPECT_NE(simulation.step().status, StepReport::Status::unsolved) << scene.name << " " << rate;
    }
    largest = std::max(largest, distance(exact[k], simulation.state()));
  }
  return largest;
}

struct Case {
  Mechanism mechanism;
  int steps;  // of Runge and Kutta in 1/60 s: springs as stiff as the governor's need many
  double duration;
  double error;         // of A1 at 1/60 s, m, at most
  double own_accuracy;  // of the motion here, m
};

void PrintTo(const Case& one, std::ostream* out) {
  *out << one.mechanism.scene;
}

class MinimalCoordinates : public testing::TestWithParam<Case> {};

// Errors at 1/60, 1/120 and 1/240 s, measured: bricard 12.8, 6.53, 3.30 mm; four_bar 45.0, 24.5, 12.9 mm;
// governor 9.64, 5.23, 2.72 mm.
TEST_P(MinimalCoordinates, A1IsOfFirstOrder) {
  const auto& [mechanism, steps, duration, error, own_accuracy] = GetParam();
  const Scene scene = scene_named(mechanism.scene);
  const std::vector<Centres> exact = motion_of(mechanism, steps, duration);
  const double coarse = largest_error(scene, exact, 60);
  const double middle = largest_error(scene, exact, 120);
  const double fine = largest_error(scene, exact, 240);
  EXPECT_LT(coarse, error);
  EXPECT_NEAR(std::log2(coarse / middle), 1, 0.2) << coarse << " " << middle << " " << fine;
  EXPECT_NEAR(std::log2(middle / fine), 1, 0.2) << coarse << " " << middle << " " << fine;
}

TEST_P(MinimalCoordinates, ReferenceStaysWithinUncertainty) {
  const auto& [mechanism, steps, duration, error, own_accuracy] = GetParam();
  const Scene scene = scene_named(mechanism.scene);
  const std::vector<Centres> exact = motion_of(mechanism, 2 * steps, 1);
  const ReferenceMotion reference = reference_motion(scene, 1);
  EXPECT_EQ(reference.method.substr(0, 3), "own") << reference.method;
  ASSERT_GT(reference.horizon, 0.99);
  double off = 0;
  for (std::size_t k = 0; k < exact.size(); ++k)
    off = std::max(off, distance(exact[k], reference.motion.samples.at(k)));
  EXPECT_LT(off, reference.uncertainty + own_accuracy);
}

INSTANTIATE_TEST_SUITE_P(Mechanisms, MinimalCoordinates,
                         testing::Values(Case{bricard(), 16, 8, 0.015, 1e-11},
                                         Case{four_bar(), 16, 2, 0.05, 1e-9},
                                         Case{governor(), 1200, 2, 0.012, 1e-9}),
                         [](const auto& one) { return std::string(one.param.mechanism.scene); });

// Beside a singular position rows are nearly redundant, at any step, and all steps are solved nevertheless.
TEST(FourBar, PassesItsSingularPositionsAtAnyStep) {
  const Scene scene = scene_named("four_bar");
  for (const int rate : {480, 960, 1920, 3840}) {
    Settings settings;
    settings.algorithm = Algorithm::a1;
    settings.step = 1.0 / rate;
    Simulation simulation(scene, settings);
    int least_squares = 0;
    for (int i = 0; i < 4 * rate; ++i) {
      const StepReport& report = simulation.step();
      EXPECT_NE(report.status, StepReport::Status::unsolved)
          << rate << " step " << i << ": " << report.residual;
      if (report.status == StepReport::Status::least_squares) ++least_squares;
    }
    EXPECT_LE(least_squares, 2);  // measured 0, 0, 1, 0: closer than the rank tolerance
  }
}

TEST(Governor, FileMatchesItsEquations) {
  const Scene scene = scene_named("governor");
  ASSERT_EQ(scene.expected.size(), 1U);
  EXPECT_NEAR(scene.expected[0].value, motion_of(governor(), 1200, 2).back()[1].y(), 1e-9);
}

}  // namespace
}  // namespace substep
