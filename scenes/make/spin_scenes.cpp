/// Scenes of turning bodies: gyroscopic effects, and rolling on turning bodies.

#include <cmath>

#include "scenes.h"
#include "sim/geometry/mass_properties.h"
#include "sim/math/rotation.h"

namespace substep::scenes {
namespace {

GltfBuilder heavy_top() {
  constexpr double mass = 2;
  constexpr double lever = 1;  // from the pivot to the centre of mass
  constexpr double tilt = 0.05;
  constexpr double spin = 50;
  constexpr double height = 0.62;

  GltfBuilder gltf("heavy_top", {.duration = 10, .poster = 1, .gravity = Vector3(0, -10, 0)},
                   {.eye = {1.7, 2.5, 4.3}, .target = {0, 1.30, 0}, .yfov = 0.56});

  gltf.scenery(
      "pedestal",
      {{turned({corner(0, 0), corner(0.42, 0, 0.01), corner(0.42, 0.06, 0.015), corner(0.36, 0.08, 0.02),
                corner(0.20, 0.14, 0.05), corner(0.13, 0.40, 0.05), corner(0.20, 0.50, 0.03),
                corner(0.20, height - 0.02, 0.01), corner(0.08, height - 0.02, 0.01),
                corner(0.03, height, 0.01), corner(0, height - 0.02)},
               48),
        finish::limestone}});
  const int pivot = gltf.node("pivot", at(0, height, 0));

  const Mesh stem =
      turned({corner(0, -lever), corner(0.014, -lever + 0.012, 0.008), corner(0.05, -lever + 0.14, 0.03),
              corner(0.05, -0.10, 0.02), corner(0.12, -0.07), corner(0.12, 0.09), corner(0.05, 0.12, 0.02),
              corner(0.05, 0.62, 0.02), corner(0.028, 0.80, 0.01), corner(0, 0.80)},
             32);
  const Mesh web =
      turned({corner(0.12, -0.035), corner(0.60, -0.02), corner(0.60, 0.02), corner(0.12, 0.045, 0.01),
              corner(0.11, 0.045, 0.002), corner(0.11, -0.035, 0.002)},
             64, true);
  const Mesh rim = turned({corner(0.59, -0.075, 0.02), corner(0.78, -0.06, 0.03), corner(0.78, 0.06, 0.03),
                           corner(0.59, 0.075, 0.02)},
                          64, true);
  const Mesh ring = turned({corner(0.04, 0.60, 0.01), corner(0.085, 0.60, 0.015), corner(0.085, 0.66, 0.015),
                            corner(0.04, 0.66, 0.01)},
                           32, true);
  // Studs, so that the spin can be seen.
  Mesh studs = ring;
  for (int i = 0; i < 6; ++i) {
    studs += turn(Y, pi * i / 3) * at(0.685, 0.068, 0) * rod(0.03, i == 0 ? 0.055 : 0.035, 0.01, 20);
  }
  const int body = gltf.body(
      "top", at(0, height, 0) * turn(X, tilt) * at(0, lever, 0),
      {.mass = mass, .inertia = Vector3(3, 1, 3), .angular_velocity = {0, spin, 0}},
      {{stem, finish::steel}, {web, finish::ivory}, {rim, finish::terracotta}, {studs, finish::brass}});
  gltf.joint(gltf.node("tip", at(0, -lever, 0), body), pivot, gltf.ball_joint());

  const std::string_view simo = "Simo and Wong (1991); Lagrange's equations, integrated to 12 digits";
  gltf.expect({"angle that it has gone round by after 10 s", "azimuth", {"top"}, Y}, at_time(10), 4.196191,
              0.1, simo);
  gltf.expect({"largest distance from the vertical", "distance", {"top"}, Y}, any_time,
              at_most(lever * sine_cosine(0.0545517).sine), 0.003, simo);
  gltf.expect_constant_energy(
      1, "Simo and Wong (1991): the energy is 1269.97500521 J, 20 J of it are the weight's");
  return gltf;
}

/// A turntable with a ball that rolls on it and blocks that it carries.
struct Turntable : GltfBuilder {
  Turntable()
      : GltfBuilder("turntable", {.duration = 6, .poster = 1.8},
                    {.eye = {1.5, 2.6, 3.4}, .target = {0, 0.30, 0.05}, .yfov = 0.56, .friction = 0.6}) {
    add_table();
    add_ball();
    const Vector3 size(0.18, 0.10, 0.18);
    const Collider solid{box_shape(size), physics_material(0.5)};
    const int block = geometry(cuboid(size, 0.012));
    add_block("inner_block", 0.72, 1.2, solid, {{block, finish::teal}});
    add_block("middle_block", 0.76, 3.3, solid, {{block, finish::mustard}});
    add_block("outer_block", 0.88, 5.0, solid, {{block, finish::terracotta}});
  }

  static constexpr double rate = 2.5;
  static constexpr double radius = 1.25;
  static constexpr double top = 0.42;

