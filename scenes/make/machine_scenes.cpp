/// Scenes of joints and contacts together: cradles, gates, chains, mechanisms.

#include <algorithm>
#include <cmath>

#include "closed_forms.h"
#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/math/rotation.h"
#include "stage.h"

namespace substep::make {

std::string cradle() {
  constexpr double radius = 0.1;
  constexpr double length = 0.7;
  constexpr double height = 0.95;
  constexpr double angle = 0.6;

  GltfBuilder gltf("cradle", 4);
  gltf.poster(0.9667);
  gltf.camera({0.5, 1.35, 4.4}, {0, 0.50, 0}, 0.50);
  gltf.sun({-0.3, -1, -0.75}, warm_white, daylight);

  const int shape = gltf.sphere_shape(radius);
  const int elastic = gltf.bouncing_material(1);
  const int round = gltf.geometry(ball(radius, 40));
  // Two stiff wires and the eye on the ball.
  Mesh wires;
  const double spread = 0.28;
  const double wire_length = Vector3(0, length, spread).norm();
  for (const int side : {-1, 1}) {
    wires.add(rod(wire_length - 0.08, 0.006, 0.001, 12),
              at(0, length / 2, side * spread / 2) *
                  Pose{Vector3::Zero(),
                       Quaternion::FromTwoVectors(Vector3::UnitY(), Vector3(0, length, side * spread))});
  }
  wires.add(rod(0.05, 0.02, 0.006, 20), at(0, radius + 0.01, 0));
  const int wire = gltf.geometry(wires);
  const int steel = gltf.material(finish::steel);
  const int brass = gltf.material(finish::brass);
  const int polished = gltf.mesh("ball", {{round, steel}, {wire, brass}});
  const int thrown = gltf.mesh("thrown_ball", {{round, gltf.material(finish::terracotta)}, {wire, brass}});
  const int hinge = gltf.hinge();

  struct Cradle {
    const char* name;
    double middle;
    double gap;
  };
  for (const Cradle& cradle : {Cradle{"touching", -1.02, 0}, Cradle{"spaced", 1.02, 0.03}}) {
    const std::string name = cradle.name;
    const double pitch = 2 * radius + cradle.gap;
    Mesh frame;
    const double half = 0.8;
    for (const int side : {-1, 1}) {
      frame.add(rod(2 * half, 0.022, 0.006, 24),
                at(cradle.middle, height, side * spread) * turn(Vector3::UnitZ(), pi / 2));
      for (const int end : {-1, 1}) {
        frame.add(rod(height - 0.03, 0.022, 0.006, 24),
                  at(cradle.middle + end * half, (height + 0.03) / 2, side * spread));
        frame.add(ball(0.034, 24), at(cradle.middle + end * half, height, side * spread));
      }
    }
    add_scenery(gltf, name + "_frame", frame, finish::iron);
    const Mesh base = Mesh().add(rounded(box({2 * half + 0.16, 0.07, 2 * spread + 0.16}), 0.02),
                                 at(cradle.middle, 0.035, 0));
    add_scenery(gltf, name + "_base", base, finish::walnut);
    for (int i = 0; i < 5; ++i) {
      const std::string number = name + "_" + std::to_string(i + 1);
      const int pivot = gltf.node(number + "_pivot", at(cradle.middle + pitch * (i - 2), height, 0));
      const Pose swing = i == 0 ? turn(Vector3::UnitZ(), -angle) : Pose{};
      const int body =
          gltf.node(number, at(cradle.middle + pitch * (i - 2), height, 0) * swing * at(0, -length, 0));
      gltf.motion(body, {.mass = 1, .inertia = Vector3::Constant(0.4 * radius * radius)});
      gltf.collider(body, shape, elastic);
      gltf.show(body, i == 0 ? thrown : polished);
      gltf.joint(gltf.node(number + "_top", at(0, length, 0), body), pivot, hinge);
    }
  }

  // What a ball has at the lowest point that has fallen from an angle, and what is left where the gap is
  // shut.
  constexpr double gravity = 9.81;
  const double slowness = 1 + 0.4 * radius * radius / (length * length);
  const double arrives = std::sqrt(2 * gravity * length * (1 - sine_cosine(angle).cosine) / slowness);
  const double beyond = 0.03 / length;
  const double taken = 2 * gravity * length * (1 - std::sqrt(1 - beyond * beyond)) / slowness;
  const auto expect_speed = [&](const std::string& name, const std::vector<std::string>& bodies, int side,
                                double speed) {
    gltf.expect({.name = name,
                 .quantity = "velocity",
                 .bodies = bodies,
                 .direction = Vector3(side, 0, 0),
                 .peak = 1,
                 .value = speed,
                 .tolerance = 0.05 * arrives,
                 .source = "the law of impact, restitution 1"});
  };
  expect_speed("touching_1: first speed back", {"touching_1"}, -1, 0.6 * arrives);
  expect_speed("touching_2 … touching_5: first speed",
               {"touching_2", "touching_3", "touching_4", "touching_5"}, 1, 0.4 * arrives);
  expect_speed("spaced_5: first speed", {"spaced_5"}, 1, std::sqrt(arrives * arrives - 4 * taken));
  gltf.expect({.name = "largest change of energy",
               .quantity = "energy_change",
               .value = 0,
               .tolerance = 0.05 * 2 * gravity * length * (1 - sine_cosine(angle).cosine),
               .source = "restitution 1 and no friction: nothing is lost"});
  return gltf.text();
}

std::string door() {
  constexpr double lean = 0.25;
  constexpr double open = 1.3;
  const Vector3 leaf(0.8, 1.5, 0.05);
  constexpr double clearance = 0.06;  // from the axis to the leaf
  constexpr std::array<int, 4> counts{1, 2, 5, 10};
  constexpr std::array finishes{finish::terracotta, finish::mustard, finish::teal, finish::blue};

  GltfBuilder gltf("door", 4);
  gltf.poster(0.9);
  gltf.camera({1.5, 2.0, 6.0}, {0.25, 0.90, 0}, 0.50);
  gltf.sun(afternoon, warm_white, daylight);

  const int hinge = gltf.hinge();
  // Boards with a frame and a brace, as a gate has.
  Mesh boards;
  for (int i = 0; i < 5; ++i)
    boards.add(rounded(box({leaf.x() / 5, leaf.y(), 0.03}), 0.006, 2), at(leaf.x() * (i - 2) / 5, 0, 0));
  Mesh braces;
  for (const double y : {-0.58, 0.58})
    braces.add(rounded(box({leaf.x(), 0.12, 0.05}), 0.008, 2), at(0, y, 0));
  braces.add(rounded(box({1.30, 0.10, 0.05}), 0.008, 2), turn(Vector3::UnitZ(), 0.97));
  const int board_look = gltf.geometry(boards);
  const int brace_look = gltf.geometry(braces);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const int count = counts[i];
    const std::string name = "hinges_" + std::to_string(count);
    const int frame = gltf.node(name + "_frame", at(1.25 * (static_cast<int>(i) - 1.5) - 0.35, 0.20, 0) *
                                                     turn(Vector3::UnitZ(), -lean));
    // The post leans towards where the gate hangs when it is closed.
    Mesh post;
    post.add(rounded(box({0.10, 1.80, 0.10}), 0.012), at(-0.10, 0.80, 0));
    Mesh foot;
    foot.add(rounded(box({0.36, 0.24, 0.36}), 0.02), turn(Vector3::UnitZ(), lean) * at(-0.10, -0.08, 0));
    Mesh pins;
    Mesh knuckles;
    std::vector<double> heights;
    for (int j = 0; j < count; ++j) heights.push_back(count == 1 ? 0.8 : 0.2 + 1.2 * j / (count - 1));
    for (const double y : heights) {
      pins.add(rod(0.09, 0.016, 0.003, 16), at(0, y, 0));
      pins.add(rounded(box({0.10, 0.03, 0.03}), 0.006, 1), at(-0.04, y - 0.025, 0));
      knuckles.add(rod(0.035, 0.028, 0.004, 20), at(-leaf.x() / 2 - clearance, y - 0.8 + 0.018, 0));
      knuckles.add(rounded(box({0.22, 0.03, 0.06}), 0.006, 1),
                   at(-leaf.x() / 2 - clearance + 0.11, y - 0.8 + 0.018, 0));
    }
    const int post_look = gltf.geometry(post);
    const int foot_look = gltf.geometry(foot);
    const int pin_look = gltf.geometry(pins);
    const int walnut = gltf.material(finish::walnut);
    const int granite = gltf.material(finish::granite);
    const int iron = gltf.material(finish::iron);
    gltf.show(frame,
              gltf.mesh(name + "_post", {{post_look, walnut}, {foot_look, granite}, {pin_look, iron}}));

    const int body =
        gltf.node(name, turn(Vector3::UnitY(), -open) * at(clearance + leaf.x() / 2, 0.8, 0), frame);
    gltf.motion(body, {.mass = 20, .inertia = box_inertia(20, leaf)});
    const int knuckle_look = gltf.geometry(knuckles);
    const int paint = gltf.material(finishes[i]);
    const int maple = gltf.material(finish::maple);
    gltf.show(body, gltf.mesh(name, {{board_look, paint}, {brace_look, maple}, {knuckle_look, iron}}));
    // Z of a hinge is its axis.
    const Pose axis = turn(Vector3::UnitX(), -pi / 2);
    for (std::size_t j = 0; j < heights.size(); ++j) {
      const std::string number = name + "_" + std::to_string(j + 1);
      const int fixed = gltf.node(number + "_pin", at(0, heights[j], 0) * axis, frame);
      gltf.joint(gltf.node(number, at(-leaf.x() / 2 - clearance, heights[j] - 0.8, 0) * axis, body), fixed,
                 hinge);
    }
  }

