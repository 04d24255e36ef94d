/// Scenes that others published: geometry, materials, step and criterion are theirs, see scenes/published.md.

#include <cmath>

#include "scenes.h"

namespace substep::scenes {
namespace {

constexpr std::array box_woods{finish::maple, finish::cherry, finish::oak, finish::walnut};

/// Returns a view from the front, above and slightly right; the picture holds `size`, m.
Stage stage_of(const Vector3& target, double size, double friction) {
  return {
      .eye = target + size * Vector3(0.45, 0.35, 1.35), .target = target, .yfov = 0.56, .friction = friction};
}

/// The shape, material and mesh of several bodies.
class BodyTemplate {
 public:
  BodyTemplate(GltfBuilder& gltf, const std::string& name, int shape, const Mesh& look, const Finish& finish,
               double friction)
      : gltf_(gltf),
        shape_(shape),
        material_(gltf.physics_material(friction)),
        mesh_(gltf.mesh(name, {{look, finish}})) {}

  /// Makes boxes of `size`, drawn with rounded edges.
  BodyTemplate(GltfBuilder& gltf, const std::string& name, const Vector3& size, const Finish& finish,
               double friction)
      : BodyTemplate(gltf, name, gltf.box_shape(size), cuboid(size, 0.04 * size.minCoeff(), 1), finish,
                     friction) {}

  /// Adds a body, without a collider where `motion` has an inertia.
  int add(const std::string& name, const Pose& pose, const Motion& motion) const {
    if (motion.inertia) return gltf_.body(name, pose, motion, mesh_);
    return gltf_.body(name, pose, motion, {shape_, material_}, mesh_);
  }

