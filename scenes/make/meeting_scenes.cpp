/// Scenes of near misses, seams and fast impacts, each with a closed form.

#include <array>
#include <numbers>
#include <string>
#include <vector>

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "stage.h"

namespace substep::scenes {
namespace {

constexpr double radius = 0.05;  // m, of all balls

/// Adds a ball of `shape` at a pose that moves along its node's +X at `speed`, m/s.
void add_ball(GltfBuilder& gltf, const std::string& name, const Pose& pose, double speed, int shape, int mesh,
              int material, double rate = 0) {
  const int body = gltf.node(name, pose);
  gltf.motion(body, {.mass = 1, .linear_velocity = {speed, 0, 0}, .angular_velocity = {0, 0, rate}});
  gltf.collider(body, shape, material);
  gltf.show(body, mesh);
}

}  // namespace

std::string near_miss() {
  constexpr double duration = 1;
  constexpr std::array<double, 4> passes{0.17, 0.37, 0.58, 0.79};  // s
  constexpr double post_radius = 0.04;
  constexpr double post_height = 0.2;
  const double corner = post_height / 4 * std::numbers::sqrt2;  // of a square post, from its axis

  GltfBuilder gltf("near_miss", duration);
  gltf.poster(0.4);
  set_view(gltf, {0.4, 3.6, 4.6}, {0, -0.05, 0.1}, 0.42);
  const int bouncing = gltf.bouncing_material(0.9);
  gltf.collider(gltf.node("ground"), gltf.plane_shape(), bouncing);

  const int round = gltf.sphere_shape(radius);
  const int ball_geometry = gltf.geometry(ball(radius));
  const int cylinder = gltf.cylinder_shape(post_radius, post_height);
  const int square = gltf.box_shape({post_height / 2, post_height, post_height / 2});
  const int steel = gltf.material(finish::steel);
  const int pin = gltf.mesh("pin", {{gltf.geometry(rod(post_height, post_radius, 0.006)), steel}});
  const int stake_geometry =
      gltf.geometry(rounded(box({post_height / 2, post_height, post_height / 2}), 0.004));
  const int stake = gltf.mesh("stake", {{stake_geometry, gltf.material(finish::walnut)}});

  struct Lane {
    double speed;         // m/s
    double clearance;     // m, of its posts
    double angle;         // rad, from +X
    double z;             // m
    double oncoming = 0;  // m/s, of a second ball that passes at the same clearance
    Finish finish;
  };
  const std::array<Lane, 5> lanes{{{1, 0.005, 0.05, 1.1, 0, finish::terracotta},
                                   {2, 0.008, -0.04, 0.65, 3.5, finish::mustard},
                                   {3, 0.012, 0.03, 0.2, 5, finish::teal},
                                   {4.5, 0.016, -0.05, -0.35, 0, finish::blue},
                                   {6, 0.02, 0.04, -0.95, 0, finish::ivory}}};
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const Lane& lane = lanes[i];
    const std::string number = std::to_string(i + 1);
    const Pose middle = at(0, 0, lane.z) * turn(Vector3::UnitY(), lane.angle);
    const int look = gltf.mesh("ball_" + number, {{ball_geometry, gltf.material(lane.finish)}});
    const double start = -lane.speed * duration / 2;

    // Place the posts: pins and corners of stakes, on both sides unless a ball comes there.
    for (std::size_t k = 0; k < passes.size(); ++k) {
      const bool is_pin = (i + k) % 2 == 0;
      const double side = lane.oncoming > 0 || k < 2 ? 1 : -1;
      const double z = side * (radius + lane.clearance + (is_pin ? post_radius : corner));
      const Pose upright = middle * at(start + lane.speed * passes[k], post_height / 2, z);
      const int post = gltf.node("post_" + number + "_" + std::to_string(k + 1),
                                 is_pin ? upright : upright * turn(Vector3::UnitY(), pi / 4));
      gltf.collider(post, is_pin ? cylinder : square, bouncing);
      gltf.show(post, is_pin ? pin : stake);
    }

    // Send the balls, the second one backwards.
    const auto send = [&](const std::string& name, const Pose& pose, double speed) {
      add_ball(gltf, name, pose, speed, round, look, bouncing);
      const Matrix3 axes = pose.orientation.toRotationMatrix();
      gltf.expect_throughout({name + ": velocity along its line", "velocity", {name}, axes.col(0)},
                             {0, duration}, speed, 1e-6 * speed, "nothing is met");
      gltf.expect_throughout({name + ": way across its line", "way", {name}, axes.col(2)}, {0, duration}, 0,
                             1e-6, "nothing is met");
    };
    send("ball_" + number, middle * at(start, radius, 0), lane.speed);
    if (lane.oncoming > 0) {
      const double beside = -2 * radius - lane.clearance;
      send("oncoming_" + number,
           middle * at(lane.oncoming * duration / 2, radius, beside) * turn(Vector3::UnitY(), pi),
           lane.oncoming);
    }
  }
  return gltf.text();
}