  const double lever = clearance + leaf.x() / 2;
  const double moment = 20 * ((leaf.x() * leaf.x() + leaf.z() * leaf.z()) / 12 + lever * lever);
  const auto [sine, cosine] = sine_cosine(lean);
  const double period = pendulum_period(moment, 20, 9.81 * sine, lever, open);
  for (const int count : counts) {
    const std::string name = "hinges_" + std::to_string(count);
    gltf.expect({.name = name + ": period",
                 .quantity = "angular_velocity",
                 .bodies = {name},
                 .direction = Vector3(sine, cosine, 0),
                 .crossing = 2,
                 .value = period,
                 .tolerance = 0.02 * period,
                 .source = "a pendulum in the field g sin 0.25: T = 4 √(I/(m g sin 0.25 l)) K(sin 0.65)"});
  }
  return gltf.text();
}

std::string short_chain() {
  constexpr double length = 0.5;
  constexpr double height = 1.1;
  constexpr double span = 2;
  constexpr std::array finishes{finish::terracotta, finish::ivory, finish::teal};

  GltfBuilder gltf("short_chain", 4);
  gltf.poster(0.05);
  gltf.camera({0.6, 1.35, 4.0}, {0, 0.72, 0}, 0.52);
  gltf.sun(afternoon, warm_white, daylight);

  std::array<int, 2> anchors{};
  for (const int side : {-1, 1}) {
    const std::array<ProfilePoint, 9> column{{{0, 0},
                                              {0.22, 0, 0.01},
                                              {0.22, 0.05, 0.02},
                                              {0.06, 0.065, 0.03},
                                              {0.03, 0.17, 0.08},
                                              {0.03, height - 0.07, 0.01},
                                              {0.055, height - 0.05, 0.01},
                                              {0.055, height + 0.05, 0.03},
                                              {0, height + 0.06}}};
    const std::string name = side < 0 ? "left_post" : "right_post";
    const int post = gltf.node(name, at(side * (span / 2 + 0.055), 0, 0));
    const int column_look = gltf.geometry(turned(column, 32));
    const int eye = gltf.geometry(Mesh().add(ball(0.045, 28), at(-side * 0.055, height, 0)));
    const int iron = gltf.material(finish::iron);
    gltf.show(post, gltf.mesh(name, {{column_look, iron}, {eye, gltf.material(finish::brass)}}));
    anchors[side > 0] = gltf.node(name + "_eye", at(-side * 0.055, height, 0), post);
  }

  // Three links of 0.5 m between eyes 2 m apart: none of the four joints can close but for the others' sake.
  const Mesh shaft = Mesh().add(rod(length - 0.05, 0.026, 0.006), turn(Vector3::UnitZ(), pi / 2));
  const Mesh ends =
      Mesh().add(ball(0.045, 28), at(-length / 2, 0, 0)).add(ball(0.045, 28), at(length / 2, 0, 0));
  const int shaft_look = gltf.geometry(shaft);
  const int end_look = gltf.geometry(ends);
  const int joint = gltf.ball_joint();
  int connected = anchors[0];
  for (int i = 0; i < 3; ++i) {
    const std::string number = std::to_string(i + 1);
    const int body = gltf.node("link_" + number, at(-span / 2 + length * (i + 0.5), height, 0));
    gltf.motion(body, {.mass = 1, .inertia = Vector3(1.0 / 2400, 1.0 / 48, 1.0 / 48)});
    const int paint = gltf.material(finishes[i]);
    gltf.show(body,
              gltf.mesh("link_" + number, {{shaft_look, paint}, {end_look, gltf.material(finish::brass)}}));
    const int head = gltf.node("joint_" + number, at(-length / 2, 0, 0), body);
    gltf.joint(head, connected, joint);
    connected = gltf.node("end_" + number, at(length / 2, 0, 0), body);
    if (i == 2) gltf.joint(connected, anchors[1], joint);
  }
  return gltf.text();
}

