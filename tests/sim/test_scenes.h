#pragma once
// Scenes built in code, for tests that need exact numbers rather than a file.

#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "sim/geometry/convex_hull.h"
#include "sim/math/rotation.h"
#include "sim/measure/measured_run.h"
#include "sim/simulation.h"

namespace substep::test {

using std::numbers::pi;

/// Gravity of a new scene, m/s².
inline constexpr double gravity = 9.81;

inline constexpr std::array all_algorithms{Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4,
                                           Algorithm::a5};

/// Returns settings of A3, A4 or A5 with m = 1.
inline Settings sub_stepped(Algorithm algorithm, int n, double tau, double kappa,
                            Joints joints = Joints::stable) {
  Settings settings{.algorithm = algorithm, .substeps = n, .tau = tau, .kappa = kappa, .joints = joints};
  return settings;
}

inline Pose at(double x, double y, double z) {
  return {Vector3(x, y, z), Quaternion::Identity()};
}

inline Scene empty_scene() {
  Scene scene;
  scene.name = "test";
  scene.file = "test";
  scene.bodies.emplace_back();
  scene.bodies[0].name = "world";
  return scene;
}

inline Scene weightless_scene() {
  Scene scene = empty_scene();
  scene.gravity.setZero();
  return scene;
}

/// Adds a body of these principal moments, without colliders; returns its index.
inline int add_body(Scene& scene, double mass, const Vector3& moments, const Pose& pose = {}) {
  Body& body = scene.bodies.emplace_back();
  body.name = "body";
  body.inverse_mass = 1 / mass;
  body.inverse_inertia = moments.cwiseInverse();
  body.pose = pose;
  return static_cast<int>(scene.bodies.size()) - 1;
}

inline constexpr std::array all_axes{true, true, true};

inline JointLimit locked(bool angular, std::array<bool, 3> axes) {
  JointLimit limit;
  limit.angular = angular;
  limit.axes = axes;
  limit.min = limit.max = 0;
  return limit;
}

inline JointLimit range(bool angular, std::array<bool, 3> axes, double min, double max) {
  JointLimit limit = locked(angular, axes);
  limit.min = min;
  limit.max = max;
  return limit;
}

inline Joint ball_joint(int a, int b, const Vector3& anchor_a, const Vector3& anchor_b) {
  Joint joint;
  joint.name = "joint";
  joint.body_a = a;
  joint.body_b = b;
  joint.frame_a.position = anchor_a;
  joint.frame_b.position = anchor_b;
  joint.limits.push_back(locked(false, all_axes));
  return joint;
}

/// Returns a uniform thin rod along its x axis, with a small moment about that axis.
inline Body rod(double length, double mass) {
  const double across = mass * length * length / 12;
  Body body;
  body.name = "rod";
  body.inverse_mass = 1 / mass;
  body.inverse_inertia = {1 / (0.01 * across), 1 / across, 1 / across};
  return body;
}

/// Returns side × side balls of 1 kg and 0.2 m in a level square, 0.5 m apart, on ball joints midway between
/// neighbours; every fourth of one edge is hung from the world.
inline Scene net(int side) {
  Scene scene = empty_scene();
  constexpr double pitch = 0.5;
  for (int i = 0; i < side * side; ++i) {
    const Vector3 centre = pitch * Vector3(i % side, 0, i / side);
    const int body = add_body(scene, 1, Vector3::Constant(0.4 * 0.2 * 0.2), {centre, Quaternion::Identity()});
    const Vector3 along = pitch / 2 * Vector3::UnitX();
    const Vector3 across = pitch / 2 * Vector3::UnitZ();
    if (i % side > 0) scene.joints.push_back(ball_joint(body - 1, body, along, -along));
    if (i >= side) scene.joints.push_back(ball_joint(body - side, body, across, -across));
    if (i < side && i % 4 == 0) scene.joints.push_back(ball_joint(body, 0, Vector3::Zero(), centre));
  }
  return scene;
}

/// Returns rods of 0.5 m and 1 kg on ball joints, hung from the origin, at `angle` below the horizontal; a
/// ball of `end_mass` (radius 0.25 m) at the end, if any.
inline Scene chain(int rods, double angle = 0, double end_mass = 0) {
  Scene scene = empty_scene();
  const double length = 0.5;
  const auto [sine, cosine] = sine_cosine(angle);
  const Vector3 along(cosine, -sine, 0);
  for (int i = 0; i < rods; ++i) {
    Body body = rod(length, 1);
    body.pose.position = along * (length * (i + 0.5));
    body.pose.orientation = rotation_quaternion({0, 0, -angle});
    scene.bodies.push_back(body);
    scene.joints.push_back(ball_joint(i + 1, i, {-length / 2, 0, 0}, {i > 0 ? length / 2 : 0.0, 0, 0}));
  }
  if (end_mass > 0) {
    add_body(scene, end_mass, Vector3::Constant(0.4 * end_mass * 0.0625),
             {along * (length * rods + 0.25), rotation_quaternion({0, 0, -angle})});
    scene.joints.push_back(ball_joint(rods + 1, rods, {-0.25, 0, 0}, {length / 2, 0, 0}));
  }
  return scene;
}

inline Scene floor_scene(double friction) {
  Scene scene = empty_scene();
  Collider& floor = scene.colliders.emplace_back();
  floor.shape = Plane{};
  floor.material.dynamic_friction = floor.material.static_friction = friction;
  return scene;
}

/// Adds a uniform box of full extents `size`; returns its body.
inline int add_box(Scene& scene, const Vector3& size, double mass, const Pose& pose, double friction) {
  Body body;
  body.name = "box " + std::to_string(scene.bodies.size());
  body.inverse_mass = 1 / mass;
  const Vector3 squared = size.cwiseAbs2();
  body.inverse_inertia =
      (12 / mass) *
      Vector3(squared.y() + squared.z(), squared.x() + squared.z(), squared.x() + squared.y()).cwiseInverse();
  body.pose = pose;
  Collider collider;
  collider.body = static_cast<int>(scene.bodies.size());
  collider.shape = box(size);
  collider.material.dynamic_friction = collider.material.static_friction = friction;
  scene.bodies.push_back(body);
  scene.colliders.push_back(collider);
  return collider.body;
}

/// Returns unit cubes of `mass` stacked on a floor, the top one of `top_mass`.
inline Scene box_stack(int boxes, double friction = 0.6, double top_mass = 1, double mass = 1) {
  Scene scene = floor_scene(friction);
  for (int i = 0; i < boxes; ++i)
    add_box(scene, {1, 1, 1}, i == boxes - 1 ? top_mass : mass, at(0, 0.5 + i, 0), friction);
  return scene;
}

/// Returns unit cubes of 1 kg on a floor in rows, 10 cm apart, `base` in the lowest.
inline Scene box_pyramid(int base) {
  Scene scene = floor_scene(0.6);
  for (int row = 0; row < base; ++row) {
    for (int i = 0; i < base - row; ++i)
      add_box(scene, {1, 1, 1}, 1, at(1.1 * (i - 0.5 * (base - row - 1)), 0.5 + row, 0), 0.6);
  }
  return scene;
}

/// Adds a uniform solid ball; returns its body.
inline int add_ball(Scene& scene, double radius, double mass, const Vector3& position, double friction = 0.6,
                    double restitution = 0) {
  Body& ball = scene.bodies.emplace_back();
  ball.name = "ball " + std::to_string(scene.bodies.size() - 1);
  ball.inverse_mass = 1 / mass;
  ball.inverse_inertia = Vector3::Constant(1 / (0.4 * mass * radius * radius));
  ball.pose.position = position;
  Collider& collider = scene.colliders.emplace_back();
  collider.body = static_cast<int>(scene.bodies.size()) - 1;
  collider.shape = Sphere{radius};
  collider.material = {.static_friction = friction, .dynamic_friction = friction, .restitution = restitution};
  return collider.body;
}

inline constexpr double infinite_error = infinity;

/// Steps for `duration`. Returns `look(state, time)` of the last step; infinite where the run diverges.
template <class Look>
double last(const Scene& scene, const Settings& settings, double duration, Look look) {
  Simulation simulation(scene, settings);
  const auto steps = std::lround(duration / settings.step);
  double result = 0;
  for (long i = 1; i <= steps; ++i) {
    if (simulation.step().status == StepReport::Status::diverged) return infinite_error;
    result = look(simulation.state(), static_cast<double>(i) * settings.step);
  }
  return result;
}

/// Returns the largest `look(state, time)` of the steps; infinite where the run diverges.
template <class Look>
double largest(const Scene& scene, const Settings& settings, double duration, Look look) {
  double most = 0;
  return last(scene, settings, duration, [&](const State& state, double time) {
    most = std::max(most, look(state, time));
    return most;
  });
}

/// Returns the largest displacement of any body, or of one, at any time, m.
inline double largest_displacement(const Scene& scene, const Settings& settings, double duration,
                                   std::size_t only = 0) {
  return largest(scene, settings, duration, [&](const State& state, double) {
    double most = 0;
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
      if (only == 0 || i == only)
        most = std::max(most, (state.q[i].linear - scene.bodies[i].pose.position).norm());
    }
    return most;
  });
}

/// Returns the state after `duration` seconds.
inline State run(const Scene& scene, const Settings& settings, double duration) {
  return measured_run(scene, settings, duration).state;
}

}  // namespace substep::test
