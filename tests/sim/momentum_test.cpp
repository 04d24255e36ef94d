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

// ω_y changes sign at 2.097 s (Jacobi's elliptic functions). Later flips are a matter of the energy's last
// digits: the body passes so near its unstable axis that an energy error of 1e-4 moves the second flip by
// seconds.
TEST(FreeBody, FlipsAsClosedForm) {
  double last = 0;
  for (int k = 0; k < 3; ++k) {
    Settings settings;
    settings.algorithm = Algorithm::a1;
    settings.step = 1.0 / (1920 << k);
    Simulation simulation(free_body(), settings);
    const auto spin = [&] {
      return (simulation.state().q[1].angular.conjugate() * simulation.state().v[1].angular).y();
    };
    double before = spin();
    double now = before;
    while (now > 0 && simulation.steps() < 100000) {
      before = now;
      simulation.step();
      now = spin();
    }
    const double flip = settings.step * (static_cast<double>(simulation.steps()) - now / (now - before));
    const double error = std::abs(flip - 2.097);
    if (k == 2) {
      EXPECT_LT(error, 0.005);
      EXPECT_LT(error, 0.7 * last);
    }
    last = error;
  }
}

}  // namespace
}  // namespace substep