std::string ragdoll() {
  constexpr int steps = 5;
  constexpr double rise = 0.2;
  constexpr double tread = 0.36;
  constexpr double top = rise * steps;

  GltfBuilder gltf("ragdoll", 4);
  gltf.poster(0.75);
  gltf.camera({2.7, 2.6, 6.0}, {0.30, 1.20, 0}, 0.56);
  gltf.sun({-0.3, -1, -0.7}, warm_white, daylight);
  add_ground(gltf, 0.6);
  const int grip = gltf.physics_material(0.6);
  for (int i = 0; i < steps; ++i) {
    // Each reaches from the landing to its own edge.
    const double right = -0.9 + tread * (steps - i);
    const double length = right + 2.1;
    add_fixed_box(gltf, "step_" + std::to_string(i + 1), {length, rise, 2.0},
                  at(right - length / 2, rise * (i + 0.5), 0), grip,
                  i % 2 == 0 ? finish::limestone : finish::sandstone);
  }

  // An artist's mannequin, facing +X, on its toes.
  const int wood = gltf.material(finish::maple);
  const int dark = gltf.material(finish::walnut);
  const int figure = gltf.node("figure", at(-1.15, top + 0.006, 0) * turn(Vector3::UnitZ(), -0.16));
  const auto moving = [&](int node, double mass) {
    gltf.motion(node,
                {.mass = mass, .linear_velocity = {1.6, 0.3, 0.15}, .angular_velocity = {0.1, 0.2, -0.8}});
  };
  const auto add_block = [&](const char* name, double y, const Vector3& size, double mass) {
    const int body = gltf.node(name, at(0, y, 0), figure);
    moving(body, mass);
    gltf.collider(body, gltf.box_shape(size), grip);
    const int look = gltf.geometry(rounded(box(size), 0.4 * std::min(size.x(), size.y()), 4));
    gltf.show(body, gltf.mesh(name, {{look, wood}}));
    return body;
  };
  // A limb hangs from its upper end; `length` is from joint to joint.
  const auto add_limb = [&](const std::string& name, const Vector3& upper_end, double length, double radius,
                            double mass) {
    const int body = gltf.node(name, at(upper_end.x(), upper_end.y() - length / 2, upper_end.z()), figure);
    moving(body, mass);
    const double straight = length - 2.6 * radius;
    gltf.collider(body, gltf.capsule_shape(radius, straight), grip);
    const std::array<ProfilePoint, 6> profile{{{0, -straight / 2 - radius},
                                               {0.8 * radius, -straight / 2 - radius, 0.6 * radius},
                                               {radius, -straight / 2 + 0.3 * radius, 0.3 * radius},
                                               {0.8 * radius, straight / 2, 0.3 * radius},
                                               {0.8 * radius, straight / 2 + radius, 0.6 * radius},
                                               {0, straight / 2 + radius}}};
    const int look = gltf.geometry(turned(profile, 28));
    const int knob = gltf.geometry(Mesh().add(ball(0.62 * radius, 20), at(0, length / 2, 0)));
    gltf.show(body, gltf.mesh(name, {{look, wood}, {knob, dark}}));
    return body;
  };
  const auto join = [&](const std::string& name, int child, const Vector3& at_child, int parent,
                        const Vector3& at_parent, int description) {
    const int held = gltf.node(name + "_socket", at(at_parent.x(), at_parent.y(), at_parent.z()), parent);
    gltf.joint(gltf.node(name, at(at_child.x(), at_child.y(), at_child.z()), child), held, description);
  };
  const AxesLimit point = locked(linear, {0, 1, 2});
  const auto cone = [](double angle) { return AxesLimit{.kind = angular, .axes = {0, 2}, .max = angle}; };
  const auto twist = [](double angle) {
    return AxesLimit{.kind = angular, .axes = {1}, .min = -angle, .max = angle};
  };

  const int pelvis = add_block("pelvis", 0.95, {0.16, 0.16, 0.30}, 12);
  const int chest = add_block("chest", 1.27, {0.19, 0.36, 0.36}, 22);
  const int head = gltf.node("head", at(0, 1.62, 0), figure);
  moving(head, 5);
  gltf.collider(head, gltf.sphere_shape(0.11), grip);
  const int skull = gltf.geometry(ball(0.11, 32));
  const int neck = gltf.geometry(Mesh()
                                     .add(rod(0.12, 0.035, 0.01), at(0, -0.12, 0))
                                     .add(ball(0.018, 16), at(0.105, 0.02, 0.04))
                                     .add(ball(0.018, 16), at(0.105, 0.02, -0.04)));
  gltf.show(head, gltf.mesh("head", {{skull, wood}, {neck, dark}}));

  // How far the whole turn between pelvis and chest goes is limited, about whatever axis.
  const int spine = gltf.joint_description({point, {.kind = angular, .axes = {0, 1, 2}, .max = 0.5}});
  join("spine", chest, {0, -0.21, 0}, pelvis, {0, 0.11, 0}, spine);
  const int nape = gltf.joint_description({point, cone(0.5), twist(0.8)});
  join("neck", head, {0, -0.16, 0}, chest, {0, 0.19, 0}, nape);
  const int shoulder = gltf.joint_description({point, cone(1.7), twist(0.8)});
  const int hip = gltf.joint_description({point, cone(1.0), twist(0.4)});
  // Angles are those of the upper limb as seen from the lower one.
  const int elbow = gltf.joint_description(
      {point, locked(angular, {0, 1}), {.kind = angular, .axes = {2}, .min = -2.4, .max = 0}});
  const int knee = gltf.joint_description(
      {point, locked(angular, {0, 1}), {.kind = angular, .axes = {2}, .min = 0, .max = 2.4}});
  for (const int side : {-1, 1}) {
    const std::string name = side < 0 ? "left" : "right";
    const int upper_arm = add_limb(name + "_upper_arm", {0, 1.40, side * 0.25}, 0.29, 0.048, 2);
    const int forearm = add_limb(name + "_forearm", {0, 1.11, side * 0.25}, 0.30, 0.040, 1.5);
    const int thigh = add_limb(name + "_thigh", {0, 0.86, side * 0.10}, 0.41, 0.070, 7);
    const int shin = add_limb(name + "_shin", {0, 0.45, side * 0.10}, 0.46, 0.052, 4);
    join(name + "_shoulder", upper_arm, {0, 0.145, 0}, chest, {0, 0.13, side * 0.25}, shoulder);
    join(name + "_elbow", forearm, {0, 0.15, 0}, upper_arm, {0, -0.145, 0}, elbow);
    join(name + "_hip", thigh, {0, 0.205, 0}, pelvis, {0, -0.09, side * 0.10}, hip);
    join(name + "_knee", shin, {0, 0.23, 0}, thigh, {0, -0.205, 0}, knee);
  }

  gltf.expect_no_gain(5, "nothing drives it, and no contact gives energy");
  return gltf.text();
}

