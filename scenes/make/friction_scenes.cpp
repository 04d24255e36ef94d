/// Scenes of friction: sliding, sticking, rolling, and one in which Coulomb's law has no solution.

#include "closed_forms.h"
#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/math/rotation.h"
#include "stage.h"

namespace substep::scenes {

std::string sliding_ball() {
  constexpr double radius = 0.2;
  constexpr double speed = 5;
  constexpr double start = -2.2;
  constexpr double top = 0.12;

  GltfBuilder gltf("sliding_ball", 1.2);
  gltf.poster(0.6);
  set_view(gltf, {0.9, 2.6, 6.6}, {0.15, 0.10, 0}, 0.48);
  add_ground(gltf, 0.3);

  const int grip = gltf.physics_material(0.3);
  const int shape = gltf.sphere_shape(radius);
  const int round = gltf.geometry(ball(radius, 48));
  // A belt and two caps, so that the turning can be seen.
  const int band = gltf.geometry(
      Mesh().add(rod(0.05, radius + 0.0015, 0.008, 48)).add(rod(2 * radius + 0.005, 0.06, 0.006, 32)));
  struct Lane {
    const char* name;
    double moment;    // of m r²
    double rolls_at;  // m from the start, where rolling begins
    Finish wood;
    Finish look;
  };
  // A ball that slides at first loses speed at μ g until it rolls, at v/(1 + moment).
  const std::array<Lane, 2> lanes{{{"solid_ball", 0.4, 2.08034, finish::maple, finish::terracotta},
                                   {"hollow_ball", 2.0 / 3, 2.71831, finish::oak, finish::teal}}};
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const Lane& lane = lanes[i];
    const double z = i == 0 ? 0.45 : -0.45;
    const std::string name = lane.name;
    add_fixed_box(gltf, name + "_lane", {6.4, top, 0.8}, at(0.2, top / 2, z), grip, lane.wood, 0.012);
    Mesh marks;
    for (const int side : {-1, 1}) {
      marks.add(rounded(box({0.03, 0.10, 0.03}), 0.006, 2),
                at(start + lane.rolls_at, top + 0.05, z + side * 0.36));
      marks.add(ball(0.03, 20), at(start + lane.rolls_at, top + 0.12, z + side * 0.36));
    }
    add_scenery(gltf, name + "_mark", marks, finish::iron);
    const int body = gltf.node(name, at(start, top + radius, z) * turn(Vector3::UnitX(), pi / 2));
    gltf.motion(body, {.mass = 1,
                       .inertia = Vector3::Constant(lane.moment * radius * radius),
                       .linear_velocity = {speed, 0, 0}});
    gltf.collider(body, shape, grip);
    gltf.show(body,
              gltf.mesh(name, {{round, gltf.material(lane.look)}, {band, gltf.material(finish::ivory)}}));
  }

  constexpr double gravity = 9.81;
  constexpr double friction = 0.3;
  for (const Lane& lane : lanes) {
    const std::string name = lane.name;
    const double rolling = speed / (1 + lane.moment);
    const double time = (speed - rolling) / (friction * gravity);
    const double way = (speed + rolling) / 2 * time + rolling * (1.2 - time);
    const std::string_view source = "it loses μ g until it rolls, at v/(1 + k) with the moment k m r²";
    gltf.expect_mean({name + ": speed, mean from 0.8 to 1.2 s", "velocity", {name}, Vector3::UnitX()},
                     {0.8, 1.2}, rolling, 0.02 * rolling, source);
    gltf.expect_mean({name + ": rate, mean from 0.8 to 1.2 s", "angular_velocity", {name}, -Vector3::UnitZ()},
                     {0.8, 1.2}, rolling / radius, 0.02 * rolling / radius, source);
    gltf.expect_at({name + ": way at 1.2 s", "way", {name}, Vector3::UnitX()}, 1.2, way, 0.02 * way, source);
  }
  return gltf.text();
}

