/// Scenes of many bodies in contact: piles, houses, arches, what falls over.

#include <cmath>

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/math/rotation.h"
#include "stage.h"

namespace substep::make {
namespace {

/// Cubes of 1 m with friction 0.6, drawn as crates in the woods' turn, on the ground in the afternoon sun.
class Crates {
 public:
  Crates(GltfBuilder& gltf, const Vector3& eye, const Vector3& target, double view)
      : gltf_(staged(gltf, eye, target, view)),
        shape_(gltf.box_shape({1, 1, 1})),
        grip_(gltf.physics_material(0.6)),
        crate_(gltf.geometry(rounded(box({1, 1, 1}), 0.06))) {}

  int look(const std::string& name, const Finish& finish) {
    return gltf_.mesh(name, {{crate_, gltf_.material(finish)}});
  }

  void add(const std::string& name, double x, double y, double mass, int look) {
    const int body = gltf_.node(name, at(x, y, 0));
    gltf_.motion(body, {.mass = mass});
    gltf_.collider(body, shape_, grip_);
    gltf_.show(body, look);
  }

  int geometry() const { return crate_; }

 private:
  static GltfBuilder& staged(GltfBuilder& gltf, const Vector3& eye, const Vector3& target, double view) {
    gltf.camera(eye, target, view);
    gltf.sun(afternoon, warm_white, daylight);
    add_ground(gltf, 0.6);
    return gltf;
  }

