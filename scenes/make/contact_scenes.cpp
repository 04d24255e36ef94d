/// Scenes of contact and friction.

#include <cmath>
#include <numbers>

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "stage.h"

namespace substep::scenes {
namespace {

/// Returns the volume of `prism(outline, height, top_scale)`, m³.
double prism_volume(std::span<const PlanePoint> outline, double height, double top_scale) {
  double twice_area = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const PlanePoint& p = outline[i];
    const PlanePoint& q = outline[(i + 1) % outline.size()];
    twice_area += p.u * q.v - q.u * p.v;
  }
  return twice_area / 2 * height * (1 + top_scale + top_scale * top_scale) / 3;
}

}  // namespace

std::string stone_pyramid() {
  constexpr int courses = 5;
  constexpr double height = 0.5;
  constexpr double pitch = 1.1;
  constexpr double density = 2500;  // of limestone, kg/m³
  // Outlines in 1/64 m, and a top of 15/16, are exact in the file's 32-bit floats: each side stays flat.
  constexpr double top_scale = 15.0 / 16;
  const std::vector<std::vector<PlanePoint>> outlines{
      {{-0.5, -0.09375},
       {-0.25, -0.40625},
       {0.28125, -0.375},
       {0.5, 0.0625},
       {0.21875, 0.40625},
       {-0.3125, 0.375}},
      {{-0.5, 0.125},
       {-0.34375, -0.375},
       {0.3125, -0.40625},
       {0.5, -0.03125},
       {0.40625, 0.34375},
       {-0.1875, 0.40625}},
      {{-0.5, -0.21875}, {0, -0.4375}, {0.5, -0.1875}, {0.375, 0.375}, {-0.34375, 0.40625}},
      {{-0.5, -0.15625},
       {-0.15625, -0.40625},
       {0.34375, -0.34375},
       {0.5, 0.03125},
       {0.375, 0.3125},
       {0, 0.4375},
       {-0.40625, 0.21875}},
      {{-0.5, 0},
       {-0.3125, -0.375},
       {0.21875, -0.40625},
       {0.5, -0.125},
       {0.4375, 0.28125},
       {0.03125, 0.421875},
       {-0.34375, 0.34375}},
  };
  constexpr std::array finishes{finish::limestone, finish::sandstone, finish::granite, finish::brick};

  GltfBuilder gltf("stone_pyramid", 5);
  set_view(gltf, {2.3, 2.4, 6.9}, {0, 1.05, 0}, 0.56);
  add_ground(gltf, 0.6);

  const int friction = gltf.physics_material(0.6);
  struct Cut {
    int geometry;
    int rough;  // node of the stone before its edges were rounded: what the hull is made of
    double mass;
  };
  std::vector<Cut> cuts;
  for (const auto& outline : outlines) {
    const Polyhedron solid = prism(outline, height, top_scale);
    const std::string name = "rough_stone_" + std::to_string(cuts.size() + 1);
    const int rough = gltf.mesh(name, {{gltf.geometry(faceted(solid)), gltf.material(finish::limestone)}});
    cuts.push_back({gltf.geometry(rounded(solid, 0.045, 2)), gltf.detached_node(name, rough),
                    std::round(density * prism_volume(outline, height, top_scale))});
  }

  int number = 0;
  for (int course = 0; course < courses; ++course) {
    const int stones = courses - course;
    for (int i = 0; i < stones; ++i, ++number) {
      const Cut& cut = cuts[number % cuts.size()];
      const Finish& look = finishes[(number * 3 + course) % finishes.size()];
      const std::string name = "stone_" + std::to_string(number + 1);
      const int body = gltf.node(name, at(pitch * (i - (stones - 1) / 2.0), height * (course + 0.5), 0));
      gltf.motion(body, {.mass = cut.mass});
      gltf.hull_collider(body, cut.rough, friction);
      gltf.show(body, gltf.mesh(name, {{cut.geometry, gltf.material(look)}}));
    }
  }

  gltf.expect_standing(0.025, "it is in equilibrium, and friction holds it");
  return gltf.text();
}

