/// Scenes of friction: sliding, sticking, rolling, and one in which Coulomb's law has no solution.

#include "closed_forms.h"
#include "scenes.h"
#include "sim/math/rotation.h"

namespace substep::scenes {
namespace {

/// Returns slats of a belt along X in two colours.
NodeMesh slats(int count, const Vector3& size, double rounding, int segments) {
  std::array<Mesh, 2> meshes;
  for (int i = 0; i < count; ++i)
    meshes[i % 2] += at(size.x() * (i - (count - 1) / 2.0), 0, 0) * cuboid(size, rounding, segments);
  return {{meshes[0], finish::basalt}, {meshes[1], finish::granite}};
}

/// Returns lines across X, 0.2 m apart, which show distances.
Mesh measuring_lines(int reach, double top, double width) {
  Mesh lines;
  for (int i = -reach; i <= reach; ++i)
    lines += at(0.2 * i, top - 0.004, 0) * cuboid({0.012, 0.01, width}, 0.002, 1);
  return lines;
}

GltfBuilder sliding_ball() {
  constexpr double radius = 0.2;
  constexpr double speed = 5;
  constexpr double start = -2.2;
  constexpr double top = 0.12;
  constexpr double friction = 0.3;
  GltfBuilder gltf("sliding_ball", {.duration = 1.2, .poster = 0.6},
                   {.eye = {0.9, 2.6, 6.6}, .target = {0.15, 0.10, 0}, .yfov = 0.48, .friction = friction});

  const int grip = gltf.physics_material(friction);
  const int shape = gltf.sphere_shape(radius);
  const int round = gltf.geometry(ball(radius, 48));
  // Draw a belt and two caps, which show the ball's rotation.
  const int band =
      gltf.geometry(rod(0.05, radius + 0.0015, 0.008, 48) + rod(2 * radius + 0.005, 0.06, 0.006, 32));
  struct Ball {
    std::string name;
    double moment;    // of m r²
    double rolls_at;  // m from the start, where rolling begins
    double z;
    Finish wood;
    Finish paint;
  };
  // A ball that slides at first loses speed at μ g until it rolls, at v/(1 + moment).
  for (const auto& [name, moment, rolls_at, z, wood, paint] :
       {Ball{"solid_ball", 0.4, 2.08034, 0.45, finish::maple, finish::terracotta},
        Ball{"hollow_ball", 2.0 / 3, 2.71831, -0.45, finish::oak, finish::teal}}) {
    gltf.fixed_box(name + "_lane", {6.4, top, 0.8}, at(0.2, top / 2, z), grip, wood, 0.012);
    Mesh marks;
    for (const int side : {-1, 1}) {
      marks += at(start + rolls_at, top + 0.05, z + side * 0.36) * cuboid({0.03, 0.10, 0.03}, 0.006, 2);
      marks += at(start + rolls_at, top + 0.12, z + side * 0.36) * ball(0.03, 20);
    }
    gltf.scenery(name + "_mark", {{marks, finish::iron}});
    gltf.body(
        name, at(start, top + radius, z) * turn(X, pi / 2),
        {.mass = 1, .inertia = Vector3::Constant(moment * radius * radius), .linear_velocity = {speed, 0, 0}},
        {shape, grip}, {{round, paint}, {band, finish::ivory}});

    const double rolling = speed / (1 + moment);
    const double time = (speed - rolling) / (friction * gravity);
    const double way = (speed + rolling) / 2 * time + rolling * (1.2 - time);
    const std::string_view source = "it loses μ g until it rolls, at v/(1 + k) with the moment k m r²";
    gltf.expect({name + ": speed, mean from 0.8 to 1.2 s", "velocity", {name}, X}, mean(0.8, 1.2), rolling,
                0.02 * rolling, source);
    gltf.expect({name + ": rate, mean from 0.8 to 1.2 s", "angular_velocity", {name}, -Z}, mean(0.8, 1.2),
                rolling / radius, 0.02 * rolling / radius, source);
    gltf.expect({name + ": way at 1.2 s", "way", {name}, X}, at_time(1.2), way, 0.02 * way, source);
  }
  return gltf;
}

GltfBuilder balls_on_tray() {
  constexpr double radius = 0.1;
  constexpr double pitch = 0.26;
  const Vector3 tray_size(2.6, 0.2, 1.5);
  constexpr std::array finishes{finish::terracotta, finish::mustard, finish::teal, finish::blue,
                                finish::cherry};
  GltfBuilder gltf("balls_on_tray", {.duration = 2, .poster = 1.2},
                   {.eye = {2.5, 2.3, 3.6}, .target = {0.55, 0.15, 0}, .yfov = 0.56, .friction = 0.4});
  // The smaller friction counts: 0.4 under the tray, 0.8 under the balls.
  const int grip = gltf.physics_material(0.8);

  // Draw a bar at the back, where the tray is pushed.
  const Mesh bar = at(-1.34, 0, 0) * cuboid({0.08, 0.12, 1.2}, 0.02);
  const int tray =
      gltf.body("tray", at(0, tray_size.y() / 2, 0), {.mass = 10}, {gltf.box_shape(tray_size), grip},
                {{cuboid(tray_size, 0.02), finish::oak},
                 {measuring_lines(6, tray_size.y() / 2, 1.44), finish::walnut},
                 {bar, finish::iron}});
  // A motor far below its target speed pushes with all its force, 150 N.
  const int push = gltf.joint_description(
      {}, {{.kind = linear, .axis = 0, .velocity = 1000, .damping = 1e6, .max_force = 150}});
  const int hand = gltf.node("hand", at(0, tray_size.y() / 2, 0));
  gltf.joint(hand, gltf.node("pushed", {}, tray), push, true);

  const int shape = gltf.sphere_shape(radius);
  const int round = gltf.geometry(ball(radius, 32));
  const int band = gltf.geometry(rod(0.03, radius + 0.0015, 0.006, 32));
  std::array<int, 5> looks{};
  gltf.material(finish::ivory);
  for (int i = 0; i < 5; ++i)
    looks[i] = gltf.mesh(numbered("ball_of_row", i + 1), {{round, finishes[i]}, {band, finish::ivory}});
  for (int row = 0; row < 5; ++row) {
    for (int i = 0; i < 5; ++i) {
      // Turn the band's axis, Y, across the tray.
      const Pose pose = at(0.55 + pitch * (i - 2), tray_size.y() + radius, pitch * (row - 2)) *
                        turn(Z, 0.3 * i) * turn(Y, pi / 4);
      gltf.body(numbered("ball", 5 * row + i + 1), pose, {.mass = 1}, {shape, grip}, looks[row]);
    }
  }

  const double gain = (150 - 0.4 * 35 * gravity) / (10 + 25 * 2.0 / 7);
  const std::string_view source = "SimBenchmark's rolling test: F − μ m g = (M + 25 · 2/7 m) a, balls 2/7 a";
  gltf.expect({"way of the tray at 2 s", "way", {"tray"}, X}, at_time(2), gain * 2, 0.02 * gain * 2, source);
  gltf.expect({"way of that ball of 25 that is furthest off at 2 s", "way", numbered("ball", 1, 25), X},
              at_time(2), 2.0 / 7 * gain * 2, 0.02 * 2.0 / 7 * gain * 2, source);
  return gltf;
}

/// Boxes that a belt carries, and two on a slope of dynamic friction less than static.
struct Conveyor : GltfBuilder {
  Conveyor()
      : GltfBuilder("conveyor", {.duration = duration},
                    {.eye = {2.4, 3.6, 7.2},
                     .target = {0, 0.42, -0.5},
                     .yfov = 0.50,
                     .friction = 0.6,
                     .light = {-0.25, -1, -0.6}}) {
    add_belt();
    box_shape_ = box_shape(box_size);
    crate_ = geometry(cuboid(box_size, 0.025));
    add_carried_boxes();
    add_slope();
  }

