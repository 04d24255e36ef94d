/// Scenes of joints alone, or without constraints: no bodies collide.

#include "closed_forms.h"
#include "scenes.h"
#include "sim/math/rotation.h"

namespace substep::scenes {
namespace {

/// Returns the principal moments of a uniform rod along X: a thin rod's m L²/12 across it, and a cylinder's m
/// r²/2 about its axis, so that none is 0.
Vector3 rod_inertia(double mass, double length, double radius) {
  const double across = mass * length * length / 12;
  return {mass * radius * radius / 2, across, across};
}

/// Returns a rod along X with a bead near each end and a rounded +X end. `size` scales all but the length.
Mesh rod_shaft(double length, double size) {
  const double half = length / 2;
  const double r = 0.028 * size;
  const double bead = 0.037 * size;
  const double b = half - 0.075 * size;
  const double w = 0.011 * size;
  const double f = 0.004 * size;
  const Mesh shaft =
      turned({corner(0, -half), corner(r, -half), corner(r, -b - w), corner(bead, -b - w, f),
              corner(bead, -b + w, f), corner(r, -b + w), corner(r, b - w), corner(bead, b - w, f),
              corner(bead, b + w, f), corner(r, b + w), corner(r, half, r), corner(0, half)},
             20);
  return turn(Z, -pi / 2) * shaft;
}

/// Adds a post behind the plane of motion, its foot on the ground, with a pin that carries the pivot.
/// Returns the node of the pivot, at (0, height, 0).
int add_post(GltfBuilder& gltf, double height, double size) {
  const double depth = 0.30 * size;
  const double r = 0.026 * size;
  const double foot = 0.26 * size;
  const double top = height + 0.10 * size;
  const Mesh column =
      turned({corner(0, 0), corner(foot, 0, 0.01 * size), corner(foot, 0.05 * size, 0.02 * size),
              corner(0.06 * size, 0.065 * size, 0.03 * size), corner(r, 0.17 * size, 0.10 * size),
              corner(r, top, 0.006 * size), corner(0.042 * size, top, 0.004 * size),
              corner(0.042 * size, top + 0.025 * size, 0.008 * size),
              corner(0.015 * size, top + 0.045 * size, 0.015 * size), corner(0, top + 0.045 * size)},
             32);
  const Mesh pin = turned(
      {corner(0, -depth), corner(0.024 * size, -depth), corner(0.024 * size, 0.035 * size, 0.004 * size),
       corner(0.040 * size, 0.035 * size, 0.004 * size), corner(0.040 * size, 0.060 * size, 0.008 * size),
       corner(0.016 * size, 0.060 * size), corner(0.016 * size, 0.075 * size, 0.006 * size),
       corner(0, 0.075 * size)},
      24);
  const Mesh fittings = at(0, height, 0) * turn(X, pi / 2) * pin +
                        at(0, height, -depth) * rod(0.12 * size, 0.042 * size, 0.008 * size);
  const int post =
      gltf.scenery("post", {{at(0, 0, -depth) * column, finish::iron}, {fittings, finish::brass}});
  return gltf.node("pivot", at(0, height, 0), post);
}

GltfBuilder rod_chain() {
  constexpr double length = 0.5;
  constexpr double height = 2;
  constexpr std::array finishes{finish::terracotta, finish::ivory, finish::teal};
  GltfBuilder gltf("rod_chain", {.duration = 5},
                   {.eye = {0.75, 1.6, 4.5}, .target = {0, 1.22, 0}, .yfov = 0.56});

  const int shaft = gltf.geometry(rod_shaft(length, 1));
  const Mesh head = at(-length / 2, 0, 0) * ball(0.056, 28);
  const int joint_ball = gltf.geometry(head);
  const int tip = gltf.geometry(head + at(length / 2, 0, 0) * ball(0.046, 28));
  const int joint = gltf.ball_joint();
  int end = add_post(gltf, height, 1);
  for (int i = 0; i < 3; ++i) {
    const int body = gltf.body(numbered("rod", i + 1), at(length * (i + 0.5), height, 0),
                               {.mass = 1, .inertia = rod_inertia(1, length, 0.02)},
                               {{shaft, finishes[i]}, {i == 2 ? tip : joint_ball, finish::brass}});
    end = gltf.add_link(i + 1, body, length, end, joint);
  }
  gltf.expect_constant_energy(
      1, "nothing drives the chain, and its joints take nothing: 22 J are what a fall is worth");
  gltf.expect({"way out of the plane z = 0", "way", {}, Z}, any_time, 0, 1e-6,
              "it starts in that plane, in which all forces are");
  return gltf;
}

GltfBuilder pendulum() {
  constexpr double length = 1;
  constexpr double height = 1.4;
  GltfBuilder gltf("pendulum", {.duration = 5},
                   {.eye = {0.5, 1.05, 3.0}, .target = {0, 0.80, 0}, .yfov = 0.56});

  // Make the hinge's eye, a ring about the hinge's axis.
  const Mesh eye = turned({corner(0.022, -0.03, 0.004), corner(0.05, -0.03, 0.008), corner(0.05, 0.03, 0.008),
                           corner(0.022, 0.03, 0.004)},
                          32, true);
  const Mesh fittings =
      at(-length / 2, 0, 0) * turn(X, pi / 2) * eye + at(length / 2, 0, 0) * ball(0.046, 28);
  const Mesh shaft = at(0.02, 0, 0) * turn(Z, -pi / 2) * rod(length - 0.04, 0.026, 0.004);
  const int body =
      gltf.body("rod", at(length / 2, height, 0), {.mass = 1, .inertia = rod_inertia(1, length, 0.02)},
                {{shaft, finish::cherry}, {fittings, finish::brass}});
  const int pivot = add_post(gltf, height, 0.8);
  gltf.joint(gltf.node("hinge", at(-length / 2, 0, 0), body), pivot, gltf.hinge());

  const double period = pendulum_period(length * length / 3, 1, gravity, length / 2, pi / 2);
  gltf.expect({"time of two and a half swings", "angular_velocity", {"rod"}, Z}, crossing(5), 2.5 * period,
              0.02 * 2.5 * period, "T = 4 √(2 L/3 g) K(sin 45°)");
  gltf.expect_constant_energy(
      0.25, "nothing drives it, and its hinge takes nothing: a fall is worth m g L/2 = 4.9 J");
  return gltf;
}

GltfBuilder heavy_chain() {
  constexpr double length = 0.5;
  constexpr int rods = 10;
  constexpr double radius = 0.25;
  constexpr double height = 6.2;
  constexpr double mass = 1000;
  GltfBuilder gltf("heavy_chain", {.duration = 5, .poster = 0.4},
                   {.eye = {1.6, 3.5, 12.4}, .target = {0, 3.15, 0}, .yfov = 0.56});

  int end = add_post(gltf, height, 1.8);
  // X of this frame is the chain's direction: down, turned 30° about Z towards +X.
  const int frame = gltf.node("chain", at(0, height, 0) * turn(Z, -pi / 2 + pi / 6));
  const int shaft = gltf.geometry(rod_shaft(length, 1.6));
  const int head = gltf.geometry(at(-length / 2, 0, 0) * ball(0.065, 24));
  const int joint = gltf.ball_joint();
  const std::array meshes{gltf.mesh("rod_odd", {{shaft, finish::terracotta}, {head, finish::brass}}),
                          gltf.mesh("rod_even", {{shaft, finish::ivory}, {head, finish::brass}})};
  for (int i = 0; i < rods; ++i) {
    const int body = gltf.body(numbered("rod", i + 1), at(length * (i + 0.5), 0, 0),
                               {.mass = 1, .inertia = rod_inertia(1, length, 0.02)}, meshes[i % 2], frame);
    end = gltf.add_link(i + 1, body, length, end, joint);
  }
  // Draw an equator and a shackle, so that the ball's turning can be seen.
  const Mesh belt = turned({corner(radius * 0.9, -0.03, 0.004), corner(radius * 1.02, -0.03, 0.012),
                            corner(radius * 1.02, 0.03, 0.012), corner(radius * 0.9, 0.03, 0.004)},
                           40, true);
  const Mesh shackle = turned({corner(0, 0), corner(0.10, 0), corner(0.10, 0.05, 0.02),
                               corner(0.05, 0.06, 0.02), corner(0.04, 0.10, 0.02), corner(0, 0.10)},
                              24);
  const Pose across = turn(Z, pi / 2);  // Y of the turned pieces to −X, the chain
  const Mesh fittings =
      across * belt + across * at(0, 0.20, 0) * shackle + at(-radius, 0, 0) * ball(0.065, 24);
  const int heavy = gltf.body("ball", at(rods * length + radius, 0, 0),
                              {.mass = mass, .inertia = Vector3::Constant(0.4 * mass * radius * radius)},
                              {{ball(radius, 40), finish::iron}, {fittings, finish::brass}}, frame);
  gltf.joint(gltf.node(numbered("joint", rods + 1), at(-radius, 0, 0), heavy), end, joint);
  gltf.expect_constant_energy(
      350, "nothing drives the chain, and its joints take nothing: 7 kJ are what its swing is worth");
  return gltf;
}

/// Returns the times, s, at which a free body's rate about its own Y changes its sign, by Runge-Kutta steps
/// of Euler's equations. `moments`, kg·m², are principal; `rate`, rad/s, is that at the start.
std::vector<double> turnovers(const Vector3& moments, const Vector3& rate, double duration) {
  constexpr double step = 1e-3;
  const auto change = [&](const Vector3& w) {
    return Vector3((moments.y() - moments.z()) / moments.x() * w.y() * w.z(),
                   (moments.z() - moments.x()) / moments.y() * w.z() * w.x(),
                   (moments.x() - moments.y()) / moments.z() * w.x() * w.y());
  };
  std::vector<double> times;
  Vector3 w = rate;
  for (int i = 0; i * step < duration; ++i) {
    const Vector3 k1 = change(w);
    const Vector3 k2 = change(w + step / 2 * k1);
    const Vector3 k3 = change(w + step / 2 * k2);
    const Vector3 k4 = change(w + step * k3);
    const Vector3 next = w + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    if ((w.y() < 0) != (next.y() < 0)) times.push_back((i + w.y() / (w.y() - next.y())) * step);
    w = next;
  }
  return times;
}

/// Draws a plinth and adds a T-handle that floats above it.
void add_handle(GltfBuilder& gltf, const Motion& motion) {
  const Mesh plinth =
      turned({corner(0, 0), corner(0.40, 0, 0.01), corner(0.40, 0.07, 0.015), corner(0.35, 0.09, 0.02),
              corner(0.31, 0.14, 0.04), corner(0.31, 0.34, 0.04), corner(0.35, 0.39, 0.02),
              corner(0.38, 0.41, 0.01), corner(0.38, 0.46, 0.015), corner(0, 0.46)},
             64);
  gltf.scenery("plinth", {{plinth, finish::limestone}});
  constexpr double bar = 0.08;  // height of the cross-bar
  const Mesh grip = turned({corner(0, 0.07), corner(0.038, 0.07, 0.01), corner(0.038, 0.12, 0.04),
                            corner(0.062, 0.24, 0.06), corner(0.062, 0.30, 0.05), corner(0, 0.30)},
                           28);
  const Mesh stem = turned(
      {corner(0, -0.20), corner(0.045, -0.20, 0.012), corner(0.045, -0.15, 0.012), corner(0.026, -0.14, 0.01),
       corner(0.026, -0.02, 0.03), corner(0.040, 0.02, 0.03), corner(0.058, bar - 0.045, 0.02),
       corner(0.058, bar + 0.045, 0.02), corner(0.030, bar + 0.07, 0.02), corner(0, bar + 0.07)},
      28);
  const Pose front = at(0, bar, 0) * turn(X, pi / 2);  // Y of the turned pieces to +Z
  const Pose back = at(0, bar, 0) * turn(X, -pi / 2);
  gltf.body("handle", at(0, 1, 0), motion,
            {{stem, finish::brass},
             {front * rod(0.16, 0.034, 0.004), finish::steel},
             {front * grip, finish::terracotta},
             {back * grip, finish::ivory}});
}

GltfBuilder tumbling_body() {
  GltfBuilder gltf(
      "tumbling_body", {.duration = 10, .gravity = Vector3::Zero()},
      {.eye = {1.25, 1.45, 1.55}, .target = {0, 0.86, 0}, .yfov = 0.56, .light = {-0.35, -1, -0.3}});
  // Moments of a block of half-sizes 0.1, 0.2, 0.3 m; a T-handle within the same box has them in the same
  // order.
  const Vector3 moments(0.13 / 3, 0.10 / 3, 0.05 / 3);
  const Vector3 rate(0.05, 5, 0.05);
  add_handle(gltf, {.mass = 1, .inertia = moments, .angular_velocity = rate});
  const std::vector<double> times = turnovers(moments, rate, 10);
  for (int i = 0; i < static_cast<int>(times.size()); ++i) {
    gltf.expect(
        {"time of turning over " + std::to_string(i + 1), "angular_velocity", {"handle"}, Y, "", true},
        crossing(i + 1), times[i], 0.1,
        "Euler's equations: the angular velocity about the handle's own Y changes its sign");
  }
  gltf.expect_constant_energy(0.02, "no force acts; the energy is 0.41674 J");
  gltf.expect({"largest change of angular momentum", "angular_momentum_change"}, any_time, 0, 0.002,
              "no moment acts; the angular momentum is 0.1667 N·m·s");
  return gltf;
}

/// Leaning gates on 1, 2, 5 and 10 hinges, all but one redundant.
struct Door : GltfBuilder {
  Door()
      : GltfBuilder("door", {.duration = 4, .poster = 0.9},
                    {.eye = {1.5, 2.0, 6.0}, .target = {0.25, 0.90, 0}, .yfov = 0.50}) {
    add_gate(1, -1.5, finish::terracotta);
    add_gate(2, -0.5, finish::mustard);
    add_gate(5, 0.5, finish::teal);
    add_gate(10, 1.5, finish::blue);
    const double lever = clearance + leaf.x() / 2;
    const double moment = 20 * ((leaf.x() * leaf.x() + leaf.z() * leaf.z()) / 12 + lever * lever);
    const auto [sine, cosine] = sine_cosine(lean);
    const double period = pendulum_period(moment, 20, gravity * sine, lever, open);
    for (const int count : {1, 2, 5, 10}) {
      const std::string name = numbered("hinges", count);
      expect({name + ": period", "angular_velocity", {name}, Vector3(sine, cosine, 0)}, crossing(2), period,
             0.02 * period, "a pendulum in the field g sin 0.25: T = 4 √(I/(m g sin 0.25 l)) K(sin 0.65)");
    }
  }

