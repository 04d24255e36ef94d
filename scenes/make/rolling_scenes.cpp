/// Scenes of rolling: a ball into pins, balls and cones into a funnel, balls onto a wheel.

#include <cmath>
#include <span>

#include "scenes.h"
#include "sim/math/rotation.h"

namespace substep::scenes {
namespace {

/// A bowling lane and a ball that slides into ten pins.
struct Bowling : GltfBuilder {
  Bowling()
      : GltfBuilder("bowling", {.duration = 2.5, .poster = 0.62},
                    {.eye = {-1.75, 1.05, 1.05},
                     .target = {0.25, 0.20, -0.03},
                     .yfov = 0.50,
                     .friction = 0.5,
                     .light = {0.35, -1, -0.5}}) {
    add_lane();
    plastic_ = bouncing_material(0.5, 0.2);
    add_pins();
    add_ball();
    expect_no_gain(1.7, "restitution below 1 and friction only take energy; the ball has 170 J");
  }

  static constexpr double top = 0.10;  // of the lane

  void add_lane() {
    constexpr double half_width = 0.53;
    const int wood = physics_material(0.2);
    fixed_box("lane", {5.4, top, 2 * half_width}, at(-1.45, top / 2, 0), wood, finish::maple, 0.006);
    for (const int side : {-1, 1})
      fixed_box(side < 0 ? "right_board" : "left_board", {6.0, 0.34, 0.06},
                at(-1.15, 0.17, side * (half_width + 0.32)), wood, finish::walnut, 0.012);
    fixed_box("cushion", {0.12, 0.7, 1.8}, at(1.9, 0.35, 0), physics_material(0.8), finish::teal, 0.04);
    Mesh seams;
    for (int i = -4; i <= 4; ++i)
      seams += at(-1.45, top + 0.0002, 0.107 * i) * cuboid({5.39, 0.002, 0.003}, 0.0008, 1);
    scenery("seams", {{seams, finish::oak}});
  }

  void add_pins() {
    constexpr double pitch = 0.3048;  // from pin to pin, 12 inches
    // Heights and diameters of a regulation pin, 15 inches high.
    const Mesh pin =
        turned({corner(0, 0), corner(0.0258, 0, 0.004), corner(0.0495, 0.0571, 0.12),
                corner(0.0605, 0.1143, 0.08), corner(0.0469, 0.1842, 0.09), corner(0.0308, 0.2191, 0.06),
                corner(0.0228, 0.2540, 0.03), corner(0.0236, 0.2730, 0.06), corner(0.0323, 0.3433, 0.022),
                corner(0.0200, 0.3740, 0.008), corner(0, 0.3810)},
               40);
    Mesh stripes;
    for (const double y : {0.240, 0.262}) stripes += at(0, y, 0) * ring(0.020, 0.0262, 0.005, 0, 40);
    const int look = mesh("pin", {{pin, finish::ivory}, {stripes, finish::terracotta}});
    // Follow the outline with three solids; the pin stands on the flat end of the first.
    const int foot = cylinder_shape(0.0258, 0.0560, 0.085);
    const int belly = capsule_shape(0.0595, 0.0235, 0.115);
    const int head = capsule_shape(0.0225, 0.0325, 0.0985);
    int number = 0;
    for (int row = 0; row < 4; ++row) {
      for (int i = 0; i <= row; ++i) {
        const std::string name = numbered("pin", ++number);
        const double forward = pitch * 0.86602540378443865;  // sin 60°
        const int index = body(name, at(forward * row, top, pitch * (i - row / 2.0)), {.mass = 1.55}, look);
        collider(node(name + "_foot", at(0, 0.0425, 0), index), {foot, plastic_});
        collider(node(name + "_belly", at(0, 0.1755, 0), index), {belly, plastic_});
        collider(node(name + "_head", at(0, 0.29925, 0), index), {head, plastic_});
      }
    }
  }

