/// Scenes that show each kind of joint, and of friction, once.

#include <cmath>
#include <numbers>

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/math/rotation.h"
#include "stage.h"

namespace substep::scenes {
namespace {

/// The frame's two beams carry a row of rigs each; a rig hangs from the point of its joint's node.
class Rigs {
 public:
  explicit Rigs(GltfBuilder& gltf) : gltf_(gltf) {}

  /// A body of 1 kg with the moments of a box. `hold` is the point of the joint in the body's node; it stands
  /// at `start` in the frame of the joint's node, whose place is `frame`.
  struct Piece {
    const char* name;
    Pose frame;
    Pose start = {};
    Vector3 hold = Vector3::Zero();
    Vector3 size;
    Vector3 linear_velocity = Vector3::Zero();
    Vector3 angular_velocity = Vector3::Zero();
  };
  int add(const Piece& piece, const std::vector<GltfBuilder::Part>& look,
          const std::vector<AxesLimit>& limits, const std::vector<AxisDrive>& drives = {}) {
    return add_to({}, piece, look, limits, drives);
  }
  /// Adds a body on another rig's body; `frame` is in its node.
  int add_to(std::optional<int> carrier, const Piece& piece, const std::vector<GltfBuilder::Part>& look,
             const std::vector<AxesLimit>& limits, const std::vector<AxisDrive>& drives = {}) {
    const std::string name = piece.name;
    const int frame = gltf_.node(name + "_frame", piece.frame, carrier);
    const int body =
        gltf_.node(name, piece.start * at(-piece.hold.x(), -piece.hold.y(), -piece.hold.z()), frame);
    gltf_.motion(body, {.mass = 1,
                        .inertia = box_inertia(1, piece.size),
                        .linear_velocity = piece.linear_velocity,
                        .angular_velocity = piece.angular_velocity});
    gltf_.show(body, gltf_.mesh(name, look));
    const int hold = gltf_.node(name + "_hold", at(piece.hold.x(), piece.hold.y(), piece.hold.z()), body);
    const int description = gltf_.joint_description(limits, drives);
    gltf_.joint(frame, hold, description);
    return body;
  }