std::string squeezer() {
  // The benchmark's data in its own units, kg and m; here all lengths are ten times as long and everything
  // takes a hundred times as long, so that it can be watched.
  static constexpr double scale = 10;
  constexpr double slow = 100;
  constexpr double xa = -0.06934, ya = -0.00227, xb = -0.03635, yb = 0.03273, xc = 0.014, yc = 0.072;
  constexpr double d = 0.028, da = 0.0115, e = 0.02, ea = 0.01421, rr = 0.007, ra = 0.00092, sa = 0.01874,
                   sb = 0.01043, sc = 0.018, sd = 0.02, ta = 0.02308, tb = 0.00916, u = 0.04, ua = 0.01228,
                   ub = 0.00449, zf = 0.02, zt = 0.04, fa = 0.01421;
  constexpr double beta = -0.0617138900142764, theta = 0, gamma = 0.455279819163070, phi = 0.222668390165886,
                   delta = 0.487364979543843, omega = -0.222668390165886, epsilon = 1.23054744454982;
  constexpr double height = 0.45;  // of the crank's axis

  GltfBuilder gltf("squeezer", 3, Vector3::Zero());
  gltf.poster(1.6);
  gltf.camera({-0.1, 0.95, 2.15}, {-0.27, 0.68, 0}, 0.52);
  gltf.sun({-0.35, -0.9, -0.8}, warm_white, daylight);

  const Mesh board = Mesh().add(rounded(box({1.25, 1.2, 0.06}), 0.015), at(-0.27, 0.70, -0.06));
  add_scenery(gltf, "board", board, finish::walnut);
  Mesh stand;
  for (const int side : {-1, 1})
    stand.add(rounded(box({0.08, 0.12, 0.4}), 0.015), at(-0.27 + side * 0.5, 0.06, -0.06));
  add_scenery(gltf, "stand", stand, finish::iron);

  // A frame of the benchmark's plane: everything below is placed in it.
  const int plane = gltf.node("plane", at(0, height, 0));
  struct Place {
    double x;
    double y;
    Vector3 point() const { return Vector3(x, y, 0) * scale; }
  };
  const auto polar = [](double length, double angle) {
    const auto [s, c] = sine_cosine(angle);
    return Place{length * c, length * s};
  };
  const auto plus = [](const Place& p, const Place& q) { return Place{p.x + q.x, p.y + q.y}; };
  // Along (sin, −cos) of an angle, as the benchmark often has it.
  const auto aside = [&](double length, double angle) { return polar(length, angle - pi / 2); };

  const Place o{0, 0};
  const Place a{xa, ya};
  const Place b{xb, yb};
  const Place c{xc, yc};
  const Place crank_pin = polar(rr, beta);
  const Place p = plus(crank_pin, polar(-d, beta + theta));
  const Place elbow = plus(a, polar(zt, delta));  // between K4 and K5
  const Place knee = plus(a, aside(u, epsilon));  // between K6 and K7
  const Place d_point = plus(b, plus(aside(sc, gamma), polar(sd, gamma)));

  struct Link {
    const char* name;
    double mass;
    double moment;
    Place centre;
    double angle;
    std::vector<Place> joints;  // its outline's corners
    double layer;
    Finish look;
  };
  const std::vector<Link> links{
      {"crank", 0.04325, 2.194e-6, polar(ra, beta), beta, {o, crank_pin}, 5, finish::terracotta},
      {"rod",
       0.00365,
       4.410e-7,
       plus(crank_pin, polar(-da, beta + theta)),
       beta + theta,
       {crank_pin, p},
       4,
       finish::ivory},
      {"lever",
       0.02373,
       5.255e-6,
       plus(b, plus(aside(sa, gamma), polar(sb, gamma))),
       gamma,
       {b, p, d_point},
       0,
       finish::teal},
      {"upper_link",
       0.00706,
       5.667e-7,
       plus(elbow, aside(e - ea, delta + phi)),
       phi + delta,
       {elbow, p},
       2,
       finish::mustard},
      {"upper_arm",
       0.07050,
       1.169e-5,
       plus(a, plus(polar(ta, delta), polar(tb, delta + pi / 2))),
       delta,
       {a, elbow},
       1,
       finish::blue},
      {"lower_link",
       0.00706,
       5.667e-7,
       plus(knee, polar(zf - fa, epsilon + omega)),
       omega + epsilon,
       {knee, p},
       3,
       finish::mustard},
      {"lower_arm",
       0.05498,
       1.912e-5,
       plus(a, plus(aside(ua, epsilon), polar(-ub, epsilon))),
       epsilon,
       {a, knee},
       1,
       finish::cherry},
  };
  const int brass = gltf.material(finish::brass);
  const int steel = gltf.material(finish::steel);
  std::vector<int> bodies;
  const auto local = [&](const Link& link, const Place& place) {
    const Pose pose{link.centre.point(), turn(Vector3::UnitZ(), link.angle).orientation};
    return pose.inverse() * place.point();
  };
  for (const Link& link : links) {
    const int body =
        gltf.node(link.name, {link.centre.point(), turn(Vector3::UnitZ(), link.angle).orientation}, plane);
    // It moves in the plane only: infinite moments across.
    gltf.motion(body, {.mass = link.mass, .inertia = Vector3(0, 0, link.moment * scale * scale)});
    const double z = 0.016 * link.layer;
    Mesh bars;
    Mesh pins;
    const std::size_t corners = link.joints.size();
    for (std::size_t i = 0; i < corners; ++i) {
      const Vector3 from = local(link, link.joints[i]);
      pins.add(rod(0.02, 0.013, 0.003, 20),
               Pose{from + Vector3(0, 0, z + 0.004), turn(Vector3::UnitX(), pi / 2).orientation});
      bars.add(rod(0.014, 0.024, 0.003, 28),
               Pose{from + Vector3(0, 0, z), turn(Vector3::UnitX(), pi / 2).orientation});
      if (corners == 2 && i == 1) break;
      const Vector3 to = local(link, link.joints[(i + 1) % corners]);
      const Vector3 along = to - from;
      bars.add(rounded(box({along.norm(), 0.028, 0.013}), 0.003, 2),
               Pose{(from + to) / 2 + Vector3(0, 0, z), Quaternion::FromTwoVectors(Vector3::UnitX(), along)});
    }
    if (corners == 2 && std::string_view(link.name) == "crank")
      bars.add(rod(0.014, 0.06, 0.003, 40),
               Pose{local(link, o) + Vector3(0, 0, z), turn(Vector3::UnitX(), pi / 2).orientation});
    const int bar_look = gltf.geometry(bars);
    const int pin_look = gltf.geometry(pins);
    const int paint = gltf.material(link.look);
    gltf.show(body, gltf.mesh(link.name, {{bar_look, paint}, {pin_look, brass}}));
    bodies.push_back(body);
  }

  // Every joint is a pin: two rows in the plane.
  const AxesLimit pin = locked(linear, {0, 1});
  const int pinned = gltf.joint_description({pin});
  const auto fixed = [&](const char* name, const Place& place) {
    return gltf.node(name, {place.point(), Quaternion::Identity()}, plane);
  };
  const auto on = [&](const char* name, int link, const Place& place) {
    // Parallel to the plane's frame.
    const Quaternion back = turn(Vector3::UnitZ(), -links[link].angle).orientation;
    return gltf.node(name, {local(links[link], place), back}, bodies[link]);
  };
  const auto add_pin = [&](const std::string& name, int first, int second, const Place& place) {
    const int held = on((name + "_eye").c_str(), second, place);
    gltf.joint(on(name.c_str(), first, place), held, pinned);
  };
  const auto add_bearing = [&](const std::string& name, int link, const Place& place) {
    const int held = fixed((name + "_bearing").c_str(), place);
    gltf.joint(on(name.c_str(), link, place), held, pinned);
  };
  // A motor that never comes near its speed turns with all its moment.
  const double moment = 0.033 * scale * scale / (slow * slow);
  const int driven = gltf.joint_description(
      {pin}, {{.kind = angular, .axis = 2, .velocity = 1e6, .damping = 1, .max_force = moment}});
  const int motor = fixed("motor", o);
  gltf.joint(motor, on("crank_axis", 0, o), driven);
  add_pin("crank_pin", 1, 0, crank_pin);
  add_pin("lever_pin", 2, 1, p);
  add_pin("upper_pin", 3, 1, p);
  add_pin("lower_pin", 5, 1, p);
  add_bearing("lever_axis", 2, b);
  add_pin("elbow", 4, 3, elbow);
  add_pin("knee", 6, 5, knee);
  add_bearing("upper_axis", 4, a);
  add_bearing("lower_axis", 6, a);
  const int spring = gltf.joint_description({{.kind = linear,
                                              .axes = {0, 1, 2},
                                              .min = 0.07785 * scale,
                                              .max = 0.07785 * scale,
                                              .stiffness = 4530 / (slow * slow)}});
  const int spring_end = on("spring_end", 2, d_point);
  const int spring_foot = fixed("spring_foot", c);
  gltf.joint(spring_foot, spring_end, spring);

  Mesh bearings;
  for (const Place& place : {o, a, b, c})
    bearings.add(rod(0.10, 0.016, 0.004, 24),
                 Pose{place.point() + Vector3(0, height, 0.02), turn(Vector3::UnitX(), pi / 2).orientation});
  const int bearing_look = gltf.geometry(bearings);
  gltf.show(gltf.node("bearings"), gltf.mesh("bearings", {{bearing_look, steel}}));

  // The seven angles at 0.03 s of the benchmark's time.
  constexpr double end_beta = 15.81077119629904, end_theta = -15.75637105984298,
                   end_gamma = 0.04082224013073101, end_phi = -0.5347301163226948,
                   end_delta = 0.5244099658805304, end_omega = 0.5347301163226948,
                   end_epsilon = 1.048080741042263;
  const std::array<double, 7> ends{end_beta,  end_beta + end_theta,    end_gamma,  end_phi + end_delta,
                                   end_delta, end_omega + end_epsilon, end_epsilon};
  for (std::size_t i = 0; i < links.size(); ++i) {
    gltf.expect({.name = std::string(links[i].name) + ": angle turned at 3 s",
                 .quantity = "angle",
                 .bodies = {links[i].name},
                 .direction = Vector3::UnitZ(),
                 .at = 3,
                 .value = ends[i] - links[i].angle,
                 .tolerance = i == 0 ? 0.15 : 0.05,
                 .source = "Test Set for IVP Solvers (Bari), Andrews' squeezing mechanism"});
  }
  return gltf.text();
}