  /// Adds a ball that slides and turns across its path, which bends into the pocket beside the first pin.
  void add_ball() {
    constexpr double radius = 0.108;
    Mesh holes;
    for (const Vector3& hole : {Vector3(0.018, 0, -0.02), Vector3(-0.018, 0, -0.02), Vector3(0, 0, 0.045)}) {
      const double height = std::sqrt(radius * radius - hole.squaredNorm());
      holes += turn(X, 0.5) * at(hole.x(), height - 0.0012, hole.z()) * rod(0.004, 0.013, 0.001, 24);
    }
    body("ball", at(-2.6, top + radius, 0.33),
         {.mass = 6.8, .linear_velocity = {7, 0, -0.62}, .angular_velocity = {-16, 0, -12}},
         {sphere_shape(radius), plastic_}, {{ball(radius, 56), finish::blue}, {holes, finish::rubber}});
  }

  int plastic_ = 0;
};

/// A point of a surface of revolution about +Y, and its normal there.
struct SurfacePoint {
  double radius;
  double y;
  double normal_radius;
  double normal_y;
};

/// Returns a point of a surface by its slope there, with the normal upwards.
SurfacePoint sloping(double radius, double y, double slope) {
  const double length = std::sqrt(1 + slope * slope);
  return {radius, y, -slope / length, 1 / length};
}

/// Returns the surface of a line turned about +Y, without thickness, whose front faces along the normals.
Mesh turned_surface(std::span<const SurfacePoint> line, std::uint32_t sectors) {
  Mesh mesh;
  for (const SurfacePoint& point : line) {
    for (std::uint32_t i = 0; i < sectors; ++i) {
      const auto [s, c] = sine_cosine(2 * pi * i / sectors);
      mesh.positions.emplace_back(point.radius * c, point.y, point.radius * s);
      mesh.normals.emplace_back(point.normal_radius * c, point.normal_y, point.normal_radius * s);
    }
  }
  for (std::uint32_t ring = 0; ring + 1 < line.size(); ++ring) {
    for (std::uint32_t i = 0; i < sectors; ++i) {
      const std::uint32_t a = ring * sectors + i;
      const std::uint32_t b = ring * sectors + (i + 1) % sectors;
      const Vector3 across =
          (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[a + sectors] - mesh.positions[a]);
      const bool is_front = across.dot(mesh.normals[a] + mesh.normals[a + sectors]) > 0;
      if (is_front)
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, b + sectors}, {a, b + sectors, a + sectors}});
      else
        mesh.triangles.insert(mesh.triangles.end(), {{a, b + sectors, b}, {a, a + sectors, b + sectors}});
    }
  }
  return mesh;
}

/// A funnel y = height − k/r, on which frictionless bodies have the potential of a planet.
struct Funnel : GltfBuilder {
  Funnel()
      : GltfBuilder("funnel", {.duration = 6, .poster = 1.2},
                    {.eye = {2.1, 3.4, 4.05},
                     .target = {0, 0.70, 0},
                     .yfov = 0.52,
                     .friction = 0.4,
                     .light = {-0.5, -1, -0.35}}) {
    // Space rings evenly in 1/√r: even steps of 1/r would crowd the hole.
    for (int i = 0; i <= 36; ++i) {
      const double root = std::sqrt(1 / rim) + i / 36.0 * (std::sqrt(1 / hole) - std::sqrt(1 / rim));
      const double r = 1 / (root * root);
      line_.push_back(sloping(r, height - k / r, slope_at(r)));
    }
    add_sheets();
    add_stand();
    slick_ = physics_material(0);
    planet_shape_ = sphere_shape(planet_radius);
    planet_ = geometry(ball(planet_radius, 32));
    add_planet("outer_planet", 2, 0.4, finish::terracotta);
    add_planet("middle_planet", 5, 2.2, finish::mustard);
    add_planet("inner_planet", 9, 4.4, finish::blue);
    add_marbles();
    add_cones();
  }

  static constexpr double k = 0.09;
  static constexpr double height = 1.55;
  static constexpr double hole = 0.10;
  static constexpr double rim = 1.0;
  static constexpr double planet_radius = 0.035;