 private:
  GltfBuilder& gltf_;
};

}  // namespace

std::string joint_kinds() {
  constexpr double pitch = 0.8;
  constexpr double upper = 2.35;
  constexpr double lower = 1.15;
  constexpr double reach = 0.5;  // of arms and ropes
  const auto column = [](int i) { return pitch * (i - 2.5); };

  GltfBuilder gltf("joint_kinds", 4);
  set_view(gltf, {0.7, 1.8, 7.0}, {0, 1.26, 0}, 0.50);

  // Draw the beams and rails of the rigs, without colliders.
  const double half_width = 3 * pitch + 0.3;
  Mesh wood;
  for (const double y : {upper, lower})
    wood.add(rounded(box({2 * half_width + 0.2, 0.1, 0.1}), 0.012), at(0, y + 0.09, 0));
  for (const int side : {-1, 1}) {
    wood.add(rounded(box({0.1, upper + 0.14, 0.1}), 0.012), at(side * half_width, (upper + 0.14) / 2, 0));
    wood.add(rounded(box({0.16, 0.06, 0.7}), 0.012), at(side * half_width, 0.03, 0));
  }
  Mesh metal;
  const auto add_pin = [&](int i, double y) { metal.add(ball(0.04, 20), at(column(i), y, 0)); };
  const auto add_guide = [&](int i, double y) {
    metal.add(rod(0.95, 0.018, 0.004, 20), at(column(i), y - 0.435, 0));
    metal.add(rod(0.03, 0.06, 0.008, 24), at(column(i), y - 0.90, 0));
  };
  for (const int i : {2, 3, 4, 5}) add_pin(i, upper);
  for (const int i : {0, 2, 4}) add_pin(i, lower);
  for (const int i : {0, 1}) add_guide(i, upper);
  for (const int i : {1, 3}) add_guide(i, lower);
  metal.add(rod(0.66, 0.018, 0.004, 20), at(column(5), lower - 0.4, 0) * turn(Vector3::UnitZ(), pi / 2));
  for (const int side : {-1, 1})
    metal.add(rod(0.45, 0.012, 0.004, 16), at(column(5) + side * 0.31, lower - 0.18, 0));
  const int frame_wood = gltf.geometry(wood);
  const int frame_metal = gltf.geometry(metal);
  gltf.show(gltf.node("frame"), gltf.mesh("frame", {{frame_wood, gltf.material(finish::walnut)},
                                                    {frame_metal, gltf.material(finish::iron)}}));

  const Vector3 block_size(0.24, 0.18, 0.24);
  const Vector3 ball_size =
      Vector3::Constant(0.2 * 0.77459666924148338);  // a box as hard to turn as the ball
  const Vector3 arm_size(0.05, reach, 0.05);
  const Vector3 plate_size(0.30, reach, 0.05);
  const int block = gltf.geometry(rounded(box(block_size), 0.02));
  const int bob = gltf.geometry(ball(0.1, 32));
  const int band = gltf.geometry(rod(0.03, 0.1025, 0.008, 32));
  const int arm = gltf.geometry(rounded(box(arm_size), 0.012));
  const int tip = gltf.geometry(Mesh().add(ball(0.055, 24), at(0, -reach / 2, 0)));
  const int plate = gltf.geometry(rounded(box(plate_size), 0.012));
  const std::array<ProfilePoint, 4> ring_profile{
      {{0.125, -0.03, 0.01}, {0.18, -0.03, 0.01}, {0.18, 0.03, 0.01}, {0.125, 0.03, 0.01}}};
  const int ring = gltf.geometry(turned(ring_profile, 40, true));
  const int brass = gltf.material(finish::brass);
  const auto arm_look = [&](const Finish& finish) {
    return std::vector<GltfBuilder::Part>{{arm, gltf.material(finish)}, {tip, brass}};
  };
  const auto bob_look = [&](const Finish& finish) {
    return std::vector<GltfBuilder::Part>{{bob, gltf.material(finish)}, {band, brass}};
  };

  const Vector3 arm_top(0, reach / 2, 0);
  const AxesLimit on_line = locked(linear, {0, 2});
  const AxesLimit point = locked(linear, {0, 1, 2});
  const AxesLimit upright = locked(angular, {0, 1, 2});
  const AxesLimit hinge = locked(angular, {0, 1});
  const Pose lean = turn(Vector3::UnitZ(), 1);
  const Vector3 coned_arm_rate(1, 0, 2);
  Rigs rigs(gltf);

  rigs.add({.name = "stopped_slider", .frame = at(column(0), upper - 0.1, 0), .size = block_size},
           {{block, gltf.material(finish::terracotta)}},
           {on_line, upright, {.kind = linear, .axes = {1}, .min = -0.6, .max = 0}});
  rigs.add(
      {.name = "spring_slider", .frame = at(column(1), upper - 0.1, 0), .size = block_size},
      {{block, gltf.material(finish::mustard)}},
      {on_line, upright, {.kind = linear, .axes = {1}, .min = 0, .max = 0, .stiffness = 30, .damping = 0.5}});
  rigs.add({.name = "roped_ball",
            .frame = at(column(2), upper, 0),
            .start = at(0.25, 0, 0),
            .hold = {0, 0.1, 0},
            .size = ball_size},
           bob_look(finish::teal), {{.kind = linear, .axes = {0, 1, 2}, .max = reach}});
  rigs.add({.name = "distant_ball",
            .frame = at(column(3), upper, 0),
            .start = at(-0.3, -0.4, 0),
            .size = ball_size},
           bob_look(finish::ivory), {{.kind = linear, .axes = {0, 1, 2}, .min = reach, .max = reach}});
  rigs.add({.name = "coned_arm",
            .frame = at(column(4), upper, 0) * lean,
            .hold = arm_top,
            .size = arm_size,
            .linear_velocity = coned_arm_rate.cross(-arm_top),  // it turns about its joint
            .angular_velocity = coned_arm_rate},
           arm_look(finish::blue), {point, {.kind = angular, .axes = {0, 2}, .max = 0.5}});
  rigs.add({.name = "stopped_hinge",
            .frame = at(column(5), upper, 0) * turn(Vector3::UnitZ(), pi / 2),
            .hold = arm_top,
            .size = arm_size},
           arm_look(finish::cherry), {point, hinge, {.kind = angular, .axes = {2}, .min = -2.2, .max = 0}});

  const int lever = rigs.add({.name = "lever",
                              .frame = at(column(0), lower, 0) * turn(Vector3::UnitZ(), 1),
                              .hold = arm_top,
                              .size = arm_size},
                             {{arm, gltf.material(finish::maple)}}, {point, hinge});
  const Vector3 short_size(0.05, 0.3, 0.05);
  const int short_arm = gltf.geometry(rounded(box(short_size), 0.012));
  const int short_tip = gltf.geometry(Mesh().add(ball(0.055, 24), at(0, -0.15, 0)));
  rigs.add_to(lever,
              {.name = "fixed_arm",
               .frame = at(0, -reach / 2, 0) * turn(Vector3::UnitZ(), pi / 2),
               .hold = {0, 0.15, 0},
               .size = short_size},
              {{short_arm, gltf.material(finish::terracotta)}, {short_tip, brass}}, {point, upright});
  rigs.add({.name = "guided_ring",
            .frame = at(column(1), lower, 0),
            .start = at(0.1, -0.15, 0),
            .size = {0.36, 0.06, 0.36},
            .linear_velocity = {0, 0, 0.4}},
           {{ring, gltf.material(finish::teal)}},
           {{.kind = linear, .axes = {0, 2}, .max = 0.1},
            upright,
            {.kind = linear, .axes = {1}, .min = -0.15, .max = -0.15, .stiffness = 40, .damping = 0.2}});
  rigs.add({.name = "spun_plate", .frame = at(column(2), lower, 0), .hold = arm_top, .size = plate_size},
           {{plate, gltf.material(finish::mustard)}}, {point, locked(angular, {0, 2})},
           {{.kind = angular, .axis = 1, .velocity = 2, .damping = 0.05, .max_force = 1}});
  rigs.add(
      {.name = "lifted_block", .frame = at(column(3), lower, 0), .start = at(0, -0.7, 0), .size = block_size},
      {{block, gltf.material(finish::ivory)}}, {on_line, upright},
      {{.kind = linear, .axis = 1, .position = -0.15, .stiffness = 100, .damping = 8, .max_force = 30}});
  rigs.add({.name = "raised_arm", .frame = at(column(4), lower, 0), .hold = arm_top, .size = arm_size},
           arm_look(finish::terracotta), {point, hinge},
           {{.kind = angular,
             .axis = 2,
             .acceleration = true,
             .position = 1.8,
             .stiffness = 120,
             .damping = 8,
             .max_force = 1000}});
  rigs.add(
      {.name = "driven_block",
       .frame = at(column(5), lower - 0.4, 0),
       .start = at(-0.18, 0, 0),
       .size = block_size},
      {{block, gltf.material(finish::blue)}}, {locked(linear, {1, 2}), upright},
      {{.kind = linear, .axis = 0, .acceleration = true, .velocity = 0.09, .damping = 50, .max_force = 100}});

  gltf.expect_at({"stopped_slider: way along Y at 4 s", "way", {"stopped_slider"}, Vector3::UnitY()}, 4, -0.6,
                 0.005, "its limit");
  gltf.expect_crossing({"spring_slider: period", "velocity", {"spring_slider"}, Vector3::UnitY()}, 2,
                       2 * pi / std::sqrt(30 - 0.25 * 0.25), 0.02, "2π/√(k/m − (c/2m)²)");
  gltf.expect_at({"lifted_block: way along Y at 4 s", "way", {"lifted_block"}, Vector3::UnitY()}, 4,
                 0.7 - 0.15 - 9.81 / 100, 0.005, "the drive's spring carries m g: target − g/100");
  gltf.expect_at({"driven_block: way along X at 4 s", "way", {"driven_block"}, Vector3::UnitX()}, 4,
                 0.09 * (4 - 1 / 50.0), 0.005, "v (t − 1/c): it comes to its speed as exp(−c t)");
  return gltf.text();
}

std::string conveyor() {
  constexpr double speed = 0.8;
  constexpr double duration = 3;
  constexpr double top = 0.4;
  constexpr double thickness = 0.08;
  const Vector3 belt_size(4.2, thickness, 1.9);
  const Vector3 box_size(0.4, 0.4, 0.4);

  GltfBuilder gltf("conveyor", duration);
  gltf.camera({2.4, 3.6, 7.2}, {0, 0.42, -0.5}, 0.50);
  gltf.sun({-0.25, -1, -0.6}, warm_white, daylight);
  const int plane = gltf.plane_shape();
  gltf.collider(gltf.node("ground"), plane, gltf.physics_material(0.6));

  // The block is midway at half time.
  const int belt = gltf.node("belt", at(-speed * duration / 2, top - thickness / 2, 0));
  gltf.motion(belt, {.mass = 100, .linear_velocity = {speed, 0, 0}, .kinematic = true});
  const int belt_shape = gltf.box_shape(belt_size);
  gltf.collider(belt, belt_shape, gltf.physics_material(1));
  std::array<Mesh, 2> slats;
  constexpr int slat_count = 14;
  const double slat = belt_size.x() / slat_count;
  for (int i = 0; i < slat_count; ++i) {
    slats[i % 2].add(rounded(box({slat, thickness, belt_size.z()}), 0.012),
                     at(slat * (i - (slat_count - 1) / 2.0), 0, 0));
  }
  const int even = gltf.geometry(slats[0]);
  const int odd = gltf.geometry(slats[1]);
  gltf.show(belt, gltf.mesh("belt",
                            {{even, gltf.material(finish::basalt)}, {odd, gltf.material(finish::granite)}}));

  // Rollers under it: drawn only.
  Mesh rollers;
  for (int i = -5; i <= 5; ++i)
    rollers.add(rod(1.7, 0.1, 0.015, 24),
                at(0.6 * i, top - thickness - 0.1, 0) * turn(Vector3::UnitX(), pi / 2));
  Mesh trestles;
  for (const int side : {-1, 1})
    trestles.add(rounded(box({6.4, 0.14, 0.08}), 0.015), at(0, 0.15, side * 0.93));
  for (const int x : {-1, 0, 1}) trestles.add(rounded(box({0.1, 0.12, 1.86}), 0.015), at(2.9 * x, 0.06, 0));
  const int roller_geometry = gltf.geometry(rollers);
  const int trestle_geometry = gltf.geometry(trestles);
  gltf.show(gltf.node("rollers"), gltf.mesh("rollers", {{roller_geometry, gltf.material(finish::steel)},
                                                        {trestle_geometry, gltf.material(finish::walnut)}}));

  const int box_shape = gltf.box_shape(box_size);
  const int crate = gltf.geometry(rounded(box(box_size), 0.025));
  struct Lane {
    const char* name;
    double friction;
    Finish look;
  };
  constexpr std::array<Lane, 3> lanes{{{"rough_box", 0.4, finish::terracotta},
                                       {"smooth_box", 0.1, finish::mustard},
                                       {"waxed_box", 0.05, finish::teal}}};
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const Lane& lane = lanes[i];
    const int body = gltf.node(
        lane.name, at(-speed * duration / 2, top + box_size.y() / 2, 0.6 * (1 - static_cast<int>(i))));
    gltf.motion(body, {.mass = 5});
    gltf.collider(body, box_shape, gltf.physics_material(lane.friction));
    gltf.show(body, gltf.mesh(lane.name, {{crate, gltf.material(lane.look)}}));
  }

