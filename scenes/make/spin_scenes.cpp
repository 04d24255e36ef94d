/// Scenes of turning bodies: gyroscopic effects, and what rolls on what turns.

#include <cmath>

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/geometry/mass_properties.h"
#include "sim/math/rotation.h"
#include "stage.h"

namespace substep::scenes {

std::string heavy_top() {
  constexpr double mass = 2;
  constexpr double lever = 1;  // from the pivot to the centre of mass
  constexpr double tilt = 0.05;
  constexpr double spin = 50;
  constexpr double height = 0.62;

  GltfBuilder gltf("heavy_top", 10, Vector3(0, -10, 0));
  gltf.poster(1);
  set_view(gltf, {1.7, 2.5, 4.3}, {0, 1.30, 0}, 0.56);

  const std::array<ProfilePoint, 11> pedestal{{{0, 0},
                                               {0.42, 0, 0.01},
                                               {0.42, 0.06, 0.015},
                                               {0.36, 0.08, 0.02},
                                               {0.20, 0.14, 0.05},
                                               {0.13, 0.40, 0.05},
                                               {0.20, 0.50, 0.03},
                                               {0.20, height - 0.02, 0.01},
                                               {0.08, height - 0.02, 0.01},
                                               {0.03, height, 0.01},
                                               {0, height - 0.02}}};
  add_scenery(gltf, "pedestal", turned(pedestal, 48), finish::limestone);
  const int pivot = gltf.node("pivot", at(0, height, 0));

  const int body = gltf.node("top", at(0, height, 0) * turn(Vector3::UnitX(), tilt) * at(0, lever, 0));
  gltf.motion(body, {.mass = mass, .inertia = Vector3(3, 1, 3), .angular_velocity = {0, spin, 0}});
  const std::array<ProfilePoint, 10> stem{{{0, -lever},
                                           {0.014, -lever + 0.012, 0.008},
                                           {0.05, -lever + 0.14, 0.03},
                                           {0.05, -0.10, 0.02},
                                           {0.12, -0.07},
                                           {0.12, 0.09},
                                           {0.05, 0.12, 0.02},
                                           {0.05, 0.62, 0.02},
                                           {0.028, 0.80, 0.01},
                                           {0, 0.80}}};
  const std::array<ProfilePoint, 6> web{{{0.12, -0.035},
                                         {0.60, -0.02},
                                         {0.60, 0.02},
                                         {0.12, 0.045, 0.01},
                                         {0.11, 0.045, 0.002},
                                         {0.11, -0.035, 0.002}}};
  const std::array<ProfilePoint, 4> rim{
      {{0.59, -0.075, 0.02}, {0.78, -0.06, 0.03}, {0.78, 0.06, 0.03}, {0.59, 0.075, 0.02}}};
  const std::array<ProfilePoint, 4> ring{
      {{0.04, 0.60, 0.01}, {0.085, 0.60, 0.015}, {0.085, 0.66, 0.015}, {0.04, 0.66, 0.01}}};
  // Studs, so that the spin can be seen.
  Mesh studs = turned(ring, 32, true);
  for (int i = 0; i < 6; ++i) {
    studs.add(rod(0.03, i == 0 ? 0.055 : 0.035, 0.01, 20),
              turn(Vector3::UnitY(), pi * i / 3) * at(0.685, 0.068, 0));
  }
  const int stem_look = gltf.geometry(turned(stem, 32));
  const int web_look = gltf.geometry(turned(web, 64, true));
  const int rim_look = gltf.geometry(turned(rim, 64, true));
  const int stud_look = gltf.geometry(studs);
  const int steel = gltf.material(finish::steel);
  const int ivory = gltf.material(finish::ivory);
  const int terracotta = gltf.material(finish::terracotta);
  gltf.show(body, gltf.mesh("top", {{stem_look, steel},
                                    {web_look, ivory},
                                    {rim_look, terracotta},
                                    {stud_look, gltf.material(finish::brass)}}));
  gltf.joint(gltf.node("tip", at(0, -lever, 0), body), pivot, gltf.ball_joint());

  const std::string_view simo = "Simo and Wong (1991); Lagrange's equations, integrated to 12 digits";
  gltf.expect_at({"angle that it has gone round by after 10 s", "azimuth", {"top"}, Vector3::UnitY()}, 10,
                 4.196191, 0.1, simo);
  gltf.expect({.name = "largest distance from the vertical",
               .quantity = "distance",
               .bodies = {"top"},
               .direction = Vector3::UnitY(),
               .at_most = lever * sine_cosine(0.0545517).sine,
               .tolerance = 0.003,
               .source = simo});
  gltf.expect_constant_energy(
      1, "Simo and Wong (1991): the energy is 1269.97500521 J, 20 J of it are the weight's");
  return gltf.text();
}

std::string turntable() {
  constexpr double rate = 2.5;
  constexpr double radius = 1.25;
  constexpr double top = 0.42;
  constexpr double thickness = 0.1;
  constexpr double ball_radius = 0.12;
  constexpr double orbit = 0.4;

  GltfBuilder gltf("turntable", 6);
  gltf.poster(1.8);
  set_view(gltf, {1.5, 2.6, 3.4}, {0, 0.30, 0.05}, 0.56);
  add_ground(gltf, 0.6);

  const std::array<ProfilePoint, 8> foot{{{0, 0},
                                          {0.7, 0, 0.01},
                                          {0.7, 0.07, 0.02},
                                          {0.22, 0.12, 0.06},
                                          {0.16, 0.26, 0.05},
                                          {0.30, 0.31, 0.01},
                                          {0.30, 0.32},
                                          {0, 0.32}}};
  add_scenery(gltf, "foot", turned(foot, 48), finish::iron);

  const int table = gltf.node("table", at(0, top - thickness / 2, 0));
  gltf.motion(table, {.mass = 100, .angular_velocity = {0, rate, 0}, .kinematic = true});
  gltf.collider(table, gltf.cylinder_shape(radius, thickness), gltf.physics_material(1));
  const std::array<ProfilePoint, 4> plate{{{0, -thickness / 2},
                                           {radius, -thickness / 2, 0.02},
                                           {radius, thickness / 2, 0.012},
                                           {0, thickness / 2}}};
  Mesh inlay;
  for (const double r : {0.4, 0.785}) {
    const std::array<ProfilePoint, 4> circle{{{r - 0.008, thickness / 2 - 0.01},
                                              {r + 0.008, thickness / 2 - 0.01},
                                              {r + 0.008, thickness / 2 + 0.001},
                                              {r - 0.008, thickness / 2 + 0.001}}};
    inlay.add(turned(circle, 96, true));
  }
  for (int i = 0; i < 12; ++i) {
    inlay.add(rounded(box({0.30, 0.012, 0.014}), 0.002, 1),
              turn(Vector3::UnitY(), pi * i / 6) * at(1.05, thickness / 2 - 0.005, 0));
  }
  const int plate_look = gltf.geometry(turned(plate, 96));
  const int inlay_look = gltf.geometry(inlay);
  const int walnut = gltf.material(finish::walnut);
  const int brass = gltf.material(finish::brass);
  gltf.show(table, gltf.mesh("table", {{plate_look, walnut}, {inlay_look, brass}}));

  // It rolls as it goes round: X of its start is outwards, its centre goes along −Z.
  const int rolling = gltf.node("ball", at(orbit, top + ball_radius, 0));
  gltf.motion(rolling, {.mass = 1,
                        .linear_velocity = {0, 0, -2.0 / 7 * rate * orbit},
                        .angular_velocity = {5.0 / 7 * rate * orbit / ball_radius, 0, 0}});
  gltf.collider(rolling, gltf.sphere_shape(ball_radius), gltf.physics_material(0.5));
  const int round = gltf.geometry(ball(ball_radius, 40));
  const int band = gltf.geometry(Mesh()
                                     .add(rod(0.03, ball_radius + 0.0015, 0.006, 40))
                                     .add(rod(2 * ball_radius + 0.006, 0.035, 0.006, 24)));
  gltf.show(rolling, gltf.mesh("ball", {{round, gltf.material(finish::ivory)}, {band, brass}}));

  const Vector3 size(0.18, 0.10, 0.18);
  const int shape = gltf.box_shape(size);
  const int grip = gltf.physics_material(0.5);
  const int look = gltf.geometry(rounded(box(size), 0.012));
  struct Block {
    const char* name;
    double distance;
    double angle;
    Finish finish;
  };
  const std::array<Block, 3> blocks{{{"inner_block", 0.72, 1.2, finish::teal},
                                     {"middle_block", 0.76, 3.3, finish::mustard},
                                     {"outer_block", 0.88, 5.0, finish::terracotta}}};
  for (const Block& block : blocks) {
    // X outwards, so that the table takes it along −Z.
    const Pose place = turn(Vector3::UnitY(), block.angle) * at(block.distance, top + size.y() / 2, 0);
    const int body = gltf.node(block.name, place);
    gltf.motion(
        body,
        {.mass = 1, .linear_velocity = {0, 0, -rate * block.distance}, .angular_velocity = {0, rate, 0}});
    gltf.collider(body, shape, grip);
    gltf.show(body, gltf.mesh(block.name, {{look, gltf.material(block.finish)}}));
  }

  gltf.expect_at({"angle that the ball has gone round by after 6 s", "azimuth", {"ball"}, Vector3::UnitY()},
                 6, 2.0 / 7 * rate * 6, 0.05,
                 "S. Earnshaw (1844): a rolling sphere goes round at 2/7 of the table's rate");
  gltf.expect({.name = "the ball's distance from the axis",
               .quantity = "distance",
               .bodies = {"ball"},
               .direction = Vector3::UnitY(),
               .value = orbit,
               .tolerance = 0.05 * orbit,
               .source = "S. Earnshaw (1844): in a circle"});
  for (const Block& block : blocks) {
    const std::string name = block.name;
    const bool stays = rate * rate * block.distance < 0.5 * 9.81;
    Known known{.name = name + (stays ? ": distance from the axis" : ": distance from the axis at 6 s"),
                .quantity = "distance",
                .bodies = {name},
                .direction = Vector3::UnitY(),
                .tolerance = 0.02,
                .source = stays ? "it stays, since Ω² r < μ g" : "it slides off, since Ω² r > μ g"};
    if (stays) {
      known.value = block.distance;
    } else {
      known.at = 6;
      known.at_least = radius;
    }
    gltf.expect(known);
  }
  return gltf.text();
}

std::string euler_disk() {
  constexpr double radius = 0.3;
  constexpr double thickness = 0.02;
  constexpr double tilt = 0.35;
  constexpr double gravity = 9.81;
  constexpr double top = 0.06;

  GltfBuilder gltf("euler_disk", 3);
  gltf.poster(0.25);
  set_view(gltf, {0.62, 0.62, 1.05}, {0, 0.13, 0}, 0.56);

  const int grip = gltf.physics_material(0.8);
  const int plate = gltf.node("plate", at(0, top / 2, 0));
  gltf.collider(plate, gltf.box_shape({1.2, top, 1.2}), grip);
  const std::array<ProfilePoint, 4> slab{
      {{0, -top / 2}, {0.55, -top / 2, 0.01}, {0.55, top / 2, 0.012}, {0, top / 2}}};
  const int slab_look = gltf.geometry(turned(slab, 96));
  gltf.show(plate, gltf.mesh("plate", {{slab_look, gltf.material(finish::basalt)}}));

  // Its lowest point lies towards +X. It rolls round that way which keeps its centre where it is: it turns
  // about the diameter through the lowest point.
  const auto [sine, cosine] = sine_cosine(tilt);
  const double round = std::sqrt(4 * gravity / (radius * sine));
  const int disk = gltf.node(
      "disk", at(0, top + radius * sine + thickness / 2 * cosine, 0) * turn(Vector3::UnitZ(), -tilt));
  gltf.motion(disk, {.mass = 1, .angular_velocity = {-round * sine, 0, 0}});
  gltf.collider(disk, gltf.cylinder_shape(radius, thickness), grip);
  const std::array<ProfilePoint, 4> profile{{{0, -thickness / 2},
                                             {radius, -thickness / 2, 0.003},
                                             {radius, thickness / 2, 0.003},
                                             {0, thickness / 2}}};
  Mesh inlay;
  for (int i = 0; i < 6; ++i) {
    inlay.add(rounded(box({0.17, 0.004, 0.02}), 0.001, 1),
              turn(Vector3::UnitY(), pi * i / 3) * at(0.17, thickness / 2 - 0.001, 0));
  }
  inlay.add(rod(0.004, 0.05, 0.001, 32), at(0, thickness / 2 - 0.001, 0));
  const int disk_look = gltf.geometry(turned(profile, 96));
  const int inlay_look = gltf.geometry(inlay);
  const int steel = gltf.material(finish::steel);
  gltf.show(disk, gltf.mesh("disk", {{disk_look, steel}, {inlay_look, gltf.material(finish::terracotta)}}));

  const double worth = 1.5 * gravity * radius * sine;  // J
  gltf.expect_constant_energy(0.1 * worth,
                              "it rolls without losses; a thin disk's energy is 3/2 m g a sin α");
  gltf.expect({.name = "largest displacement of its centre",
               .quantity = "displacement",
               .bodies = {"disk"},
               .value = 0,
               .tolerance = 0.1 * radius,
               .source = "H. K. Moffatt (2000): it rolls with its centre at rest"});
  return gltf.text();
}

std::string rattleback() {
  // T. R. Kane and D. A. Levinson's figures (1982). Their axes 1, 2 and 3 are X, −Z and Y.
  const Vector3 half_axes(0.20, 0.02, 0.03);
  constexpr double lowered = 0.01;  // the centre of mass below the ellipsoid's
  constexpr double tilt = 0.5 * pi / 180;
  constexpr double spin = 5;
  Matrix3 inertia;
  inertia << 2e-4, 0, 0.2e-4, 0, 17e-4, 0, 0.2e-4, 0, 16e-4;
  const PrincipalInertia principal = principal_inertia(inertia);

  GltfBuilder gltf("rattleback", 10);
  gltf.poster(3);
  set_view(gltf, {0.50, 0.48, 0.86}, {0, 0.0, 0.0}, 0.42);
  add_ground(gltf, 1);

  // The lower half of the ellipsoid under a lid, with two weights askew on it, which make its principal axes
  // stand askew to its keel.
  const auto stretched = [](Mesh mesh, const Vector3& factors) {
    for (Vector3& position : mesh.positions) position = position.cwiseProduct(factors);
    for (Vector3& normal : mesh.normals) normal = normal.cwiseQuotient(factors).normalized();
    return mesh;
  };
  const std::array<ProfilePoint, 4> bowl{{{0, -1}, {1, -1, 1}, {1, 0}, {0, 0}}};
  const int hull_geometry = gltf.geometry(stretched(turned(bowl, 64), half_axes));
  const std::array<ProfilePoint, 4> cap{{{0, 0}, {0.013, 0}, {0.013, 0.012, 0.005}, {0, 0.012}}};
  Mesh weights;
  for (const int side : {-1, 1}) weights.add(turned(cap, 32), at(side * 0.125, 0, side * -0.008));
  const int weight_geometry = gltf.geometry(weights);
  const int brass = gltf.material(finish::brass);
  const int shape = gltf.sphere_shape(1);
  const int grip = gltf.physics_material(1);
  for (const bool turns_back : {true, false}) {
    const std::string name = turns_back ? "turns_back" : "goes_on";
    const Quaternion orientation = (turn(Vector3::UnitX(), tilt) * turn(Vector3::UnitZ(), tilt)).orientation;
    // All in the body's node, whose origin is the ellipsoid's centre.
    const Vector3 up = orientation.conjugate() * Vector3::UnitY();
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
    gltf.collider(shell, shape, grip);
    const int paint = gltf.material(turns_back ? finish::terracotta : finish::teal);
    gltf.show(body, gltf.mesh(name, {{hull_geometry, paint}, {weight_geometry, brass}}));
  }

  const std::string_view kane =
      "Kane and Levinson's equations (1982) of rolling without slip, integrated to rounding in "
      "tests/sim/scenes_test.cpp";
  gltf.expect_crossing(
      {"turns_back: time at which it stands", "angular_velocity", {"turns_back"}, Vector3::UnitY()}, 1, 2.804,
      0.3, kane);
  gltf.expect_at({"turns_back: rate at 6 s", "angular_velocity", {"turns_back"}, Vector3::UnitY()}, 6, 5.26,
                 0.5, kane);
  gltf.expect_at({"goes_on: rate at 5 s", "angular_velocity", {"goes_on"}, Vector3::UnitY()}, 5, 4.361, 0.2,
                 kane);
  gltf.expect_at({"goes_on: rate at 10 s", "angular_velocity", {"goes_on"}, Vector3::UnitY()}, 10, 1.25, 0.2,
                 kane);
  return gltf.text();
}

}  // namespace substep::scenes
