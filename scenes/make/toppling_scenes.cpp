/// Scenes of what is knocked over: dominoes, a wall.

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "stage.h"

namespace substep::scenes {

std::string dominoes() {
  constexpr int count = 24;
  constexpr double radius = 0.85;
  constexpr double pitch = 0.19;
  const Vector3 size(0.06, 0.36, 0.18);
  constexpr std::array finishes{finish::terracotta, finish::mustard, finish::ivory, finish::teal,
                                finish::blue};

  GltfBuilder gltf("dominoes", 4);
  gltf.poster(1.5);
  set_view(gltf, {0.9, 1.9, 2.6}, {0, 0.10, 0}, 0.56);
  add_ground(gltf, 0.5);

  const int shape = gltf.box_shape(size);
  const int grip = gltf.physics_material(0.5);
  const int tile = gltf.geometry(rounded(box(size), 0.012));
  // A bar and pips on both faces, as dominoes have.
  Mesh pips;
  for (const int face : {-1, 1}) {
    const double x = face * (size.x() / 2 - 0.002);
    pips.add(rounded(box({0.008, 0.008, 0.13}), 0.002, 1), at(x, 0, 0));
    for (const int y : {-1, 1}) {
      for (const int z : {-1, 0, 1})
        pips.add(rod(0.008, 0.014, 0.002, 16),
                 at(x, 0.09 * y + 0.045 * z, 0.045 * z) * turn(Vector3::UnitZ(), pi / 2));
    }
  }
  const int pip = gltf.geometry(pips);
  const int walnut = gltf.material(finish::walnut);
  const int cream = gltf.material(finish::ivory);
  std::array<int, 5> looks{};
  for (int i = 0; i < 5; ++i)
    looks[i] = gltf.mesh("tile_" + std::to_string(i + 1),
                         {{tile, gltf.material(finishes[i])}, {pip, i == 2 ? walnut : cream}});
  for (int i = 0; i < count; ++i) {
    // X along the ring, in the sense in which they fall.
    const int body = gltf.node("domino_" + std::to_string(i + 1),
                               turn(Vector3::UnitY(), pitch * i / radius) * at(0, size.y() / 2, radius));
    Motion motion{.mass = 1};
    if (i == 0) {
      // Tipped about its leading edge.
      motion.linear_velocity = {size.y(), size.x(), 0};
      motion.angular_velocity = {0, 0, -2};
    }
    gltf.motion(body, motion);
    gltf.collider(body, shape, grip);
    gltf.show(body, looks[i % 5]);
  }

  gltf.expect({.name = "fall of that domino's centre which falls least, at 4 s",
               .quantity = "way",
               .direction = -Vector3::UnitY(),
               .at = 4,
               .at_least = 0.05,
               .tolerance = 0.005,
               .source = "the first one turns faster than it takes to fall, and each hits the next"});
  gltf.expect_no_gain(0.5, "nothing drives them; all of them are worth 36 J when they fall");
  return gltf.text();
}

std::string wrecking_ball() {
  constexpr double radius = 0.35;
  constexpr double link = 0.4;
  constexpr int links = 6;
  constexpr double pivot_height = 3.55;
  constexpr double angle = 1.0;
  const Vector3 brick(0.25, 0.25, 0.5);
  constexpr int courses = 5;

  GltfBuilder gltf("wrecking_ball", 4);
  gltf.poster(0.95);
  set_view(gltf, {-3.6, 2.7, 8.7}, {0.15, 1.62, 0}, 0.56);
  add_ground(gltf, 0.6);

  // A crane behind it all: drawn only.
  Mesh mast;
  mast.add(rounded(box({0.18, 3.8, 0.18}), 0.02), at(0, 1.9, -2.2));
  mast.add(rounded(box({0.14, 0.14, 2.5}), 0.02), at(0, pivot_height + 0.12, -1.05));
  mast.add(rounded(box({0.10, 0.10, 1.3}), 0.02),
           at(0, pivot_height - 0.35, -1.78) * turn(Vector3::UnitX(), -0.75));
  mast.add(rounded(box({1.2, 0.12, 0.2}), 0.02), at(0, 0.06, -2.2));
  mast.add(rounded(box({0.2, 0.12, 1.2}), 0.02), at(0, 0.06, -2.2));
  add_scenery(gltf, "crane", mast, finish::mustard);
  const int pivot = gltf.node("pivot", at(0, pivot_height, 0));
  const int frame = gltf.node("chain", at(0, pivot_height, 0) * turn(Vector3::UnitZ(), -pi / 2 - angle));

  const int joint = gltf.ball_joint();
  const Mesh shaft = Mesh()
                         .add(rod(link - 0.06, 0.03, 0.008, 20), turn(Vector3::UnitZ(), pi / 2))
                         .add(ball(0.05, 20), at(-link / 2, 0, 0));
  const int shaft_look = gltf.geometry(shaft);
  const int steel = gltf.material(finish::steel);
  const int link_look = gltf.mesh("link", {{shaft_look, steel}});
  int connected = pivot;
  for (int i = 0; i < links; ++i) {
    const std::string number = std::to_string(i + 1);
    const int body = gltf.node("link_" + number, at(link * (i + 0.5), 0, 0), frame);
    gltf.motion(body, {.mass = 10, .inertia = Vector3(0.01, 10 * link * link / 12, 10 * link * link / 12)});
    gltf.show(body, link_look);
    gltf.joint(gltf.node("joint_" + number, at(-link / 2, 0, 0), body), connected, joint);
    connected = gltf.node("end_" + number, at(link / 2, 0, 0), body);
  }
  const int heavy = gltf.node("ball", at(links * link + radius, 0, 0), frame);
  gltf.motion(heavy, {.mass = 400, .inertia = Vector3::Constant(0.4 * 400 * radius * radius)});
  const int grip = gltf.physics_material(0.6);
  gltf.collider(heavy, gltf.sphere_shape(radius), grip);
  const Pose across = turn(Vector3::UnitZ(), pi / 2);
  Mesh fittings;
  fittings.add(rod(0.07, radius + 0.004, 0.01, 48), across);
  fittings.add(rod(0.09, 0.10, 0.03, 24), across * at(0, radius - 0.02, 0));
  fittings.add(ball(0.05, 20), at(-radius, 0, 0));
  const int round = gltf.geometry(ball(radius, 40));
  const int fitting = gltf.geometry(fittings);
  const int iron = gltf.material(finish::iron);
  gltf.show(heavy, gltf.mesh("ball", {{round, iron}, {fitting, gltf.material(finish::brass)}}));
  gltf.joint(gltf.node("joint_" + std::to_string(links + 1), at(-radius, 0, 0), heavy), connected, joint);

  // The wall stands where the ball hangs at rest, in running bond.
  const Vector3 half(brick.x(), brick.y(), brick.z() / 2);
  const int whole_shape = gltf.box_shape(brick);
  const int half_shape = gltf.box_shape(half);
  const int whole_look = gltf.geometry(rounded(box(brick), 0.018, 2));
  const int half_look = gltf.geometry(rounded(box(half), 0.018, 2));
  const std::array<int, 3> clay{gltf.material(finish::brick), gltf.material(finish::terracotta),
                                gltf.material(finish::sandstone)};
  int number = 0;
  for (int course = 0; course < courses; ++course) {
    const bool odd = course % 2 == 1;
    const int pieces = odd ? 5 : 4;
    for (int i = 0; i < pieces; ++i, ++number) {
      const bool end = odd && (i == 0 || i == pieces - 1);
      double z = brick.z() * (i - (pieces - 1) / 2.0);
      if (end) z += i == 0 ? half.z() / 2 : -half.z() / 2;
      const std::string name = "brick_" + std::to_string(number + 1);
      const int body = gltf.node(name, at(0.62, brick.y() * (course + 0.5), z));
      gltf.motion(body, {.mass = end ? 10.0 : 20.0});
      gltf.collider(body, end ? half_shape : whole_shape, grip);
      gltf.show(body, gltf.mesh(name, {{end ? half_look : whole_look, clay[(number * 5 + course) % 3]}}));
    }
  }

  gltf.expect_no_gain(50, "nothing drives it; the ball's fall is worth 5 kJ");
  return gltf.text();
}

}  // namespace substep::scenes
