// Free rotation at default settings and 1/60 s, drawn from a seed: energy, angular momentum and, of symmetric
// tops, the exact motion, over 10 s. Each prints a row of a table.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/sim/random_trials.h"

namespace substep {
namespace {

using test::Random;
using test::Trial;

constexpr int steps = 600;

/// Returns principal moments that a solid can have, each in [0.1, 1] of a scale, kg m².
Vector3 moments(Random& random) {
  const double scale = random.spread(1e-3, 1e3);
  const double first = random.between(0.1, 1);
  const double second = random.between(0.1, 1);
  const double third = random.between(std::max(0.1, std::abs(first - second)), first + second);
  return scale * Vector3(first, second, third);
}

struct FreeBody {
  Scene scene;
  Vector3 inertia;   ///< principal moments, kg m²
  Vector3 momentum;  ///< world frame, kg m²/s
  double energy;     ///< J, of the rotation
};

FreeBody free_body(Random& random, const Vector3& inertia) {
  FreeBody made{test::empty_scene(), inertia, {}, {}};
  made.scene.gravity = 9.81 * random.direction();
  Body body;
  body.name = "body";
  body.inverse_mass = 1 / random.spread(1e-2, 1e2);
  body.inverse_inertia = inertia.cwiseInverse();
  body.pose = {Vector3::Zero(), random.orientation()};
  body.angular_velocity = random.spread(0.1, 100) * random.direction();
  const Vector3 local = body.pose.orientation.conjugate() * body.angular_velocity;
  made.momentum = body.pose.orientation * inertia.cwiseProduct(local);
  made.energy = inertia.cwiseProduct(local).dot(local) / 2;
  made.scene.bodies.push_back(body);
  return made;
}

/// Returns the largest of `error` at the ends of 600 steps.
template <class Error>
double largest(const Scene& scene, Algorithm algorithm, const Error& error) {
  Settings settings = test::default_settings_of(scene, algorithm);
  settings.step = 1.0 / 60;
  Simulation simulation(scene, settings);
  double worst = 0;
  for (int step = 1; step <= steps; ++step) {
    simulation.step();
    worst = std::max(worst, error(simulation.state().q[1], simulation.state().v[1], step * settings.step));
  }
  return worst;
}

std::string named(const Scene& scene) {
  const Vector3& spin = scene.bodies[1].angular_velocity;
  return fmt::format("spin {} {} {}", spin.x(), spin.y(), spin.z());
}

/// Returns the trial of a body of any moments, whose error is that of its orientation and local angular
/// velocity.
Trial trial_of(Random& random, double (*error)(const FreeBody&, const Quaternion&, const Vector3&)) {
  const Vector3 inertia = moments(random);
  const FreeBody drawn = free_body(random, inertia);
  return {named(drawn.scene), [=](Algorithm algorithm) {
            return largest(drawn.scene, algorithm,
                           [&](const Coordinates& q, const Velocity& v, double /*time*/) {
                             return error(drawn, q.angular, q.angular.conjugate() * v.angular);
                           });
          }};
}

double energy_error(const FreeBody& drawn, const Quaternion& /*orientation*/, const Vector3& local) {
  return std::abs(drawn.inertia.cwiseProduct(local).dot(local) / 2 / drawn.energy - 1);
}

double momentum_error(const FreeBody& drawn, const Quaternion& orientation, const Vector3& local) {
  return (orientation * drawn.inertia.cwiseProduct(local) - drawn.momentum).norm() / drawn.momentum.norm();
}

/// A top turns about its axis at (1 − I₃/I₁) ω₃, and with that about its momentum at L/I₁.
Trial motion_of_top(Random& random) {
  const double across = random.spread(1e-3, 1e3);
  Vector3 inertia = Vector3::Constant(across);
  const int axis = random.below(3);
  inertia[axis] *= random.between(0.1, 2);
  const FreeBody drawn = free_body(random, inertia);
  const Body body = drawn.scene.bodies[1];
  const Vector3 local = body.pose.orientation.conjugate() * body.angular_velocity;
  const double own = (1 - inertia[axis] / across) * local[axis];
  return {named(drawn.scene), [=](Algorithm algorithm) {
            return largest(drawn.scene, algorithm,
                           [&](const Coordinates& q, const Velocity& /*v*/, double time) {
                             const Quaternion exact = rotation_quaternion(time / across * drawn.momentum) *
                                                      body.pose.orientation *
                                                      rotation_quaternion(own * time * Vector3::Unit(axis));
                             return 2 * (q.angular.conjugate() * exact).vec().norm();
                           });
          }};
}

using enum Algorithm;

TEST(FreeRotation, KeepsEnergy) {
  // Measured 8e-13: the rounding of 600 steps or 6000 sub-steps.
  test::run({.name = "free rotation: energy", .limit = 1e-9, .draw = [](Random& random) {
               return trial_of(random, energy_error);
             }});
}

TEST(FreeRotation, KeepsMomentum) {
  // A4 and A5 sum the rotation vectors of their sub-steps, which do not commute. The others: measured 5e-13.
  test::run({.name = "free rotation: momentum",
             .limit = 1e-9,
             .draw = [](Random& random) { return trial_of(random, momentum_error); },
             .algorithms = {a1, a2, a3}});
}

TEST(FreeRotation, KeepsTopsExact) {
  // Measured 7e-11 rad after up to 1000 rad.
  test::run(
      {.name = "free top: angle, rad", .limit = 1e-7, .draw = motion_of_top, .algorithms = {a1, a2, a3}});
}

// ω_y changes sign at 2.097 and 7.207 s (Jacobi's elliptic functions). The body, of half-sizes 0.1, 0.2 and
// 0.3 m, passes so near its unstable axis that an energy error of 1e-4 would move the second flip by seconds.
TEST(FreeRotation, FlipsAsClosedForm) {
  Scene scene = test::empty_scene();
  scene.gravity.setZero();
  Body body;
  body.name = "body";
  body.inverse_mass = 1;
  body.inverse_inertia = {3 / 0.13, 3 / 0.10, 3 / 0.05};
  body.angular_velocity = {0.05, 5, 0.05};
  scene.bodies.push_back(body);
  for (const Algorithm algorithm : test::all_algorithms) {
    Settings settings;
    settings.algorithm = algorithm;
    settings.step = 1.0 / 60;
    Simulation simulation(scene, settings);
    std::vector<double> flips;
    double before = 5;
    for (int i = 0; i < 600; ++i) {
      simulation.step();
      const double now = (simulation.state().q[1].angular.conjugate() * simulation.state().v[1].angular).y();
      if (now * before < 0) flips.push_back(settings.step * (i + 1 - now / (now - before)));
      before = now;
    }
    ASSERT_EQ(flips.size(), 2U) << name(algorithm);
    EXPECT_NEAR(flips[0], 2.097, 1e-3) << name(algorithm);
    EXPECT_NEAR(flips[1], 7.207, 1e-3) << name(algorithm);
  }
}

}  // namespace
}  // namespace substep