  static constexpr double speed = 0.8;
  static constexpr double duration = 3;
  static constexpr double top = 0.4;
  const Vector3 box_size{0.4, 0.4, 0.4};

  void add_belt() {
    constexpr double thickness = 0.08;
    const Vector3 size(4.2, thickness, 1.9);
    // Centre the belt at x = 0 at half time.
    body("belt", at(-speed * duration / 2, top - thickness / 2, 0),
         {.mass = 100, .linear_velocity = {speed, 0, 0}, .kinematic = true},
         {box_shape(size), physics_material(1)}, slats(14, {size.x() / 14, thickness, size.z()}, 0.012, 3));
    Mesh rollers;
    for (int i = -5; i <= 5; ++i)
      rollers += at(0.6 * i, top - thickness - 0.1, 0) * turn(X, pi / 2) * rod(1.7, 0.1, 0.015, 24);
    Mesh trestles;
    for (const int side : {-1, 1}) trestles += at(0, 0.15, side * 0.93) * cuboid({6.4, 0.14, 0.08}, 0.015);
    for (const int x : {-1, 0, 1}) trestles += at(2.9 * x, 0.06, 0) * cuboid({0.1, 0.12, 1.86}, 0.015);
    scenery("rollers", {{rollers, finish::steel}, {trestles, finish::walnut}});
  }