  static constexpr double lean = 0.25;
  static constexpr double open = 1.3;
  static constexpr double clearance = 0.06;  // from the axis to the leaf
  const Vector3 leaf{0.8, 1.5, 0.05};

  /// Returns the boards of a gate.
  Mesh boards() const {
    Mesh mesh;
    for (int i = 0; i < 5; ++i)
      mesh += at(leaf.x() * (i - 2) / 5, 0, 0) * cuboid({leaf.x() / 5, leaf.y(), 0.03}, 0.006, 2);
    return mesh;
  }

  /// Returns the frame and the brace of a gate.
  Mesh braces() const {
    Mesh mesh;
    for (const double y : {-0.58, 0.58}) mesh += at(0, y, 0) * cuboid({leaf.x(), 0.12, 0.05}, 0.008, 2);
    return mesh + turn(Z, 0.97) * cuboid({1.30, 0.10, 0.05}, 0.008, 2);
  }

  void add_gate(int count, double column, const Finish& paint) {
    const std::string name = numbered("hinges", count);
    const double edge = -leaf.x() / 2 - clearance;
    Mesh pins;
    Mesh knuckles;
    std::vector<double> heights;
    for (int j = 0; j < count; ++j) heights.push_back(count == 1 ? 0.8 : 0.2 + 1.2 * j / (count - 1));
    for (const double y : heights) {
      pins += at(0, y, 0) * rod(0.09, 0.016, 0.003, 16);
      pins += at(-0.04, y - 0.025, 0) * cuboid({0.10, 0.03, 0.03}, 0.006, 1);
      knuckles += at(edge, y - 0.8 + 0.018, 0) * rod(0.035, 0.028, 0.004, 20);
      knuckles += at(edge + 0.11, y - 0.8 + 0.018, 0) * cuboid({0.22, 0.03, 0.06}, 0.006, 1);
    }
    // The post leans towards the closed gate.
    const Mesh post = at(-0.10, 0.80, 0) * cuboid({0.10, 1.80, 0.10}, 0.012);
    const Mesh foot = turn(Z, lean) * at(-0.10, -0.08, 0) * cuboid({0.36, 0.24, 0.36}, 0.02);
    const int frame =
        scenery(name + "_frame",
                mesh(name + "_post", {{post, finish::walnut}, {foot, finish::granite}, {pins, finish::iron}}),
                at(1.25 * column - 0.35, 0.20, 0) * turn(Z, -lean));
    const int gate = body(name, turn(Y, -open) * at(clearance + leaf.x() / 2, 0.8, 0),
                          {.mass = 20, .inertia = box_inertia(20, leaf)},
                          {{boards_, paint}, {braces_, finish::maple}, {knuckles, finish::iron}}, frame);
    const Pose axis = turn(X, -pi / 2);  // Z of a hinge to +Y
    for (int j = 0; j < count; ++j) {
      const std::string number = numbered(name, j + 1);
      const int pin = node(number + "_pin", at(0, heights[j], 0) * axis, frame);
      joint(node(number, at(edge, heights[j] - 0.8, 0) * axis, gate), pin, hinge_);
    }
  }

