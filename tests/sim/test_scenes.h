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
inline constexpr std::array iterative_algorithms{Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5};

/// Returns settings of A3, A4 or A5 with m = 1.
inline Settings sub_stepped(Algorithm algorithm, int n, double tau, double kappa,
                            Joints joints = Joints::stable) {
  Settings settings{.algorithm = algorithm, .substeps = n, .tau = tau, .kappa = kappa, .joints = joints};
  return settings;
}

/// Returns default settings with n sub-steps.
inline Settings with_substeps(Algorithm algorithm, int n) {
  Settings settings = default_settings(algorithm);
  settings.substeps = n;
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

inline JointLimit range(bool angular, std::array<bool, 3> axes, double min, double max) {
  return {.angular = angular, .axes = axes, .min = min, .max = max, .stiffness = {}};
}

inline JointLimit locked(bool angular, std::array<bool, 3> axes) {
  return range(angular, axes, 0, 0);
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

/// Returns the principal moments of a uniform box.
inline Vector3 box_moments(double mass, const Vector3& size) {
  const Vector3 s = size.cwiseAbs2();
  return mass / 12 * Vector3(s.y() + s.z(), s.x() + s.z(), s.x() + s.y());
}

inline Vector3 ball_moments(double mass, double radius) {
  return Vector3::Constant(0.4 * mass * radius * radius);
}

/// Returns side × side balls of 1 kg and 0.2 m in a level square, 0.5 m apart, on ball joints midway between
/// neighbours; every fourth of one edge is hung from the world.
inline Scene net(int side) {
  Scene scene = empty_scene();
  constexpr double pitch = 0.5;
  for (int i = 0; i < side * side; ++i) {
    const Vector3 centre = pitch * Vector3(i % side, 0, i / side);
    const int body = add_body(scene, 1, ball_moments(1, 0.2), {centre, Quaternion::Identity()});
    const Vector3 along = pitch / 2 * Vector3::UnitX();
    const Vector3 across = pitch / 2 * Vector3::UnitZ();
    if (i % side > 0) scene.joints.push_back(ball_joint(body - 1, body, along, -along));
    if (i >= side) scene.joints.push_back(ball_joint(body - side, body, across, -across));
    if (i < side && i % 4 == 0) scene.joints.push_back(ball_joint(body, 0, Vector3::Zero(), centre));
  }
  return scene;
}

/// Adds `links` rods of 1 kg on ball joints, in a line from the world's point `from` to `to`. Returns the
/// last.
inline int add_chain(Scene& scene, int links, const Vector3& from, const Vector3& to) {
  const Vector3 link = (to - from) / links;
  const Vector3 half(link.norm() / 2, 0, 0);
  int last = world_body;
  for (int i = 0; i < links; ++i) {
    Body& body = scene.bodies.emplace_back(rod(link.norm(), 1));
    body.pose = {from + (i + 0.5) * link, shortest_rotation(Vector3::UnitX(), link)};
    const int own = static_cast<int>(scene.bodies.size()) - 1;
    scene.joints.push_back(ball_joint(own, last, -half, i == 0 ? from : half));
    last = own;
  }
  return last;
}

/// Returns rods of 0.5 m and 1 kg on ball joints, hung from the origin, at `angle` below the horizontal; a
/// ball of `end_mass` (radius 0.25 m) at the end, if any.
inline Scene chain(int rods, double angle = 0, double end_mass = 0) {
  Scene scene = empty_scene();
  const auto [sine, cosine] = sine_cosine(angle);
  const Vector3 along(cosine, -sine, 0);
  const int last = add_chain(scene, rods, Vector3::Zero(), 0.5 * rods * along);
  if (end_mass > 0) {
    const int ball = add_body(scene, end_mass, ball_moments(end_mass, 0.25),
                              {along * (0.5 * rods + 0.25), scene.bodies[1].pose.orientation});
    scene.joints.push_back(ball_joint(ball, last, {-0.25, 0, 0}, {0.25, 0, 0}));
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

/// Gives the last body a shape about its centre and a name with its index. Returns the body.
inline int add_collider(Scene& scene, const std::string& name, const Shape& shape, double friction,
                        double restitution) {
  const int body = static_cast<int>(scene.bodies.size()) - 1;
  scene.bodies.back().name = name + " " + std::to_string(body);
  Collider& collider = scene.colliders.emplace_back();
  collider.body = body;
  collider.shape = shape;
  collider.material = {.static_friction = friction, .dynamic_friction = friction, .restitution = restitution};
  return body;
}

/// Adds a uniform box of full extents `size`; returns its body.
inline int add_box(Scene& scene, const Vector3& size, double mass, const Pose& pose, double friction) {
  add_body(scene, mass, box_moments(mass, size), pose);
  return add_collider(scene, "box", box(size), friction, 0);
}

/// Adds a uniform solid ball; returns its body.
inline int add_ball(Scene& scene, double radius, double mass, const Vector3& position, double friction = 0.6,
                    double restitution = 0) {
  add_body(scene, mass, ball_moments(mass, radius), {position, Quaternion::Identity()});
  return add_collider(scene, "ball", Sphere{radius}, friction, restitution);
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

/// Steps for `duration`. Returns `look(state, time)` of the last step; infinite where the run diverges.
template <class Look>
double last(const Scene& scene, const Settings& settings, double duration, Look look) {
  Simulation simulation(scene, settings);
  const auto steps = std::lround(duration / settings.step);
  double result = 0;
  for (long i = 1; i <= steps; ++i) {
    if (simulation.step().status == StepReport::Status::diverged) return infinity;
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
  const State start = initial_state(scene);
  return largest(scene, settings, duration, [&](const State& state, double) {
    return only == 0 ? position_difference(state, start)
                     : (state.q[only].linear - start.q[only].linear).norm();
  });
}

/// Returns the state after `duration` seconds.
inline State run(const Scene& scene, const Settings& settings, double duration) {
  return measured_run(scene, settings, duration).state;
}

}  // namespace substep::test