  void add_carried_boxes() {
    const std::string_view source =
        "Coulomb: it gains μ g until it has the belt's speed v, and lags by v²/(2 μ g)";
    double z = 0.6;
    for (const auto& [name, friction, paint] :
         {Lane{"rough_box", 0.4, finish::terracotta}, Lane{"smooth_box", 0.1, finish::mustard},
          Lane{"waxed_box", 0.05, finish::teal}}) {
      body(name, at(-speed * duration / 2, top + box_size.y() / 2, z), {.mass = 5},
           {box_shape_, physics_material(friction)}, {{crate_, paint}});
      z -= 0.6;
      const double way = speed * duration - speed * speed / (2 * friction * gravity);
      expect({name + ": way at 3 s", "way", {name}, X}, at_time(duration), way, 0.02 * way, source);
      expect({name + ": speed from 2 s on", "velocity", {name}, X}, throughout(2, duration), speed,
             0.02 * speed, source);
    }
  }

  void add_slope() {
    // X of the slope's frame is downhill, Y off its surface, which is y = 0.
    const Vector3 size(3.8, 0.15, 1.3);
    const int slope = node("slope", at(0, 0.75, -1.9) * turn(Z, -pi / 10));
    fixed_body("slab", at(0, -size.y() / 2, 0), {box_shape(size), physics_material(1)},
               {{cuboid(size, 0.02), finish::maple}}, slope);
    // The supports end at the slab's underside.
    const Mesh supports = at(-1.4, 0.5, -1.9) * cuboid({0.16, 1.0, 1.1}, 0.02) +
                          at(1.0, 0.15, -1.9) * cuboid({0.16, 0.3, 1.1}, 0.02);
    scenery("supports", {{supports, finish::granite}});
    const Collider collider{box_shape_, physics_material(0.8, 0.3)};
    body("resting_block", at(-1.3, box_size.y() / 2, -0.3), {.mass = 5}, collider, {{crate_, finish::blue}},
         slope);
    body("pushed_block", at(-1.3, box_size.y() / 2, 0.3), {.mass = 5, .linear_velocity = {0.4, 0, 0}},
         collider, {{crate_, finish::oak}}, slope);
    expect({"resting_block: largest displacement", "displacement", {"resting_block"}}, any_time, 0, 0.001,
           "Coulomb: it stays, since tan 18° is less than the static μ");
    const auto [sine, cosine] = sine_cosine(pi / 10);
    const double slid = 0.4 * duration + gravity * (sine - 0.3 * cosine) * duration * duration / 2;
    expect({"pushed_block: way down the slope at 3 s", "way", {"pushed_block"}, Vector3(cosine, -sine, 0)},
           at_time(duration), slid, 0.02 * slid,
           "Coulomb: v t + g (sin 18° − μ cos 18°) t²/2 with the dynamic μ");
  }

