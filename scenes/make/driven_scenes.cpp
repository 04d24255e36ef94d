/// Scenes of joints with limits, springs and motors: each kind once, a car, a falling mannequin.

#include <algorithm>
#include <cmath>

#include "scenes.h"

namespace substep::scenes {
namespace {

/// Two beams that carry a row of rigs each, one for each kind of joint. A rig hangs from the origin of its
/// joint's node.
struct JointKinds : GltfBuilder {
  JointKinds()
      : GltfBuilder("joint_kinds", {.duration = 4},
                    {.eye = {0.7, 1.8, 7.0}, .target = {0, 1.26, 0}, .yfov = 0.50}) {
    add_frame();
    block_ = geometry(cuboid(block_size, 0.02));
    bob_ = geometry(ball(0.1, 32));
    band_ = geometry(rod(0.03, 0.1025, 0.008, 32));
    arm_ = geometry(cuboid(arm_size, 0.012));
    tip_ = geometry(at(0, -reach / 2, 0) * ball(0.055, 24));
    plate_ = geometry(cuboid(plate_size, 0.012));
    ring_ = geometry(ring(0.125, 0.18, 0.03, 0.01, 40));
    material(finish::brass);
    add_upper_row();
    add_lower_row();
    expect_motion();
  }

  static constexpr double pitch = 0.8;
  static constexpr double upper = 2.35;
  static constexpr double lower = 1.15;
  static constexpr double reach = 0.5;  // of arms and ropes
  const Vector3 block_size{0.24, 0.18, 0.24};
  const Vector3 arm_size{0.05, reach, 0.05};
  const Vector3 plate_size{0.30, reach, 0.05};
  const Vector3 arm_top{0, reach / 2, 0};
  const AxesLimit on_line = locked(linear, {0, 2});
  const AxesLimit point = locked(linear, {0, 1, 2});
  const AxesLimit upright = locked(angular, {0, 1, 2});
  const AxesLimit on_hinge = locked(angular, {0, 1});

  static Pose column(int i, double y) { return at(pitch * (i - 2.5), y, 0); }
  NodeMesh arm_look(const Finish& paint) const { return {{arm_, paint}, {tip_, finish::brass}}; }
  NodeMesh bob_look(const Finish& paint) const { return {{bob_, paint}, {band_, finish::brass}}; }

  /// Draws the beams and rails of the rigs.
  void add_frame() {
    const double half_width = 3 * pitch + 0.3;
    Mesh wood;
    for (const double y : {upper, lower})
      wood += at(0, y + 0.09, 0) * cuboid({2 * half_width + 0.2, 0.1, 0.1}, 0.012);
    for (const int side : {-1, 1}) {
      wood += at(side * half_width, (upper + 0.14) / 2, 0) * cuboid({0.1, upper + 0.14, 0.1}, 0.012);
      wood += at(side * half_width, 0.03, 0) * cuboid({0.16, 0.06, 0.7}, 0.012);
    }
    Mesh metal;
    const auto add_guide = [&](int i, double y) {
      metal += column(i, y - 0.435) * rod(0.95, 0.018, 0.004, 20);
      metal += column(i, y - 0.90) * rod(0.03, 0.06, 0.008, 24);
    };
    for (const int i : {2, 3, 4, 5}) metal += column(i, upper) * ball(0.04, 20);
    for (const int i : {0, 2, 4}) metal += column(i, lower) * ball(0.04, 20);
    for (const int i : {0, 1}) add_guide(i, upper);
    for (const int i : {1, 3}) add_guide(i, lower);
    metal += column(5, lower - 0.4) * turn(Z, pi / 2) * rod(0.66, 0.018, 0.004, 20);
    for (const int side : {-1, 1})
      metal += at(pitch * (5 - 2.5) + side * 0.31, lower - 0.18, 0) * rod(0.45, 0.012, 0.004, 16);
    scenery("frame", {{wood, finish::walnut}, {metal, finish::iron}});
  }

  /// A body of 1 kg with the moments of a box. `hold` is the joint's point in the body's node; `start` is the
  /// point's pose in the joint's node.
  struct RigBody {
    Vector3 size;
    Pose start = {};
    Vector3 hold = Vector3::Zero();
    Vector3 linear_velocity = Vector3::Zero();
    Vector3 angular_velocity = Vector3::Zero();
  };

