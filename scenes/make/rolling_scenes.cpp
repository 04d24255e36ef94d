/// Scenes of what rolls into something: a ball into pins, balls and cones into a funnel.

#include <cmath>
#include <span>
#include <vector>

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/math/rotation.h"
#include "stage.h"

namespace substep::scenes {
namespace {

/// A point of a surface of revolution about +Y, and its normal there.
struct SurfacePoint {
  double radius;
  double y;
  double normal_radius;
  double normal_y;
};

/// The surface of a line turned about +Y, without thickness: its front is where the normals point.
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
      const std::uint32_t next = (i + 1) % sectors;
      const std::uint32_t a = ring * sectors + i;
      const std::uint32_t b = ring * sectors + next;
      const Vector3 across =
          (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[a + sectors] - mesh.positions[a]);
      if (across.dot(mesh.normals[a] + mesh.normals[a + sectors]) > 0) {
        mesh.triangles.push_back({a, b, b + sectors});
        mesh.triangles.push_back({a, b + sectors, a + sectors});
      } else {
        mesh.triangles.push_back({a, b + sectors, b});
        mesh.triangles.push_back({a, a + sectors, b + sectors});
      }
    }
  }
  return mesh;
}

}  // namespace

std::string bowling() {
  constexpr double top = 0.10;         // of the lane
  constexpr double half_width = 0.53;  // of the lane
  constexpr double pitch = 0.3048;     // from pin to pin, 12 inches
  constexpr double ball_radius = 0.108;

  GltfBuilder gltf("bowling", 2.5);
  gltf.poster(0.62);
  gltf.camera({-1.75, 1.05, 1.05}, {0.25, 0.20, -0.03}, 0.50);
  gltf.sun({0.35, -1, -0.5}, warm_white, daylight);
  add_ground(gltf, 0.5);

  const int wood = gltf.physics_material(0.2);
  add_fixed_box(gltf, "lane", {5.4, top, 2 * half_width}, at(-1.45, top / 2, 0), wood, finish::maple, 0.006);
  for (const int side : {-1, 1}) {
    add_fixed_box(gltf, side < 0 ? "right_board" : "left_board", {6.0, 0.34, 0.06},
                  at(-1.15, 0.17, side * (half_width + 0.32)), wood, finish::walnut, 0.012);
  }
  const int cushion = gltf.physics_material(0.8);
  add_fixed_box(gltf, "cushion", {0.12, 0.7, 1.8}, at(1.9, 0.35, 0), cushion, finish::teal, 0.04);
  // Boards' seams and arrows: drawn only.
  Mesh seams;
  for (int i = -4; i <= 4; ++i)
    seams.add(rounded(box({5.39, 0.002, 0.003}), 0.0008, 1), at(-1.45, top + 0.0002, 0.107 * i));
  add_scenery(gltf, "seams", seams, finish::oak);

  // Heights and diameters of a regulation pin, 15 inches high.
  const std::array<ProfilePoint, 11> outline{{{0, 0},
                                              {0.0258, 0, 0.004},
                                              {0.0495, 0.0571, 0.12},
                                              {0.0605, 0.1143, 0.08},
                                              {0.0469, 0.1842, 0.09},
                                              {0.0308, 0.2191, 0.06},
                                              {0.0228, 0.2540, 0.03},
                                              {0.0236, 0.2730, 0.06},
                                              {0.0323, 0.3433, 0.022},
                                              {0.0200, 0.3740, 0.008},
                                              {0, 0.3810}}};
  const int pin_geometry = gltf.geometry(turned(outline, 40));
  Mesh stripes;
  for (const double y : {0.240, 0.262}) {
    const std::array<ProfilePoint, 4> stripe{
        {{0.020, y - 0.005}, {0.0262, y - 0.005}, {0.0262, y + 0.005}, {0.020, y + 0.005}}};
    stripes.add(turned(stripe, 40, true));
  }
  const int stripe_geometry = gltf.geometry(stripes);
  const int pin_look = gltf.mesh("pin", {{pin_geometry, gltf.material(finish::ivory)},
                                         {stripe_geometry, gltf.material(finish::terracotta)}});
  // Three solids that follow the outline: it stands on the first one's flat end.
  struct Piece {
    const char* name;
    int shape;
    double middle;
  };
  const std::array<Piece, 3> pieces{{{"foot", gltf.tapered_cylinder_shape(0.0258, 0.0560, 0.085), 0.0425},
                                     {"belly", gltf.tapered_capsule_shape(0.0595, 0.0235, 0.115), 0.1755},
                                     {"head", gltf.tapered_capsule_shape(0.0225, 0.0325, 0.0985), 0.29925}}};
  const int plastic = gltf.bouncing_material(0.5, 0.2);
  int number = 0;
  for (int row = 0; row < 4; ++row) {
    for (int i = 0; i <= row; ++i) {
      const std::string name = "pin_" + std::to_string(++number);
      const double forward = pitch * 0.86602540378443865;  // sin 60°
      const int pin = gltf.node(name, at(forward * row, top, pitch * (i - row / 2.0)));
      gltf.motion(pin, {.mass = 1.55});
      gltf.show(pin, pin_look);
      for (const Piece& piece : pieces)
        gltf.collider(gltf.node(name + "_" + piece.name, at(0, piece.middle, 0), pin), piece.shape, plastic);
    }
  }

  // It slides, turning across its way, which bends it into the pocket beside the first pin.
  const int ball_node = gltf.node("ball", at(-2.6, top + ball_radius, 0.33));
  gltf.motion(ball_node, {.mass = 6.8, .linear_velocity = {7, 0, -0.62}, .angular_velocity = {-16, 0, -12}});
  gltf.collider(ball_node, gltf.sphere_shape(ball_radius), plastic);
  Mesh holes;
  const Mesh hole = rod(0.004, 0.013, 0.001, 24);
  const Pose towards_grip = turn(Vector3::UnitX(), 0.5);
  for (const Vector3& place : {Vector3(0.018, 0, -0.02), Vector3(-0.018, 0, -0.02), Vector3(0, 0, 0.045)}) {
    const double height = std::sqrt(ball_radius * ball_radius - place.squaredNorm());
    holes.add(hole, towards_grip * at(place.x(), height - 0.0012, place.z()));
  }
  const int ball_geometry = gltf.geometry(ball(ball_radius, 56));
  const int hole_geometry = gltf.geometry(holes);
  gltf.show(ball_node, gltf.mesh("ball", {{ball_geometry, gltf.material(finish::blue)},
                                          {hole_geometry, gltf.material(finish::rubber)}}));

  gltf.expect_no_gain(1.7, "restitution below 1 and friction only take energy; the ball has 170 J");
  return gltf.text();
}