  int box_shape_ = 0;
  int crate_ = 0;
};

/// Blocks on a table that a crank shakes.
struct ShakenBlock : GltfBuilder {
  ShakenBlock()
      : GltfBuilder("shaken_block", {.duration = duration, .poster = 0.75},
                    {.eye = {1.9, 2.6, 3.9}, .target = {0.05, 0.62, 0.1}, .yfov = 0.56}) {
    add_stand();
    const int crank = add_crank();
    const int table = add_table();
    const int slide = joint_description({locked(linear, {1, 2}), locked(angular, {0, 1, 2})});
    const int rail = node("rail", at(0, middle, 0));
    joint(rail, node("carriage", {}, table), slide);
    const int slot = joint_description({locked(linear, {0})});
    const int slot_node = node("slot", at(0, crank_y - middle, 0), table);
    joint(slot_node, node("pin", at(radius, 0, 0), crank), slot);
    expect({"place of the table at 4 s", "position", {"table"}, X}, at_time(duration),
           radius * sine_cosine(rate * duration).cosine, 0.01, "the crank's pin: r cos ω t");

    const Vector3 size(0.3, 0.1, 0.3);
    const int shape = box_shape(size);
    const int block = geometry(cuboid(size, 0.015));
    double z = 0.42;
    for (const Lane& lane :
         {Lane{"rubber_block", 0.9, finish::terracotta}, Lane{"wooden_block", 0.8, finish::mustard},
          Lane{"waxed_block", 0.4, finish::teal}}) {
      body(lane.name, at(radius, top + size.y() / 2, z), {.mass = 1},
           {shape, physics_material(lane.friction)}, {{block, lane.paint}});
      z -= 0.42;
      expect_slips(lane);
    }
  }

  static constexpr double duration = 4;
  static constexpr double rate = 4;      // of the crank, rad/s
  static constexpr double radius = 0.5;  // of the crank, m: the table's acceleration is at most 8 m/s²
  static constexpr double crank_y = 0.32;
  static constexpr double crank_z = 0.78;
  static constexpr double top = 0.85;           // of the table
  static constexpr double middle = top - 0.04;  // of the table's height

  void add_stand() {
    Mesh rails;
    Mesh legs;
    for (const int side : {-1, 1}) {
      rails += at(0, top - 0.16, side * 0.45) * turn(Z, pi / 2) * rod(3.5, 0.035, 0.008, 24);
      for (const int end : {-1, 1}) {
        legs += at(end * 1.62, 0.36, side * 0.45) * cuboid({0.12, 0.72, 0.12}, 0.015);
        legs += at(end * 1.62, 0.03, side * 0.45) * cuboid({0.3, 0.06, 0.2}, 0.015);
      }
    }
    // The crank's bearing.
    legs += at(0, 0.17, crank_z + 0.16) * cuboid({0.16, 0.34, 0.10}, 0.015);
    legs += at(0, 0.025, crank_z + 0.16) * cuboid({0.5, 0.05, 0.3}, 0.012);
    scenery("stand", {{rails, finish::steel}, {legs, finish::walnut}});
  }

  /// Adds a crank that turns at a constant rate under any load; its pin is in the table's upright slot.
  int add_crank() {
    const Pose along_z = turn(X, pi / 2);
    const Mesh wheel = at(radius / 2, 0, 0) * cuboid({radius + 0.12, 0.12, 0.04}, 0.015) +
                       along_z * rod(0.045, 0.13, 0.012, 40);
    const Mesh pins =
        at(radius, 0, -0.05) * along_z * rod(0.16, 0.035, 0.006, 24) + along_z * rod(0.10, 0.05, 0.01, 24);
    return body("crank", at(0, crank_y, crank_z + 0.05),
                {.mass = 10, .angular_velocity = {0, 0, rate}, .kinematic = true},
                {{wheel, finish::terracotta}, {pins, finish::brass}});
  }