  void add_sheets() {
    Finish shell = finish::steel;
    shell.name = "sheet steel";
    shell.double_sided = true;
    shell.roughness = 0.45;
    Finish cover = finish::teal;
    cover.name = "sheet teal";
    cover.double_sided = true;
    const int steel = physics_material(0.5);
    const int surface = geometry(turned_surface(line_, 160));
    // Studs show that the funnel turns; frictionless bodies must not be affected.
    Mesh studs;
    for (int i = 0; i < 12; ++i)
      studs += turn(Y, pi * i / 6) * at(rim - 0.008, height - k + 0.02, 0) * ball(0.016, 16);
    const int stud = geometry(studs);
    const int sheet = detached_node("sheet", {{surface, shell}});
    const int funnel = body("funnel", {}, {.mass = 20, .angular_velocity = {0, 0.6, 0}, .kinematic = true},
                            {{surface, shell}, {stud, finish::brass}});
    collider(funnel, {sheet, steel, Collider::Kind::mesh});
    collide_as(funnel, "sheet");

    // Add a shallow bowl upside down: bodies fall on the backs of its triangles.
    std::vector<SurfacePoint> bowl;
    for (int i = 0; i <= 12; ++i) {
      const double r = 0.002 + 0.55 * i / 12;
      bowl.push_back(sloping(r, 0.4 * r * r, 0.8 * r));
    }
    const int roof = scenery("roof", {{turned_surface(bowl, 64), cover}}, at(0, 0.36, 0) * turn(X, pi));
    collider(roof, {roof, steel, Collider::Kind::mesh});
    // Add a wall on the ground, which bodies hit from inside.
    const std::array<SurfacePoint, 2> strip{{{1.15, 0, 1, 0}, {1.15, 0.09, 1, 0}}};
    const int wall = scenery("wall", {{turned_surface(strip, 96), cover}});
    collider(wall, {wall, steel, Collider::Kind::mesh});
  }

  void add_stand() {
    Mesh stand;
    for (int i = 0; i < 3; ++i) {
      const Pose leg = turn(Y, 2 * pi * i / 3 + 0.5);
      stand += leg * at(rim + 0.03, (height - k) / 2, 0) * rod(height - k, 0.022, 0.006, 20);
      stand += leg * at(rim + 0.03, 0.015, 0) * rod(0.03, 0.07, 0.01, 28);
      stand += leg * at(0.44, 0.115, 0) * rod(0.23, 0.014, 0.004, 16);
    }
    stand += at(0, height - k, 0) * ring(rim - 0.006, rim + 0.016, 0.02, 0.008, 128);
    scenery("stand", {{stand, finish::walnut}});
  }

  static double slope_at(double r) { return k / (r * r); }

  /// Returns the centre of a ball that touches the funnel at distance r from the axis, in the plane z = 0.
  static Vector3 resting(double r, double radius) {
    const double slope = slope_at(r);
    const double length = std::sqrt(1 + slope * slope);
    return {r - radius * slope / length, height - k / r + radius / length, 0};
  }

  /// Adds a ball that circles on a ring, counted from the rim.
  void add_planet(const std::string& name, std::size_t ring, double angle, const Finish& paint) {
    // The ring's straight side has the slope of the curve at the geometric mean of its ends.
    const SurfacePoint& inner = line_[ring + 1];
    const double r = std::sqrt(line_[ring].radius * inner.radius);
    const double sunk = height - k / r - inner.y - k / (r * r) * (r - inner.radius);
    const Vector3 centre = resting(r, planet_radius);
    const double distance = centre.x();
    // On a circle the component of gravity along the slope is the centripetal force.
    const double speed = std::sqrt(gravity * slope_at(r) * distance);
    const int planet =
        body(name, turn(Y, angle) * at(distance, centre.y() - sunk, 0),
             {.mass = 1, .linear_velocity = {0, 0, -speed}}, {planet_shape_, slick_}, {{planet_, paint}});
    collide_as(planet, "planets", "sheet");
    expect({name + ": angle that it has gone round by after 6 s", "azimuth", {name}, Y}, at_time(6),
           speed / distance * 6, 0.05 * speed / distance * 6,
           "Kepler: v = √(g s ρ) on the circle where it starts");
    expect({name + ": distance from the axis", "distance", {name}, Y}, any_time, distance, 0.05 * distance,
           "Kepler: it stays on its circle");
  }

