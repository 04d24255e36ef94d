// Rotations; free rotation at default settings, drawn from a seed: energy, angular momentum and, of symmetric
// tops, the exact motion over 10 s, each with a row of a table; and the flip of a body at plainest settings.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/math/rotation.h"
#include "tests/sim/random_trials.h"

namespace substep {
namespace {

TEST(SineCosine, EqualsLibraryToTheLastDigit) {
  double largest = 0;
  for (int i = -20000; i <= 20000; ++i) {
    const double angle = i * 0.00731 + i * i * 1e-7;
    const auto [sine, cosine] = sine_cosine(angle);
    largest = std::max({largest, std::abs(sine - std::sin(angle)), std::abs(cosine - std::cos(angle))});
  }
  EXPECT_LT(largest, 2.3e-16);  // measured 1.1e-16: one unit in the last place of [0.5, 1)
}

TEST(SineCosine, ReducesLargeArguments) {
  for (const double angle : {1e3, 12345.678, 99999.9, -1e5}) {
    const auto [sine, cosine] = sine_cosine(angle);
    EXPECT_NEAR(sine, std::sin(angle), 2.3e-16) << angle;
    EXPECT_NEAR(cosine, std::cos(angle), 2.3e-16) << angle;
  }
  EXPECT_TRUE(std::isnan(sine_cosine(INFINITY).sine));
}

TEST(RotationQuaternion, IsExponentialOfHalfVector) {
  for (const double angle : {0.0, 1e-9, 0.1, 0.9999, 1.0001, 3.0, 7.0, 200.0}) {
    const Vector3 axis = Vector3(1, -2, 3).normalized();
    const Quaternion q = rotation_quaternion(angle * axis);
    EXPECT_NEAR(q.norm(), 1, 4e-16) << angle;
    const Quaternion expected(Eigen::AngleAxisd(angle, axis));
    EXPECT_LT((q.coeffs() - expected.coeffs()).norm(), angle > 100 ? 1e-14 : 5e-16) << angle;
  }
}

TEST(RotationVector, UndoesTheQuaternion) {
  for (const double angle : {1e-12, 1e-3, 0.5, 1.5, 3.0, 3.14159}) {
    const Vector3 vector = angle * Vector3(-2, 0.5, 1).normalized();
    EXPECT_LT((rotation_vector(rotation_quaternion(vector)) - vector).norm(), 1e-15 + 4e-16 * angle) << angle;
  }
  EXPECT_EQ(rotation_vector(Quaternion::Identity()), Vector3::Zero());
}

TEST(MeanOfFreeRotation, OneStepEqualsManySteps) {
  const Vector3 inertia(0.043333, 0.033333, 0.016667);
  const Vector3 velocity(5, 50, -30);
  for (const double duration : {1.0 / 240, 1.0 / 60, 1.0 / 10}) {
    const Quaternion at_once =
        rotation_quaternion(duration * mean_of_free_rotation(velocity, inertia, duration));
    Quaternion in_many = Quaternion::Identity();
    Vector3 now = velocity;
    constexpr int many = 1000;
    for (int i = 0; i < many; ++i) {
      const Vector3 turn = duration / many * mean_of_free_rotation(now, inertia, duration / many);
      in_many = compose(in_many, rotation_quaternion(turn));
      now = velocity_after_turn(inertia.cwiseProduct(now), inertia, turn);
    }
    const double energy = inertia.cwiseProduct(velocity).dot(velocity);
    EXPECT_NEAR(inertia.cwiseProduct(now).dot(now) / energy, 1, 1e-12) << duration;  // measured 4e-14
    EXPECT_LT((at_once.conjugate() * in_many).vec().norm(), 1e-11) << duration;      // measured 3e-13
  }
}

TEST(MeanOfFreeRotation, KeepsVelocityAboutAxis) {
  // A velocity across the axis by rounding alone must not end the series.
  const Vector3 velocity(6e-15, -5, 5e-15);
  EXPECT_LT((mean_of_free_rotation(velocity, {0.3, 0.4, 0.5}, 1.0 / 60) - velocity).norm(),
            1e-14);  // measured 9e-16
}

TEST(MeanOfFreeRotation, CountsWholeTurns) {
  // The body turns about its axis with a wobble, by 16.7 rad in a step.
  const Vector3 velocity(1, 0.5, 1000);
  const Vector3 mean = mean_of_free_rotation(velocity, {0.3, 0.4, 0.5}, 1.0 / 60);
  EXPECT_NEAR(mean.norm(), 1000, 1);
}

using test::Random;
using test::Trial;

/// Returns principal moments of a solid, kg m²: two in [0.1, 1] of a scale, the third from 0.1 to their sum.
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
  const double mass = random.spread(1e-2, 1e2);
  test::add_body(made.scene, mass, inertia, {Vector3::Zero(), random.orientation()});
  Body& body = made.scene.bodies[1];
  body.angular_velocity = random.spread(0.1, 100) * random.direction();
  const Vector3 local = body.pose.orientation.conjugate() * body.angular_velocity;
  made.momentum = body.pose.orientation * inertia.cwiseProduct(local);
  made.energy = inertia.cwiseProduct(local).dot(local) / 2;
  return made;
}

/// Returns the trial of a drawn body, whose error is the largest `error(q, v, time)` in 10 s.
template <class Error>
Trial trial_of(const FreeBody& drawn, const Error& error) {
  const Vector3& spin = drawn.scene.bodies[1].angular_velocity;
  return test::largest_of(
      fmt::format("spin {} {} {}", spin.x(), spin.y(), spin.z()), drawn.scene, 10,
      [=](const State& state, double time) { return error(state.q[1].angular, state.v[1].angular, time); });
}

Trial energy_error(Random& random) {
  const FreeBody drawn = free_body(random, moments(random));
  return trial_of(drawn, [=](const Quaternion& q, const Vector3& spin, double) {
    const Vector3 local = q.conjugate() * spin;
    return std::abs(drawn.inertia.cwiseProduct(local).dot(local) / 2 / drawn.energy - 1);
  });
}

Trial momentum_error(Random& random) {
  const FreeBody drawn = free_body(random, moments(random));
  return trial_of(drawn, [=](const Quaternion& q, const Vector3& spin, double) {
    return (q * drawn.inertia.cwiseProduct(q.conjugate() * spin) - drawn.momentum).norm() /
           drawn.momentum.norm();
  });
}

/// Returns the trial of a top, which turns about its axis at (1 − I₃/I₁) ω₃ and about its momentum at L/I₁.
Trial motion_of_top(Random& random) {
  const double across = random.spread(1e-3, 1e3);
  Vector3 inertia = Vector3::Constant(across);
  const int axis = random.below(3);
  inertia[axis] *= random.between(0.1, 2);
  const FreeBody drawn = free_body(random, inertia);
  const Body& body = drawn.scene.bodies[1];
  const Vector3 local = body.pose.orientation.conjugate() * body.angular_velocity;
  const double own = (1 - inertia[axis] / across) * local[axis];
  return trial_of(
      drawn, [=, orientation = body.pose.orientation](const Quaternion& q, const Vector3&, double time) {
        const Quaternion exact = rotation_quaternion(time / across * drawn.momentum) * orientation *
                                 rotation_quaternion(own * time * Vector3::Unit(axis));
        return 2 * (q.conjugate() * exact).vec().norm();
      });
}

const std::vector<Algorithm> exact_in_rotation{Algorithm::a1, Algorithm::a2, Algorithm::a3};

TEST(FreeRotation, KeepsEnergy) {
  // Measured 8e-13: the rounding of 600 steps or 6000 sub-steps.
  test::run({.name = "free rotation: energy", .limit = 1e-9, .draw = energy_error});
}

TEST(FreeRotation, KeepsMomentum) {
  // A4 and A5 sum the rotation vectors of their sub-steps, which do not commute. The others: measured 5e-13.
  test::run({.name = "free rotation: momentum",
             .limit = 1e-9,
             .draw = momentum_error,
             .algorithms = exact_in_rotation});
}

TEST(FreeRotation, KeepsTopsExact) {
  // Measured 7e-11 rad after up to 1000 rad.
  test::run({.name = "free top: angle, rad",
             .limit = 1e-7,
             .draw = motion_of_top,
             .algorithms = exact_in_rotation});
}

// ω_y changes sign at 2.097 and 7.207 s (Jacobi's elliptic functions). The body, of half-sizes 0.1, 0.2 and
// 0.3 m, passes so near its unstable axis that an energy error of 1e-4 would move the second flip by seconds.
TEST(FreeRotation, FlipsAsClosedForm) {
  Scene scene = test::weightless_scene();
  test::add_body(scene, 1, Vector3(0.13, 0.10, 0.05) / 3);
  scene.bodies[1].angular_velocity = {0.05, 5, 0.05};
  for (const Algorithm algorithm : test::all_algorithms) {
    Settings settings{.algorithm = algorithm, .step = 1.0 / 60};
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
