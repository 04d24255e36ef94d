/// Closed loops of hinges and a stiff governor, after the IFToMM's library of multibody benchmarks.

#include <algorithm>

#include "closed_forms.h"
#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/math/rotation.h"
#include "stage.h"

namespace substep::scenes {
namespace {

/// A square bar from one point to another.
Mesh bar(const Vector3& from, const Vector3& to, double width) {
  const Vector3 along = to - from;
  return Mesh().add(rounded(box({along.norm(), width, width}), width / 8, 2),
                    Pose{(from + to) / 2, Quaternion::FromTwoVectors(Vector3::UnitX(), along)});
}

/// A pin about an axis of the node's, at a point.
Mesh pin(const Vector3& place, int axis, double length, double radius) {
  return Mesh().add(rod(length, radius, radius / 8, 24),
                    Pose{place, Quaternion::FromTwoVectors(Vector3::UnitY(), Vector3::Unit(axis))});
}

/// From a hinge's frame, whose Z is its axis, to the node's.
Quaternion hinge_about(int axis) {
  return Quaternion::FromTwoVectors(Vector3::UnitZ(), Vector3::Unit(axis));
}

Mesh foot(double height, double thickness, const Vector3& place) {
  Mesh mesh;
  mesh.add(rounded(box({thickness, height, thickness}), 0.012), at(place.x(), height / 2, place.z()));
  mesh.add(rounded(box({0.5, 0.06, 0.5}), 0.02), at(place.x(), 0.03, place.z()));
  return mesh;
}

}  // namespace

std::string bricard() {
  constexpr double width = 0.1;
  constexpr double height = 2.3;  // of the fixed rod
  constexpr int count = 6;
  const std::array<Vector3, count> corners{
      {{0, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, -1, 1}, {0, -1, 1}, {0, 0, 1}}};
  constexpr std::array<int, count> axes{1, 2, 0, 1, 2, 0};
  constexpr std::array finishes{finish::terracotta, finish::mustard, finish::teal, finish::blue,
                                finish::ivory};

  GltfBuilder gltf("bricard", 10);
  gltf.poster(1.1);
  set_view(gltf, {4.4, 2.9, 4.4}, {0.45, 1.55, 0.5}, 0.52);

  // The sixth rod is the ground.
  const Vector3 origin(0, height, 0);
  Mesh fixed = bar(corners[5] + origin, corners[0] + origin, width);
  for (const double z : {0.25, 0.75}) fixed.add(foot(height, 0.07, {0, 0, z}));
  add_scenery(gltf, "stand", fixed, finish::iron);

  std::array<int, count> nodes{};
  std::array<Vector3, count> centres;
  for (int i = 0; i < count; ++i) {
    const Vector3& from = corners[i];
    const Vector3& to = corners[(i + 1) % count];
    centres[i] = (from + to) / 2 + origin;
    const bool moves = i < count - 1;
    const std::string name = moves ? "rod_" + std::to_string(i + 1) : "ground_rod";
    nodes[i] = gltf.node(name, {centres[i], Quaternion::Identity()});
    if (!moves) continue;
    Vector3 size = (to - from).cwiseAbs();
    for (double& extent : size) extent = std::max(extent, width);
    gltf.motion(nodes[i], {.mass = 1, .inertia = box_inertia(1, size)});
    const int look = gltf.geometry(bar((from - to) / 2, (to - from) / 2, width));
    const int eye = gltf.geometry(pin((from - to) / 2, axes[i], 0.17, 0.035));
    gltf.show(nodes[i],
              gltf.mesh(name, {{look, gltf.material(finishes[i])}, {eye, gltf.material(finish::brass)}}));
  }
  const int hinge = gltf.hinge();
  for (int i = 0; i < count; ++i) {
    const int before = (i + count - 1) % count;
    const std::string number = std::to_string(i + 1);
    const Quaternion frame = hinge_about(axes[i]);
    const int held =
        gltf.node("corner_" + number + "_eye", {corners[i] + origin - centres[before], frame}, nodes[before]);
    const int carried = gltf.node("corner_" + number, {corners[i] + origin - centres[i], frame}, nodes[i]);
    // A joint's own node is on a body that moves.
    if (i == count - 1) {
      gltf.joint(held, carried, hinge);
    } else {
      gltf.joint(carried, held, hinge);
    }
  }
  gltf.expect_constant_energy(0.5, "nothing drives it, and hinges take nothing");
  return gltf.text();
}

std::string four_bar() {
  constexpr int cells = 4;
  constexpr double length = 1;
  constexpr double width = 0.04;
  constexpr double height = 1.35;     // of the bearings
  constexpr double leaning = pi / 6;  // of the cranks from the upright
  constexpr std::array finishes{finish::terracotta, finish::mustard, finish::teal, finish::blue,
                                finish::cherry};

  GltfBuilder gltf("four_bar", 4);
  gltf.poster(0.75);
  set_view(gltf, {2.0, 2.1, 6.6}, {2.0, 1.30, 0}, 0.56);

  Mesh stand;
  stand.add(rounded(box({cells * length + 0.3, 0.08, 0.08}), 0.015), at(cells * length / 2, height, -0.16));
  for (const int i : {0, cells}) stand.add(foot(height, 0.07, {i * length, 0, -0.16}));
  add_scenery(gltf, "stand", stand, finish::iron);

  const auto [sine, cosine] = sine_cosine(leaning);
  const Vector3 inertia = box_inertia(1, {length, width, width});
  const int hinge = gltf.hinge();
  const int crank_look = gltf.geometry(bar({0, -length / 2, 0}, {0, length / 2, 0}, width));
  const int crank_pins = gltf.geometry(Mesh()
                                           .add(pin({0, -length / 2, -0.06}, 2, 0.22, 0.018))
                                           .add(pin({0, length / 2, 0.03}, 2, 0.14, 0.018)));
  const int coupler_look = gltf.geometry(bar({-length / 2, 0, 0.05}, {length / 2, 0, 0.05}, width));
  const int brass = gltf.material(finish::brass);
  std::array<int, cells + 1> cranks{};
  const int bearings = gltf.node("bearings", at(0, height, 0));
  for (int i = 0; i <= cells; ++i) {
    const std::string name = "crank_" + std::to_string(i);
    const Vector3 centre(i * length + sine * length / 2, height + cosine * length / 2, 0);
    cranks[i] = gltf.node(name, {centre, turn(Vector3::UnitZ(), -leaning).orientation});
    gltf.motion(cranks[i], {.mass = 1, .inertia = Vector3(inertia.y(), inertia.x(), inertia.z())});
    gltf.show(cranks[i], gltf.mesh(name, {{crank_look, gltf.material(finishes[i])}, {crank_pins, brass}}));
    const int bearing = gltf.node(name + "_bearing", at(i * length, 0, 0), bearings);
    gltf.joint(gltf.node(name + "_axle", at(0, -length / 2, 0), cranks[i]), bearing, hinge);
  }
  for (int i = 0; i < cells; ++i) {
    const std::string name = "coupler_" + std::to_string(i + 1);
    const int coupler = gltf.node(name, at((i + 0.5 + sine) * length, height + cosine * length, 0));
    gltf.motion(coupler, {.mass = 1, .inertia = inertia});
    gltf.show(coupler, gltf.mesh(name, {{coupler_look, gltf.material(finish::ivory)}}));
    for (const int side : {0, 1}) {
      const std::string end = name + (side == 0 ? "_left" : "_right");
      const int held = gltf.node(end + "_pin", at(0, length / 2, 0), cranks[i + side]);
      gltf.joint(gltf.node(end, at((side - 0.5) * length, 0, 0), coupler), held, hinge);
    }
  }
  // All cranks turn as one: a pendulum that swings by 150° from its lowest place.
  const double moment = (cells + 1) * (inertia.z() + 0.25 * length * length) + cells * length * length;
  const double period = pendulum_period(moment, (cells + 1) * 0.5 + cells, 9.81, length, pi - leaning);
  gltf.expect_crossing({"period", "angular_velocity", {"crank_0"}, Vector3::UnitZ()}, 2, period,
                       0.02 * period, "all cranks turn as one pendulum: T = 4 √(I/(w l)) K(sin 75°)");
  return gltf.text();
}

std::string governor() {
  // The benchmark's: bars of 1 m, 0.01 m square, and a cube of 0.1 m, of 3000 kg/m³; 5 kg at each arm's end,
  // here as balls.
  constexpr double length = 1;
  constexpr double bar_mass = 0.3;
  constexpr double slider_mass = 3;
  constexpr double ball_mass = 5;
  constexpr double ball_radius = 0.075;
  constexpr double half = 0.5;     // from the top to where a spring holds an arm; a spring's length
  constexpr double base = 0.55;    // of the shaft
  constexpr double rate = 2 * pi;  // rad/s
  constexpr double arm_mass = bar_mass + ball_mass;
  constexpr double centre = (bar_mass * length / 2 + ball_mass * length) / arm_mass;  // from the top
  const auto [sine, cosine] = sine_cosine(pi / 6);

  GltfBuilder gltf("governor", 4);
  gltf.poster(0.5);
  set_view(gltf, {1.5, 1.75, 2.9}, {0, 1.02, 0}, 0.56);
  add_scenery(gltf, "stand", foot(base, 0.12, {0, 0, 0}), finish::iron);

  const Vector3 thin = box_inertia(bar_mass, {0.01, length, 0.01});
  const int shaft = gltf.node("shaft", at(0, base + length / 2, 0));
  gltf.motion(shaft, {.mass = bar_mass, .inertia = thin, .angular_velocity = {0, rate, 0}});
  const int shaft_look = gltf.geometry(rod(length + 0.06, 0.016, 0.004));
  gltf.show(shaft, gltf.mesh("shaft", {{shaft_look, gltf.material(finish::steel)}}));
  const Quaternion upright = hinge_about(1);
  const int bearing = gltf.node("bearing", {Vector3(0, base, 0), upright});
  const int hinge = gltf.hinge();
  gltf.joint(gltf.node("shaft_foot", {Vector3(0, -length / 2, 0), upright}, shaft), bearing, hinge);

  const int slider = gltf.node("slider", at(0, base + length - 2 * half * cosine, 0));
  gltf.motion(slider, {.mass = slider_mass,
                       .inertia = box_inertia(slider_mass, Vector3::Constant(0.1)),
                       .angular_velocity = {0, rate, 0}});
  const int slider_look = gltf.geometry(rounded(box(Vector3::Constant(0.1)), 0.012));
  gltf.show(slider, gltf.mesh("slider", {{slider_look, gltf.material(finish::mustard)}}));
  const int slides = gltf.joint_description({locked(linear, {0, 2}), locked(angular, {0, 1, 2})});
  gltf.joint(gltf.node("sleeve", {}, slider), gltf.node("guide", {}, shaft), slides);

  const int spring = gltf.joint_description(
      {{.kind = linear, .axes = {0, 1, 2}, .min = half, .max = half, .stiffness = 8e5, .damping = 4e4}});
  const double of_ball = 0.4 * ball_mass * ball_radius * ball_radius;
  const double across = thin.x() + bar_mass * (centre - length / 2) * (centre - length / 2) + of_ball +
                        ball_mass * (length - centre) * (length - centre);
  const int arm_look = gltf.geometry(bar({0, centre, 0}, {0, centre - length, 0}, 0.022));
  const int ball_look = gltf.geometry(Mesh().add(ball(ball_radius, 32), at(0, centre - length, 0)));
  for (const int side : {-1, 1}) {
    const std::string name = side < 0 ? "left" : "right";
    const Quaternion leaning = turn(Vector3::UnitZ(), side * pi / 6).orientation;
    const Vector3 along(side * sine, -cosine, 0);
    const int arm = gltf.node(name + "_arm", {Vector3(0, base + length, 0) + centre * along, leaning});
    // Velocities are in the node's space: the arm goes round with the shaft.
    const Quaternion back = turn(Vector3::UnitZ(), -side * pi / 6).orientation;
    gltf.motion(arm, {.mass = arm_mass,
                      .inertia = Vector3(across, thin.y() + of_ball, across),
                      .linear_velocity = back * Vector3(0, 0, -rate * side * centre * sine),
                      .angular_velocity = back * Vector3(0, rate, 0)});
    gltf.show(arm, gltf.mesh(name + "_arm", {{arm_look, gltf.material(finish::terracotta)},
                                             {ball_look, gltf.material(finish::brass)}}));
    const int top = gltf.node(name + "_top", at(0, length / 2, 0), shaft);
    gltf.joint(gltf.node(name + "_hinge", {Vector3(0, centre, 0), back}, arm), top, hinge);
    const int low = gltf.node(name + "_spring_foot", {}, slider);
    gltf.joint(gltf.node(name + "_spring", at(0, centre - half, 0), arm), low, spring);
  }
  gltf.expect_at({"slider: height at 2 s", "position", {"slider"}, Vector3::UnitY()}, 2, 0.684838792523, 0.01,
                 "Lagrange's equations of the shaft's and the arms' angles and the slider's height");
  return gltf.text();
}

}  // namespace substep::scenes