std::string incline() {
  constexpr double angle = std::numbers::pi / 6;
  constexpr double length = 6.4;
  constexpr double width = 2.8;
  constexpr double thickness = 0.2;
  constexpr double pitch = 0.9;
  const Vector3 size(0.6, 0.4, 0.6);
  struct Lane {
    const char* name;
    double friction;
    Finish look;
  };
  constexpr std::array<Lane, 3> lanes{{{"rubber_block", 0.8, finish::terracotta},
                                       {"wooden_block", 0.5, finish::mustard},
                                       {"waxed_block", 0.3, finish::teal}}};

  GltfBuilder gltf("incline", 2);
  gltf.camera({4.4, 4.2, 7.9}, {0.05, 1.40, 0}, 0.56);
  gltf.sun({-0.25, -1, -0.6}, warm_white, daylight);
  add_ground(gltf, 0.6);

  // The slope's frame: X downhill, Y off the surface, which is y = 0.
  const double sine = 0.5;
  const double cosine = std::sqrt(0.75);
  const double foot = thickness * cosine;  // the slab's lower edge stands on the ground
  const int slope = gltf.node("slope", at(0, length / 2 * sine + foot, 0) * turn(Vector3::UnitZ(), -angle));
  const int slab = gltf.node("slab", at(0, -thickness / 2, 0), slope);
  const Vector3 slab_size(length, thickness, width);
  gltf.collider(slab, gltf.box_shape(slab_size), gltf.physics_material(1));
  gltf.show(slab, gltf.mesh("slab",
                            {{gltf.geometry(rounded(box(slab_size), 0.03)), gltf.material(finish::maple)}}));

  // Draw the slab's supports, without colliders.
  const double half = length / 2 * cosine - 0.25;
  const double rise = 2 * half * sine / cosine;
  const std::array<PlanePoint, 3> side{{{-half, 0}, {half, 0}, {-half, rise}}};
  const Mesh wedge =
      Mesh().add(rounded(prism(side, width - 0.5), 0.03), turn(Vector3::UnitX(), std::numbers::pi / 2));
  gltf.show(gltf.node("support", at(0, 0, 0)),
            gltf.mesh("support", {{gltf.geometry(wedge), gltf.material(finish::granite)}}));

  const int shape = gltf.box_shape(size);
  const int block = gltf.geometry(rounded(box(size), 0.035));
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const Lane& lane = lanes[i];
    const int body = gltf.node(lane.name, at(-2.6, size.y() / 2, pitch * (static_cast<int>(i) - 1)), slope);
    gltf.motion(body, {.mass = 10});
    gltf.collider(body, shape, gltf.physics_material(lane.friction));
    gltf.show(body, gltf.mesh(lane.name, {{block, gltf.material(lane.look)}}));
  }

  const Vector3 downhill(cosine, -sine, 0);
  for (const Lane& lane : lanes) {
    const std::string name = lane.name;
    const double gain = 9.81 * (sine - lane.friction * cosine);
    if (gain < 0) {
      gltf.expect({.name = name + ": largest displacement",
                   .quantity = "displacement",
                   .bodies = {name},
                   .value = 0,
                   .tolerance = 0.001,
                   .source = "Coulomb: it stays, since tan 30° < μ"});
      continue;
    }
    const double way = gain * 2 * 2 / 2;
    gltf.expect_at({name + ": way down the slope at 2 s", "way", {name}, downhill}, 2, way, 0.02 * way,
                   "Coulomb: a t²/2 with a = g (sin 30° − μ cos 30°)");
  }
  return gltf.text();
}