std::string seams() {
  constexpr double duration = 2;
  constexpr double tile = 0.25;
  constexpr double thickness = 0.1;
  constexpr double pitch = 0.3;
  constexpr int tiles = 20;
  constexpr std::array<double, 3> speeds{0.5, 1, 2};
  const Vector3 block(0.16, 0.1, 0.1);
  const Pose row = turn(Vector3::UnitY(), 0.35);
  const Matrix3 axes = row.orientation.toRotationMatrix();

  GltfBuilder gltf("seams", duration);
  gltf.poster(1.6);
  set_view(gltf, {1.5, 3.2, 4.9}, {0, 0, 0}, 0.62);
  add_ground(gltf, 0.5);
  const int grip = gltf.physics_material(0.5);
  const int smooth = gltf.physics_material(0);
  const double width = 9 * pitch;
  for (int i = 0; i < tiles; ++i) {
    const double x = tile * (i - (tiles - 1) / 2.0);
    add_fixed_box(gltf, "tile_" + std::to_string(i + 1), {tile, thickness, width},
                  row * at(x, thickness / 2, 0), grip, i % 2 == 0 ? finish::maple : finish::oak, 0.002);
  }

  const int shapes[]{gltf.box_shape(block), gltf.sphere_shape(radius), gltf.cylinder_shape(radius, 0.12)};
  const Pose stands[]{at(0, block.y() / 2, 0), at(0, radius, 0),
                      at(0, radius, 0) * turn(Vector3::UnitX(), pi / 2)};
  const int geometries[]{gltf.geometry(rounded(box(block), 0.004)), gltf.geometry(ball(radius)),
                         gltf.geometry(rod(0.12, radius, 0.004))};
  const Finish finishes[]{finish::terracotta, finish::ivory, finish::teal};
  const char* const names[]{"box", "ball", "cylinder"};
  std::vector<std::string> bodies;
  for (int kind = 0; kind < 3; ++kind) {
    const int look = gltf.mesh(names[kind], {{geometries[kind], gltf.material(finishes[kind])}});
    for (int i = 0; i < 3; ++i) {
      const double speed = speeds[i];
      const std::string name = std::string(names[kind]) + "_" + std::to_string(i + 1);
      const double z = pitch * (3 * kind + i - 4);
      const int body = gltf.node(name, row * at(-speed * duration / 2, thickness, z) * stands[kind]);
      // The cylinder's own −Y is the row's −Z, about which it rolls.
      const double rate = speed / radius;
      gltf.motion(body, {.mass = 1,
                         .linear_velocity = {speed, 0, 0},
                         .angular_velocity = kind == 1   ? Vector3(0, 0, -rate)
                                             : kind == 2 ? Vector3(0, -rate, 0)
                                                         : Vector3(0, 0, 0)});
      gltf.collider(body, shapes[kind], kind == 0 ? smooth : grip);
      gltf.show(body, look);
      bodies.push_back(name);
      gltf.expect_at({name + ": way along the row", "way", {name}, axes.col(0)}, duration, speed * duration,
                     0.002 * speed * duration, kind == 0 ? "no friction: v t" : "rolling does not slip: v t");
    }
  }
  gltf.expect_throughout({"way up, of all", "way", bodies, Vector3::UnitY()}, {0, duration}, 0, 1e-4,
                         "the boxes are flush");
  gltf.expect_throughout({"way across the row, of all", "way", bodies, axes.col(2)}, {0, duration}, 0, 1e-4,
                         "nothing pushes across");
  return gltf.text();
}

