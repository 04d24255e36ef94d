#include <gtest/gtest.h>

#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

/// The body of the intermediate-axis flip: half-sizes 0.1, 0.2, 0.3 m, 1 kg.
Scene free_body() {
  Scene scene = test::empty_scene();
  scene.gravity.setZero();
  Body body;
  body.name = "body";
  body.inverse_mass = 1;
  body.inverse_inertia = {3 / 0.13, 3 / 0.10, 3 / 0.05};
  body.angular_velocity = {0.05, 5, 0.05};
  scene.bodies.push_back(body);
  return scene;
}

Vector3 angular_momentum(const State& state, const Vector3& inverse_inertia) {
  const Quaternion& q = state.q[1].angular;
  return q * (q.conjugate() * state.v[1].angular).cwiseQuotient(inverse_inertia);
}

TEST(FreeBody, KeepsItsAngularMomentum) {
  const Scene scene = free_body();
  const Vector3& inverse_inertia = scene.bodies[1].inverse_inertia;
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a2, Algorithm::a3}) {
    Settings settings;
    settings.algorithm = algorithm;
    Simulation simulation(scene, settings);
    const Vector3 before = angular_momentum(simulation.state(), inverse_inertia);
    for (int i = 0; i < 10000; ++i) simulation.step();
    const Vector3 after = angular_momentum(simulation.state(), inverse_inertia);
    EXPECT_LT((after - before).norm() / before.norm(), 1e-9) << name(algorithm);  // measured at most 5e-13
  }
}

// ω_y changes sign at 2.097 and 7.207 s (Jacobi's elliptic functions). The body passes so near its unstable
// axis that an energy error of 1e-4 would move the second flip by seconds.
TEST(FreeBody, FlipsAsClosedForm) {
  for (const Algorithm algorithm : test::all_algorithms) {
    Settings settings;
    settings.algorithm = algorithm;
    settings.step = 1.0 / 60;
    Simulation simulation(free_body(), settings);
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