  // X of the slope's frame is downhill, Y off its surface, which is y = 0.
  const Vector3 slab_size(3.8, 0.15, 1.3);
  const int slope = gltf.node("slope", at(0, 0.75, -1.9) * turn(Vector3::UnitZ(), -pi / 10));
  const int slab = gltf.node("slab", at(0, -slab_size.y() / 2, 0), slope);
  const int slab_shape = gltf.box_shape(slab_size);
  gltf.collider(slab, slab_shape, gltf.physics_material(1));
  const int slab_geometry = gltf.geometry(rounded(box(slab_size), 0.02));
  gltf.show(slab, gltf.mesh("slab", {{slab_geometry, gltf.material(finish::maple)}}));
  // As high as the slab's underside is there.
  const Mesh supports = Mesh()
                            .add(rounded(box({0.16, 1.0, 1.1}), 0.02), at(-1.4, 0.5, -1.9))
                            .add(rounded(box({0.16, 0.3, 1.1}), 0.02), at(1.0, 0.15, -1.9));
  const int support_geometry = gltf.geometry(supports);
  gltf.show(gltf.node("supports"),
            gltf.mesh("supports", {{support_geometry, gltf.material(finish::granite)}}));

  const int stick = gltf.physics_material(0.8, 0.3);
  for (const bool sliding : {false, true}) {
    const char* name = sliding ? "pushed_block" : "resting_block";
    const int body = gltf.node(name, at(-1.3, box_size.y() / 2, sliding ? 0.3 : -0.3), slope);
    gltf.motion(body, {.mass = 5, .linear_velocity = {sliding ? 0.4 : 0, 0, 0}});
    gltf.collider(body, box_shape, stick);
    gltf.show(body, gltf.mesh(name, {{crate, gltf.material(sliding ? finish::oak : finish::blue)}}));
  }

