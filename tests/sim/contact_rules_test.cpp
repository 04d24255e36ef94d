// Rules of contacts that no scene of the suite of goldens would notice the loss of, on one ball and a floor:
// which colliders meet, A2's over-relaxation and where it stops, from what speed on something bounces, and
// which friction an impact has.

#include <gtest/gtest.h>

#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

constexpr double radius = 0.2;
constexpr double gravity = 9.81;
constexpr double step = 1.0 / 60;

/// A ball of 1 kg that touches the floor.
Scene ball_on_floor() {
  Scene scene = test::floor_scene(0);
  scene.gravity = {0, -gravity, 0};
  test::add_ball(scene, radius, 1, {0, radius, 0}, 0);
  return scene;
}

Settings settings_of(Algorithm algorithm) {
  Settings settings = default_settings(algorithm);
  settings.step = step;
  return settings;
}

double speed_after_a_step(const Scene& scene, const Settings& settings) {
  return test::run(scene, settings, step).v[1].linear.y();
}

/// Speed gained in a step without a floor, m/s.
constexpr double fall = gravity * step;

class Filter : public testing::TestWithParam<Algorithm> {};

TEST_P(Filter, ForbidsWhenEitherSideDoes) {
  const auto speed = [](std::uint64_t floor_meets, std::uint64_t ball_meets) {
    Scene scene = ball_on_floor();
    scene.colliders[0].in_no_system = scene.colliders[1].in_no_system = false;
    scene.colliders[0].member = 1;
    scene.colliders[1].member = 2;
    scene.colliders[0].collides_with = floor_meets;
    scene.colliders[1].collides_with = ball_meets;
    return speed_after_a_step(scene, settings_of(GetParam()));
  };
  EXPECT_NEAR(speed(2, 1), 0, 0.01 * fall);
  EXPECT_NEAR(speed(2, 2), -fall, 1e-12);  // the ball does not meet the floor's system
  EXPECT_NEAR(speed(1, 1), -fall, 1e-12);  // nor the floor the ball's
  EXPECT_NEAR(speed(1, 2), -fall, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Contacts, Filter, testing::ValuesIn(test::all_algorithms),
                         [](const auto& of) { return std::string(name(of.param)); });

TEST(Relaxation, ReducesErrorByItsFraction) {
  for (const double omega : {0.5, 1.0, 1.3}) {
    Settings settings = settings_of(Algorithm::a2);
    settings.relaxation = omega;
    settings.tolerance = 0;
    for (const int iterations : {1, 2, 3}) {
      settings.iterations = iterations;
      const double left = std::pow(1 - omega, iterations);
      EXPECT_NEAR(speed_after_a_step(ball_on_floor(), settings), -fall * left, 1e-12)
          << omega << " " << iterations;
    }
  }
}

TEST(Relaxation, StopsBelowTolerance) {
  Settings settings = settings_of(Algorithm::a2);
  settings.relaxation = 0.5;
  settings.iterations = 100;
  // Iterations move 1/2, 1/4, 1/8 … of the fall.
  settings.tolerance = 0.3 * fall;
  EXPECT_NEAR(speed_after_a_step(ball_on_floor(), settings), -fall / 4, 1e-12);
  settings.tolerance = 0.1 * fall;
  EXPECT_NEAR(speed_after_a_step(ball_on_floor(), settings), -fall / 16, 1e-12);
}

TEST(BounceThreshold, IsTwiceGravityPerSubstep) {
  for (const Algorithm algorithm : test::all_algorithms) {
    const auto speed = [&](double approach) {
      Scene scene = ball_on_floor();
      for (Collider& collider : scene.colliders) collider.material.restitution = 0.9;
      scene.bodies[1].linear_velocity = {0, -approach, 0};
      return speed_after_a_step(scene, test::sub_stepped(algorithm, 1, 1, 1));
    };
    EXPECT_NEAR(speed(1.9 * fall), 0, 0.01 * fall) << name(algorithm);
    EXPECT_GT(speed(2.1 * fall), 0.5 * fall) << name(algorithm);
  }
}

TEST(FrictionOfAnImpact, IsStaticWhereNothingSlips) {
  // It falls along the floor's normal at six times what counts as at rest, and gravity draws it aside. Were
  // the speed of the fall taken for slip, dynamic friction, of which there is none here, would let it go.
  for (const Algorithm algorithm : test::all_algorithms) {
    const auto speed_aside = [&](double slip) {
      Scene scene = ball_on_floor();
      scene.gravity = {2, -gravity, 0};
      scene.bodies[1].inverse_inertia.setZero();
      scene.bodies[1].linear_velocity = {slip, -1, 0};
      for (Collider& collider : scene.colliders) collider.material.static_friction = 1;
      for (Collider& collider : scene.colliders) collider.material.dynamic_friction = 0;
      return test::run(scene, settings_of(algorithm), step).v[1].linear.x();
    };
    EXPECT_NEAR(speed_aside(0), 0, 0.05 * 2 * step) << name(algorithm);
    EXPECT_NEAR(speed_aside(1), 1 + 2 * step, 1e-9) << name(algorithm);
  }
}

}  // namespace
}  // namespace substep