std::string balls_on_tray() {
  constexpr double radius = 0.1;
  constexpr double pitch = 0.26;
  const Vector3 tray_size(2.6, 0.2, 1.5);

  GltfBuilder gltf("balls_on_tray", 2);
  gltf.poster(1.2);
  set_view(gltf, {2.5, 2.3, 3.6}, {0.55, 0.15, 0}, 0.56);
  // The smaller friction counts: 0.4 under the tray, 0.8 under the balls.
  add_ground(gltf, 0.4);
  const int grip = gltf.physics_material(0.8);

  const int tray = gltf.node("tray", at(0, tray_size.y() / 2, 0));
  gltf.motion(tray, {.mass = 10});
  gltf.collider(tray, gltf.box_shape(tray_size), grip);
  const int board = gltf.geometry(rounded(box(tray_size), 0.02));
  // Draw a bar at the back, where the tray is pushed, and lines across it to measure the balls' ways by.
  Mesh lines;
  for (int i = -6; i <= 6; ++i)
    lines.add(rounded(box({0.012, 0.01, 1.44}), 0.002, 1), at(0.2 * i, tray_size.y() / 2 - 0.004, 0));
  const Mesh bar = Mesh().add(rounded(box({0.08, 0.12, 1.2}), 0.02), at(-1.34, 0, 0));
  const int line_look = gltf.geometry(lines);
  const int bar_look = gltf.geometry(bar);
  const int oak = gltf.material(finish::oak);
  const int walnut = gltf.material(finish::walnut);
  gltf.show(tray,
            gltf.mesh("tray", {{board, oak}, {line_look, walnut}, {bar_look, gltf.material(finish::iron)}}));
  // A motor that never comes near its speed pushes with all its force, 150 N.
  const int push = gltf.joint_description(
      {}, {{.kind = linear, .axis = 0, .velocity = 1000, .damping = 1e6, .max_force = 150}});
  const int hand = gltf.node("hand", at(0, tray_size.y() / 2, 0));
  gltf.joint(hand, gltf.node("pushed", {}, tray), push, true);

  const int shape = gltf.sphere_shape(radius);
  const int round = gltf.geometry(ball(radius, 32));
  const int band = gltf.geometry(rod(0.03, radius + 0.0015, 0.006, 32));
  constexpr std::array finishes{finish::terracotta, finish::mustard, finish::teal, finish::blue,
                                finish::cherry};
  const int ivory = gltf.material(finish::ivory);
  std::array<int, 5> looks{};
  for (int i = 0; i < 5; ++i)
    looks[i] = gltf.mesh("ball_of_row_" + std::to_string(i + 1),
                         {{round, gltf.material(finishes[i])}, {band, ivory}});
  for (int row = 0; row < 5; ++row) {
    for (int i = 0; i < 5; ++i) {
      // Turn the band's axis, Y, across the tray.
      const int body = gltf.node("ball_" + std::to_string(5 * row + i + 1),
                                 at(0.55 + pitch * (i - 2), tray_size.y() + radius, pitch * (row - 2)) *
                                     turn(Vector3::UnitZ(), 0.3 * i) * turn(Vector3::UnitY(), pi / 4));
      gltf.motion(body, {.mass = 1});
      gltf.collider(body, shape, grip);
      gltf.show(body, looks[row]);
    }
  }

  const double gain = (150 - 0.4 * 35 * 9.81) / (10 + 25 * 2.0 / 7);
  const std::string_view source = "SimBenchmark's rolling test: F − μ m g = (M + 25 · 2/7 m) a, balls 2/7 a";
  std::vector<std::string> balls;
  for (int i = 1; i <= 25; ++i) balls.push_back("ball_" + std::to_string(i));
  gltf.expect_at({"way of the tray at 2 s", "way", {"tray"}, Vector3::UnitX()}, 2, gain * 2, 0.02 * gain * 2,
                 source);
  gltf.expect_at({"way of that ball of 25 that is furthest off at 2 s", "way", balls, Vector3::UnitX()}, 2,
                 2.0 / 7 * gain * 2, 0.02 * 2.0 / 7 * gain * 2, source);
  return gltf.text();
}

