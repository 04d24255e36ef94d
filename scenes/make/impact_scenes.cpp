/// Scenes of impacts: balls that bounce or pass on their speed, dominoes, a wrecking ball.

#include <cmath>

#include "scenes.h"
#include "sim/math/rotation.h"

namespace substep::scenes {
namespace {

GltfBuilder bouncing_balls() {
  constexpr double radius = 0.15;
  constexpr double drop = 1;
  constexpr double pitch = 0.5;
  constexpr std::array finishes{finish::rubber, finish::blue, finish::teal, finish::mustard,
                                finish::terracotta};
  GltfBuilder gltf("bouncing_balls", {.duration = 4},
                   {.eye = {0.7, 1.15, 3.9}, .target = {0, 0.66, 0}, .yfov = 0.46});
  gltf.ground(gltf.bouncing_material(0));

  const int shape = gltf.sphere_shape(radius);
  const int round = gltf.geometry(ball(radius, 40));
  // Draw a post beside each ball, with a mark where its lowest point comes to after the first bounce.
  const Mesh foot = turned({corner(0, 0), corner(0.10, 0, 0.01), corner(0.10, 0.03, 0.01),
                            corner(0.014, 0.04, 0.01), corner(0.014, 1.4, 0.01), corner(0, 1.4)},
                           28);
  const int post = gltf.mesh("post", {{foot, finish::iron}});
  const int mark = gltf.mesh("mark", {{ring(0.012, 0.035, 0.012, 0.004, 28), finish::brass}});
  const double falls = std::sqrt(2 * drop / gravity);  // s
  for (int i = 0; i < 5; ++i) {
    const double restitution = i / 4.0;
    const int stand = gltf.scenery(numbered("post", i), post, at(pitch * (i - 2), 0, -0.3));
    gltf.scenery(numbered("mark", i), mark, at(0, restitution * restitution * drop, 0), stand);
    const std::string name = numbered("ball", i);
    gltf.body(name, at(pitch * (i - 2), drop + radius, 0), {.mass = 1},
              {shape, gltf.bouncing_material(restitution)}, {{round, finishes[i]}});

    double height = drop;
    double flight = falls;
    double time = falls;
    for (int bounce = 1; bounce <= 3 && i > 0; ++bounce) {
      height *= restitution * restitution;
      flight *= restitution;
      time += 2 * flight;
      if (time > 4 || height < 0.01) break;
      gltf.expect({name + ": highest centre after impact " + std::to_string(bounce), "position", {name}, Y},
                  peak(bounce), radius + height, 0.05 * height,
                  "it goes up to e² times the height that it fell from");
    }
    if (restitution == 1) continue;
    const double rests = falls * (1 + restitution) / (1 - restitution);
    gltf.expect({name + ": centre once it rests", "position", {name}, Y}, throughout(rests + 0.1, 4), radius,
                0.01, "infinitely many impacts last √(2 h/g) (1 + e)/(1 − e)");
  }
  return gltf;
}

/// Newton's cradles: one whose balls touch, one whose balls have gaps of 3 cm.
struct Cradles : GltfBuilder {
  Cradles()
      : GltfBuilder(
            "cradle", {.duration = 4, .poster = 0.9667},
            {.eye = {0.6, 1.45, 5.0}, .target = {0, 0.50, 0}, .yfov = 0.50, .light = {-0.3, -1, -0.75}}) {
    const int round = geometry(ball(radius, 40));
    const int wire = geometry(wires());
    polished_ = mesh("ball", {{round, finish::steel}, {wire, finish::brass}});
    thrown_ = mesh("thrown_ball", {{round, finish::terracotta}, {wire, finish::brass}});
    add("touching", -1.02, 0);
    add("spaced", 1.02, 0.03);
    expect_speeds();
  }

  static constexpr double radius = 0.1;
  static constexpr double length = 0.7;
  static constexpr double height = 0.95;
  static constexpr double angle = 0.6;
  static constexpr double spread = 0.28;  // of the wires, along Z

  /// Returns two stiff wires and the eye on the ball.
  static Mesh wires() {
    Mesh mesh;
    for (const int side : {-1, 1}) {
      const Vector3 wire(0, length, side * spread);
      mesh += Pose{Vector3(0, length / 2, side * spread / 2), shortest_rotation(Y, wire)} *
              rod(wire.norm() - 0.08, 0.006, 0.001, 12);
    }
    return mesh + at(0, radius + 0.01, 0) * rod(0.05, 0.02, 0.006, 20);
  }

