/// Scenes of joints alone, and of no constraint at all: nothing in them collides.

#include <cmath>
#include <numbers>

#include "closed_forms.h"
#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "stage.h"

namespace substep::scenes {
namespace {

/// Returns the principal moments of a uniform rod along X: a thin rod's m L²/12 across it, and a cylinder's m
/// r²/2 about its axis, so that none is 0.
Vector3 rod_inertia(double mass, double length, double radius) {
  const double across = mass * length * length / 12;
  return {mass * radius * radius / 2, across, across};
}

/// Draws a rod along X, with a ball round the joint at the −X end. `size` scales all but the length.
Mesh rod_shaft(double length, double size) {
  // A bead near each end, as a turner would leave it.
  const double half = length / 2;
  const double r = 0.028 * size;
  const double bead = 0.037 * size;
  const double b = half - 0.075 * size;
  const double w = 0.011 * size;
  const double f = 0.004 * size;
  const std::array<ProfilePoint, 12> profile{{{0, -half},
                                              {r, -half},
                                              {r, -b - w},
                                              {bead, -b - w, f},
                                              {bead, -b + w, f},
                                              {r, -b + w},
                                              {r, b - w},
                                              {bead, b - w, f},
                                              {bead, b + w, f},
                                              {r, b + w},
                                              {r, half, r},
                                              {0, half}}};
  // Turned about Y; the Y axis goes to X.
  return Mesh().add(turned(profile, 20), turn(Vector3::UnitZ(), -std::numbers::pi / 2));
}

/// A post behind the plane of motion, its foot on the ground, with a pin that carries the pivot.
/// Returns the node of the pivot, at (0, height, 0).
int add_post(GltfBuilder& gltf, double height, double size) {
  const double depth = 0.30 * size;
  const double r = 0.026 * size;
  const double foot = 0.26 * size;
  const double top = height + 0.10 * size;
  const std::array<ProfilePoint, 10> column{{{0, 0},
                                             {foot, 0, 0.01 * size},
                                             {foot, 0.05 * size, 0.02 * size},
                                             {0.06 * size, 0.065 * size, 0.03 * size},
                                             {r, 0.17 * size, 0.10 * size},
                                             {r, top, 0.006 * size},
                                             {0.042 * size, top, 0.004 * size},
                                             {0.042 * size, top + 0.025 * size, 0.008 * size},
                                             {0.015 * size, top + 0.045 * size, 0.015 * size},
                                             {0, top + 0.045 * size}}};
  const std::array<ProfilePoint, 8> pin{{{0, -depth},
                                         {0.024 * size, -depth},
                                         {0.024 * size, 0.035 * size, 0.004 * size},
                                         {0.040 * size, 0.035 * size, 0.004 * size},
                                         {0.040 * size, 0.060 * size, 0.008 * size},
                                         {0.016 * size, 0.060 * size},
                                         {0.016 * size, 0.075 * size, 0.006 * size},
                                         {0, 0.075 * size}}};
  Mesh fittings;
  fittings.add(turned(pin, 24), at(0, height, 0) * turn(Vector3::UnitX(), std::numbers::pi / 2));
  fittings.add(rod(0.12 * size, 0.042 * size, 0.008 * size), at(0, height, -depth));
  const int post = gltf.node("post");
  gltf.show(post, gltf.mesh("post", {{gltf.geometry(Mesh().add(turned(column, 32), at(0, 0, -depth))),
                                      gltf.material(finish::iron)},
                                     {gltf.geometry(fittings), gltf.material(finish::brass)}}));
  return gltf.node("pivot", at(0, height, 0), post);
}

/// Puts a joint on a body's X axis, and joins what `connected_node` is on.
void add_joint(GltfBuilder& gltf, std::string_view name, int body, double x, int connected_node, int joint) {
  gltf.joint(gltf.node(name, at(x, 0, 0), body), connected_node, joint);
}

}  // namespace

std::string rod_chain() {
  constexpr double length = 0.5;
  constexpr double height = 2;
  constexpr std::array finishes{finish::terracotta, finish::ivory, finish::teal};

  GltfBuilder gltf("rod_chain", 5);
  set_view(gltf, {0.75, 1.6, 4.5}, {0, 1.22, 0}, 0.56);

  const int shaft = gltf.geometry(rod_shaft(length, 1));
  const int joint_ball = gltf.geometry(Mesh().add(ball(0.056, 28), at(-length / 2, 0, 0)));
  const int tip = gltf.geometry(
      Mesh().add(ball(0.056, 28), at(-length / 2, 0, 0)).add(ball(0.046, 28), at(length / 2, 0, 0)));
  const int joint = gltf.ball_joint();
  int connected = add_post(gltf, height, 1);
  for (int i = 0; i < 3; ++i) {
    const std::string number = std::to_string(i + 1);
    const int body = gltf.node("rod_" + number, at(length * (i + 0.5), height, 0));
    gltf.motion(body, {.mass = 1, .inertia = rod_inertia(1, length, 0.02)});
    gltf.show(body, gltf.mesh("rod_" + number, {{shaft, gltf.material(finishes[i])},
                                                {i == 2 ? tip : joint_ball, gltf.material(finish::brass)}}));
    add_joint(gltf, "joint_" + number, body, -length / 2, connected, joint);
    connected = gltf.node("end_" + number, at(length / 2, 0, 0), body);
  }

  gltf.expect_constant_energy(
      1, "nothing drives the chain, and its joints take nothing: 22 J are what a fall is worth");
  gltf.expect({.name = "way out of the plane z = 0",
               .quantity = "way",
               .direction = Vector3::UnitZ(),
               .value = 0,
               .tolerance = 1e-6,
               .source = "it starts in that plane, in which all forces are"});
  return gltf.text();
}

std::string pendulum() {
  constexpr double length = 1;
  constexpr double height = 1.4;

  GltfBuilder gltf("pendulum", 5);
  set_view(gltf, {0.5, 1.05, 3.0}, {0, 0.80, 0}, 0.56);

  const int body = gltf.node("rod", at(length / 2, height, 0));
  gltf.motion(body, {.mass = 1, .inertia = rod_inertia(1, length, 0.02)});
  // The hinge's eye, seen along its axis.
  const std::array<ProfilePoint, 4> ring{
      {{0.022, -0.03, 0.004}, {0.05, -0.03, 0.008}, {0.05, 0.03, 0.008}, {0.022, 0.03, 0.004}}};
  Mesh fittings;
  fittings.add(turned(ring, 32, true), at(-length / 2, 0, 0) * turn(Vector3::UnitX(), std::numbers::pi / 2));
  fittings.add(ball(0.046, 28), at(length / 2, 0, 0));
  const Mesh shaft = Mesh().add(rod(length - 0.04, 0.026, 0.004),
                                at(0.02, 0, 0) * turn(Vector3::UnitZ(), -std::numbers::pi / 2));
  gltf.show(body, gltf.mesh("rod", {{gltf.geometry(shaft), gltf.material(finish::cherry)},
                                    {gltf.geometry(fittings), gltf.material(finish::brass)}}));
  add_joint(gltf, "hinge", body, -length / 2, add_post(gltf, height, 0.8), gltf.hinge());

  const double moment = length * length / 3;
  const double period = pendulum_period(moment, 1, 9.81, length / 2, std::numbers::pi / 2);
  gltf.expect_crossing({"time of two and a half swings", "angular_velocity", {"rod"}, Vector3::UnitZ()}, 5,
                       2.5 * period, 0.02 * 2.5 * period, "T = 4 √(2 L/3 g) K(sin 45°)");
  gltf.expect_constant_energy(
      0.25, "nothing drives it, and its hinge takes nothing: a fall is worth m g L/2 = 4.9 J");
  return gltf.text();
}

std::string heavy_chain() {
  constexpr double length = 0.5;
  constexpr int rods = 10;
  constexpr double radius = 0.25;
  constexpr double height = 6.2;
  constexpr std::array finishes{finish::terracotta, finish::ivory};

  GltfBuilder gltf("heavy_chain", 5);
  gltf.poster(0.4);
  set_view(gltf, {1.6, 3.5, 12.4}, {0, 3.15, 0}, 0.56);

  const int pivot = add_post(gltf, height, 1.8);
  // X of this frame is the chain's direction: down, turned 30° about Z towards +X.
  const int frame = gltf.node(
      "chain", at(0, height, 0) * turn(Vector3::UnitZ(), -std::numbers::pi / 2 + std::numbers::pi / 6));

  const int shaft = gltf.geometry(rod_shaft(length, 1.6));
  const int joint_ball = gltf.geometry(Mesh().add(ball(0.065, 24), at(-length / 2, 0, 0)));
  const int joint = gltf.ball_joint();
  std::array<int, 2> looks{};
  for (int i = 0; i < 2; ++i) {
    looks[i] = gltf.mesh(i == 0 ? "rod_odd" : "rod_even",
                         {{shaft, gltf.material(finishes[i])}, {joint_ball, gltf.material(finish::brass)}});
  }
  int connected = pivot;
  for (int i = 0; i < rods; ++i) {
    const std::string number = std::to_string(i + 1);
    const int body = gltf.node("rod_" + number, at(length * (i + 0.5), 0, 0), frame);
    gltf.motion(body, {.mass = 1, .inertia = rod_inertia(1, length, 0.02)});
    gltf.show(body, looks[i % 2]);
    add_joint(gltf, "joint_" + number, body, -length / 2, connected, joint);
    connected = gltf.node("end_" + number, at(length / 2, 0, 0), body);
  }

  constexpr double mass = 1000;
  const int heavy = gltf.node("ball", at(rods * length + radius, 0, 0), frame);
  gltf.motion(heavy, {.mass = mass, .inertia = Vector3::Constant(0.4 * mass * radius * radius)});
  // An equator and a shackle, so that the ball's turning can be seen.
  const std::array<ProfilePoint, 4> belt{{{radius * 0.9, -0.03, 0.004},
                                          {radius * 1.02, -0.03, 0.012},
                                          {radius * 1.02, 0.03, 0.012},
                                          {radius * 0.9, 0.03, 0.004}}};
  const std::array<ProfilePoint, 6> shackle{
      {{0, 0}, {0.10, 0}, {0.10, 0.05, 0.02}, {0.05, 0.06, 0.02}, {0.04, 0.10, 0.02}, {0, 0.10}}};
  const Pose across =
      turn(Vector3::UnitZ(), std::numbers::pi / 2);  // Y of the turned pieces to −X, the chain
  Mesh fittings;
  fittings.add(turned(belt, 40, true), across);
  fittings.add(turned(shackle, 24), across * at(0, 0.20, 0));
  fittings.add(ball(0.065, 24), at(-radius, 0, 0));
  gltf.show(heavy, gltf.mesh("ball", {{gltf.geometry(ball(radius, 40)), gltf.material(finish::iron)},
                                      {gltf.geometry(fittings), gltf.material(finish::brass)}}));
  add_joint(gltf, "joint_" + std::to_string(rods + 1), heavy, -radius, connected, joint);

  gltf.expect_constant_energy(
      350, "nothing drives the chain, and its joints take nothing: 7 kJ are what its swing is worth");
  return gltf.text();
}

std::string tumbling_body() {
  GltfBuilder gltf("tumbling_body", 10, Vector3::Zero());
  gltf.camera({1.25, 1.45, 1.55}, {0, 0.86, 0}, 0.56);
  gltf.sun({-0.35, -1, -0.3}, warm_white, daylight);

  // A plinth to float above.
  const std::array<ProfilePoint, 10> plinth{{{0, 0},
                                             {0.40, 0, 0.01},
                                             {0.40, 0.07, 0.015},
                                             {0.35, 0.09, 0.02},
                                             {0.31, 0.14, 0.04},
                                             {0.31, 0.34, 0.04},
                                             {0.35, 0.39, 0.02},
                                             {0.38, 0.41, 0.01},
                                             {0.38, 0.46, 0.015},
                                             {0, 0.46}}};
  gltf.show(gltf.node("plinth"),
            gltf.mesh("plinth", {{gltf.geometry(turned(plinth, 64)), gltf.material(finish::limestone)}}));

  // Moments of a block of half-sizes 0.1, 0.2, 0.3 m; a T-handle within the same box has them in the same
  // order.
  const int body = gltf.node("handle", at(0, 1, 0));
  gltf.motion(
      body,
      {.mass = 1, .inertia = Vector3(0.13 / 3, 0.10 / 3, 0.05 / 3), .angular_velocity = {0.05, 5, 0.05}});
  const Pose along_z = turn(Vector3::UnitX(), std::numbers::pi / 2);  // Y of the turned pieces to +Z
  constexpr double bar = 0.08;                                        // height of the cross-bar
  const std::array<ProfilePoint, 6> grip{{{0, 0.07},
                                          {0.038, 0.07, 0.01},
                                          {0.038, 0.12, 0.04},
                                          {0.062, 0.24, 0.06},
                                          {0.062, 0.30, 0.05},
                                          {0, 0.30}}};
  const std::array<ProfilePoint, 10> stem{{{0, -0.20},
                                           {0.045, -0.20, 0.012},
                                           {0.045, -0.15, 0.012},
                                           {0.026, -0.14, 0.01},
                                           {0.026, -0.02, 0.03},
                                           {0.040, 0.02, 0.03},
                                           {0.058, bar - 0.045, 0.02},
                                           {0.058, bar + 0.045, 0.02},
                                           {0.030, bar + 0.07, 0.02},
                                           {0, bar + 0.07}}};
  const Mesh axle = Mesh().add(rod(0.16, 0.034, 0.004), at(0, bar, 0) * along_z);
  const Mesh front = Mesh().add(turned(grip, 28), at(0, bar, 0) * along_z);
  const Mesh back =
      Mesh().add(turned(grip, 28), at(0, bar, 0) * turn(Vector3::UnitX(), -std::numbers::pi / 2));
  gltf.show(body, gltf.mesh("handle", {{gltf.geometry(turned(stem, 28)), gltf.material(finish::brass)},
                                       {gltf.geometry(axle), gltf.material(finish::steel)},
                                       {gltf.geometry(front), gltf.material(finish::terracotta)},
                                       {gltf.geometry(back), gltf.material(finish::ivory)}}));

  const std::vector<double> times =
      turnovers(Vector3(0.13 / 3, 0.10 / 3, 0.05 / 3), Vector3(0.05, 5, 0.05), 10);
  for (std::size_t i = 0; i < times.size(); ++i) {
    gltf.expect(
        {.name = "time of turning over " + std::to_string(i + 1),
         .quantity = "angular_velocity",
         .bodies = {"handle"},
         .direction = Vector3::UnitY(),
         .in_node = true,
         .crossing = static_cast<int>(i) + 1,
         .value = times[i],
         .tolerance = 0.1,
         .source = "Euler's equations: the angular velocity about the handle's own Y changes its sign"});
  }
  gltf.expect_constant_energy(0.02, "no force acts; the energy is 0.41674 J");
  gltf.expect({.name = "largest change of angular momentum",
               .quantity = "angular_momentum_change",
               .value = 0,
               .tolerance = 0.002,
               .source = "no moment acts; the angular momentum is 0.1667 N·m·s"});
  return gltf.text();
}

}  // namespace substep::scenes
