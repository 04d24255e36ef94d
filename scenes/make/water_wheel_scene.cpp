/// A wheel with blades that balls turn.

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/math/rotation.h"
#include "stage.h"

namespace substep::scenes {

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
  gltf.expect_at({"ball_20: way down the chute at 1 s", "way", {"ball_20"}, Vector3(cosine, -sine, 0)}, 1,
                 5.0 / 7 * 9.81 * sine / 2, 0.025, "a solid ball rolls with 5/7 g sin θ");
  gltf.expect_no_gain(6, "nothing drives the wheel; the balls' fall is worth 600 J");
  return gltf.text();
}

}  // namespace substep::scenes