  /// Adds a rig; `frame` is that of the joint, in another rig's body where there is a carrier.
  int add(const std::string& name, const Pose& frame, const RigBody& rig, const NodeMesh& look,
          const std::vector<AxesLimit>& limits, const std::vector<AxisDrive>& drives = {},
          std::optional<int> carrier = {}) {
    const int fixed = node(name + "_frame", frame, carrier);
    const int hung = body(name, rig.start * at(-rig.hold),
                          {.mass = 1,
                           .inertia = box_inertia(1, rig.size),
                           .linear_velocity = rig.linear_velocity,
                           .angular_velocity = rig.angular_velocity},
                          look, fixed);
    const int hold = node(name + "_hold", at(rig.hold), hung);
    joint(fixed, hold, joint_description(limits, drives));
    return hung;
  }

  void add_upper_row() {
    const Vector3 bob_size =
        Vector3::Constant(0.2 * 0.77459666924148338);  // a box as hard to turn as the ball
    const Vector3 swing(1, 0, 2);
    const AxesLimit stopped{.kind = linear, .axes = {1}, .min = -0.6, .max = 0};
    const AxesLimit spring{.kind = linear, .axes = {1}, .min = 0, .max = 0, .stiffness = 30, .damping = 0.5};
    add("stopped_slider", column(0, upper - 0.1), {block_size}, {{block_, finish::terracotta}},
        {on_line, upright, stopped});
    add("spring_slider", column(1, upper - 0.1), {block_size}, {{block_, finish::mustard}},
        {on_line, upright, spring});
    add("roped_ball", column(2, upper), {.size = bob_size, .start = at(0.25, 0, 0), .hold = {0, 0.1, 0}},
        bob_look(finish::teal), {{.kind = linear, .axes = {0, 1, 2}, .max = reach}});
    add("distant_ball", column(3, upper), {.size = bob_size, .start = at(-0.3, -0.4, 0)},
        bob_look(finish::ivory), {{.kind = linear, .axes = {0, 1, 2}, .min = reach, .max = reach}});
    // The arm turns about its joint.
    add("coned_arm", column(4, upper) * turn(Z, 1),
        {.size = arm_size,
         .hold = arm_top,
         .linear_velocity = swing.cross(-arm_top),
         .angular_velocity = swing},
        arm_look(finish::blue), {point, {.kind = angular, .axes = {0, 2}, .max = 0.5}});
    add("stopped_hinge", column(5, upper) * turn(Z, pi / 2), {.size = arm_size, .hold = arm_top},
        arm_look(finish::cherry), {point, on_hinge, {.kind = angular, .axes = {2}, .min = -2.2, .max = 0}});
  }

  void add_lower_row() {
    const int lever = add("lever", column(0, lower) * turn(Z, 1), {.size = arm_size, .hold = arm_top},
                          {{arm_, finish::maple}}, {point, on_hinge});
    const Vector3 short_size(0.05, 0.3, 0.05);
    const Mesh short_tip = at(0, -0.15, 0) * ball(0.055, 24);
    add("fixed_arm", at(0, -reach / 2, 0) * turn(Z, pi / 2), {.size = short_size, .hold = {0, 0.15, 0}},
        {{cuboid(short_size, 0.012), finish::terracotta}, {short_tip, finish::brass}}, {point, upright}, {},
        lever);
    const AxesLimit spring{
        .kind = linear, .axes = {1}, .min = -0.15, .max = -0.15, .stiffness = 40, .damping = 0.2};
    add("guided_ring", column(1, lower),
        {.size = {0.36, 0.06, 0.36}, .start = at(0.1, -0.15, 0), .linear_velocity = {0, 0, 0.4}},
        {{ring_, finish::teal}}, {{.kind = linear, .axes = {0, 2}, .max = 0.1}, upright, spring});
    add("spun_plate", column(2, lower), {.size = plate_size, .hold = arm_top}, {{plate_, finish::mustard}},
        {point, locked(angular, {0, 2})},
        {{.kind = angular, .axis = 1, .velocity = 2, .damping = 0.05, .max_force = 1}});
    add("lifted_block", column(3, lower), {.size = block_size, .start = at(0, -0.7, 0)},
        {{block_, finish::ivory}}, {on_line, upright},
        {{.kind = linear, .axis = 1, .position = -0.15, .stiffness = 100, .damping = 8, .max_force = 30}});
    const AxisDrive raising{.kind = angular,
                            .axis = 2,
                            .acceleration = true,
                            .position = 1.8,
                            .stiffness = 120,
                            .damping = 8,
                            .max_force = 1000};
    add("raised_arm", column(4, lower), {.size = arm_size, .hold = arm_top}, arm_look(finish::terracotta),
        {point, on_hinge}, {raising});
    const AxisDrive pushing{
        .kind = linear, .axis = 0, .acceleration = true, .velocity = 0.09, .damping = 50, .max_force = 100};
    add("driven_block", column(5, lower - 0.4), {.size = block_size, .start = at(-0.18, 0, 0)},
        {{block_, finish::blue}}, {locked(linear, {1, 2}), upright}, {pushing});
  }