  void add(const std::string& name, double middle, double gap) {
    constexpr double half = 0.8;  // of the frame's length
    Mesh frame;
    for (const int side : {-1, 1}) {
      frame += at(middle, height, side * spread) * turn(Z, pi / 2) * rod(2 * half, 0.022, 0.006, 24);
      for (const int end : {-1, 1}) {
        frame += at(middle + end * half, (height + 0.03) / 2, side * spread) *
                 rod(height - 0.03, 0.022, 0.006, 24);
        frame += at(middle + end * half, height, side * spread) * ball(0.034, 24);
      }
    }
    scenery(name + "_frame", {{frame, finish::iron}});
    const Mesh base = cuboid({2 * half + 0.16, 0.07, 2 * spread + 0.16}, 0.02);
    scenery(name + "_base", {{at(middle, 0.035, 0) * base, finish::walnut}});
    for (int i = 0; i < 5; ++i) {
      const std::string number = numbered(name, i + 1);
      const Pose top = at(middle + (2 * radius + gap) * (i - 2), height, 0);
      const int pivot = node(number + "_pivot", top);
      const int bob = body(number, top * (i == 0 ? turn(Z, -angle) : Pose{}) * at(0, -length, 0),
                           {.mass = 1, .inertia = Vector3::Constant(0.4 * radius * radius)},
                           {shape_, elastic_}, i == 0 ? thrown_ : polished_);
      joint(node(number + "_top", at(0, length, 0), bob), pivot, hinge_);
    }
  }

  /// Expects the first speeds after the impacts and constant energy. Each gap takes `loss` of speed².
  void expect_speeds() {
    const double rotation_factor = 1 + 0.4 * radius * radius / (length * length);
    const double fall = 2 * gravity * length * (1 - sine_cosine(angle).cosine);
    const double arrives = std::sqrt(fall / rotation_factor);
    const double beyond = 0.03 / length;
    const double loss = 2 * gravity * length * (1 - std::sqrt(1 - beyond * beyond)) / rotation_factor;
    const auto expect_speed = [&](const std::string& name, const std::vector<std::string>& bodies, int side,
                                  double speed) {
      expect({name, "velocity", bodies, Vector3(side, 0, 0)}, peak(1), speed, 0.05 * arrives,
             "the law of impact, restitution 1");
    };
    expect_speed("touching_1: first speed back", {"touching_1"}, -1, 0.6 * arrives);
    expect_speed("touching_2 … touching_5: first speed", numbered("touching", 2, 5), 1, 0.4 * arrives);
    expect_speed("spaced_5: first speed", {"spaced_5"}, 1, std::sqrt(arrives * arrives - 4 * loss));
    expect_constant_energy(0.05 * fall, "restitution 1 and no friction: nothing is lost");
  }

  int shape_ = sphere_shape(radius);
  int elastic_ = bouncing_material(1);
  int hinge_ = hinge();
  int polished_ = 0;
  int thrown_ = 0;
};

GltfBuilder dominoes() {
  constexpr double radius = 0.85;
  constexpr double pitch = 0.19;
  const Vector3 size(0.06, 0.36, 0.18);
  constexpr std::array finishes{finish::terracotta, finish::mustard, finish::ivory, finish::teal,
                                finish::blue};
  GltfBuilder gltf("dominoes", {.duration = 4, .poster = 1.5},
                   {.eye = {0.9, 1.9, 2.6}, .target = {0, 0.10, 0}, .yfov = 0.56, .friction = 0.5});

  const Collider collider{gltf.box_shape(size), gltf.physics_material(0.5)};
  const int tile = gltf.geometry(cuboid(size, 0.012));
  // Draw a bar and pips on both faces, as dominoes have.
  Mesh pips;
  for (const int face : {-1, 1}) {
    const double x = face * (size.x() / 2 - 0.002);
    pips += at(x, 0, 0) * cuboid({0.008, 0.008, 0.13}, 0.002, 1);
    for (const int y : {-1, 1}) {
      for (const int z : {-1, 0, 1})
        pips += at(x, 0.09 * y + 0.045 * z, 0.045 * z) * turn(Z, pi / 2) * rod(0.008, 0.014, 0.002, 16);
    }
  }
  const int pip = gltf.geometry(pips);
  gltf.material(finish::walnut);
  gltf.material(finish::ivory);
  std::array<int, 5> looks{};
  for (int i = 0; i < 5; ++i)
    looks[i] = gltf.mesh(numbered("tile", i + 1),
                         {{tile, finishes[i]}, {pip, i == 2 ? finish::walnut : finish::ivory}});
  for (int i = 0; i < 24; ++i) {
    // Point X along the ring, in the direction of fall; tip the first domino about its leading edge.
    Motion motion{.mass = 1};
    if (i == 0) motion.linear_velocity = {size.y(), size.x(), 0};
    if (i == 0) motion.angular_velocity = {0, 0, -2};
    gltf.body(numbered("domino", i + 1), turn(Y, pitch * i / radius) * at(0, size.y() / 2, radius), motion,
              collider, looks[i % 5]);
  }
  gltf.expect({"fall of that domino's centre which falls least, at 4 s", "way", {}, -Y}, at_time(4),
              at_least(0.05), 0.005,
              "the first one turns faster than it takes to fall, and each hits the next");
  gltf.expect_no_gain(0.5, "nothing drives them; all of them are worth 36 J when they fall");
  return gltf;
}

/// A ball on a chain, and a wall where it hangs at rest.
struct WreckingBall : GltfBuilder {
  WreckingBall()
      : GltfBuilder("wrecking_ball", {.duration = 4, .poster = 0.95},
                    {.eye = {-3.6, 2.7, 8.7}, .target = {0.15, 1.62, 0}, .yfov = 0.56, .friction = 0.6}) {
    add_crane();
    add_chain_and_ball();
    add_wall();
    expect_no_gain(50, "nothing drives it; the ball's fall is worth 5 kJ");
  }

