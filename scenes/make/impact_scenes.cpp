/// Scenes of impacts: balls that bounce, balls that hand on what they are hit with.

#include <cmath>

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/math/rotation.h"
#include "stage.h"

namespace substep::scenes {

std::string bouncing_balls() {
  constexpr double radius = 0.15;
  constexpr double drop = 1;
  constexpr double pitch = 0.5;
  constexpr std::array finishes{finish::rubber, finish::blue, finish::teal, finish::mustard,
                                finish::terracotta};

  GltfBuilder gltf("bouncing_balls", 4);
  set_view(gltf, {0.7, 1.15, 3.9}, {0, 0.66, 0}, 0.46);
  const int plane = gltf.plane_shape();
  gltf.collider(gltf.node("ground"), plane, gltf.bouncing_material(0));

  const int shape = gltf.sphere_shape(radius);
  const int round = gltf.geometry(ball(radius, 40));
  // Where the lowest point of each ball should come to after its first bounce: drawn only.
  const std::array<ProfilePoint, 6> foot{
      {{0, 0}, {0.10, 0, 0.01}, {0.10, 0.03, 0.01}, {0.014, 0.04, 0.01}, {0.014, 1.4, 0.01}, {0, 1.4}}};
  const std::array<ProfilePoint, 4> collar{
      {{0.012, -0.012, 0.004}, {0.035, -0.012, 0.004}, {0.035, 0.012, 0.004}, {0.012, 0.012, 0.004}}};
  const int post = gltf.geometry(turned(foot, 28));
  const int mark = gltf.geometry(turned(collar, 28, true));
  const int post_look = gltf.mesh("post", {{post, gltf.material(finish::iron)}});
  const int mark_look = gltf.mesh("mark", {{mark, gltf.material(finish::brass)}});
  for (int i = 0; i < 5; ++i) {
    const std::string number = std::to_string(i);
    const double restitution = i / 4.0;
    const double x = pitch * (i - 2);
    const int stand = gltf.node("post_" + number, at(x, 0, -0.3));
    gltf.show(stand, post_look);
    gltf.show(gltf.node("mark_" + number, at(0, restitution * restitution * drop, 0), stand), mark_look);
    const int body = gltf.node("ball_" + number, at(x, drop + radius, 0));
    gltf.motion(body, {.mass = 1});
    gltf.collider(body, shape, gltf.bouncing_material(restitution));
    gltf.show(body, gltf.mesh("ball_" + number, {{round, gltf.material(finishes[i])}}));
  }

  constexpr double gravity = 9.81;
  const double falls = std::sqrt(2 * drop / gravity);  // s
  for (int i = 0; i < 5; ++i) {
    const double restitution = i / 4.0;
    const std::string name = "ball_" + std::to_string(i);
    double height = drop;
    double flight = falls;
    double time = falls;
    for (int bounce = 1; bounce <= 3 && i > 0; ++bounce) {
      height *= restitution * restitution;
      flight *= restitution;
      time += 2 * flight;
      if (time > 4 || height < 0.01) break;
      gltf.expect({.name = name + ": highest centre after impact " + std::to_string(bounce),
                   .quantity = "position",
                   .bodies = {name},
                   .direction = Vector3::UnitY(),
                   .peak = bounce,
                   .value = radius + height,
                   .tolerance = 0.05 * height,
                   .source = "it goes up to e² times the height that it fell from"});
    }
    if (restitution == 1) continue;
    const double rests = falls * (1 + restitution) / (1 - restitution);
    gltf.expect_throughout({name + ": centre once it rests", "position", {name}, Vector3::UnitY()},
                           {rests + 0.1, 4}, radius, 0.01,
                           "infinitely many impacts last √(2 h/g) (1 + e)/(1 − e)");
  }
  return gltf.text();
}

std::string cradle() {
  constexpr double radius = 0.1;
  constexpr double length = 0.7;
  constexpr double height = 0.95;
  constexpr double angle = 0.6;

  GltfBuilder gltf("cradle", 4);
  gltf.poster(0.9667);
  gltf.camera({0.6, 1.45, 5.0}, {0, 0.50, 0}, 0.50);
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
  gltf.expect_constant_energy(0.05 * 2 * gravity * length * (1 - sine_cosine(angle).cosine),
                              "restitution 1 and no friction: nothing is lost");
  return gltf.text();
}

}  // namespace substep::scenes