  GltfBuilder& gltf_;
  int shape_;
  int grip_;
  int crate_;
};

constexpr std::array woods{finish::walnut, finish::maple, finish::cherry, finish::oak};

std::array<int, woods.size()> wooden_looks(Crates& crates) {
  std::array<int, woods.size()> looks{};
  for (std::size_t i = 0; i < woods.size(); ++i)
    looks[i] = crates.look("box_" + std::string(woods[i].name), woods[i]);
  return looks;
}

constexpr std::string_view stands = "it is in equilibrium, and friction holds it";

/// `count` crates of 1 kg, one on the other.
void add_column(Crates& crates, int count) {
  const auto looks = wooden_looks(crates);
  for (int i = 0; i < count; ++i)
    crates.add("box_" + std::to_string(i + 1), 0, i + 0.5, 1,
               looks[static_cast<std::size_t>(i) % woods.size()]);
}

}  // namespace

std::string box_stack() {
  GltfBuilder gltf("box_stack", 5);
  Crates crates(gltf, {9.0, 9.4, 16.6}, {0, 4.7, 0}, 0.60);
  add_column(crates, 10);
  gltf.expect_standing(0.05, stands);
  return gltf.text();
}

std::string tall_stack() {
  GltfBuilder gltf("tall_stack", 5);
  Crates crates(gltf, {17.5, 17.0, 33.0}, {0, 10.2, 0}, 0.60);
  add_column(crates, 20);
  gltf.expect_standing(0.05, stands);
  return gltf.text();
}

std::string top_heavy_stack() {
  constexpr int boxes = 10;
  constexpr double top_mass = 1000;

  GltfBuilder gltf("top_heavy_stack", 5);
  Crates crates(gltf, {9.0, 9.4, 16.6}, {0, 4.7, 0}, 0.60);
  add_column(crates, boxes - 1);
  // One stud for each zero of its mass, as in heavy_on_light.
  Mesh studs;
  for (int j = -1; j <= 1; ++j)
    studs.add(rod(0.04, 0.056, 0.016, 20), at(0.2 * j, 0, 0.5) * turn(Vector3::UnitX(), pi / 2));
  const int stud_look = gltf.geometry(studs);
  const int iron = gltf.material(finish::iron);
  const int top = gltf.mesh("top", {{crates.geometry(), iron}, {stud_look, gltf.material(finish::brass)}});
  crates.add("top", 0, boxes - 0.5, top_mass, top);
  gltf.expect_standing(0.05, stands);
  return gltf.text();
}

std::string box_pyramid() {
  constexpr int base = 20;
  constexpr double pitch = 1.1;

  GltfBuilder gltf("box_pyramid", 5);
  Crates crates(gltf, {17.0, 14.0, 39.0}, {0, 9.4, 0}, 0.58);
  const auto looks = wooden_looks(crates);
  int number = 0;
  for (int row = 0; row < base; ++row) {
    const int boxes = base - row;
    for (int i = 0; i < boxes; ++i) {
      crates.add("box_" + std::to_string(++number), pitch * (i - (boxes - 1) / 2.0), row + 0.5, 1,
                 looks[static_cast<std::size_t>(row) % 4]);
    }
  }
  gltf.expect_standing(0.05, stands);
  return gltf.text();
}

std::string brick_wall() {
  constexpr int rows = 10;
  constexpr int columns = 10;
  constexpr double shift = 0.15;
  constexpr std::array clay{finish::brick, finish::terracotta, finish::sandstone};

  GltfBuilder gltf("brick_wall", 5);
  Crates crates(gltf, {8.5, 8.5, 18.5}, {0, 4.6, 0}, 0.60);
  std::array<int, clay.size()> looks{};
  for (std::size_t i = 0; i < clay.size(); ++i)
    looks[i] = crates.look("brick_" + std::string(clay[i].name), clay[i]);
  int number = 0;
  for (int row = 0; row < rows; ++row) {
    const double left = (row % 2 == 0 ? -shift : shift) - (columns - 1) / 2.0;
    for (int i = 0; i < columns; ++i, ++number) {
      crates.add("brick_" + std::to_string(number + 1), left + i, row + 0.5, 1,
                 looks[static_cast<std::size_t>(noise(static_cast<std::uint64_t>(number)) * 3)]);
    }
  }
  gltf.expect_standing(0.05, stands);
  return gltf.text();
}

std::string heavy_on_light() {
  const Vector3 size(0.5, 0.5, 0.5);
  constexpr std::array masses{1.0, 10.0, 100.0, 1000.0, 10000.0};
  constexpr std::array finishes{finish::maple, finish::oak, finish::sandstone, finish::granite, finish::iron};

  GltfBuilder gltf("heavy_on_light", 4);
  gltf.camera({1.2, 1.55, 4.6}, {0, 0.50, 0}, 0.50);
  gltf.sun(afternoon, warm_white, daylight);
  add_ground(gltf, 0.6);

  const int shape = gltf.box_shape(size);
  const int grip = gltf.physics_material(0.6);
  const int block = gltf.geometry(rounded(box(size), 0.02));
  const int light = gltf.mesh("light", {{block, gltf.material(finish::maple)}});
  const int brass = gltf.material(finish::brass);
  for (std::size_t i = 0; i < masses.size(); ++i) {
    const double x = 0.8 * (static_cast<int>(i) - 2);
    const std::string number = std::to_string(i + 1);
    const int lower = gltf.node("light_" + number, at(x, size.y() / 2, 0));
    gltf.motion(lower, {.mass = 1});
    gltf.collider(lower, shape, grip);
    gltf.show(lower, light);
    // One stud for each zero of its mass.
    Mesh studs;
    for (std::size_t j = 0; j < i; ++j) {
      studs.add(rod(0.02, 0.028, 0.008, 20),
                at(0.09 * (static_cast<double>(j) - (static_cast<double>(i) - 1) / 2), 0, size.z() / 2) *
                    turn(Vector3::UnitX(), pi / 2));
    }
    const int upper = gltf.node("heavy_" + number, at(x, 1.5 * size.y(), 0));
    gltf.motion(upper, {.mass = masses[i]});
    gltf.collider(upper, shape, grip);
    const int paint = gltf.material(finishes[i]);
    std::vector<GltfBuilder::Part> parts{{block, paint}};
    if (i > 0) parts.push_back({gltf.geometry(studs), brass});
    gltf.show(upper, gltf.mesh("heavy_" + number, parts));
  }

  for (std::size_t i = 0; i < masses.size(); ++i) {
    const std::string number = std::to_string(i + 1);
    gltf.expect_standing(0.025, "each pair is in equilibrium, and friction holds it",
                         {"light_" + number, "heavy_" + number});
  }
  return gltf.text();
}

std::string overlap() {
  constexpr double side = 0.5;
  constexpr double pitch = 0.75 * side;
  constexpr int base = 4;
  constexpr std::array finishes{finish::teal, finish::ivory, finish::terracotta, finish::mustard};

  GltfBuilder gltf("overlap", 3);
  gltf.poster(0.1);
  gltf.camera({1.6, 1.7, 4.2}, {0, 0.62, 0}, 0.50);
  gltf.sun(afternoon, warm_white, daylight);
  add_ground(gltf, 0.6);

  const int shape = gltf.box_shape(Vector3::Constant(side));
  const int grip = gltf.physics_material(0.6);
  const int cube = gltf.geometry(rounded(box(Vector3::Constant(side)), 0.03));
  int number = 0;
  for (int row = 0; row < base; ++row) {
    for (int i = 0; i < base - row; ++i, ++number) {
      const std::string name = "box_" + std::to_string(number + 1);
      const int body = gltf.node(name, at(pitch * (i - (base - row - 1) / 2.0), side / 2 + pitch * row, 0));
      gltf.motion(body, {.mass = 1});
      gltf.collider(body, shape, grip);
      gltf.show(body, gltf.mesh(name, {{cube, gltf.material(finishes[number % 4])}}));
    }
  }

  const std::string_view source = "what starts overlapping shall come apart, and not be blown apart";
  gltf.expect(
      {.name = "fastest body", .quantity = "speed", .at_most = 2, .tolerance = 0.2, .source = source});
  gltf.expect({.name = "fastest body at 3 s",
               .quantity = "speed",
               .at = 3,
               .value = 0,
               .tolerance = 0.1,
               .source = source});
  return gltf.text();
}

std::string card_house() {
  constexpr double height = 0.4;
  constexpr double thickness = 0.012;
  constexpr double width = 0.28;
  constexpr double lean = 25 * pi / 180;
  constexpr double pitch = height + 0.004;
  constexpr int levels = 3;

  GltfBuilder gltf("card_house", 5);
  gltf.poster(1);
  gltf.camera({0.9, 1.1, 2.7}, {0, 0.55, 0}, 0.50);
  gltf.sun(afternoon, warm_white, daylight);
  add_ground(gltf, 0.7);

  const Vector3 size(thickness, height, width);
  const int shape = gltf.box_shape(size);
  const int grip = gltf.physics_material(0.7);
  // An ivory card with a coloured back on either side.
  const int edge = gltf.geometry(rounded(box(size), 0.003, 1));
  Mesh back;
  for (const int side : {-1, 1})
    back.add(rounded(box({0.004, height - 0.05, width - 0.05}), 0.0015, 1),
             at(side * (thickness / 2 - 0.0012), 0, 0));
  const int back_look = gltf.geometry(back);
  const int ivory = gltf.material(finish::ivory);
  const int red = gltf.material(finish::terracotta);
  const int blue = gltf.material(finish::blue);
  const std::array<int, 2> looks{gltf.mesh("red_card", {{edge, ivory}, {back_look, red}}),
                                 gltf.mesh("blue_card", {{edge, ivory}, {back_look, blue}})};
  int number = 0;
  const auto add_card = [&](const Pose& pose, int look) {
    const int body = gltf.node("card_" + std::to_string(++number), pose);
    gltf.motion(body, {.mass = 0.1});
    gltf.collider(body, shape, grip);
    gltf.show(body, looks[look]);
  };
  // A card leaning at an apex: from the apex to its centre, and from its lowest edge.
  const auto [sine, cosine] = sine_cosine(lean);
  const double out = (thickness * cosine + height * sine) / 2;
  const double up = (thickness * sine + height * cosine) / 2;
  double floor = 0;
  for (int level = 0; level < levels; ++level) {
    const int pairs = levels - level;
    for (int i = 0; i < pairs; ++i) {
      const double apex = pitch * (i - (pairs - 1) / 2.0);
      for (const int side : {-1, 1})
        add_card(at(apex + side * out, floor + up, 0) * turn(Vector3::UnitZ(), side * lean), level % 2);
    }
    floor += 2 * up;
    for (int i = 0; i + 1 < pairs; ++i)
      add_card(at(pitch * (i - (pairs - 2) / 2.0), floor + thickness / 2, 0) * turn(Vector3::UnitZ(), pi / 2),
               1 - level % 2);
    floor += thickness;
  }

  gltf.expect_standing(0.05 * height, "a pair stands if μ ≥ ½ tan θ, under load if μ ≥ tan θ = 0.466");
  return gltf.text();
}

std::string masonry_arch() {
  constexpr double radius = 1;
  constexpr double depth = 0.4;
  constexpr double density = 2300;
  constexpr double plinth = 0.35;
  constexpr int stones = 11;
  struct Arch {
    const char* name;
    double thickness;
    double middle;
    std::array<Finish, 2> finishes;
  };
  const std::array<Arch, 2> arches{{{"thick", 0.18, -1.35, {finish::sandstone, finish::limestone}},
                                    {"thin", 0.07, 1.35, {finish::brick, finish::granite}}}};

  GltfBuilder gltf("masonry_arch", 3);
  gltf.poster(0.1);
  gltf.camera({1.6, 1.9, 5.9}, {0, 0.66, 0}, 0.52);
  gltf.sun(afternoon, warm_white, daylight);
  add_ground(gltf, 0.7);

  const int grip = gltf.physics_material(0.7);
  const double part = pi / stones;
  const auto [sine, cosine] = sine_cosine(part / 2);
  for (const Arch& arch : arches) {
    const std::string name = arch.name;
    const double inner = radius - arch.thickness / 2;
    const double outer = radius + arch.thickness / 2;
    for (const int side : {-1, 1}) {
      add_fixed_box(gltf, name + (side < 0 ? "_left_plinth" : "_right_plinth"), {0.36, plinth, depth + 0.14},
                    at(arch.middle + side * radius, plinth / 2, 0), grip, finish::basalt);
    }
    // Its frame: X outwards, Y the depth.
    const std::array<PlanePoint, 4> outline{{{inner * cosine - radius, -inner * sine},
                                             {outer * cosine - radius, -outer * sine},
                                             {outer * cosine - radius, outer * sine},
                                             {inner * cosine - radius, inner * sine}}};
    const Polyhedron solid = prism(outline, depth);
    const int rough =
        gltf.mesh(name + "_rough_stone", {{gltf.geometry(faceted(solid)), gltf.material(finish::limestone)}});
    const int hull = gltf.detached_node(name + "_rough_stone", rough);
    const int dressed = gltf.geometry(rounded(solid, 0.012, 2));
    const double mass = std::round(density * depth * arch.thickness * radius * 2 * sine * cosine);
    for (int i = 0; i < stones; ++i) {
      const std::string number = name + "_stone_" + std::to_string(i + 1);
      const Pose place = at(arch.middle, plinth, 0) * turn(Vector3::UnitZ(), part * (i + 0.5)) *
                         at(radius, 0, 0) * turn(Vector3::UnitX(), pi / 2);
      const int body = gltf.node(number, place);
      gltf.motion(body, {.mass = mass});
      gltf.hull_collider(body, hull, grip);
      const Finish& look = i == stones / 2 ? finish::terracotta : arch.finishes[i % 2];
      gltf.show(body, gltf.mesh(number, {{dressed, gltf.material(look)}}));
    }
  }

  std::vector<std::string> thick;
  for (int i = 1; i <= stones; ++i) thick.push_back("thick_stone_" + std::to_string(i));
  gltf.expect_standing(0.01, "Milankovitch (1907): a semicircle stands from 0.1075 of its radius on", thick);
  gltf.expect({.name = "fall of the thin arch's crown at 3 s",
               .quantity = "way",
               .bodies = {"thin_stone_6"},
               .direction = -Vector3::UnitY(),
               .at = 3,
               .at_least = 0.5,
               .tolerance = 0.05,
               .source = "Milankovitch (1907): a semicircle thinner than 0.1075 of its radius cannot stand"});
  return gltf.text();
}

std::string dominoes() {
  constexpr int count = 24;
  constexpr double radius = 0.85;
  constexpr double pitch = 0.19;
  const Vector3 size(0.06, 0.36, 0.18);
  constexpr std::array finishes{finish::terracotta, finish::mustard, finish::ivory, finish::teal,
                                finish::blue};

  GltfBuilder gltf("dominoes", 4);
  gltf.poster(1.5);
  gltf.camera({0.9, 1.9, 2.6}, {0, 0.10, 0}, 0.56);
  gltf.sun(afternoon, warm_white, daylight);
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
  gltf.camera({-3.2, 2.5, 7.4}, {0.15, 1.35, 0}, 0.56);
  gltf.sun(afternoon, warm_white, daylight);
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

}  // namespace substep::make
