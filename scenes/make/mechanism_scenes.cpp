/// Scenes of closed loops and stiff springs: mechanisms of the IFToMM's library of multibody benchmarks, and
/// Andrews' squeezing mechanism from the Test Set for IVP Solvers.

#include <algorithm>

#include "closed_forms.h"
#include "scenes.h"
#include "sim/math/rotation.h"

namespace substep::scenes {
namespace {

/// Returns a square bar from one point to another.
Mesh bar(const Vector3& from, const Vector3& to, double width) {
  const Vector3 along = to - from;
  return Pose{(from + to) / 2, shortest_rotation(X, along)} *
         cuboid({along.norm(), width, width}, width / 8, 2);
}

/// Returns a pin about an axis of the node, at a point.
Mesh pin(const Vector3& point, int axis, double length, double radius) {
  return Pose{point, shortest_rotation(Y, Vector3::Unit(axis))} * rod(length, radius, radius / 8, 24);
}

/// Returns the rotation from a hinge's frame, whose +Z is the axis, to the node's.
Quaternion hinge_about(int axis) {
  return shortest_rotation(Z, Vector3::Unit(axis));
}

/// Returns a square post on a plate that reaches from the ground to `height`.
Mesh foot(double height, double thickness, const Vector3& point) {
  return at(point.x(), height / 2, point.z()) * cuboid({thickness, height, thickness}, 0.012) +
         at(point.x(), 0.03, point.z()) * cuboid({0.5, 0.06, 0.5}, 0.02);
}

GltfBuilder bricard() {
  constexpr double width = 0.1;
  constexpr double height = 2.3;  // of the fixed rod
  constexpr int count = 6;
  const std::array<Vector3, count> corners{
      {{0, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, -1, 1}, {0, -1, 1}, {0, 0, 1}}};
  constexpr std::array<int, count> axes{1, 2, 0, 1, 2, 0};
  constexpr std::array finishes{finish::terracotta, finish::mustard, finish::teal, finish::blue,
                                finish::ivory};
  GltfBuilder gltf("bricard", {.duration = 10, .poster = 1.1},
                   {.eye = {4.4, 2.9, 4.4}, .target = {0.45, 1.55, 0.5}, .yfov = 0.52});

  // The sixth rod is the ground.
  const Vector3 origin(0, height, 0);
  Mesh fixed = bar(corners[5] + origin, corners[0] + origin, width);
  for (const double z : {0.25, 0.75}) fixed += foot(height, 0.07, {0, 0, z});
  gltf.scenery("stand", {{fixed, finish::iron}});

  std::array<int, count> nodes{};
  std::array<Vector3, count> centres;
  for (int i = 0; i < count; ++i) {
    const Vector3 half = (corners[(i + 1) % count] - corners[i]) / 2;
    centres[i] = corners[i] + half + origin;
    if (i == count - 1) {
      nodes[i] = gltf.node("ground_rod", at(centres[i]));
      continue;
    }
    Vector3 size = 2 * half.cwiseAbs();
    for (double& extent : size) extent = std::max(extent, width);
    nodes[i] = gltf.body(
        numbered("rod", i + 1), at(centres[i]), {.mass = 1, .inertia = box_inertia(1, size)},
        {{bar(-half, half, width), finishes[i]}, {pin(-half, axes[i], 0.17, 0.035), finish::brass}});
  }
  const int hinge = gltf.hinge();
  for (int i = 0; i < count; ++i) {
    const int before = (i + count - 1) % count;
    const std::string name = numbered("corner", i + 1);
    const Vector3 corner = corners[i] + origin;
    const Quaternion frame = hinge_about(axes[i]);
    const int held = gltf.node(name + "_eye", {corner - centres[before], frame}, nodes[before]);
    const int carried = gltf.node(name, {corner - centres[i], frame}, nodes[i]);
    // Put a joint's own node on a body that moves.
    const bool is_last = i == count - 1;
    gltf.joint(is_last ? held : carried, is_last ? carried : held, hinge);
  }
  gltf.expect_constant_energy(0.5, "nothing drives it, and hinges take nothing");
  return gltf;
}

GltfBuilder four_bar() {
  constexpr int cells = 4;
  constexpr double length = 1;
  constexpr double width = 0.04;
  constexpr double height = 1.35;     // of the bearings
  constexpr double leaning = pi / 6;  // of the cranks from the upright
  constexpr std::array finishes{finish::terracotta, finish::mustard, finish::teal, finish::blue,
                                finish::cherry};
  GltfBuilder gltf("four_bar", {.duration = 4, .poster = 0.75},
                   {.eye = {2.0, 2.1, 6.6}, .target = {2.0, 1.30, 0}, .yfov = 0.56});

  Mesh stand = at(cells * length / 2, height, -0.16) * cuboid({cells * length + 0.3, 0.08, 0.08}, 0.015);
  for (const int i : {0, cells}) stand += foot(height, 0.07, {i * length, 0, -0.16});
  gltf.scenery("stand", {{stand, finish::iron}});

  const auto [sine, cosine] = sine_cosine(leaning);
  const Vector3 inertia = box_inertia(1, {length, width, width});
  const int hinge = gltf.hinge();
  const int crank = gltf.geometry(bar({0, -length / 2, 0}, {0, length / 2, 0}, width));
  const int crank_pins = gltf.geometry(pin({0, -length / 2, -0.06}, 2, 0.22, 0.018) +
                                       pin({0, length / 2, 0.03}, 2, 0.14, 0.018));
  const int coupler = gltf.geometry(bar({-length / 2, 0, 0.05}, {length / 2, 0, 0.05}, width));
  gltf.material(finish::brass);
  std::array<int, cells + 1> cranks{};
  const int bearings = gltf.node("bearings", at(0, height, 0));
  for (int i = 0; i <= cells; ++i) {
    const std::string name = numbered("crank", i);
    cranks[i] = gltf.body(
        name, at(i * length + sine * length / 2, height + cosine * length / 2, 0) * turn(Z, -leaning),
        {.mass = 1, .inertia = Vector3(inertia.y(), inertia.x(), inertia.z())},
        {{crank, finishes[i]}, {crank_pins, finish::brass}});
    const int bearing = gltf.node(name + "_bearing", at(i * length, 0, 0), bearings);
    gltf.joint(gltf.node(name + "_axle", at(0, -length / 2, 0), cranks[i]), bearing, hinge);
  }
  for (int i = 0; i < cells; ++i) {
    const std::string name = numbered("coupler", i + 1);
    const int body = gltf.body(name, at((i + 0.5 + sine) * length, height + cosine * length, 0),
                               {.mass = 1, .inertia = inertia}, {{coupler, finish::ivory}});
    for (const int side : {0, 1}) {
      const std::string end = name + (side == 0 ? "_left" : "_right");
      const int held = gltf.node(end + "_pin", at(0, length / 2, 0), cranks[i + side]);
      gltf.joint(gltf.node(end, at((side - 0.5) * length, 0, 0), body), held, hinge);
    }
  }
  // All cranks turn as one: a pendulum that swings by 150° from its lowest position.
  const double moment = (cells + 1) * (inertia.z() + 0.25 * length * length) + cells * length * length;
  const double period = pendulum_period(moment, (cells + 1) * 0.5 + cells, gravity, length, pi - leaning);
  gltf.expect({"period", "angular_velocity", {"crank_0"}, Z}, crossing(2), period, 0.02 * period,
              "all cranks turn as one pendulum: T = 4 √(I/(w l)) K(sin 75°)");
  return gltf;
}

/// A flyball governor of 3000 kg/m³: bars of 1 m, 0.01 m square, and a cube of 0.1 m. Each arm ends in a ball
/// of 5 kg.
struct Governor : GltfBuilder {
  Governor()
      : GltfBuilder("governor", {.duration = 4, .poster = 0.5},
                    {.eye = {1.5, 1.75, 2.9}, .target = {0, 1.02, 0}, .yfov = 0.56}) {
    scenery("stand", {{foot(base, 0.12, {0, 0, 0}), finish::iron}});
    const int shaft = body("shaft", at(0, base + length / 2, 0),
                           {.mass = bar_mass, .inertia = thin, .angular_velocity = {0, rate, 0}},
                           {{rod(length + 0.06, 0.016, 0.004), finish::steel}});
    const Quaternion upright = hinge_about(1);
    const int bearing = node("bearing", {Vector3(0, base, 0), upright});
    joint(node("shaft_foot", {Vector3(0, -length / 2, 0), upright}, shaft), bearing, hinge_);
    const Vector3 cube = Vector3::Constant(0.1);
    const int slider = body("slider", at(0, base + length - 2 * half * cosine, 0),
                            {.mass = 3, .inertia = box_inertia(3, cube), .angular_velocity = {0, rate, 0}},
                            {{cuboid(cube, 0.012), finish::mustard}});
    const int slides = joint_description({locked(linear, {0, 2}), locked(angular, {0, 1, 2})});
    const int guide = node("guide", {}, shaft);
    joint(node("sleeve", {}, slider), guide, slides);
    add_arms(shaft, slider);
    expect({"slider: height at 2 s", "position", {"slider"}, Y}, at_time(2), 0.684838792523, 0.01,
           "Lagrange's equations of the shaft's and the arms' angles and the slider's height");
  }

