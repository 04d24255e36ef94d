// Blocks that slide, stop and stay in A2 to A5, against closed forms.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

constexpr double gravity = 9.81;
constexpr double pi = std::numbers::pi;

/// A block of 2 kg on a slope, sent up along it.
struct Slope {
  Scene scene;
  Vector3 up;
};

Slope slope_of(double friction, double heading, double speed) {
  const Quaternion turned = compose(rotation_quaternion({0, heading, 0}), rotation_quaternion({0, 0, pi / 9}));
  Slope slope{test::floor_scene(friction), turned * Vector3(1, 0, 0)};
  slope.scene.colliders[0].placement.orientation = turned;
  test::add_box(slope.scene, {0.5, 0.2, 0.3}, 2, {turned * Vector3(0, 0.1, 0), turned}, friction);
  slope.scene.bodies[1].linear_velocity = speed * slope.up;
  return slope;
}

/// The block's place along the slope, and the way that it has gone up and down.
struct Place {
  double place;
  double way;
};

Place closed_form(double friction, double speed, double time) {
  const double weight = gravity * std::sin(pi / 9);
  const double grip = friction * gravity * std::cos(pi / 9);
  const double stop = speed / (weight + grip);
  if (time < stop) {
    const double x = speed * time - 0.5 * (weight + grip) * time * time;
    return {x, x};
  }
  const double top = 0.5 * speed * stop;
  const double back = grip < weight ? 0.5 * (weight - grip) * (time - stop) * (time - stop) : 0;
  return {top - back, top + back};
}

TEST(Friction, ABlockSentUpASlopeMovesAsTheClosedFormSays) {
  for (const double rate : {60.0, 240.0})
    for (const int n : {10, 30})
      for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a4, Algorithm::a5})
        for (const double friction : {0.2, 0.6})
          for (const double heading : {0.0, 0.7}) {
            Settings settings = default_settings(algorithm);
            settings.step = 1 / rate;
            settings.substeps = n;
            const Slope slope = slope_of(friction, heading, 3);
            Simulation simulation(slope.scene, settings);
            const Vector3 start = simulation.state().q[1].linear;
            double worst = 0, worst_at = 0, off = 0, aside = 0, end = 0, wide=0, after=0;
            for (int i = 1; i <= 2 * rate; ++i) {
              simulation.step();
              const Vector3 moved = simulation.state().q[1].linear - start;
              const Place place = closed_form(friction, 3, i / rate);
              const double error = moved.dot(slope.up) - place.place;
              if (std::abs(error) / place.way > worst) { worst = std::abs(error) / place.way; worst_at = i / rate; off = error; }
              if (i/rate > 0.2) wide = std::max(wide, std::abs(error)/place.way);
              if (i/rate > 0.7) after = std::max(after, std::abs(error)/place.way);
              aside = std::max(aside, (moved - moved.dot(slope.up) * slope.up).norm());
              end = error;
            }
            printf("rate %g n=%d A%d mu=%g head %g: worst %.5f at %.4f s (%.3g m), from .2s %.5f, .7s %.5f, aside %.2g, end %.3g m\n", rate, n, static_cast<int>(algorithm) + 1, friction, heading, worst, worst_at, off, wide, after, aside, end);
          }
}

Quaternion turn(double degrees) {
  return rotation_quaternion({0, degrees * pi / 180, 0});
}

/// A flat block on a plane, turned by `block` about the plane's normal, pushed along the plane by `push`
/// times the largest friction in the direction `heading`. The push is a part of gravity, so it acts at the
/// centre of mass. All of it stands on a plane at `slope`.
constexpr double tray_friction = 0.45;
Scene pushed_block(double push, double heading, double block, const Quaternion& slope) {
  Scene scene = test::floor_scene(tray_friction);
  scene.colliders[0].placement.orientation = slope;
  const auto [sine, cosine] = sine_cosine(heading * pi / 180);
  const double along = push * tray_friction * gravity;
  scene.gravity = slope * Vector3(along * cosine, -gravity, along * sine);
  test::add_box(scene, {0.8, 0.1, 0.5}, 35, {slope * Vector3(0, 0.05, 0), slope * turn(block)}, tray_friction);
  return scene;
}

Vector3 heading_of(double heading, const Quaternion& slope) {
  const auto [sine, cosine] = sine_cosine(heading * pi / 180);
  return slope * Vector3(cosine, 0, sine);
}

constexpr double blocks[] = {0, 22, 45, 70};
const Quaternion slopes[] = {Quaternion::Identity(), rotation_quaternion({0.2, 0.1, -0.35})};

TEST(Friction, ATray) {
  for (const int n : {10, 4, 16})
  for (const Algorithm algorithm : {Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    Settings settings = default_settings(algorithm);
    settings.substeps = n;
    if (algorithm == Algorithm::a2) settings.iterations = n;
    double worst = 0, aside_worst = 0, stay = 0, sum = 0; int count = 0;
    for (const Quaternion& slope : slopes)
      for (const double block : blocks)
        for (int k = 0; k < 16; ++k) {
          const double time = 2;
          const Scene scene = pushed_block(1.06, 22.5 * k, block, slope);
          const State state = test::run(scene, settings, time);
          const Vector3 moved = state.q[1].linear - scene.bodies[1].pose.position;
          const Vector3 heading = heading_of(22.5 * k, slope);
          const double expected = 0.5 * 0.06 * tray_friction * gravity * time * time;
          const double error = moved.dot(heading) / expected - 1;
          if (std::abs(error) > std::abs(worst)) worst = error;
          sum += error; ++count;
          aside_worst = std::max(aside_worst, (moved - moved.dot(heading) * heading).norm() / expected);
          const Scene other = pushed_block(0.96, 22.5 * k, block, slope);
          stay = std::max(stay, (test::run(other, settings, 2).q[1].linear - other.bodies[1].pose.position).norm());
        }
    printf("n=%d A%d worst %.5f mean %.5f aside %.5f stays %.3g m\n", n, static_cast<int>(algorithm) + 1, worst, sum / count, aside_worst, stay);
  }
}

}  // namespace
}  // namespace substep