  void add_table() {
    constexpr double half = 0.05;  // of the thickness
    const Mesh foot =
        turned({corner(0, 0), corner(0.7, 0, 0.01), corner(0.7, 0.07, 0.02), corner(0.22, 0.12, 0.06),
                corner(0.16, 0.26, 0.05), corner(0.30, 0.31, 0.01), corner(0.30, 0.32), corner(0, 0.32)},
               48);
    scenery("foot", {{foot, finish::iron}});
    const Mesh plate = turned(
        {corner(0, -half), corner(radius, -half, 0.02), corner(radius, half, 0.012), corner(0, half)}, 96);
    Mesh inlay;
    for (const double r : {0.4, 0.785})
      inlay += at(0, half - 0.0045, 0) * ring(r - 0.008, r + 0.008, 0.0055, 0, 96);
    for (int i = 0; i < 12; ++i)
      inlay += turn(Y, pi * i / 6) * at(1.05, half - 0.005, 0) * cuboid({0.30, 0.012, 0.014}, 0.002, 1);
    body("table", at(0, top - half, 0), {.mass = 100, .angular_velocity = {0, rate, 0}, .kinematic = true},
         {cylinder_shape(radius, radius, 2 * half), physics_material(1)},
         {{plate, finish::walnut}, {inlay, finish::brass}});
  }

  /// Adds a ball that rolls in a circle: it starts on +X, and its centre moves along −Z.
  void add_ball() {
    constexpr double ball_radius = 0.12;
    constexpr double orbit = 0.4;
    const Mesh bands =
        rod(0.03, ball_radius + 0.0015, 0.006, 40) + rod(2 * ball_radius + 0.006, 0.035, 0.006, 24);
    body("ball", at(orbit, top + ball_radius, 0),
         {.mass = 1,
          .linear_velocity = {0, 0, -2.0 / 7 * rate * orbit},
          .angular_velocity = {5.0 / 7 * rate * orbit / ball_radius, 0, 0}},
         {sphere_shape(ball_radius), physics_material(0.5)},
         {{ball(ball_radius, 40), finish::ivory}, {bands, finish::brass}});
    expect({"angle that the ball has gone round by after 6 s", "azimuth", {"ball"}, Y}, at_time(6),
           2.0 / 7 * rate * 6, 0.05,
           "S. Earnshaw (1844): a rolling sphere goes round at 2/7 of the table's rate");
    expect({"the ball's distance from the axis", "distance", {"ball"}, Y}, any_time, orbit, 0.05 * orbit,
           "S. Earnshaw (1844): in a circle");
  }