  static constexpr double length = 1;
  static constexpr double bar_mass = 0.3;
  static constexpr double ball_mass = 5;
  static constexpr double ball_radius = 0.075;
  static constexpr double half = 0.5;     // from the top to where a spring holds an arm; a spring's length
  static constexpr double base = 0.55;    // of the shaft
  static constexpr double rate = 2 * pi;  // rad/s
  const Vector3 thin = box_inertia(bar_mass, {0.01, length, 0.01});
  const double cosine = sine_cosine(pi / 6).cosine;

  void add_arms(int shaft, int slider) {
    constexpr double arm_mass = bar_mass + ball_mass;
    constexpr double centre = (bar_mass * length / 2 + ball_mass * length) / arm_mass;  // from the top
    const double sine = sine_cosine(pi / 6).sine;
    const int spring = joint_description(
        {{.kind = linear, .axes = {0, 1, 2}, .min = half, .max = half, .stiffness = 8e5, .damping = 4e4}});
    const double of_ball = 0.4 * ball_mass * ball_radius * ball_radius;
    const double across = thin.x() + bar_mass * (centre - length / 2) * (centre - length / 2) + of_ball +
                          ball_mass * (length - centre) * (length - centre);
    const int arm_bar = geometry(bar({0, centre, 0}, {0, centre - length, 0}, 0.022));
    const int arm_ball = geometry(at(0, centre - length, 0) * ball(ball_radius, 32));
    for (const int side : {-1, 1}) {
      const std::string name = side < 0 ? "left" : "right";
      const Vector3 along(side * sine, -cosine, 0);
      // Velocities are in the node's space: the arm goes round with the shaft.
      const Quaternion back = turn(Z, -side * pi / 6).orientation;
      const int arm =
          body(name + "_arm", at(Vector3(0, base + length, 0) + centre * along) * turn(Z, side * pi / 6),
               {.mass = arm_mass,
                .inertia = Vector3(across, thin.y() + of_ball, across),
                .linear_velocity = back * Vector3(0, 0, -rate * side * centre * sine),
                .angular_velocity = back * Vector3(0, rate, 0)},
               {{arm_bar, finish::terracotta}, {arm_ball, finish::brass}});
      const int top = node(name + "_top", at(0, length / 2, 0), shaft);
      joint(node(name + "_hinge", {Vector3(0, centre, 0), back}, arm), top, hinge_);
      const int low = node(name + "_spring_foot", {}, slider);
      joint(node(name + "_spring", at(0, centre - half, 0), arm), low, spring);
    }
  }