  void expect_motion() {
    expect({"stopped_slider: way along Y at 4 s", "way", {"stopped_slider"}, Y}, at_time(4), -0.6, 0.005,
           "its limit");
    expect({"spring_slider: period", "velocity", {"spring_slider"}, Y}, crossing(2),
           2 * pi / std::sqrt(30 - 0.25 * 0.25), 0.02, "2π/√(k/m − (c/2m)²)");
    expect({"lifted_block: way along Y at 4 s", "way", {"lifted_block"}, Y}, at_time(4),
           0.7 - 0.15 - gravity / 100, 0.005, "the drive's spring carries m g: target − g/100");
    expect({"driven_block: way along X at 4 s", "way", {"driven_block"}, X}, at_time(4),
           0.09 * (4 - 1 / 50.0), 0.005, "v (t − 1/c): it comes to its speed as exp(−c t)");
  }

  int block_, bob_, band_, arm_, tip_, plate_, ring_;  // geometries
};

/// A car whose motor drives it up a ramp.
struct PoweredWheel : GltfBuilder {
  PoweredWheel()
      : GltfBuilder("powered_wheel", {.duration = 5},
                    {.eye = {4.3, 2.3, 6.4}, .target = {2.2, 0.5, 0}, .yfov = 0.56, .friction = 0.9}) {
    add_ramp();
    const int chassis = add_chassis();
    const int wheels = add_wheels();
    // The motor turns the chassis about +Z relative to the wheels, which so turn about −Z and roll along +X.
    const int axle = node("axle", {}, wheels);
    joint(axle, node("bearing", {}, chassis),
          hinge({{.kind = angular, .axis = 2, .velocity = rate, .damping = 1000, .max_force = 8}}));

    constexpr double reached = 0.7;  // s: time at which the car reaches its speed
    const std::string_view level = "T/r = (M + I/r²) a until v = ω r, and v from then on";
    expect({"speed before the ramp, mean from 0.8 to 1.5 s", "velocity", {"wheels"}, X}, mean(0.8, 1.5),
           rate * radius, 0.02, level);
    expect({"way to the ramp at 1.5 s", "way", {"wheels"}, X}, at_time(1.5),
           reached * rate * radius / 2 + (1.5 - reached) * rate * radius, 0.025, level);
    expect({"speed on the deck, mean from 4.5 to 5 s", "velocity", {"wheels"}, X}, mean(4.5, 5),
           rate * radius, 0.02, "the motor holds ω, the wheels roll: v = ω r");
    expect({"the wheels' rate on the deck, mean from 4.5 to 5 s", "angular_velocity", {"wheels"}, -Z},
           mean(4.5, 5), rate, 0.05, "the motor's speed");
  }

  static constexpr double rate = 2.5;    // rad/s
  static constexpr double radius = 0.4;  // of the wheels
  static constexpr double track = 0.42;  // from the middle to each wheel
  const Pose along_z = turn(X, pi / 2);  // Y of turned pieces and of prisms to +Z

  /// Adds a ramp that rises 1 in 8 to a deck. The boards along its sides are drawn only.
  void add_ramp() {
    const Outline side({point(-2.5, 0), point(2.5, 0), point(2.5, 0.1875), point(-1, 0.1875)});
    const Outline board(
        {point(-2.3, 0), point(2.53, 0), point(2.53, 0.22), point(-1, 0.22), point(-2.3, 0.0575)});
    const int deck = geometry(along_z * faceted(prism(side, 1.75)));
    Mesh boards;
    for (const int z : {1, -1}) boards += at(0, 0, z * 0.905) * along_z * rounded(prism(board, 0.06), 0.015);
    const int ramp = node("ramp", at(3.75, 0, 0));
    const int hull = detached_node("ramp_hull", {{deck, finish::maple}});
    collider(ramp, {hull, physics_material(0.9), Collider::Kind::hull});
    show(ramp, {{deck, finish::maple}, {boards, finish::walnut}});
  }

