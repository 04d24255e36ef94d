// Balls that bounce on a plane, level or tilted with gravity tilted likewise, against e² of the height.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

constexpr double radius = 0.13;
constexpr double fall = 1.07;  // m, of the ball's lowest point
constexpr double gravity = 9.81;
const Quaternion tilts[] = {Quaternion::Identity(), rotation_quaternion({0.5, 0.3, -0.4})};

/// A ball of 0.7 kg above a plane that is tilted; gravity is along the plane's normal.
Scene bouncing_ball(double restitution, const Quaternion& tilt) {
  Scene scene = test::floor_scene(0.4);
  scene.colliders[0].placement.orientation = tilt;
  scene.colliders[0].material.restitution = restitution;
  scene.gravity = tilt * Vector3(0, -gravity, 0);
  Body ball;
  ball.name = "ball";
  const double mass = 0.7;
  ball.inverse_mass = 1 / mass;
  ball.inverse_inertia = Vector3::Constant(1 / (0.4 * mass * radius * radius));
  ball.pose.position = tilt * Vector3(0.3, fall + radius, -0.2);
  scene.bodies.push_back(ball);
  Collider collider;
  collider.body = 1;
  collider.shape = Sphere{radius};
  collider.material.restitution = restitution;
  scene.colliders.push_back(collider);
  return scene;
}

/// The heights of the ball's turning points, with the speed there taken for what the step cuts off: m above
/// where it rests.
std::vector<double> heights_of_bounces(const Scene& scene, const Settings& settings, double duration,
                                       const Quaternion& tilt) {
  Simulation simulation(scene, settings);
  const Vector3 up = tilt * Vector3(0, 1, 0);
  std::vector<double> heights;
  double before = 0;
  const auto steps = std::lround(duration / settings.step);
  for (long i = 0; i < steps; ++i) {
    simulation.step();
    const double speed = simulation.state().v[1].linear.dot(up);
    if (before > 0 && speed <= 0) {
      const double height = simulation.state().q[1].linear.dot(up) - radius;
      heights.push_back(height + 0.5 * speed * speed / gravity);
    }
    before = speed;
  }
  return heights;
}

Settings settings_of(Algorithm algorithm, int n, double tau, double kappa) {
  Settings settings;
  settings.algorithm = algorithm;
  settings.substeps = n;
  settings.tau = tau;
  settings.kappa = kappa;
  return settings;
}

TEST(Restitution, ComesBackToESquaredOfTheHeight) {
  for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a4, Algorithm::a5})
    for (const int n : {4, 7, 10, 30})
      for (const double kappa : {1.0, 0.9})
        for (const double tau : {0.3, 0.6, 1.0})
          for (const double e : {0.5, 0.8, 1.0})
            for (const Quaternion& tilt : tilts) {
              const auto heights = heights_of_bounces(bouncing_ball(e, tilt), settings_of(algorithm, n, tau, kappa), e == 1 ? 12 : 5, tilt);
              double expected = fall;
              double worst = 0;
              int bounces = 0;
              double at = 0;
              double last = fall;
              for (const double height : heights) {
                expected = e * e * last;
                if (expected < 0.005) break;
                ++bounces;
                const double error = height / expected - 1;
                if (std::abs(error) > std::abs(worst)) { worst = error; at = expected; }
                last = height;
              }
              printf("A%d n=%d k=%g t=%g e=%g tilt=%d: %d bounces worst %.4f at %.4f m; last %.5f\n", static_cast<int>(algorithm) + 1, n, kappa, tau, e, tilt.w() != 1, bounces, worst, at, last);
            }
}

}  // namespace
}  // namespace substep