std::string water_wheel() {
  constexpr double radius = 0.85;
  constexpr double width = 0.34;
  constexpr double hub_radius = 0.45;
  constexpr double height = 1.15;
  constexpr int buckets = 12;
  constexpr double ball_radius = 0.075;
  constexpr int balls = 20;

  GltfBuilder gltf("water_wheel", 6);
  gltf.poster(2.6);
  gltf.camera({-1.0, 2.5, 6.4}, {-1.1, 1.35, 0}, 0.56);
  gltf.sun({-0.3, -1, -0.6}, warm_white, daylight);
  add_ground(gltf, 0.4);

  const Pose along_z = turn(Vector3::UnitX(), pi / 2);
  const int slick = gltf.physics_material(0.2);
  const int wheel = gltf.node("wheel", at(0, height, 0));
  gltf.motion(wheel, {.mass = 20, .inertia = Vector3(4, 4, 7)});
  const int drum = gltf.node("drum", along_z, wheel);
  gltf.collider(drum, gltf.cylinder_shape(hub_radius, width), slick);
  const int disc = gltf.cylinder_shape(radius, 0.03);
  for (const int side : {-1, 1})
    gltf.collider(gltf.node(side < 0 ? "back_disc" : "front_disc",
                            at(0, 0, side * (width / 2 + 0.015)) * along_z, wheel),
                  disc, slick);
  // Blades lean forwards, so that they hold a ball from the top to well below the axis.
  const Vector3 blade_size(0.42, 0.025, width);
  const int blade_shape = gltf.box_shape(blade_size);
  Mesh blades;
  for (int i = 0; i < buckets; ++i) {
    const Pose blade = turn(Vector3::UnitZ(), 2 * pi * i / buckets) * at((hub_radius + radius) / 2, 0, 0) *
                       turn(Vector3::UnitZ(), 0.35);
    gltf.collider(gltf.node("blade_" + std::to_string(i + 1), blade, wheel), blade_shape, slick);
    blades.add(rounded(box(blade_size), 0.008, 2), blade);
  }
  Mesh metal;
  metal.add(rod(width + 0.7, 0.035, 0.008), along_z);
  Mesh wood;
  wood.add(rod(width, hub_radius, 0.01, 48), along_z);
  // Rings and spokes instead of the discs, so that one can see inside.
  const std::array<ProfilePoint, 4> ring{{{radius - 0.07, -0.015, 0.005},
                                          {radius, -0.015, 0.005},
                                          {radius, 0.015, 0.005},
                                          {radius - 0.07, 0.015, 0.005}}};
  Mesh rings;
  for (const int side : {-1, 1}) {
    rings.add(turned(ring, 64, true), at(0, 0, side * (width / 2 + 0.015)) * along_z);
    for (int i = 0; i < 6; ++i)
      rings.add(rounded(box({radius - 0.03, 0.05, 0.028}), 0.006, 2),
                turn(Vector3::UnitZ(), pi * i / 3) * at(radius / 2, 0, side * (width / 2 + 0.015)));
  }
  const int blade_look = gltf.geometry(blades);
  const int wood_look = gltf.geometry(wood);
  const int ring_look = gltf.geometry(rings);
  const int metal_look = gltf.geometry(metal);
  const int maple = gltf.material(finish::maple);
  const int oak = gltf.material(finish::oak);
  const int walnut = gltf.material(finish::walnut);
  const int steel = gltf.material(finish::steel);
  gltf.show(
      wheel,
      gltf.mesh("wheel", {{blade_look, maple}, {wood_look, oak}, {ring_look, walnut}, {metal_look, steel}}));
  Mesh trestle;
  for (const int side : {-1, 1}) {
    for (const int lean : {-1, 1})
      trestle.add(rounded(box({0.09, 1.25, 0.08}), 0.012),
                  at(lean * 0.2, 0.58, side * 0.42) * turn(Vector3::UnitZ(), lean * 0.33));
    trestle.add(rounded(box({0.2, 0.12, 0.09}), 0.012), at(0, height, side * 0.42));
  }
  add_scenery(gltf, "trestle", trestle, finish::iron);
  const int bearing = gltf.node("bearing", at(0, height, 0));
  gltf.joint(gltf.node("axle", {}, wheel), bearing, gltf.hinge(), true);

  // The chute: a floor and two walls, sloping to the wheel's left shoulder.
  const int chute = gltf.node("chute", at(-0.42, 2.20, 0) * turn(Vector3::UnitZ(), -0.14));
  const double length = 0.16 * balls + 0.1;
  const auto add_plank = [&](const char* name, const Vector3& size, const Vector3& centre) {
    const int node = gltf.node(name, {centre, Quaternion::Identity()}, chute);
    gltf.collider(node, gltf.box_shape(size), slick);
    const int look = gltf.geometry(rounded(box(size), 0.008, 2));
    gltf.show(node, gltf.mesh(name, {{look, oak}}));
  };
  add_plank("chute_floor", {length, 0.03, 0.24}, {-length / 2, -0.015, 0});
  for (const int side : {-1, 1})
    add_plank(side < 0 ? "chute_back" : "chute_front", {length, 0.10, 0.03},
              {-length / 2, 0.035, side * 0.12});
  Mesh posts;
  for (const double x : {-1.0, -3.1})
    for (const int side : {-1, 1})
      posts.add(rounded(box({0.08, 2.24 - 0.14 * x, 0.08}), 0.012),
                at(x - 0.42, (2.18 - 0.14 * x) / 2 - 0.05, side * 0.18));
  add_scenery(gltf, "posts", posts, finish::walnut);
  const int shape = gltf.sphere_shape(ball_radius);
  const int round = gltf.geometry(ball(ball_radius, 28));
  const std::array<int, 3> paints{gltf.material(finish::blue), gltf.material(finish::teal),
                                  gltf.material(finish::ivory)};
  for (int i = 0; i < balls; ++i) {
    const std::string name = "ball_" + std::to_string(i + 1);
    const int body = gltf.node(name, at(-0.12 - 0.16 * i, ball_radius, 0), chute);
    gltf.motion(body, {.mass = 1.5});
    gltf.collider(body, shape, slick);
    gltf.show(body, gltf.mesh(name, {{round, paints[i % 3]}}));
  }

  const auto [sine, cosine] = sine_cosine(0.14);
  gltf.expect({.name = "ball_20: way down the chute at 1 s",
               .quantity = "way",
               .bodies = {"ball_20"},
               .direction = Vector3(cosine, -sine, 0),
               .at = 1,
               .value = 5.0 / 7 * 9.81 * sine / 2,
               .tolerance = 0.025,
               .source = "a solid ball rolls with 5/7 g sin θ"});
  gltf.expect_no_gain(6, "nothing drives the wheel; the balls' fall is worth 600 J");
  return gltf.text();
}

}  // namespace substep::make