std::string shaken_block() {
  constexpr double rate = 4;      // of the crank, rad/s
  constexpr double throw_ = 0.5;  // of the crank, m: the table's acceleration is at most 8 m/s²
  constexpr double top = 0.85;
  const Vector3 table_size(2.0, 0.08, 1.3);
  const Vector3 block_size(0.3, 0.1, 0.3);
  constexpr double crank_x = 0;
  constexpr double crank_z = 0.78;

  GltfBuilder gltf("shaken_block", 4);
  gltf.poster(0.75);
  set_view(gltf, {1.9, 2.6, 3.9}, {0.05, 0.62, 0.1}, 0.56);

  // Rails: drawn only.
  Mesh rails;
  Mesh legs;
  for (const int side : {-1, 1}) {
    rails.add(rod(3.5, 0.035, 0.008, 24), at(0, top - 0.16, side * 0.45) * turn(Vector3::UnitZ(), pi / 2));
    for (const int end : {-1, 1}) {
      legs.add(rounded(box({0.12, 0.72, 0.12}), 0.015), at(end * 1.62, 0.36, side * 0.45));
      legs.add(rounded(box({0.3, 0.06, 0.2}), 0.015), at(end * 1.62, 0.03, side * 0.45));
    }
  }
  // The crank's bearing.
  legs.add(rounded(box({0.16, 0.34, 0.10}), 0.015), at(crank_x, 0.17, crank_z + 0.16));
  legs.add(rounded(box({0.5, 0.05, 0.3}), 0.012), at(crank_x, 0.025, crank_z + 0.16));
  const int rail_look = gltf.geometry(rails);
  const int leg_look = gltf.geometry(legs);
  const int steel = gltf.material(finish::steel);
  const int walnut = gltf.material(finish::walnut);
  gltf.show(gltf.node("stand"), gltf.mesh("stand", {{rail_look, steel}, {leg_look, walnut}}));

  // The crank turns at a constant rate under any load. Its pin is in the table's upright slot.
  const double crank_y = 0.32;
  const int crank = gltf.node("crank", at(crank_x, crank_y, crank_z + 0.05));
  gltf.motion(crank, {.mass = 10, .angular_velocity = {0, 0, rate}, .kinematic = true});
  const Pose along_z = turn(Vector3::UnitX(), pi / 2);
  const Mesh wheel = Mesh()
                         .add(rounded(box({throw_ + 0.12, 0.12, 0.04}), 0.015), at(throw_ / 2, 0, 0))
                         .add(rod(0.045, 0.13, 0.012, 40), along_z);
  const Mesh pin = Mesh()
                       .add(rod(0.16, 0.035, 0.006, 24), at(throw_, 0, -0.05) * along_z)
                       .add(rod(0.10, 0.05, 0.01, 24), along_z);
  const int wheel_look = gltf.geometry(wheel);
  const int pin_look = gltf.geometry(pin);
  const int terracotta = gltf.material(finish::terracotta);
  const int brass = gltf.material(finish::brass);
  gltf.show(crank, gltf.mesh("crank", {{wheel_look, terracotta}, {pin_look, brass}}));

  // At t = 0 the table is at its right end.
  const int table = gltf.node("table", at(crank_x + throw_, top - table_size.y() / 2, 0));
  gltf.motion(table, {.mass = 50, .inertia = box_inertia(50, table_size)});
  gltf.collider(table, gltf.box_shape(table_size), gltf.physics_material(1));
  const int board = gltf.geometry(rounded(box(table_size), 0.015));
  Mesh yoke;
  for (const int side : {-1, 1}) {
    yoke.add(rounded(box({0.035, 1.14, 0.05}), 0.01),
             at(side * 0.056, crank_y - (top - table_size.y() / 2), crank_z - 0.06));
    for (const int end : {-1, 1})
      yoke.add(rod(0.16, 0.06, 0.008, 24),
               at(end * 0.7, -0.12, side * 0.45) * turn(Vector3::UnitZ(), pi / 2));
  }
  yoke.add(rounded(box({0.16, 0.05, 0.14}), 0.01), at(0, 0.0, crank_z - 0.09));
  Mesh lines;
  for (int i = -4; i <= 4; ++i)
    lines.add(rounded(box({0.012, 0.01, 1.24}), 0.002, 1), at(0.2 * i, table_size.y() / 2 - 0.004, 0));
  const int yoke_look = gltf.geometry(yoke);
  const int line_look = gltf.geometry(lines);
  const int maple = gltf.material(finish::maple);
  gltf.show(table, gltf.mesh("table", {{board, maple}, {yoke_look, steel}, {line_look, walnut}}));
  const int slide = gltf.joint_description({locked(linear, {1, 2}), locked(angular, {0, 1, 2})});
  const int rail = gltf.node("rail", at(crank_x, top - table_size.y() / 2, 0));
  gltf.joint(rail, gltf.node("carriage", {}, table), slide);
  const int slot = gltf.joint_description({locked(linear, {0})});
  const int slot_node = gltf.node("slot", at(0, crank_y - (top - table_size.y() / 2), 0), table);
  gltf.joint(slot_node, gltf.node("pin", at(throw_, 0, 0), crank), slot);

  const int shape = gltf.box_shape(block_size);
  const int look = gltf.geometry(rounded(box(block_size), 0.015));
  struct Block {
    const char* name;
    double friction;
    Finish finish;
  };
  const std::array<Block, 3> blocks{{{"rubber_block", 0.9, finish::terracotta},
                                     {"wooden_block", 0.8, finish::mustard},
                                     {"waxed_block", 0.4, finish::teal}}};
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Block& block = blocks[i];
    const int body = gltf.node(
        block.name, at(crank_x + throw_, top + block_size.y() / 2, 0.42 * (1 - static_cast<int>(i))));
    gltf.motion(body, {.mass = 1});
    gltf.collider(body, shape, gltf.physics_material(block.friction));
    gltf.show(body, gltf.mesh(block.name, {{look, gltf.material(block.finish)}}));
  }

  constexpr double gravity = 9.81;
  gltf.expect_at({"place of the table at 4 s", "position", {"table"}, Vector3::UnitX()}, 4,
                 crank_x + throw_ * sine_cosine(rate * 4).cosine, 0.01, "the crank's pin: r cos ω t");
  constexpr double least_slip = 0.0025;  // m: error of the table's sudden start
  for (const Block& block : blocks) {
    const std::string name = block.name;
    const std::vector<double> slips = slips_on_shaken_table(throw_, rate, block.friction, gravity, 4);
    if (slips.empty()) {
      gltf.expect({.name = name + ": largest slip",
                   .quantity = "way",
                   .bodies = {name},
                   .relative_to = "table",
                   .direction = Vector3::UnitX(),
                   .value = 0,
                   .tolerance = least_slip,
                   .source = "it sticks, since the table's acceleration is less than μ g"});
      continue;
    }
    const std::string_view source =
        "Coulomb, integrated from slip to slip; after Solfec's block under 8 cos t";
    // The first two slips, to the right and to the left. One of less than a millimetre may be lost in the
    // first steps; then only bounds are known.
    const bool is_small = block.friction > 0.5;
    for (const int side : {1, -1}) {
      const double slip = side > 0 ? slips[0] : -slips[1];
      const char* const end = side > 0 ? "right" : "left";
      Known known{
          .name = name + (is_small ? ": furthest slip to the " : ": first end of a slip to the ") + end,
          .quantity = "way",
          .bodies = {name},
          .relative_to = "table",
          .direction = Vector3(side, 0, 0),
          .tolerance = is_small ? least_slip : 0.05 * slip,
          .source = source};
      if (is_small) {
        known.at_most = slip;
      } else {
        known.peak = 1;
        known.value = slip;
      }
      gltf.expect(known);
    }
  }
  return gltf.text();
}

