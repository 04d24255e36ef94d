// Closed loops at default settings, drawn from a seed: Flores' N four-bar, a spatial four-bar with two hinges
// and two ball joints, and a flyball governor with stiff springs. Each prints a row of a table.

#include <gtest/gtest.h>

#include <optional>

#include "sim/loading/load_scene.h"
#include "sim/math/rotation.h"
#include "sim/measure/invariants.h"
#include "sim/measure/motion.h"
#include "sim/measure/stepper.h"
#include "tests/scene_files.h"
#include "tests/sim/minimal_coordinates.h"
#include "tests/sim/random_trials.h"

namespace substep {
namespace {

using test::Random;
using test::Trial;

using test::gravity;
constexpr double run_duration = 5;
constexpr int run_steps = 300;

/// A loop with the exact motion of its bodies at multiples of 1/60 s.
struct Loop {
  Scene scene;
  std::vector<std::vector<Vector3>> centres;  ///< of bodies 1, 2, …
  std::vector<double> energies;               ///< kinetic and potential, beyond the start's, J
  std::string parameters;
};

/// Returns a thin bar between two points, whose own z axis is `axis`, across it.
Body bar(const Vector3& from, const Vector3& to, const Vector3& axis, double mass) {
  const double length = (to - from).norm();
  Body body = test::rod(length, mass);
  Matrix3 axes;
  axes.col(0) = (to - from) / length;
  axes.col(1) = axis.cross(axes.col(0));
  axes.col(2) = axis;
  body.pose = {(from + to) / 2, Quaternion(axes)};
  return body;
}

/// Adds a hinge at a point about an axis, both in the world; without an axis a ball joint.
void join(Scene& scene, int a, int b, const Vector3& point, const std::optional<Vector3>& axis) {
  const auto frame = [&](int body) {
    const Pose& pose = scene.bodies[static_cast<std::size_t>(body)].pose;
    const Quaternion turn = shortest_rotation(Vector3::UnitZ(), axis.value_or(Vector3::UnitZ()));
    return Pose{pose.orientation.conjugate() * (point - pose.position), pose.orientation.conjugate() * turn};
  };
  Joint joint = test::ball_joint(a, b, Vector3::Zero(), Vector3::Zero());
  joint.frame_a = frame(a);
  joint.frame_b = frame(b);
  if (axis) joint.limits.push_back(test::locked(true, {true, true, false}));
  scene.joints.push_back(joint);
}

/// Flores' N four-bar: parallel cranks turn as one pendulum and pass their singular position.
Loop four_bar(Random& random) {
  const int cells = 1 + random.below(4);
  const double length = random.between(0.7, 2);
  const double angle = random.one_of({-1.0, 1.0}) * random.between(0.5, 1.4);  // from the upright
  const double turn = random.between(0, 2 * std::numbers::pi);
  const Vector3 along(std::cos(turn), 0, std::sin(turn));
  const Vector3 axis = along.cross(Vector3::UnitY());
  Loop loop;
  loop.scene = test::empty_scene();
  Scene& scene = loop.scene;
  scene.gravity = {0, -gravity, 0};
  const auto tip_at = [&](double theta) -> Vector3 {
    return length * (std::sin(theta) * along + std::cos(theta) * Vector3::UnitY());
  };
  double moment = 0;
  double weight = 0;
  const Vector3 tip = tip_at(angle);
  for (int i = 0; i <= cells; ++i) {
    const Vector3 foot = i * length * along;
    const double mass = random.spread(0.5, 2);
    scene.bodies.push_back(bar(foot, foot + tip, axis, mass));
    join(scene, i + 1, world_body, foot, axis);
    moment += mass * length * length / 3;
    weight += mass * length / 2;
  }
  for (int i = 0; i < cells; ++i) {
    const Vector3 foot = i * length * along + tip;
    const double mass = random.spread(0.5, 2);
    scene.bodies.push_back(bar(foot, foot + length * along, axis, mass));
    const int own = cells + 2 + i;
    join(scene, own, i + 1, foot, axis);
    join(scene, own, i + 2, foot + length * along, axis);
    moment += mass * length * length;
    weight += mass * length;
  }
  std::vector<double> y{angle, 0};
  for (int k = 0; k <= run_steps; ++k) {
    std::vector<Vector3> centres;
    const Vector3 now = tip_at(y[0]);
    for (int i = 0; i <= cells; ++i) centres.emplace_back(i * length * along + now / 2);
    for (int i = 0; i < cells; ++i) centres.emplace_back((i + 0.5) * length * along + now);
    loop.centres.push_back(centres);
    for (int i = 0; i < 64; ++i)
      test::runge_kutta(
          [&](const std::vector<double>& x) {
            return std::vector<double>{x[1], weight * gravity / moment * std::sin(x[0])};
          },
          1.0 / 60 / 64, y);
  }
  loop.energies.assign(run_steps + 1, 0);
  loop.parameters = fmt::format("cells={} length={:.3g} angle={:.3g}", cells, length, angle);
  return loop;
}

/// A spatial four-bar of a crank and a rocker on hinges with a coupler on ball joints between them. Its exact
/// motion is the reference integrator's.
Loop spatial_four_bar(Random& random) {
  for (;;) {
    const double scale = random.between(0.7, 2);
    const Vector3 crank_axis = (Vector3::UnitZ() + 0.3 * random.direction()).normalized();
    const Vector3 rocker_axis = (Vector3::UnitZ() + 0.9 * random.direction()).normalized();
    const Vector3 ground(2 * scale, 0, 0);
    const auto on_circle = [&](const Vector3& axis, double angle, double radius) -> Vector3 {
      const Vector3 first = axis.cross(Vector3::UnitX()).normalized();
      return radius * (std::cos(angle) * first + std::sin(angle) * axis.cross(first));
    };
    const double crank_angle = random.between(0, 2 * std::numbers::pi);
    const Vector3 crank_tip = on_circle(crank_axis, crank_angle, scale);
    const auto excess = [&](double angle) {
      return (ground + on_circle(rocker_axis, angle, 1.6 * scale) - crank_tip).norm() - 1.8 * scale;
    };
    double low = random.between(0, 2 * std::numbers::pi);
    double high = low + 0.5;
    if (excess(low) * excess(high) > 0) continue;
    for (int i = 0; i < 60; ++i) {
      const double middle = (low + high) / 2;
      (excess(low) * excess(middle) > 0 ? low : high) = middle;
    }
    const Vector3 rocker_tip = ground + on_circle(rocker_axis, low, 1.6 * scale);
    Loop loop;
    loop.scene = test::empty_scene();
    Scene& scene = loop.scene;
    scene.gravity = {0, -gravity, 0};
    scene.bodies.push_back(bar(Vector3::Zero(), crank_tip, crank_axis, random.spread(0.5, 2)));
    scene.bodies.push_back(bar(crank_tip, rocker_tip,
                               (rocker_tip - crank_tip).cross(Vector3::UnitX()).normalized(),
                               random.spread(0.5, 2)));
    scene.bodies.push_back(bar(ground, rocker_tip, rocker_axis, random.spread(0.5, 2)));
    join(scene, 1, world_body, Vector3::Zero(), crank_axis);
    join(scene, 1, 2, crank_tip, std::nullopt);
    join(scene, 3, 2, rocker_tip, std::nullopt);
    join(scene, 3, world_body, ground, rocker_axis);
    // The motion branches where both bars are nearly in line with the coupler.
    const auto lever_of = [](const State& state, const Vector3& axis, std::size_t body) {
      const Vector3 along = state.q[2].angular * Vector3::UnitX();
      return std::abs(along.dot(axis.cross(state.q[body].angular * Vector3::UnitX())));
    };
    const auto exact = reference_stepper(scene, 1.0 / 120, 12);
    bool is_smooth = true;
    for (int k = 0; k <= run_steps && is_smooth; ++k) {
      std::vector<Vector3> centres;
      for (int i = 1; i <= 3; ++i) centres.push_back(exact->state().q[static_cast<std::size_t>(i)].linear);
      loop.centres.push_back(centres);
      is_smooth =
          std::max(lever_of(exact->state(), crank_axis, 1), lever_of(exact->state(), rocker_axis, 3)) > 0.4;
      for (int i = 0; i < 2; ++i) is_smooth = is_smooth && exact->step();
    }
    if (!is_smooth) continue;
    loop.energies.assign(run_steps + 1, 0);
    loop.parameters = fmt::format("scale={:.3g} crank={:.3g} rocker={:.3g}", scale, crank_angle, low);
    return loop;
  }
}

/// The governor of scenes/governor.md with other rates, springs and balls. Half of the trials have points for
/// balls: an arm's moment about its own axis is then 5e-6 kg m².
Loop governor(Random& random) {
  test::GovernorEquations exact;
  exact.of_ball = random.flip() ? 0 : random.spread(0.005, 0.02);
  exact.speed = random.between(0.7, 1.1);
  exact.stiffness = random.spread(4e5, 1.6e6);
  exact.damping = random.spread(2e4, 8e4);
  Loop loop;
  loop.scene = scene_named("governor");
  for (Body& body : loop.scene.bodies) {
    body.linear_velocity *= exact.speed;
    body.angular_velocity *= exact.speed;
    if (body.name != "left_arm" && body.name != "right_arm") continue;
    const double across = exact.arm() - (exact.bar + exact.ball) * exact.centre * exact.centre;
    for (double& inverse : body.inverse_inertia) inverse = inverse > 10 ? 1 / exact.long_way() : 1 / across;
  }
  for (Joint& joint : loop.scene.joints) {
    for (JointLimit& limit : joint.limits) {
      if (!limit.stiffness) continue;
      limit.stiffness = exact.stiffness;
      limit.damping = exact.damping;
    }
  }
  std::vector<double> y = exact.start();
  const double start = exact.energy(y);
  for (int k = 0; k <= run_steps; ++k) {
    loop.centres.push_back(exact.centres(y));
    loop.energies.push_back(exact.energy(y) - start);
    for (int i = 0; i < 1500; ++i)
      test::runge_kutta([&](const auto& x) { return exact.rate(x); }, 1.0 / 60 / 1500, y);
  }
  loop.parameters = fmt::format("rate={:.3g} ball's moment={:.3g} stiffness={:.3g} damping={:.3g}",
                                exact.speed, exact.of_ball, exact.stiffness, exact.damping);
  return loop;
}

/// Returns the trial of a loop. Its error is the largest of: energy error / 0.05 energy_scale() (in A5
/// `energy_of_a5`), joint gap / 0.1 size and, in A3, distance of a centre from the exact motion / 0.05 size.
Trial trial_of(const Loop& loop, double energy_of_a5) {
  return {loop.parameters, [=](Algorithm algorithm) {
            const double size = size_of(loop.scene);
            const JointGapMeter joints(loop.scene);
            const double start = energy(loop.scene, initial_state(loop.scene));
            const double energy_limit = algorithm == Algorithm::a5 ? energy_of_a5 : 0.05;
            const auto error = [&](const State& state, double time) {
              const auto k = static_cast<std::size_t>(std::lround(60 * time));
              const double change = energy(loop.scene, state) - start - loop.energies[k];
              double worst = std::max(std::abs(change) / energy_scale(loop.scene) / energy_limit,
                                      joints.gap(state) / size / 0.1);
              if (algorithm != Algorithm::a3) return worst;
              for (std::size_t i = 0; i < loop.centres[k].size(); ++i) {
                const double off = (state.q[i + 1].linear - loop.centres[k][i]).norm();
                worst = std::max(worst, off / size / 0.05);
              }
              return worst;
            };
            return test::largest(loop.scene, test::default_settings_of(loop.scene, algorithm), run_duration,
                                 error);
          }};
}

void check_loops(const char* name, Loop (*draw)(Random& random), double energy_of_a5) {
  test::run({.name = name, .limit = 1, .draw = [=](Random& random) {
               return trial_of(draw(random), energy_of_a5);
             }});
}

TEST(FourBar, HoldsAtSixtyHertz) {
  check_loops("N four-bar", four_bar, 0.05);
}

TEST(SpatialFourBar, HoldsAtSixtyHertz) {
  check_loops("spatial four-bar", spatial_four_bar, 0.15);  // A5 exceeds 0.05, and more with n
}

TEST(Governor, HoldsAtSixtyHertz) {
  check_loops("governor", governor, 0.05);
}

}  // namespace
}  // namespace substep
