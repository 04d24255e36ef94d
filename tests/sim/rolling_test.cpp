// Balls that roll, against closed forms, in all five: a solid one and a hollow one, off the axes, of unusual
// sizes and masses, on a floor that is tilted.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "sim/simulation.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

constexpr double friction = 0.5;
constexpr double gravity = 9.81;

/// A ball of moment `share` · m r² on the floor; gravity is turned by `slope` about an axis off x and z.
struct Rolling {
  double radius;
  double mass;
  double share;  ///< 2/5 solid, 2/3 hollow
  double slope;
  double direction;  ///< of the way down, about y
};

Scene scene_of(const Rolling& x) {
  Scene scene = test::floor_scene(friction);
  const Vector3 down(std::cos(x.direction), 0, std::sin(x.direction));
  scene.gravity = gravity * (std::sin(x.slope) * down - std::cos(x.slope) * Vector3::UnitY());
  Body ball;
  ball.name = "ball";
  ball.inverse_mass = 1 / x.mass;
  ball.inverse_inertia = Vector3::Constant(1 / (x.share * x.mass * x.radius * x.radius));
  ball.pose = {{3, x.radius, -2}, Quaternion(0.5, 0.5, -0.5, 0.5)};
  scene.bodies.push_back(ball);
  Collider collider;
  collider.body = 1;
  collider.shape = Sphere{x.radius};
  collider.material.static_friction = collider.material.dynamic_friction = friction;
  scene.colliders.push_back(collider);
  return scene;
}

class Rolls : public testing::TestWithParam<Algorithm> {};

TEST_P(Rolls, DownASlopeAsTheClosedFormSays) {
  for (const Rolling& x : {Rolling{0.3, 2, 0.4, 0.2, 0.7}, Rolling{0.07, 0.5, 2.0 / 3, 0.3, 2.5}}) {
    const Scene scene = scene_of(x);
    Simulation simulation(scene, default_settings(GetParam()));
    const double acceleration = gravity * std::sin(x.slope) / (1 + x.share);
    const Vector3 down(std::cos(x.direction), 0, std::sin(x.direction));
    const double step = simulation.settings().step;
    // Of the speed. Measured: A1 1e-13, A2 4e-5, A3 7e-4 (the small ball, which turns by 0.8 rad in the last
    // steps), A4 and A5 6e-8.
    const double tolerance = GetParam() == Algorithm::a3 ? 1e-3 : 1e-4;
    for (int i = 1; i <= 120; ++i) {
      simulation.step();
      const State& state = simulation.state();
      const double speed = acceleration * i * step;
      EXPECT_NEAR(state.v[1].linear.dot(down), speed, tolerance * speed) << i;
      EXPECT_NEAR(state.v[1].angular.norm() * x.radius, speed, tolerance * speed) << i;
      EXPECT_LT((state.v[1].linear - state.v[1].linear.dot(down) * down).norm(), tolerance * speed) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Rolls,
                         testing::Values(Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4,
                                         Algorithm::a5),
                         [](const auto& algorithm) { return std::string(name(algorithm.param)); });

}  // namespace
}  // namespace substep