  /// Adds marbles that roll down from the rim, half of them with a push along it.
  void add_marbles() {
    constexpr double radius = 0.045;
    const Collider round{sphere_shape(radius), physics_material(0.5)};
    const int look = mesh("marble", {{ball(radius, 32), finish::ivory},
                                     {rod(0.012, radius + 0.0006, 0.002, 32), finish::cherry}});
    const Vector3 centre = resting(0.90, radius);
    for (int i = 0; i < 6; ++i)
      body(numbered("marble", i + 1), turn(Y, pi * i / 3) * at(centre.x(), centre.y(), 0),
           {.mass = 1, .linear_velocity = {0, 0, i % 2 == 0 ? -0.5 : 0}}, round, look);
  }

  /// Adds cones that stand on the slope at first.
  void add_cones() {
    constexpr double radius = 0.05;
    constexpr double half = 0.06;  // of the height
    const int shape = cylinder_shape(radius, 0, 2 * half);
    const Mesh cone = turned({corner(0, -half), corner(radius, -half, 0.002), corner(0, half)}, 40);
    const int look = mesh("cone", {{cone, finish::teal}});
    const Vector3 foot = resting(0.70, 0);
    const double slope = slope_at(0.70);
    const double length = std::sqrt(1 + slope * slope);
    // Stand the cone along the normal, its base just above the facets.
    const double half_cosine = std::sqrt((1 + 1 / length) / 2);
    const Pose upright{Vector3::Zero(), Quaternion(half_cosine, 0, 0, slope / length / (2 * half_cosine))};
    const double away = half + 0.004;
    for (int i = 0; i < 4; ++i)
      body(numbered("cone", i + 1),
           turn(Y, pi * i / 2 + 0.5) * at(foot.x() - away * slope / length, foot.y() + away / length, 0) *
               upright,
           {.mass = 0.5}, {shape, physics_material(0.08)}, look);
  }

  std::vector<SurfacePoint> line_;
  int slick_ = 0;
  int planet_shape_ = 0;
  int planet_ = 0;
};

/// A bladed wheel, turned by balls that fall onto it from a chute.
struct WaterWheel : GltfBuilder {
  WaterWheel()
      : GltfBuilder("water_wheel", {.duration = 6, .poster = 2.6},
                    {.eye = {-1.0, 2.5, 6.4},
                     .target = {-1.1, 1.35, 0},
                     .yfov = 0.56,
                     .friction = 0.4,
                     .light = {-0.3, -1, -0.6}}) {
    add_wheel();
    add_chute();
    const auto [sine, cosine] = sine_cosine(0.14);
    expect({"ball_20: way down the chute at 1 s", "way", {"ball_20"}, Vector3(cosine, -sine, 0)}, at_time(1),
           5.0 / 7 * gravity * sine / 2, 0.025, "a solid ball rolls with 5/7 g sin θ");
    expect_no_gain(6, "nothing drives the wheel; the balls' fall is worth 600 J");
  }

  static constexpr double radius = 0.85;
  static constexpr double width = 0.34;
  static constexpr double hub_radius = 0.45;
  static constexpr double height = 1.15;
  static constexpr double disc = width / 2 + 0.015;  // from the middle to a disc