  /// Adds the chassis, whose node stands on the axle.
  int add_chassis() {
    constexpr double skid = 0.1;
    const Vector3 size(1.4, 0.3, 0.5);
    const int chassis = node("chassis", at(0, radius, 0));
    motion(chassis, {.mass = 8, .inertia = box_inertia(8, size), .centre_of_mass = Vector3(-0.2, 0, 0)});
    collider(node("chassis_box", at(-0.25, 0.05, 0), chassis), {box_shape(size), physics_material(0.6)});
    collider(node("skid", at(-0.9, skid - radius, 0), chassis), {sphere_shape(skid), physics_material(0)});

    const Outline profile({point(-0.95, -0.04), point(-0.80, -0.12), point(0.30, -0.12), point(0.46, 0.02),
                           point(0.16, 0.18), point(-0.88, 0.24)});
    const Outline seat({point(-0.62, 0.17), point(-0.12, 0.15), point(-0.30, 0.34), point(-0.56, 0.38)});
    const Mesh metal = along_z * rod(2 * track - 0.1, 0.05, 0.01) + along_z * rod(0.34, 0.15, 0.03, 28) +
                       at(-0.9, skid - radius + 0.15, 0) * rod(0.24, 0.035, 0.005) +
                       at(-0.9, skid - radius, 0) * ball(skid);
    show(chassis, {{along_z * rounded(prism(profile, 0.5), 0.05, 4), finish::terracotta},
                   {along_z * rounded(prism(seat, 0.36), 0.04, 3), finish::ivory},
                   {metal, finish::steel}});
    return chassis;
  }

  /// Adds both wheels and their axle as one body, with balls as colliders, which roll smoother than prisms.
  int add_wheels() {
    const int wheels = node("wheels", at(0, radius, 0));
    motion(wheels, {.mass = 4, .inertia = Vector3(0.9, 0.9, 0.32)});
    const Collider round{sphere_shape(radius), physics_material(0.9)};
    const int wheel = add_wheel();
    // Y of the wheel's mesh points outwards.
    fixed_body("left_wheel", at(0, 0, track) * turn(X, pi / 2), round, wheel, wheels);
    fixed_body("right_wheel", at(0, 0, -track) * turn(X, -pi / 2), round, wheel, wheels);
    return wheels;
  }

  int add_wheel() {
    constexpr double tyre = 0.08;  // half its width
    constexpr int treads = 24;
    Mesh rubber =
        turned({corner(radius - 0.09, -tyre + 0.01, 0.01), corner(radius - 0.03, -tyre, 0.025),
                corner(radius - 0.012, -tyre + 0.04, 0.03), corner(radius - 0.012, tyre - 0.04, 0.03),
                corner(radius - 0.03, tyre, 0.025), corner(radius - 0.09, tyre - 0.01, 0.01)},
               48, true);
    const Mesh tread = cuboid({0.03, 0.055, 0.05}, 0.008, 1);
    for (int i = 0; i < 2 * treads; ++i)
      rubber += turn(Y, pi * i / treads) * at(radius - 0.0155, i % 2 == 0 ? -0.033 : 0.033, 0) * tread;
    const Mesh rim =
        turned({corner(radius - 0.115, -tyre + 0.015, 0.006), corner(radius - 0.085, -tyre + 0.005, 0.006),
                corner(radius - 0.085, tyre - 0.005, 0.006), corner(radius - 0.115, tyre - 0.015, 0.006)},
               40, true);
    Mesh spokes = turned({corner(0, -0.07), corner(0.075, -0.07, 0.012), corner(0.075, 0.05, 0.012),
                          corner(0.055, 0.065, 0.01), corner(0.055, 0.085, 0.01), corner(0.03, 0.10, 0.015),
                          corner(0.012, 0.105, 0.005), corner(0, 0.105)},
                         24);
    const Outline spoke(
        {point(-0.034, -0.022), point(0.034, -0.022), point(0.034, 0.022), point(-0.034, 0.022)});
    const Mesh bar =
        at(0.175, 0, 0) * turn(Z, -pi / 2) * turn(Y, pi / 2) * rounded(prism(spoke, 0.26, 0.625), 0.008, 2);
    for (int i = 0; i < 6; ++i) spokes += turn(Y, 2 * pi * i / 6) * bar;
    return mesh("wheel", {{rubber, finish::rubber}, {rim, finish::brass}, {spokes, finish::ivory}});
  }
};

/// An artist's mannequin, facing +X on its toes, that falls down a stair.
struct Ragdoll : GltfBuilder {
  // Ten sub-steps are too few for its impacts: scenes/ragdoll.md.
  Ragdoll()
      : GltfBuilder("ragdoll", {.duration = 4, .poster = 0.75, .substeps = 32},
                    {.eye = {2.7, 2.6, 6.0},
                     .target = {0.30, 1.20, 0},
                     .yfov = 0.56,
                     .friction = 0.6,
                     .light = {-0.3, -1, -0.7}}) {
    add_stair();
    material(finish::maple);
    material(finish::walnut);
    figure_ = node("figure", at(-1.15, rise * steps + 0.006, 0) * turn(Z, -0.16));
    const int pelvis = add_block("pelvis", 0.95, {0.16, 0.16, 0.30}, 12);
    const int chest = add_block("chest", 1.27, {0.19, 0.36, 0.36}, 22);
    const int head = add_head();
    // Limit the angle between pelvis and chest, about any axis.
    const int spine = joint_description({point, {.kind = angular, .axes = {0, 1, 2}, .max = 0.5}});
    join("spine", chest, {0, -0.21, 0}, pelvis, {0, 0.11, 0}, spine);
    join("neck", head, {0, -0.16, 0}, chest, {0, 0.19, 0}, swing_twist(0.5, 0.8));
    add_limbs(pelvis, chest);
    expect_no_gain(5, "nothing drives it, and no contact gives energy");
  }