  int hinge_ = hinge();
  int boards_ = geometry(boards());
  int braces_ = geometry(braces());
};

GltfBuilder short_chain() {
  constexpr double length = 0.5;
  constexpr double height = 1.1;
  constexpr double span = 2;
  constexpr std::array finishes{finish::terracotta, finish::ivory, finish::teal};
  GltfBuilder gltf("short_chain", {.duration = 4, .poster = 0.05},
                   {.eye = {0.6, 1.35, 4.0}, .target = {0, 0.72, 0}, .yfov = 0.52});

  const Mesh column =
      turned({corner(0, 0), corner(0.22, 0, 0.01), corner(0.22, 0.05, 0.02), corner(0.06, 0.065, 0.03),
              corner(0.03, 0.17, 0.08), corner(0.03, height - 0.07, 0.01), corner(0.055, height - 0.05, 0.01),
              corner(0.055, height + 0.05, 0.03), corner(0, height + 0.06)},
             32);
  std::array<int, 2> anchors{};
  for (const int side : {-1, 1}) {
    const std::string name = side < 0 ? "left_post" : "right_post";
    const Pose eye = at(-side * 0.055, height, 0);
    const int post = gltf.scenery(name, {{column, finish::iron}, {eye * ball(0.045, 28), finish::brass}},
                                  at(side * (span / 2 + 0.055), 0, 0));
    anchors[side > 0] = gltf.node(name + "_eye", eye, post);
  }

  // Three links of 0.5 m between eyes 2 m apart: a joint can close only at the others' expense.
  const int shaft = gltf.geometry(turn(Z, pi / 2) * rod(length - 0.05, 0.026, 0.006));
  const int ends =
      gltf.geometry(at(-length / 2, 0, 0) * ball(0.045, 28) + at(length / 2, 0, 0) * ball(0.045, 28));
  const int joint = gltf.ball_joint();
  int end = anchors[0];
  for (int i = 0; i < 3; ++i) {
    const int body = gltf.body(numbered("link", i + 1), at(-span / 2 + length * (i + 0.5), height, 0),
                               {.mass = 1, .inertia = Vector3(1.0 / 2400, 1.0 / 48, 1.0 / 48)},
                               {{shaft, finishes[i]}, {ends, finish::brass}});
    end = gltf.add_link(i + 1, body, length, end, joint);
  }
  gltf.joint(end, anchors[1], joint);
  return gltf;
}

}  // namespace

std::vector<SceneFunction> joint_scenes() {
  return {rod_chain, pendulum, heavy_chain, tumbling_body, made<Door>, short_chain};
}

}  // namespace substep::scenes