  void add_wheel() {
    const Pose along_z = turn(X, pi / 2);
    const int wheel = node("wheel", at(0, height, 0));
    motion(wheel, {.mass = 20, .inertia = Vector3(4, 4, 7)});
    collider(node("drum", along_z, wheel), {cylinder_shape(hub_radius, hub_radius, width), slick_});
    const int disc_shape = cylinder_shape(radius, radius, 0.03);
    for (const int side : {-1, 1})
      collider(node(side < 0 ? "back_disc" : "front_disc", at(0, 0, side * disc) * along_z, wheel),
               {disc_shape, slick_});
    // Blades lean forwards, so that they hold a ball from the top to well below the axis.
    const Vector3 blade_size(0.42, 0.025, width);
    const int blade_shape = box_shape(blade_size);
    Mesh blades;
    for (int i = 0; i < 12; ++i) {
      const Pose blade = turn(Z, 2 * pi * i / 12) * at((hub_radius + radius) / 2, 0, 0) * turn(Z, 0.35);
      collider(node(numbered("blade", i + 1), blade, wheel), {blade_shape, slick_});
      blades += blade * cuboid(blade_size, 0.008, 2);
    }
    // Draw rings and spokes instead of the discs, which would hide the inside.
    Mesh rings;
    const Mesh rim = ring(radius - 0.07, radius, 0.015, 0.005, 64);
    for (const int side : {-1, 1}) {
      rings += at(0, 0, side * disc) * along_z * rim;
      for (int i = 0; i < 6; ++i)
        rings += turn(Z, pi * i / 3) * at(radius / 2, 0, side * disc) *
                 cuboid({radius - 0.03, 0.05, 0.028}, 0.006, 2);
    }
    show(wheel, {{blades, finish::maple},
                 {along_z * rod(width, hub_radius, 0.01, 48), finish::oak},
                 {rings, finish::walnut},
                 {along_z * rod(width + 0.7, 0.035, 0.008), finish::steel}});
    Mesh trestle;
    for (const int side : {-1, 1}) {
      for (const int lean : {-1, 1})
        trestle +=
            at(lean * 0.2, 0.58, side * 0.42) * turn(Z, lean * 0.33) * cuboid({0.09, 1.25, 0.08}, 0.012);
      trestle += at(0, height, side * 0.42) * cuboid({0.2, 0.12, 0.09}, 0.012);
    }
    scenery("trestle", {{trestle, finish::iron}});
    const int bearing = node("bearing", at(0, height, 0));
    joint(node("axle", {}, wheel), bearing, hinge(), true);
  }

  /// Adds a floor and two walls that slope to the wheel's left shoulder, and the balls on it.
  void add_chute() {
    constexpr double ball_radius = 0.075;
    constexpr double length = 0.16 * 20 + 0.1;
    constexpr std::array paints{finish::blue, finish::teal, finish::ivory};
    const int chute = node("chute", at(-0.42, 2.20, 0) * turn(Z, -0.14));
    const auto add_plank = [&](const char* name, const Vector3& size, const Vector3& centre) {
      fixed_body(name, at(centre), {box_shape(size), slick_}, {{cuboid(size, 0.008, 2), finish::oak}}, chute);
    };
    add_plank("chute_floor", {length, 0.03, 0.24}, {-length / 2, -0.015, 0});
    add_plank("chute_back", {length, 0.10, 0.03}, {-length / 2, 0.035, -0.12});
    add_plank("chute_front", {length, 0.10, 0.03}, {-length / 2, 0.035, 0.12});
    Mesh posts;
    for (const double x : {-1.0, -3.1}) {
      for (const int side : {-1, 1})
        posts += at(x - 0.42, (2.18 - 0.14 * x) / 2 - 0.05, side * 0.18) *
                 cuboid({0.08, 2.24 - 0.14 * x, 0.08}, 0.012);
    }
    scenery("posts", {{posts, finish::walnut}});
    const int shape = sphere_shape(ball_radius);
    const int round = geometry(ball(ball_radius, 28));
    for (int i = 0; i < 20; ++i)
      body(numbered("ball", i + 1), at(-0.12 - 0.16 * i, ball_radius, 0), {.mass = 1.5}, {shape, slick_},
           {{round, paints[i % 3]}}, chute);
  }

  int slick_ = physics_material(0.2);
};

}  // namespace

std::vector<SceneFunction> rolling_scenes() {
  return {made<Bowling>, made<Funnel>, made<WaterWheel>};
}

}  // namespace substep::scenes