std::string struck() {
  constexpr double duration = 0.4;
  constexpr double speed = 8;
  constexpr double gap = 0.003;
  constexpr double run_up = 0.5;
  constexpr double thickness = 0.01;
  constexpr double pitch = 2 * radius + gap;
  const Pose line = turn(Vector3::UnitY(), 0.2);
  const Vector3 along = line.orientation.toRotationMatrix().col(0);

  GltfBuilder gltf("struck", duration);
  gltf.poster(0.1);
  set_view(gltf, {0.5, 2.2, 3.4}, {0.1, 0, 0}, 0.36);
  gltf.collider(gltf.node("ground"), gltf.plane_shape(), gltf.bouncing_material(0));
  const int round = gltf.sphere_shape(radius);
  const int geometry = gltf.geometry(ball(radius));
  const int striking = gltf.mesh("striker", {{geometry, gltf.material(finish::terracotta)}});
  const int hit = gltf.mesh("ball", {{geometry, gltf.material(finish::steel)}});

  // The row: each ball hands its speed on to the next.
  const int elastic = gltf.bouncing_material(1);
  add_ball(gltf, "striker", line * at(-run_up - 2 * radius, radius, 0.6), speed, round, striking, elastic);
  std::vector<std::string> stopped{"striker"};
  for (int i = 0; i < 5; ++i) {
    const std::string name = "ball_" + std::to_string(i + 1);
    add_ball(gltf, name, line * at(i * pitch, radius, 0.6), 0, round, hit, elastic);
    if (i < 4) stopped.push_back(name);
  }
  const std::string_view hands_on = "equal masses, restitution 1: each takes all the speed of the one before";
  gltf.expect_at({"ball_5: way at 0.4 s", "way", {"ball_5"}, along}, duration,
                 speed * duration - run_up - 4 * gap, gap, hands_on);
  gltf.expect_at({"ball_5: speed at 0.4 s", "velocity", {"ball_5"}, along}, duration, speed, 0.01 * speed,
                 hands_on);
  gltf.expect({.name = "speed of the others at 0.4 s",
               .quantity = "speed",
               .bodies = stopped,
               .at = duration,
               .value = 0,
               .tolerance = 0.01 * speed,
               .source = hands_on});

  // Balls before a wall, by restitution: the velocities at the end follow from one impact after another.
  struct Lane {
    const char* name;
    double restitution;
    double striker;  // of `speed`, at the end
    double ball;
  };
  for (const Lane& lane :
       {Lane{"elastic", 1, -1, 0}, Lane{"half", 0.5, -7.0 / 32, -3.0 / 64}, Lane{"plastic", 0, 0, 0}}) {
    const std::string name = lane.name;
    const double z = lane.restitution == 1 ? 0.2 : lane.restitution == 0 ? -0.6 : -0.2;
    const int material = gltf.bouncing_material(lane.restitution);
    add_fixed_box(gltf, name + "_wall", {thickness, 0.2, 0.3},
                  line * at(radius + gap + thickness / 2, 0.1, z), material, finish::walnut, 0.002);
    add_ball(gltf, name + "_striker", line * at(-run_up - 2 * radius, radius, z), speed, round, striking,
             material);
    add_ball(gltf, name + "_ball", line * at(0, radius, z), 0, round, hit, material);
    const std::string_view source = "one impact after another, each with its restitution";
    const auto expect_velocity = [&](const std::string& body, double value) {
      gltf.expect_at({body + ": velocity at 0.4 s", "velocity", {body}, along}, duration, value, 0.01 * speed,
                     source);
    };
    expect_velocity(name + "_striker", lane.striker * speed);
    expect_velocity(name + "_ball", lane.ball * speed);
    gltf.expect({.name = name + "_ball: furthest way",
                 .quantity = "way",
                 .bodies = {name + "_ball"},
                 .direction = along,
                 .during = {{0, duration}},
                 .at_most = gap,
                 .tolerance = 0.01 * thickness,
                 .source = "there the wall begins"});
  }
  return gltf.text();
}

}  // namespace substep::scenes