std::string painleve_rod() {
  constexpr double lean = 31 * pi / 180;  // of the rod from the horizontal
  constexpr double slip = 30;
  constexpr double top = 0.1;
  constexpr double length = 70;

  GltfBuilder gltf("painleve_rod", 1.2, Vector3(0, -10, 0));
  gltf.poster(0.5);
  set_view(gltf, {-2.6, 2.4, 10.5}, {-3.9, 0.8, 0}, 0.50);

  // The rod starts at rest on a moving belt, which equals a rod pushed along the ground.
  const int belt = gltf.node("belt", at(length / 2 - 12, top / 2, 0));
  gltf.motion(belt, {.mass = 1000, .linear_velocity = {-slip, 0, 0}, .kinematic = true});
  const int grip = gltf.physics_material(5.0 / 3);
  gltf.collider(belt, gltf.box_shape({length, top, 1.2}), grip);
  std::array<Mesh, 2> slats;
  for (int i = 0; i < 70; ++i) slats[i % 2].add(rounded(box({1, top, 1.2}), 0.015, 1), at(i - 34.5, 0, 0));
  const int even = gltf.geometry(slats[0]);
  const int odd = gltf.geometry(slats[1]);
  const int basalt = gltf.material(finish::basalt);
  gltf.show(belt, gltf.mesh("belt", {{even, basalt}, {odd, gltf.material(finish::granite)}}));

  // Its ends are edges, so that it touches at half-length 1 m whatever its lean. The lower end leads.
  const std::array<PlanePoint, 4> outline{{{-1, 0}, {0, -0.03125}, {1, 0}, {0, 0.03125}}};
  const Mesh sharp = Mesh().add(faceted(prism(outline, 0.25)), turn(Vector3::UnitX(), pi / 2));
  const int hull = gltf.geometry(sharp);
  const int body_node = gltf.node("rod", at(0, top, 0) * turn(Vector3::UnitZ(), -lean) * at(-1, 0, 0));
  gltf.motion(body_node, {.mass = 1, .inertia = Vector3(1.0 / 100, 1.0 / 3, 1.0 / 3)});
  const Mesh cap = Mesh()
                       .add(rod(0.22, 0.075, 0.02), at(0, 0, 0) * turn(Vector3::UnitZ(), pi / 2))
                       .add(ball(0.06, 24), at(-0.97, 0, 0));
  const int cap_look = gltf.geometry(cap);
  const int paint = gltf.material(finish::terracotta);
  const int brass = gltf.material(finish::brass);
  const int shown = gltf.mesh("rod", {{hull, paint}, {cap_look, brass}});
  gltf.show(body_node, shown);
  const int bare = gltf.mesh("rod_hull", {{hull, paint}});
  gltf.hull_collider(body_node, gltf.detached_node("rod_hull", bare), grip);

  gltf.expect({.name = "time at which the rod stands at 45°",
               .quantity = "angle",
               .bodies = {"rod"},
               .direction = -Vector3::UnitZ(),
               .crossing = 1,
               .level = pi / 4 - lean,
               .value = 0.8145,
               .tolerance = 0.05,
               .source = "Ch. Glocker's example with the numbers of the cardillo package"});
  return gltf.text();
}

}  // namespace substep::scenes