std::string funnel() {
  // Over a surface y = height − k/r, what slides without friction has the potential of a planet.
  constexpr double k = 0.09;
  constexpr double height = 1.55;
  constexpr double hole = 0.10;
  constexpr double rim = 1.0;
  constexpr double gravity = 9.81;

  GltfBuilder gltf("funnel", 6);
  gltf.poster(1.2);
  gltf.camera({2.1, 3.4, 4.05}, {0, 0.70, 0}, 0.52);
  gltf.sun({-0.5, -1, -0.35}, warm_white, daylight);
  add_ground(gltf, 0.4);

  Finish shell = finish::steel;
  shell.name = "sheet steel";
  shell.double_sided = true;
  shell.roughness = 0.45;
  Finish cover = finish::teal;
  cover.name = "sheet teal";
  cover.double_sided = true;

  // Rings at even steps of slope, so that edges are alike all the way down.
  std::vector<SurfacePoint> line;
  constexpr int rings = 36;
  for (int i = 0; i <= rings; ++i) {
    // From 1/rim to 1/hole in 1/r would crowd the hole; its square root spreads them.
    const double t = static_cast<double>(i) / rings;
    const double root = std::sqrt(1 / rim) + t * (std::sqrt(1 / hole) - std::sqrt(1 / rim));
    const double r = 1 / (root * root);
    const double slope = k / (r * r);
    const double length = std::sqrt(1 + slope * slope);
    line.push_back({r, height - k / r, -slope / length, 1 / length});
  }
  const int steel = gltf.physics_material(0.5);
  const int funnel_geometry = gltf.geometry(turned_surface(line, 160));
  // It turns, as the studs on its rim show: what slides on it without friction must not notice.
  Mesh studs;
  for (int i = 0; i < 12; ++i)
    studs.add(ball(0.016, 16), turn(Vector3::UnitY(), pi * i / 6) * at(rim - 0.008, height - k + 0.02, 0));
  const int stud_geometry = gltf.geometry(studs);
  const int steel_finish = gltf.material(shell);
  const int sheet = gltf.detached_node("sheet", gltf.mesh("sheet", {{funnel_geometry, steel_finish}}));
  const int funnel_node = gltf.node("funnel");
  gltf.motion(funnel_node, {.mass = 20, .angular_velocity = {0, 0.6, 0}, .kinematic = true});
  gltf.show(funnel_node, gltf.mesh("funnel", {{funnel_geometry, steel_finish},
                                              {stud_geometry, gltf.material(finish::brass)}}));
  gltf.mesh_collider(funnel_node, sheet, steel);
  gltf.collide_as(funnel_node, "sheet");

  // A shallow bowl, turned over: what falls on it meets the backs of its triangles.
  std::vector<SurfacePoint> bowl;
  for (int i = 0; i <= 12; ++i) {
    const double r = 0.002 + 0.55 * i / 12;
    const double slope = 0.8 * r;
    const double length = std::sqrt(1 + slope * slope);
    bowl.push_back({r, 0.4 * r * r, -slope / length, 1 / length});
  }
  const int bowl_geometry = gltf.geometry(turned_surface(bowl, 64));
  const int roof = gltf.node("roof", at(0, 0.36, 0) * turn(Vector3::UnitX(), pi));
  gltf.show(roof, gltf.mesh("roof", {{bowl_geometry, gltf.material(cover)}}));
  gltf.mesh_collider(roof, roof, steel);

  // A wall on the ground, met from inside.
  const std::array<SurfacePoint, 2> strip{{{1.15, 0, 1, 0}, {1.15, 0.09, 1, 0}}};
  const int strip_geometry = gltf.geometry(turned_surface(strip, 96));
  const int wall = gltf.node("wall");
  gltf.show(wall, gltf.mesh("wall", {{strip_geometry, gltf.material(cover)}}));
  gltf.mesh_collider(wall, wall, steel);

  // What holds it: drawn only.
  Mesh stand;
  for (int i = 0; i < 3; ++i) {
    const Pose leg = turn(Vector3::UnitY(), 2 * pi * i / 3 + 0.5);
    stand.add(rod(height - k, 0.022, 0.006, 20), leg * at(rim + 0.03, (height - k) / 2, 0));
    stand.add(rod(0.03, 0.07, 0.01, 28), leg * at(rim + 0.03, 0.015, 0));
    stand.add(rod(0.23, 0.014, 0.004, 16), leg * at(0.44, 0.115, 0));
  }
  const std::array<ProfilePoint, 4> hoop{{{rim - 0.006, height - k - 0.02, 0.008},
                                          {rim + 0.016, height - k - 0.02, 0.008},
                                          {rim + 0.016, height - k + 0.02, 0.008},
                                          {rim - 0.006, height - k + 0.02, 0.008}}};
  stand.add(turned(hoop, 128, true));
  add_scenery(gltf, "stand", stand, finish::walnut);

  // A ball that touches the funnel at distance r from the axis: its centre and the slope there.
  const auto resting = [&](double r, double radius) {
    const double slope = k / (r * r);
    const double length = std::sqrt(1 + slope * slope);
    return Vector3(r - radius * slope / length, height - k / r + radius / length, slope);
  };
  constexpr double planet_radius = 0.035;
  const int slick = gltf.physics_material(0);
  const int planet_shape = gltf.sphere_shape(planet_radius);
  const int planet_geometry = gltf.geometry(ball(planet_radius, 32));
  struct Circle {
    std::string name;
    double distance;  // of the planet's centre from the axis
    double speed;
  };
  std::vector<Circle> circles;
  struct Planet {
    const char* name;
    int ring;  // on which it goes round, from the rim
    double angle;
    Finish finish;
  };
  for (const Planet& planet :
       {Planet{"outer_planet", 2, 0.4, finish::terracotta}, Planet{"middle_planet", 5, 2.2, finish::mustard},
        Planet{"inner_planet", 9, 4.4, finish::blue}}) {
    // Where the ring's straight side has the slope of the curve: at the geometric mean of its ends.
    const SurfacePoint& outer = line[static_cast<std::size_t>(planet.ring)];
    const SurfacePoint& inner = line[static_cast<std::size_t>(planet.ring) + 1];
    const double r = std::sqrt(outer.radius * inner.radius);
    const double sunk = height - k / r - inner.y - k / (r * r) * (r - inner.radius);
    const Vector3 place = resting(r, planet_radius);
    // Round a circle: gravity's part along the slope is what it takes to stay on it.
    const double speed = std::sqrt(gravity * place.z() * place.x());
    circles.push_back({planet.name, place.x(), speed});
    const int body =
        gltf.node(planet.name, turn(Vector3::UnitY(), planet.angle) * at(place.x(), place.y() - sunk, 0));
    gltf.motion(body, {.mass = 1, .linear_velocity = {0, 0, -speed}});
    gltf.collider(body, planet_shape, slick);
    gltf.collide_as(body, "planets", "sheet");
    gltf.show(body, gltf.mesh(planet.name, {{planet_geometry, gltf.material(planet.finish)}}));
  }

  // Marbles that roll down from the rim, half of them with a push along it.
  constexpr double marble_radius = 0.045;
  const int grip = gltf.physics_material(0.5);
  const int marble_shape = gltf.sphere_shape(marble_radius);
  const int marble_geometry = gltf.geometry(ball(marble_radius, 32));
  const int band_geometry = gltf.geometry(rod(0.012, marble_radius + 0.0006, 0.002, 32));
  const int marble_look = gltf.mesh("marble", {{marble_geometry, gltf.material(finish::ivory)},
                                               {band_geometry, gltf.material(finish::cherry)}});
  for (int i = 0; i < 6; ++i) {
    const Vector3 place = resting(0.90, marble_radius);
    const int body = gltf.node("marble_" + std::to_string(i + 1),
                               turn(Vector3::UnitY(), pi * i / 3) * at(place.x(), place.y(), 0));
    Motion motion{.mass = 1};
    if (i % 2 == 0) motion.linear_velocity = {0, 0, -0.5};
    gltf.motion(body, motion);
    gltf.collider(body, marble_shape, grip);
    gltf.show(body, marble_look);
  }

  // Cones that stand on the slope at first.
  constexpr double cone_radius = 0.05;
  constexpr double cone_height = 0.12;
  const int cone_shape = gltf.tapered_cylinder_shape(cone_radius, 0, cone_height);
  const std::array<ProfilePoint, 3> cone{
      {{0, -cone_height / 2}, {cone_radius, -cone_height / 2, 0.002}, {0, cone_height / 2}}};
  const int cone_geometry = gltf.geometry(turned(cone, 40));
  const int cone_look = gltf.mesh("cone", {{cone_geometry, gltf.material(finish::teal)}});
  for (int i = 0; i < 4; ++i) {
    const Vector3 place = resting(0.70, 0);
    const double slope = place.z();
    const double length = std::sqrt(1 + slope * slope);
    // Along the normal there.
    const double half_cosine = std::sqrt((1 + 1 / length) / 2);
    const Pose upright{Vector3::Zero(), Quaternion(half_cosine, 0, 0, slope / length / (2 * half_cosine))};
    // Its base just clear of the facets under it.
    const double away = cone_height / 2 + 0.004;
    const int body =
        gltf.node("cone_" + std::to_string(i + 1),
                  turn(Vector3::UnitY(), pi * i / 2 + 0.5) *
                      at(place.x() - away * slope / length, place.y() + away / length, 0) * upright);
    gltf.motion(body, {.mass = 0.5});
    gltf.collider(body, cone_shape, gltf.physics_material(0.08));
    gltf.show(body, cone_look);
  }

  for (const auto& [name, distance, speed] : circles) {
    gltf.expect_at(
        {name + ": angle that it has gone round by after 6 s", "azimuth", {name}, Vector3::UnitY()}, 6,
        speed / distance * 6, 0.05 * speed / distance * 6,
        "Kepler: v = √(g s ρ) on the circle where it starts");
    gltf.expect({.name = name + ": distance from the axis",
                 .quantity = "distance",
                 .bodies = {name},
                 .direction = Vector3::UnitY(),
                 .value = distance,
                 .tolerance = 0.05 * distance,
                 .source = "Kepler: it stays on its circle"});
  }
  return gltf.text();
}

}  // namespace substep::scenes