std::string powered_wheel() {
  constexpr double radius = 0.4;
  constexpr double track = 0.42;                        // from the middle to each wheel
  constexpr double tyre = 0.08;                         // half its width
  const Pose along_z = turn(Vector3::UnitX(), pi / 2);  // Y of turned pieces to +Z

  GltfBuilder gltf("powered_wheel", 5);
  set_view(gltf, {4.3, 2.3, 6.4}, {2.2, 0.5, 0}, 0.56);
  add_ground(gltf, 0.9);

  // A ramp that rises 1 in 8 to a deck. The boards along its sides are drawn only.
  const std::array<PlanePoint, 4> side{{{-2.5, 0}, {2.5, 0}, {2.5, 0.1875}, {-1, 0.1875}}};
  const std::array<PlanePoint, 5> board_side{
      {{-2.3, 0}, {2.53, 0}, {2.53, 0.22}, {-1, 0.22}, {-2.3, 0.0575}}};
  const Pose upright = turn(Vector3::UnitX(), pi / 2);
  const int deck = gltf.geometry(Mesh().add(faceted(prism(side, 1.75)), upright));
  Mesh boards;
  for (const int z : {1, -1})
    boards.add(rounded(prism(board_side, 0.06), 0.015), at(0, 0, z * 0.905) * upright);
  const int ramp = gltf.node("ramp", at(3.75, 0, 0));
  const int hull =
      gltf.detached_node("ramp_hull", gltf.mesh("ramp_hull", {{deck, gltf.material(finish::maple)}}));
  gltf.hull_collider(ramp, hull, gltf.physics_material(0.9));
  gltf.show(ramp, gltf.mesh("ramp", {{deck, gltf.material(finish::maple)},
                                     {gltf.geometry(boards), gltf.material(finish::walnut)}}));

  // Chassis: its node stands on the axle.
  const int chassis = gltf.node("chassis", at(0, radius, 0));
  const Vector3 hull_size(1.4, 0.3, 0.5);
  const double mass = 8;
  const Vector3 squares = hull_size.cwiseProduct(hull_size);
  gltf.motion(chassis, {.mass = mass,
                        .inertia = Vector3(squares.y() + squares.z(), squares.x() + squares.z(),
                                           squares.x() + squares.y()) *
                                   (mass / 12),
                        .centre_of_mass = Vector3(-0.2, 0, 0)});
  gltf.collider(gltf.node("chassis_box", at(-0.25, 0.05, 0), chassis), gltf.box_shape(hull_size),
                gltf.physics_material(0.6));
  constexpr double skid = 0.1;
  gltf.collider(gltf.node("skid", at(-0.9, skid - radius, 0), chassis), gltf.sphere_shape(skid),
                gltf.physics_material(0));

  const std::array<PlanePoint, 6> profile{
      {{-0.95, -0.04}, {-0.80, -0.12}, {0.30, -0.12}, {0.46, 0.02}, {0.16, 0.18}, {-0.88, 0.24}}};
  const Mesh body = Mesh().add(rounded(prism(profile, 0.5), 0.05, 4), upright);
  const std::array<PlanePoint, 4> seat{{{-0.62, 0.17}, {-0.12, 0.15}, {-0.30, 0.34}, {-0.56, 0.38}}};
  const Mesh cabin = Mesh().add(rounded(prism(seat, 0.36), 0.04, 3), upright);
  Mesh metal;
  metal.add(rod(2 * track - 0.1, 0.05, 0.01), along_z);
  metal.add(rod(0.34, 0.15, 0.03, 28), along_z);
  metal.add(rod(0.24, 0.035, 0.005), at(-0.9, skid - radius + 0.15, 0));
  metal.add(ball(skid), at(-0.9, skid - radius, 0));
  gltf.show(chassis, gltf.mesh("chassis", {{gltf.geometry(body), gltf.material(finish::terracotta)},
                                           {gltf.geometry(cabin), gltf.material(finish::ivory)},
                                           {gltf.geometry(metal), gltf.material(finish::steel)}}));

  // Both wheels and their axle are one body. Balls as colliders: they roll without the bumps of a prism.
  const int wheels = gltf.node("wheels", at(0, radius, 0));
  gltf.motion(wheels, {.mass = 4, .inertia = Vector3(0.9, 0.9, 0.32)});
  const int round = gltf.sphere_shape(radius);
  const int grip = gltf.physics_material(0.9);

  const std::array<ProfilePoint, 6> tyre_ring{{{radius - 0.09, -tyre + 0.01, 0.01},
                                               {radius - 0.03, -tyre, 0.025},
                                               {radius - 0.012, -tyre + 0.04, 0.03},
                                               {radius - 0.012, tyre - 0.04, 0.03},
                                               {radius - 0.03, tyre, 0.025},
                                               {radius - 0.09, tyre - 0.01, 0.01}}};
  const std::array<ProfilePoint, 4> rim_ring{{{radius - 0.115, -tyre + 0.015, 0.006},
                                              {radius - 0.085, -tyre + 0.005, 0.006},
                                              {radius - 0.085, tyre - 0.005, 0.006},
                                              {radius - 0.115, tyre - 0.015, 0.006}}};
  const std::array<ProfilePoint, 8> hub{{{0, -0.07},
                                         {0.075, -0.07, 0.012},
                                         {0.075, 0.05, 0.012},
                                         {0.055, 0.065, 0.01},
                                         {0.055, 0.085, 0.01},
                                         {0.03, 0.10, 0.015},
                                         {0.012, 0.105, 0.005},
                                         {0, 0.105}}};
  Mesh rubber = turned(tyre_ring, 48, true);
  constexpr int treads = 24;
  const Mesh tread = rounded(box({0.03, 0.055, 0.05}), 0.008, 1);
  for (int i = 0; i < 2 * treads; ++i) {
    // Two staggered rows.
    const double row = i % 2 == 0 ? -0.033 : 0.033;
    rubber.add(tread, turn(Vector3::UnitY(), pi * i / treads) * at(radius - 0.0155, row, 0));
  }
  Mesh spokes = turned(hub, 24);
  constexpr int spoke_count = 6;
  const std::array<PlanePoint, 4> spoke{{{-0.034, -0.022}, {0.034, -0.022}, {0.034, 0.022}, {-0.034, 0.022}}};
  const Mesh bar =
      Mesh().add(rounded(prism(spoke, 0.26, 0.625), 0.008, 2),
                 at(0.175, 0, 0) * turn(Vector3::UnitZ(), -pi / 2) * turn(Vector3::UnitY(), pi / 2));
  for (int i = 0; i < spoke_count; ++i) spokes.add(bar, turn(Vector3::UnitY(), 2 * pi * i / spoke_count));
  const int wheel =
      gltf.mesh("wheel", {{gltf.geometry(rubber), gltf.material(finish::rubber)},
                          {gltf.geometry(turned(rim_ring, 40, true)), gltf.material(finish::brass)},
                          {gltf.geometry(spokes), gltf.material(finish::ivory)}});
  for (const int z : {1, -1}) {
    // Y of the wheel's mesh points outwards.
    const int node = gltf.node(z > 0 ? "left_wheel" : "right_wheel",
                               at(0, 0, z * track) * turn(Vector3::UnitX(), z * pi / 2), wheels);
    gltf.collider(node, round, grip);
    gltf.show(node, wheel);
  }

  // The chassis as the wheels see it turns about +Z: the wheels turn about −Z, which is forwards along +X.
  const int axle = gltf.node("axle", {}, wheels);
  gltf.joint(axle, gltf.node("bearing", {}, chassis),
             gltf.hinge(VelocityDrive{.velocity = 2.5, .damping = 1000, .max_torque = 8}));

  constexpr double reached = 0.7;  // s: when it has its speed
  const std::string_view level = "T/r = (M + I/r²) a until v = ω r, and v from then on";
  gltf.expect_mean(
      {"speed before the ramp, mean from 0.8 to 1.5 s", "velocity", {"wheels"}, Vector3::UnitX()}, {0.8, 1.5},
      2.5 * radius, 0.02, level);
  gltf.expect_at({"way to the ramp at 1.5 s", "way", {"wheels"}, Vector3::UnitX()}, 1.5,
                 reached * 2.5 * radius / 2 + (1.5 - reached) * 2.5 * radius, 0.025, level);
  gltf.expect_mean({"speed on the deck, mean from 4.5 to 5 s", "velocity", {"wheels"}, Vector3::UnitX()},
                   {4.5, 5}, 2.5 * radius, 0.02, "the motor holds ω, the wheels roll: v = ω r");
  gltf.expect_mean({"the wheels' rate on the deck, mean from 4.5 to 5 s",
                    "angular_velocity",
                    {"wheels"},
                    -Vector3::UnitZ()},
                   {4.5, 5}, 2.5, 0.05, "the motor's speed");
  return gltf.text();
}

}  // namespace substep::scenes