  /// Adds the table, which is at its right end at t = 0.
  int add_table() {
    const Vector3 size(2.0, 0.08, 1.3);
    Mesh yoke;
    for (const int side : {-1, 1}) {
      yoke += at(side * 0.056, crank_y - middle, crank_z - 0.06) * cuboid({0.035, 1.14, 0.05}, 0.01);
      for (const int end : {-1, 1})
        yoke += at(end * 0.7, -0.12, side * 0.45) * turn(Z, pi / 2) * rod(0.16, 0.06, 0.008, 24);
    }
    yoke += at(0, 0.0, crank_z - 0.09) * cuboid({0.16, 0.05, 0.14}, 0.01);
    return body("table", at(radius, middle, 0), {.mass = 50, .inertia = box_inertia(50, size)},
                {box_shape(size), physics_material(1)},
                {{cuboid(size, 0.015), finish::maple},
                 {yoke, finish::steel},
                 {measuring_lines(4, size.y() / 2, 1.24), finish::walnut}});
  }

  /// Expects the first two slips, to the right and to the left. One of less than a millimetre may be lost in
  /// the first steps; then only bounds are known.
  void expect_slips(const Lane& lane) {
    constexpr double least = 0.0025;  // m: error of the table's sudden start
    const std::vector<double> slips = slips_on_shaken_table(radius, rate, lane.friction, gravity, duration);
    if (slips.empty()) {
      expect({lane.name + ": largest slip", "way", {lane.name}, X, "table"}, any_time, 0, least,
             "it sticks, since the table's acceleration is less than μ g");
      return;
    }
    const bool is_small = slips[0] < 0.001;  // m
    const std::string what = is_small ? ": furthest slip to the " : ": first end of a slip to the ";
    for (const int side : {1, -1}) {
      const double slip = side > 0 ? slips[0] : -slips[1];
      expect({lane.name + what + (side > 0 ? "right" : "left"),
              "way",
              {lane.name},
              Vector3(side, 0, 0),
              "table"},
             is_small ? any_time : peak(1), is_small ? at_most(slip) : slip, is_small ? least : 0.05 * slip,
             "Coulomb, integrated from slip to slip; after Solfec's block under 8 cos t");
    }
  }
};

GltfBuilder painleve_rod() {
  constexpr double lean = 31 * pi / 180;  // of the rod from the horizontal
  constexpr double top = 0.1;
  constexpr double length = 70;
  GltfBuilder gltf("painleve_rod", {.duration = 1.2, .poster = 0.5, .gravity = Vector3(0, -10, 0)},
                   {.eye = {-2.6, 2.4, 10.5}, .target = {-3.9, 0.8, 0}, .yfov = 0.50});

  // The rod starts at rest on a moving belt, which equals a rod pushed along the ground.
  const int grip = gltf.physics_material(5.0 / 3);
  gltf.body("belt", at(length / 2 - 12, top / 2, 0),
            {.mass = 1000, .linear_velocity = {-30, 0, 0}, .kinematic = true},
            {gltf.box_shape({length, top, 1.2}), grip}, slats(70, {1, top, 1.2}, 0.015, 1));

  // The rod's ends are edges, so that it touches at half-length 1 m at any angle. The lower end leads.
  const Outline outline({point(-1, 0), point(0, -0.03125), point(1, 0), point(0, 0.03125)});
  const int hull = gltf.geometry(turn(X, pi / 2) * faceted(prism(outline, 0.25)));
  const Mesh cap = turn(Z, pi / 2) * rod(0.22, 0.075, 0.02) + at(-0.97, 0, 0) * ball(0.06, 24);
  const int rod = gltf.body("rod", at(0, top, 0) * turn(Z, -lean) * at(-1, 0, 0),
                            {.mass = 1, .inertia = Vector3(1.0 / 100, 1.0 / 3, 1.0 / 3)},
                            {{hull, finish::terracotta}, {cap, finish::brass}});
  const int bare = gltf.detached_node("rod_hull", {{hull, finish::terracotta}});
  gltf.collider(rod, {bare, grip, Collider::Kind::hull});
  gltf.expect({"time at which the rod stands at 45°", "angle", {"rod"}, -Z}, crossing(1, pi / 4 - lean),
              0.8145, 0.05, "Ch. Glocker's example with the numbers of the cardillo package");
  return gltf;
}

}  // namespace

std::vector<SceneFunction> friction_scenes() {
  return {sliding_ball, balls_on_tray, made<Conveyor>, made<ShakenBlock>, painleve_rod};
}

}  // namespace substep::scenes