  static constexpr double pivot_height = 3.55;

  void add_crane() {
    const Mesh mast = at(0, 1.9, -2.2) * cuboid({0.18, 3.8, 0.18}, 0.02) +
                      at(0, pivot_height + 0.12, -1.05) * cuboid({0.14, 0.14, 2.5}, 0.02) +
                      at(0, pivot_height - 0.35, -1.78) * turn(X, -0.75) * cuboid({0.10, 0.10, 1.3}, 0.02) +
                      at(0, 0.06, -2.2) * cuboid({1.2, 0.12, 0.2}, 0.02) +
                      at(0, 0.06, -2.2) * cuboid({0.2, 0.12, 1.2}, 0.02);
    scenery("crane", {{mast, finish::mustard}});
  }

  void add_chain_and_ball() {
    constexpr double radius = 0.35;
    constexpr double link = 0.4;
    constexpr int links = 6;
    const Pose across = turn(Z, pi / 2);
    int end = node("pivot", at(0, pivot_height, 0));
    const int frame = node("chain", at(0, pivot_height, 0) * turn(Z, -pi / 2 - 1));
    const int pins = ball_joint();
    const Mesh shaft = across * rod(link - 0.06, 0.03, 0.008, 20) + at(-link / 2, 0, 0) * ball(0.05, 20);
    const int look = mesh("link", {{shaft, finish::steel}});
    const Motion swinging{.mass = 10, .inertia = Vector3(0.01, 10 * link * link / 12, 10 * link * link / 12)};
    for (int i = 1; i <= links; ++i) {
      const int bob = body(numbered("link", i), at(link * (i - 0.5), 0, 0), swinging, look, frame);
      end = add_link(i, bob, link, end, pins);
    }
    const Mesh fittings = across * rod(0.07, radius + 0.004, 0.01, 48) +
                          across * at(0, radius - 0.02, 0) * rod(0.09, 0.10, 0.03, 24) +
                          at(-radius, 0, 0) * ball(0.05, 20);
    const int heavy = body("ball", at(links * link + radius, 0, 0),
                           {.mass = 400, .inertia = Vector3::Constant(0.4 * 400 * radius * radius)},
                           {sphere_shape(radius), grip_},
                           {{ball(radius, 40), finish::iron}, {fittings, finish::brass}}, frame);
    joint(node(numbered("joint", links + 1), at(-radius, 0, 0), heavy), end, pins);
  }

  /// Adds a wall in running bond.
  void add_wall() {
    const Vector3 whole(0.25, 0.25, 0.5);
    const Vector3 half(0.25, 0.25, 0.25);
    constexpr std::array clay{finish::brick, finish::terracotta, finish::sandstone};
    for (const Finish& finish : clay) material(finish);
    const int whole_shape = box_shape(whole);
    const int half_shape = box_shape(half);
    const int whole_look = geometry(cuboid(whole, 0.018, 2));
    const int half_look = geometry(cuboid(half, 0.018, 2));
    int number = 0;
    for (int course = 0; course < 5; ++course) {
      const bool odd = course % 2 == 1;
      const int pieces = odd ? 5 : 4;
      for (int i = 0; i < pieces; ++i, ++number) {
        const bool end = odd && (i == 0 || i == pieces - 1);
        double z = whole.z() * (i - (pieces - 1) / 2.0);
        if (end) z += i == 0 ? half.z() / 2 : -half.z() / 2;
        body(numbered("brick", number + 1), at(0.62, whole.y() * (course + 0.5), z),
             {.mass = end ? 10.0 : 20.0}, {end ? half_shape : whole_shape, grip_},
             {{end ? half_look : whole_look, clay[(number * 5 + course) % 3]}});
      }
    }
  }

  int grip_ = physics_material(0.6);
};

}  // namespace

std::vector<SceneFunction> impact_scenes() {
  return {bouncing_balls, made<Cradles>, dominoes, made<WreckingBall>};
}

}  // namespace substep::scenes