 private:
  GltfBuilder& gltf_;
  int shape_;
  int material_;
  int mesh_;
};

/// Expects that no cube moves by half its side.
void expect_standing_for(GltfBuilder& gltf, double seconds, std::string_view source) {
  gltf.expect({"time until a cube has moved 0.5 m", "displacement"}, stays(0.5), at_least(seconds), 0.01,
              source);
}

void join(GltfBuilder& gltf, int joint, int body, const Vector3& on_body, int parent,
          const Vector3& on_parent) {
  const int end = gltf.node("joint", at(on_body), body);
  gltf.joint(end, gltf.node("end", at(on_parent), parent), joint);
}

constexpr double dvi_step = 0.002;  // s, step of Newton's DVI tests

/// Expects the speed and distance after `steps` steps, each of which adds `acceleration` × step to the speed.
void expect_sums(GltfBuilder& gltf, const std::string& body, const Vector3& direction, double speed,
                 double acceleration, int steps, std::string_view source) {
  const double time = dvi_step * steps;
  gltf.expect({"", "velocity", {body}, direction}, at_time(time), speed + acceleration * time, 1e-4, source);
  gltf.expect({"", "way", {body}, direction}, at_time(time),
              speed * time + acceleration * dvi_step * dvi_step * steps * (steps + 1) / 2, 1e-5, source);
}

/// Returns SimBenchmark's Kapla tower: six floors of eight base bricks and nine wall bricks.
GltfBuilder kapla_with(std::string_view name, double friction) {
  constexpr int floors = 6;
  constexpr double seconds = 600;
  GltfBuilder gltf(name, {.duration = seconds, .poster = 1, .step = 0.01},
                   stage_of({0.7, 0.6, 0}, 1.6, friction));
  const BodyTemplate base(gltf, "base", {0.05, 0.10, 0.25}, finish::walnut, friction);
  const BodyTemplate wall(gltf, "wall", {0.20, 0.10, 0.05}, finish::maple, friction);
  std::string last;
  for (int floor = 0; floor < floors; ++floor) {
    const double height = 0.2 * floor;
    int number = 0;
    for (int j = 0; j < 8; ++j)
      base.add(numbered("base", floor) + std::to_string(j), at(0.2 * j, height + 0.05, 0), {.mass = 10});
    const auto add_wall = [&](double x, double z) {
      last = numbered("wall", floor) + std::to_string(number++);
      wall.add(last, at(x, height + 0.15, z), {.mass = 10});
    };
    for (int j = 0; j < 4; ++j) add_wall(0.4 * j + 0.1, 0.1);
    for (int j = 0; j < 3; ++j) add_wall(0.4 * j + 0.3, -0.1);
    add_wall(0.1, -0.1);
    add_wall(1.3, -0.1);
  }
  gltf.expect({"time until the last wall is below 1 m", "position", {last}, Y}, stays(1), at_least(seconds),
              0.01, "SimBenchmark, Kapla test: RaiSim with 1000 iterations reaches the cap of 60,000 steps");
  return gltf;
}

/// Returns the AVBD demo's chain along +X. `weight_x`: x of the centre of its last body, a cube, m.
GltfBuilder heavy_rope_with(std::string_view name, double weight_x) {
  constexpr int bodies = 20;
  constexpr double cube = 5;
  constexpr double height = 29.5;  // above the ground
  constexpr double friction = 0.5;
  const Vector3 link(1, 0.5, 0.5);
  GltfBuilder gltf(name, {.duration = 10, .poster = 2, .gravity = {0, -10, 0}},
                   stage_of({8, 18, 0}, 38, friction));
  const BodyTemplate links(gltf, "link", link, finish::maple, friction);
  const BodyTemplate cubes(gltf, "weight", Vector3::Constant(cube), finish::iron, friction);
  const int joint = gltf.ball_joint();
  int parent = gltf.fixed_box("hook", link, at(0, height, 0), gltf.physics_material(friction), finish::steel);
  for (int i = 1; i < bodies; ++i) {
    const bool is_last = i == bodies - 1;
    const std::string body = is_last ? "weight" : numbered("link", i);
    const int node = (is_last ? cubes : links)
                         .add(body, at(is_last ? weight_x : i, height, 0),
                              {.mass = is_last ? cube * cube * cube : link.prod()});
    join(gltf, joint, node, {is_last ? -cube / 2 : -0.5, 0, 0}, parent, {0.5, 0, 0});
    parent = node;
  }
  gltf.expect({"lowest height of the weight", "position", {"weight"}, Y}, any_time,
              at_least(cube / 2 * std::sqrt(3.0)), 0.05,
              "Giles, Diaz and Yuksel 2025: no corner of it touches the ground, as with AVBD");
  gltf.expect({"joint gap", "joint_gap"}, any_time, at_most(0.5), 0.01,
              "half a link; the paper gives no number");
  return gltf;
}

/// Returns ContactBench's cube of 1000 kg on one of 1 g; `gap`, m, is below the light cube, 2 `gap` above.
GltfBuilder million_with(std::string_view name, double gap) {
  constexpr double side = 0.2;
  constexpr std::string_view source = "ContactBench, 2cubes.py: the paper's ill-conditioned case";
  GltfBuilder gltf(name, {.duration = 0.1, .step = 0.001}, stage_of({0, side, 0}, 0.9, 0.9));
  const BodyTemplate light(gltf, "light", Vector3::Constant(side), finish::maple, 0.95);
  const BodyTemplate heavy(gltf, "heavy", Vector3::Constant(side), finish::iron, 0.95);
  light.add("light", at(0, side / 2 + gap, 0), {.mass = 1e-3});
  heavy.add("heavy", at(0, 1.5 * side + 3 * gap, 0), {.mass = 1e3});
  if (gap > 0) {
    gltf.expect({"", "position", {"heavy"}, Y}, at_time(0.1), 1.5 * side, 1e-3, source);
    return gltf;
  }
  gltf.expect_standing(1e-9, source);
  gltf.expect({"complementarity", "contact_work"}, any_time, at_most(0), 1e-10, source);
  return gltf;
}

/// Returns cubes of 1 m in rows, each row a cube shorter than the row below.
GltfBuilder pyramid_with(std::string_view name, int base, double seconds) {
  constexpr double friction = 0.6;
  GltfBuilder gltf(name, {.duration = seconds, .gravity = {0, -10, 0}, .substeps = 4},
                   stage_of({0, 0.4 * base, 0}, 1.1 * base, friction));
  const BodyTemplate cube(gltf, "cube", Vector3::Ones(), finish::oak, friction);
  for (int row = 0; row < base; ++row) {
    for (int i = row; i < base; ++i)
      cube.add("", at((row + 1) * 0.5 + (i - row) - 0.5 * base, row + 0.5, 0), {.mass = 100});
  }
  expect_standing_for(gltf, seconds,
                      "Box3D, benchmarks.c: with 4 sub-steps the version of 80 falls over after 1000 steps");
  return gltf;
}

GltfBuilder rapier_chain() {
  constexpr int links = 16;
  constexpr double radius = 0.2;
  constexpr double pitch = 0.44;
  GltfBuilder gltf("rapier_chain", {.duration = 5, .poster = 0.5},
                   {.eye = {11, 1, 4.5}, .target = {0, -2.2, 4.5}, .yfov = 0.8});
  const int joint = gltf.ball_joint();
  const BodyTemplate balls(gltf, "ball", gltf.sphere_shape(radius), ball(radius, 16), finish::teal, 0);
  const BodyTemplate last(gltf, "weight", gltf.sphere_shape(10 * radius), ball(10 * radius), finish::iron, 0);
  int parent = gltf.node("hook");
  for (int i = 1; i <= links; ++i) {
    const bool is_last = i == links;
    const double r = is_last ? 10 * radius : radius;
    const double mass = 4.0 / 3 * pi * r * r * r;  // of density 1
    const int node = (is_last ? last : balls)
                         .add(is_last ? "weight" : numbered("ball", i), at(0, 0, is_last ? 8.84 : pitch * i),
                              {.mass = mass, .inertia = Vector3::Constant(0.4 * mass * r * r)});
    join(gltf, joint, node, {0, 0, i == 1 ? -pitch : -(r + 0.02)}, parent, {0, 0, i == 1 ? 0 : 0.22});
    parent = node;
  }
  gltf.expect({"joint gap", "joint_gap"}, any_time, at_most(0.1 * pitch), 0.01 * pitch,
              "a tenth of a link; Rapier's test compares gaps with 4 and with 20 sub-steps");
  return gltf;
}

GltfBuilder five_boxes() {
  constexpr int boxes = 5;
  constexpr double side = 0.2;
  constexpr double weight = 9.81e-3;  // N s: of a box, in a step
  constexpr std::string_view source = "Newton, test_kamino_solvers_dvi.py 05b: within 2 % after 75 sweeps";
  GltfBuilder gltf("five_boxes", {.duration = 0.05, .step = 0.001}, stage_of({0, 0.5, 0}, 1.4, 0.8));
  const BodyTemplate cube(gltf, "box", Vector3::Constant(side), finish::oak, 0.8);
  for (int i = 0; i < boxes; ++i) cube.add(numbered("box", i + 1), at(0, side * (i + 0.5), 0), {.mass = 1});
  gltf.expect({"impulses on the ground", "momentum_change"}, at_time(0.001), boxes * weight,
              0.02 * boxes * weight, source);
  gltf.expect({"impulses of all contacts", "contact_impulse", {}, Y}, at_time(0.001), 15 * weight,
              0.02 * 15 * weight, source);
  return gltf;
}

GltfBuilder sliding_boxes() {
  constexpr double speed = 3;
  GltfBuilder gltf("sliding_boxes", {.duration = 50 * dvi_step, .step = dvi_step},
                   stage_of({0.2, 0.1, 0}, 1.6, 1));
  int number = 0;
  for (const double friction : {0.1, 0.3, 0.8}) {
    const std::string name = numbered("box", ++number);
    BodyTemplate(gltf, name, Vector3::Constant(0.2), box_woods[static_cast<std::size_t>(number)], friction)
        .add(name, at(0, 0.1, 0.5 * (number - 2)), {.mass = 1, .linear_velocity = {speed, 0, 0}});
    expect_sums(gltf, name, X, speed, -friction * gravity, 50,
                "Newton, test_kamino_solvers_dvi.py 08d2: the sums of the steps");
  }
  return gltf;
}

GltfBuilder slopes() {
  GltfBuilder gltf("slopes", {.duration = 100 * dvi_step, .step = dvi_step}, stage_of({0, 0.5, 0}, 2.2, 1));
  for (const bool slides : {false, true}) {
    const std::string name = slides ? "sliding" : "resting";
    const double friction = slides ? 0.3 : 0.7;
    const Pose surface = at(0, 0.6, slides ? 0.5 : -0.5) * turn(Z, -(slides ? 35 : 25) / 180.0 * pi);
    const Vector3 downhill = surface.orientation * X;
    gltf.fixed_box(name + "_slope", {1.6, 0.1, 0.8}, surface * at(0, -0.05, 0), gltf.physics_material(1),
                   finish::maple);
    BodyTemplate(gltf, name, Vector3::Constant(0.2), slides ? finish::teal : finish::terracotta, friction)
        .add(name, surface * at(0, 0.1, 0), {.mass = 1});
    const double sine = -downhill.y();
    const double cosine = downhill.x();
    expect_sums(gltf, name, downhill, 0, slides ? gravity * (sine - friction * cosine) : 0, 100,
                "Newton, test_kamino_solvers_dvi.py 08d4: the sums of the steps");
  }
  return gltf;
}

GltfBuilder rolling_ball() {
  constexpr double radius = 0.1;
  constexpr double speed = 2;
  constexpr double rolling = speed / 1.4;  // of a solid ball
  constexpr double time = 0.232;
  constexpr std::string_view source = "Newton, test_kamino_solvers_dvi.py 08e: rolling without slip";
  GltfBuilder gltf("rolling_ball", {.duration = time, .step = 0.001}, stage_of({0.2, 0.1, 0}, 1, 0.5));
  BodyTemplate(gltf, "ball", gltf.sphere_shape(radius), ball(radius), finish::mustard, 0.5)
      .add("ball", at(0, radius, 0), {.mass = 1, .linear_velocity = {speed, 0, 0}});
  gltf.expect({"", "velocity", {"ball"}, X}, at_time(time), rolling, 1e-4, source);
  gltf.expect({"", "angular_velocity", {"ball"}, -Z}, at_time(time), rolling / radius, 1e-4 / radius, source);
  return gltf;
}

GltfBuilder growing_cubes() {
  constexpr double friction = 0.5;
  GltfBuilder gltf("growing_cubes", {.duration = 10, .poster = 5, .gravity = {0, -10, 0}},
                   stage_of({0, 7.5, 0}, 19, friction));
  double bottom = 0;
  double side = 1;
  for (const Finish& wood : box_woods) {
    const std::string name = numbered("cube", static_cast<int>(side));
    BodyTemplate(gltf, name, Vector3::Constant(side), wood, friction)
        .add(name, at(0, bottom + side / 2, 0), {.mass = side * side * side});
    bottom += side;
    side *= 2;
  }
  gltf.expect_standing(0.05, "Giles, Diaz and Yuksel 2025, Fig. 10: AVBD with 20 iterations holds it");
  return gltf;
}

GltfBuilder friction_ways() {
  constexpr double speed = 10;
  constexpr double seconds = 3;
  GltfBuilder gltf("friction_ways", {.duration = seconds, .poster = seconds, .gravity = {0, -10, 0}},
                   stage_of({6, 0, 0}, 20, 10));
  for (int i = 0; i <= 10; ++i) {
    // The demo's pair has the geometric mean; here the ground has more friction than any box.
    const double friction = std::sqrt(0.5 * (5 - 0.5 * i));
    const std::string name = numbered("box", i);
    BodyTemplate(gltf, name, {1, 0.5, 1}, box_woods[static_cast<std::size_t>(i) % 4], friction)
        .add(name, at(0, 0.25, 2 * (i - 5)), {.mass = 0.5, .linear_velocity = {speed, 0, 0}});
    const double way = i == 10 ? speed * seconds : speed * speed / (20 * friction);
    gltf.expect({"", "way", {name}, X}, at_time(seconds), way, 0.01 * way,
                "v²/(2 μ g), of the AVBD demo's scene of dynamic friction");
  }
  return gltf;
}

GltfBuilder cube_tower() {
  constexpr double friction = 0.5;
  constexpr double seconds = 60;
  GltfBuilder gltf("cube_tower", {.duration = seconds, .poster = 30}, stage_of({0, 48, 0}, 120, friction));
  const BodyTemplate cube(gltf, "cube", Vector3::Ones(), finish::oak, friction);
  for (int i = 0; i < 100; ++i) cube.add(numbered("cube", i + 1), at(0, i + 0.5, 0), {.mass = 1});
  expect_standing_for(gltf, seconds,
                      "Avian, pull request 1033: stands with 4 sub-steps and recycled contacts");
  return gltf;
}

}  // namespace

std::vector<SceneFunction> published_scenes() {
  return {[] { return kapla_with("kapla", 0.64); },
          [] { return kapla_with("kapla_slippery", 0.5); },
          rapier_chain,
          five_boxes,
          sliding_boxes,
          slopes,
          rolling_ball,
          [] { return heavy_rope_with("heavy_rope", 21); },
          [] { return heavy_rope_with("heavy_rope_open", 21.5); },
          growing_cubes,
          friction_ways,
          [] { return million_with("million_to_one", 0); },
          [] { return million_with("million_to_one_dropped", 0.004); },
          [] { return pyramid_with("pyramid_80", 80, 1000.0 / 60); },
          [] { return pyramid_with("pyramid_100", 100, 200.0 / 60); },
          cube_tower};
}

}  // namespace substep::scenes