  void add_block(const std::string& name, double distance, double angle, const Collider& solid,
                 const NodeMesh& look) {
    // Point X outwards: the table moves the block along −Z.
    body(name, turn(Y, angle) * at(distance, top + 0.05, 0),
         {.mass = 1, .linear_velocity = {0, 0, -rate * distance}, .angular_velocity = {0, rate, 0}}, solid,
         look);
    if (rate * rate * distance < 0.5 * gravity) {
      expect({name + ": distance from the axis", "distance", {name}, Y}, any_time, distance, 0.02,
             "it stays, since Ω² r < μ g");
    } else {
      expect({name + ": distance from the axis at 6 s", "distance", {name}, Y}, at_time(6), at_least(radius),
             0.02, "it slides off, since Ω² r > μ g");
    }
  }
};

GltfBuilder euler_disk() {
  constexpr double radius = 0.3;
  constexpr double thickness = 0.02;
  constexpr double tilt = 0.35;
  constexpr double top = 0.06;

  GltfBuilder gltf("euler_disk", {.duration = 3, .poster = 0.25},
                   {.eye = {0.62, 0.62, 1.05}, .target = {0, 0.13, 0}, .yfov = 0.56});

  const int grip = gltf.physics_material(0.8);
  gltf.fixed_body("plate", at(0, top / 2, 0), {gltf.box_shape({1.2, top, 1.2}), grip},
                  {{turned({corner(0, -top / 2), corner(0.55, -top / 2, 0.01), corner(0.55, top / 2, 0.012),
                            corner(0, top / 2)},
                           96),
                    finish::basalt}});

  // The disk's lowest point lies towards +X. Its angular velocity is along the diameter through that point,
  // so that its centre rests.
  const auto [sine, cosine] = sine_cosine(tilt);
  const double round = std::sqrt(4 * gravity / (radius * sine));
  const Mesh profile = rod(thickness, radius, 0.003, 96);
  Mesh inlay;
  for (int i = 0; i < 6; ++i) {
    inlay += turn(Y, pi * i / 3) * at(0.17, thickness / 2 - 0.001, 0) * cuboid({0.17, 0.004, 0.02}, 0.001, 1);
  }
  inlay += at(0, thickness / 2 - 0.001, 0) * rod(0.004, 0.05, 0.001, 32);
  gltf.body("disk", at(0, top + radius * sine + thickness / 2 * cosine, 0) * turn(Z, -tilt),
            {.mass = 1, .angular_velocity = {-round * sine, 0, 0}},
            {gltf.cylinder_shape(radius, radius, thickness), grip},
            {{profile, finish::steel}, {inlay, finish::terracotta}});

  const double worth = 1.5 * gravity * radius * sine;  // J
  gltf.expect_constant_energy(0.1 * worth,
                              "it rolls without losses; a thin disk's energy is 3/2 m g a sin α");
  gltf.expect({"largest displacement of its centre", "displacement", {"disk"}}, any_time, 0, 0.1 * radius,
              "H. K. Moffatt (2000): it rolls with its centre at rest");
  return gltf;
}

/// Returns the mesh scaled along the axes.
Mesh stretched(Mesh mesh, const Vector3& factors) {
  for (Vector3& position : mesh.positions) position = position.cwiseProduct(factors);
  for (Vector3& normal : mesh.normals) normal = normal.cwiseQuotient(factors).normalized();
  return mesh;
}

GltfBuilder rattleback() {
  // T. R. Kane and D. A. Levinson's figures (1982). Their axes 1, 2 and 3 are X, −Z and Y.
  const Vector3 half_axes(0.20, 0.02, 0.03);
  constexpr double lowered = 0.01;  // the centre of mass below the ellipsoid's
  constexpr double tilt = 0.5 * pi / 180;
  constexpr double spin = 5;
  Matrix3 inertia;
  inertia << 2e-4, 0, 0.2e-4, 0, 17e-4, 0, 0.2e-4, 0, 16e-4;
  const PrincipalInertia principal = principal_inertia(inertia);

  GltfBuilder gltf("rattleback", {.duration = 10, .poster = 3},
                   {.eye = {0.50, 0.48, 0.86}, .target = {0, 0.0, 0.0}, .yfov = 0.42, .friction = 1});

  // The lower half of the ellipsoid under a lid, with two weights askew on it, which make its principal axes
  // stand askew to its keel.
  const int hull_geometry = gltf.geometry(
      stretched(turned({corner(0, -1), corner(1, -1, 1), corner(1, 0), corner(0, 0)}, 64), half_axes));
  const Mesh cap =
      turned({corner(0, 0), corner(0.013, 0), corner(0.013, 0.012, 0.005), corner(0, 0.012)}, 32);
  Mesh weights;
  for (const int side : {-1, 1}) weights += at(side * 0.125, 0, side * -0.008) * cap;
  const int weight_geometry = gltf.geometry(weights);
  gltf.material(finish::brass);
  const int shape = gltf.sphere_shape(1);
  const int grip = gltf.physics_material(1);
  for (const bool turns_back : {true, false}) {
    const std::string name = turns_back ? "turns_back" : "goes_on";
    const Quaternion orientation = (turn(X, tilt) * turn(Z, tilt)).orientation;
    // These vectors are in the body's node, whose origin is the ellipsoid's centre.
    const Vector3 up = orientation.conjugate() * Y;
    const Vector3 reach = half_axes.cwiseProduct(up);
    const Vector3 contact = -half_axes.cwiseProduct(reach) / reach.norm();
    const Vector3 rate = (turns_back ? -spin : spin) * up;
    const Vector3 centre(0, -lowered, 0);
    const int body = gltf.node(name, {Vector3(0, reach.norm(), turns_back ? -0.25 : 0.25), orientation});
    gltf.motion(body, {.mass = 1,
                       .inertia = principal.moments,
                       .inertia_orientation = principal.orientation,
                       .centre_of_mass = centre,
                       .linear_velocity = rate.cross(centre - contact),  // it rolls: its contact is at rest
                       .angular_velocity = rate});
    const int shell = gltf.node(name + "_shell", {}, body);
    gltf.scale(shell, half_axes);
    gltf.collider(shell, {shape, grip});
    gltf.show(body, {{hull_geometry, turns_back ? finish::terracotta : finish::teal},
                     {weight_geometry, finish::brass}});
  }

  const std::string_view kane =
      "Kane and Levinson's equations (1982) of rolling without slip, integrated to rounding in "
      "tests/sim/scenes_test.cpp";
  gltf.expect({"turns_back: time at which it stands", "angular_velocity", {"turns_back"}, Y}, crossing(1),
              2.804, 0.3, kane);
  gltf.expect({"turns_back: rate at 6 s", "angular_velocity", {"turns_back"}, Y}, at_time(6), 5.26, 0.5,
              kane);
  gltf.expect({"goes_on: rate at 5 s", "angular_velocity", {"goes_on"}, Y}, at_time(5), 4.361, 0.2, kane);
  gltf.expect({"goes_on: rate at 10 s", "angular_velocity", {"goes_on"}, Y}, at_time(10), 1.25, 0.2, kane);
  return gltf;
}

}  // namespace

std::vector<SceneFunction> spin_scenes() {
  return {heavy_top, made<Turntable>, euler_disk, rattleback};
}

}  // namespace substep::scenes