  int hinge_ = hinge();
};

/// Andrews' squeezing mechanism: seven bodies in a plane, three closed loops. The benchmark's data is in its
/// own units, kg and m; here all lengths are ten times as long and everything takes a hundred times as long,
/// so that it can be watched.
struct Squeezer : GltfBuilder {
  Squeezer()
      : GltfBuilder("squeezer", {.duration = 3, .poster = 1.6, .gravity = Vector3::Zero()},
                    {.eye = {-0.1, 0.95, 2.15},
                     .target = {-0.27, 0.68, 0},
                     .yfov = 0.52,
                     .light = {-0.35, -0.9, -0.8}}) {
    const Mesh board = at(-0.27, 0.70, -0.06) * cuboid({1.25, 1.2, 0.06}, 0.015);
    scenery("board", {{board, finish::walnut}});
    Mesh stand;
    for (const int side : {-1, 1})
      stand += at(-0.27 + side * 0.5, 0.06, -0.06) * cuboid({0.08, 0.12, 0.4}, 0.015);
    scenery("stand", {{stand, finish::iron}});
    plane_ = node("plane", at(0, height, 0));
    material(finish::brass);
    material(finish::steel);
    add_bodies();
    add_joints();
    Mesh bearings;
    for (const Vector3& point : {o, a, b, c})
      bearings +=
          at(scale * point + Vector3(0, height, 0.02)) * turn(X, pi / 2) * rod(0.10, 0.016, 0.004, 24);
    scenery("bearings", {{bearings, finish::steel}});
    expect_angles();
  }