  static constexpr int steps = 5;
  static constexpr double rise = 0.2;
  const AxesLimit point = locked(linear, {0, 1, 2});

  /// Adds steps that are boxes from the landing to the step's edge.
  void add_stair() {
    for (int i = 0; i < steps; ++i) {
      const double right = -0.9 + 0.36 * (steps - i);
      const double length = right + 2.1;
      fixed_box(numbered("step", i + 1), {length, rise, 2.0}, at(right - length / 2, rise * (i + 0.5), 0),
                grip_, i % 2 == 0 ? finish::limestone : finish::sandstone);
    }
  }

  static Motion falling(double mass) {
    return {.mass = mass, .linear_velocity = {1.6, 0.3, 0.15}, .angular_velocity = {0.1, 0.2, -0.8}};
  }

  int add_block(const char* name, double y, const Vector3& size, double mass) {
    const Mesh wood = cuboid(size, 0.4 * std::min(size.x(), size.y()), 4);
    return body(name, at(0, y, 0), falling(mass), {box_shape(size), grip_}, {{wood, finish::maple}}, figure_);
  }

  int add_head() {
    const Mesh neck = at(0, -0.12, 0) * rod(0.12, 0.035, 0.01) + at(0.105, 0.02, 0.04) * ball(0.018, 16) +
                      at(0.105, 0.02, -0.04) * ball(0.018, 16);
    return body("head", at(0, 1.62, 0), falling(5), {sphere_shape(0.11), grip_},
                {{ball(0.11, 32), finish::maple}, {neck, finish::walnut}}, figure_);
  }

  /// Adds a limb that hangs from its upper end; `length` is from joint to joint.
  int add_limb(const std::string& name, const Vector3& upper_end, double length, double radius, double mass) {
    const double half = (length - 2.6 * radius) / 2;  // of the straight part
    const Mesh wood =
        turned({corner(0, -half - radius), corner(0.8 * radius, -half - radius, 0.6 * radius),
                corner(radius, -half + 0.3 * radius, 0.3 * radius), corner(0.8 * radius, half, 0.3 * radius),
                corner(0.8 * radius, half + radius, 0.6 * radius), corner(0, half + radius)},
               28);
    const Mesh knob = at(0, length / 2, 0) * ball(0.62 * radius, 20);
    return body(name, at(upper_end.x(), upper_end.y() - length / 2, upper_end.z()), falling(mass),
                {capsule_shape(radius, radius, length - 2.6 * radius), grip_},
                {{wood, finish::maple}, {knob, finish::walnut}}, figure_);
  }

  void join(const std::string& name, int child, const Vector3& at_child, int parent, const Vector3& at_parent,
            int description) {
    const int socket = node(name + "_socket", at(at_parent), parent);
    joint(node(name, at(at_child), child), socket, description);
  }

  int swing_twist(double swing, double twist) {
    return joint_description({point,
                              {.kind = angular, .axes = {0, 2}, .max = swing},
                              {.kind = angular, .axes = {1}, .min = -twist, .max = twist}});
  }

  /// Returns a hinge with a range of angles, rad, of the upper limb relative to the lower one.
  int bend(double min, double max) {
    return joint_description(
        {point, locked(angular, {0, 1}), {.kind = angular, .axes = {2}, .min = min, .max = max}});
  }

  void add_limbs(int pelvis, int chest) {
    const int shoulder = swing_twist(1.7, 0.8);
    const int hip = swing_twist(1.0, 0.4);
    const int elbow = bend(-2.4, 0);
    const int knee = bend(0, 2.4);
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
  }

  int figure_ = 0;
  int grip_ = physics_material(0.6);
};

}  // namespace

std::vector<SceneFunction> driven_scenes() {
  return {made<JointKinds>, made<PoweredWheel>, made<Ragdoll>};
}

}  // namespace substep::scenes