  constexpr double gravity = 9.81;
  const std::string_view carried =
      "Coulomb: it gains μ g until it has the belt's speed v, and lags by v²/(2 μ g)";
  for (const Lane& lane : lanes) {
    const std::string name = lane.name;
    const double way = speed * duration - speed * speed / (2 * lane.friction * gravity);
    gltf.expect_at({name + ": way at 3 s", "way", {name}, Vector3::UnitX()}, duration, way, 0.02 * way,
                   carried);
    gltf.expect_throughout({name + ": speed from 2 s on", "velocity", {name}, Vector3::UnitX()},
                           {2, duration}, speed, 0.02 * speed, carried);
  }
  const auto [sine, cosine] = sine_cosine(pi / 10);
  gltf.expect({.name = "resting_block: largest displacement",
               .quantity = "displacement",
               .bodies = {"resting_block"},
               .value = 0,
               .tolerance = 0.001,
               .source = "Coulomb: it stays, since tan 18° is less than the static μ"});
  const double slid = 0.4 * duration + gravity * (sine - 0.3 * cosine) * duration * duration / 2;
  gltf.expect_at(
      {"pushed_block: way down the slope at 3 s", "way", {"pushed_block"}, Vector3(cosine, -sine, 0)},
      duration, slid, 0.02 * slid, "Coulomb: v t + g (sin 18° − μ cos 18°) t²/2 with the dynamic μ");
  return gltf.text();
}

}  // namespace substep::scenes