  struct Link {
    std::string name;
    Pose pose;
    double angle;
    int node;
  };

  static constexpr double scale = 10;
  static constexpr double slow = 100;
  static constexpr double height = 0.45;  // of the crank's axis
  // Angles of the bodies at the start, rad, with the benchmark's names.
  static constexpr double beta = -0.0617138900142764, gamma = 0.455279819163070, phi = 0.222668390165886,
                          delta = 0.487364979543843, omega = -0.222668390165886, epsilon = 1.23054744454982;

  static Vector3 point(double x, double y) { return {x, y, 0}; }
  static Vector3 polar(double length, double angle) {
    const auto [sine, cosine] = sine_cosine(angle);
    return point(length * cosine, length * sine);
  }
  /// Returns a point along (sin, −cos) of an angle, as the benchmark often has it.
  static Vector3 aside(double length, double angle) { return polar(length, angle - pi / 2); }

  const Vector3 o = point(0, 0);
  const Vector3 a = point(-0.06934, -0.00227);
  const Vector3 b = point(-0.03635, 0.03273);
  const Vector3 c = point(0.014, 0.072);
  const Vector3 crank_pin = polar(0.007, beta);
  const Vector3 p = crank_pin + polar(-0.028, beta);
  const Vector3 elbow = a + polar(0.04, delta);   // between K4 and K5
  const Vector3 knee = a + aside(0.04, epsilon);  // between K6 and K7
  const Vector3 spring_point = b + (aside(0.018, gamma) + polar(0.02, gamma));

  void add_bodies() {
    add_body("crank", 0.04325, 2.194e-6, polar(0.00092, beta), beta, {o, crank_pin}, 5, finish::terracotta);
    add_body("rod", 0.00365, 4.410e-7, crank_pin + polar(-0.0115, beta), beta, {crank_pin, p}, 4,
             finish::ivory);
    add_body("lever", 0.02373, 5.255e-6, b + (aside(0.01874, gamma) + polar(0.01043, gamma)), gamma,
             {b, p, spring_point}, 0, finish::teal);
    add_body("upper_link", 0.00706, 5.667e-7, elbow + aside(0.02 - 0.01421, delta + phi), phi + delta,
             {elbow, p}, 2, finish::mustard);
    add_body("upper_arm", 0.07050, 1.169e-5, a + (polar(0.02308, delta) + polar(0.00916, delta + pi / 2)),
             delta, {a, elbow}, 1, finish::blue);
    add_body("lower_link", 0.00706, 5.667e-7, knee + polar(0.02 - 0.01421, epsilon + omega), omega + epsilon,
             {knee, p}, 3, finish::mustard);
    add_body("lower_arm", 0.05498, 1.912e-5, a + (aside(0.01228, epsilon) + polar(-0.00449, epsilon)),
             epsilon, {a, knee}, 1, finish::cherry);
  }

  /// Adds a body that is drawn as bars between its joints.
  void add_body(const std::string& name, double mass, double moment, const Vector3& centre, double angle,
                const std::vector<Vector3>& joints, double layer, const Finish& paint) {
    const Pose pose = at(scale * centre) * turn(Z, angle);
    const Pose upright = turn(X, pi / 2);
    const Vector3 up(0, 0, 0.016 * layer);
    const auto local = [&](std::size_t i) { return pose.inverse() * (scale * joints[i % joints.size()]); };
    Mesh bars;
    Mesh pins;
    for (std::size_t i = 0; i < joints.size(); ++i) {
      pins += at(local(i) + Vector3(0, 0, up.z() + 0.004)) * upright * rod(0.02, 0.013, 0.003, 20);
      bars += at(local(i) + up) * upright * rod(0.014, 0.024, 0.003, 28);
      if (joints.size() == 2 && i == 1) break;
      const Vector3 along = local(i + 1) - local(i);
      bars += Pose{(local(i) + local(i + 1)) / 2 + up, shortest_rotation(X, along)} *
              cuboid({along.norm(), 0.028, 0.013}, 0.003, 2);
    }
    if (name == "crank") bars += at(local(0) + up) * upright * rod(0.014, 0.06, 0.003, 40);
    // A moment of 0 is infinite in the format: the body turns about Z alone.
    const int index = body(name, pose, {.mass = mass, .inertia = Vector3(0, 0, moment * scale * scale)},
                           {{bars, paint}, {pins, finish::brass}}, plane_);
    links_.push_back({name, pose, angle, index});
  }

  int fixed(const std::string& name, const Vector3& point) { return node(name, at(scale * point), plane_); }

  /// Adds a node on a link, parallel to the plane's frame.
  int on(const std::string& name, int link, const Vector3& point) {
    const auto& [link_name, pose, angle, body] = links_[link];
    return node(name, at(pose.inverse() * (scale * point)) * turn(Z, -angle), body);
  }

  void add_joints() {
    // Every joint is a pin: two rows in the plane.
    const AxesLimit pin = locked(linear, {0, 1});
    const int pinned = joint_description({pin});
    const auto add_pin = [&](const std::string& name, int first, int second, const Vector3& point) {
      const int held = on(name + "_eye", second, point);
      joint(on(name, first, point), held, pinned);
    };
    const auto add_bearing = [&](const std::string& name, int link, const Vector3& point) {
      const int held = fixed(name + "_bearing", point);
      joint(on(name, link, point), held, pinned);
    };
    // A motor far below its target speed turns with its full torque.
    const double moment = 0.033 * scale * scale / (slow * slow);
    const int driven = joint_description(
        {pin}, {{.kind = angular, .axis = 2, .velocity = 1e6, .damping = 1, .max_force = moment}});
    const int motor = fixed("motor", o);
    joint(motor, on("crank_axis", 0, o), driven);
    add_pin("crank_pin", 1, 0, crank_pin);
    add_pin("lever_pin", 2, 1, p);
    add_pin("upper_pin", 3, 1, p);
    add_pin("lower_pin", 5, 1, p);
    add_bearing("lever_axis", 2, b);
    add_pin("elbow", 4, 3, elbow);
    add_pin("knee", 6, 5, knee);
    add_bearing("upper_axis", 4, a);
    add_bearing("lower_axis", 6, a);
    const int spring = joint_description({{.kind = linear,
                                           .axes = {0, 1, 2},
                                           .min = 0.07785 * scale,
                                           .max = 0.07785 * scale,
                                           .stiffness = 4530 / (slow * slow)}});
    const int spring_end = on("spring_end", 2, spring_point);
    joint(fixed("spring_foot", c), spring_end, spring);
  }

  /// Expects the seven angles at 0.03 s of the benchmark's time.
  void expect_angles() {
    constexpr double end_beta = 15.81077119629904, end_theta = -15.75637105984298,
                     end_gamma = 0.04082224013073101, end_phi = -0.5347301163226948,
                     end_delta = 0.5244099658805304, end_omega = 0.5347301163226948,
                     end_epsilon = 1.048080741042263;
    constexpr std::array ends{end_beta,  end_beta + end_theta,    end_gamma,  end_phi + end_delta,
                              end_delta, end_omega + end_epsilon, end_epsilon};
    for (std::size_t i = 0; i < links_.size(); ++i) {
      const auto& [name, pose, angle, index] = links_[i];
      expect({name + ": angle turned at 3 s", "angle", {name}, Z}, at_time(3), ends[i] - angle,
             i == 0 ? 0.15 : 0.05, "Test Set for IVP Solvers (Bari), Andrews' squeezing mechanism");
    }
  }

  int plane_ = 0;  // frame of the benchmark's plane
  std::vector<Link> links_;
};

}  // namespace

std::vector<SceneFunction> mechanism_scenes() {
  return {bricard, four_bar, made<Governor>, made<Squeezer>};
}

}  // namespace substep::scenes
