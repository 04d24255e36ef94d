/// Scenes of bodies that stand on each other: stacks, pyramids, walls, a card house, arches.

#include <cmath>

#include "scenes.h"
#include "sim/math/rotation.h"

namespace substep::scenes {
namespace {

constexpr std::string_view stands = "it is in equilibrium, and friction holds it";
constexpr std::array woods{finish::walnut, finish::maple, finish::cherry, finish::oak};
constexpr std::array clay{finish::brick, finish::terracotta, finish::sandstone};

/// Cubes of 1 m with friction 0.6, drawn as crates.
class Crates {
 public:
  explicit Crates(GltfBuilder& gltf)
      : gltf_(gltf),
        collider_{gltf.box_shape({1, 1, 1}), gltf.physics_material(0.6)},
        crate_(gltf.geometry(cuboid({1, 1, 1}, 0.06))) {}

  /// Adds a mesh for each finish.
  template <std::size_t count>
  std::array<int, count> looks(const std::string& prefix, const std::array<Finish, count>& finishes) {
    std::array<int, count> meshes{};
    for (std::size_t i = 0; i < count; ++i)
      meshes[i] = gltf_.mesh(prefix + std::string(finishes[i].name), {{crate_, finishes[i]}});
    return meshes;
  }

  void add(const std::string& name, double x, double y, double mass, const NodeMesh& look) {
    gltf_.body(name, at(x, y, 0), {.mass = mass}, collider_, look);
  }

  /// Adds crates of 1 kg, one on the other.
  void add_column(int count) {
    const auto wooden = looks("box_", woods);
    for (int i = 0; i < count; ++i) add(numbered("box", i + 1), 0, i + 0.5, 1, wooden[i % 4]);
  }

  int geometry() const { return crate_; }

 private:
  GltfBuilder& gltf_;
  Collider collider_;
  int crate_;
};

/// Returns a row of `count` studs at z = `side`.
Mesh studs(int count, double pitch, double side, double size) {
  Mesh mesh;
  for (int i = 0; i < count; ++i) {
    mesh += at(pitch * (i - (count - 1) / 2.0), 0, side) * turn(X, pi / 2) *
            rod(size, 1.4 * size, 0.4 * size, 20);
  }
  return mesh;
}

GltfBuilder box_stack() {
  GltfBuilder gltf("box_stack", {.duration = 5},
                   {.eye = {9.0, 9.4, 16.6}, .target = {0, 4.7, 0}, .yfov = 0.60, .friction = 0.6});
  Crates(gltf).add_column(10);
  gltf.expect_standing(0.05, stands);
  return gltf;
}

GltfBuilder tall_stack() {
  GltfBuilder gltf("tall_stack", {.duration = 5},
                   {.eye = {17.5, 17.0, 33.0}, .target = {0, 10.2, 0}, .yfov = 0.60, .friction = 0.6});
  Crates(gltf).add_column(20);
  gltf.expect_standing(0.05, stands);
  return gltf;
}

GltfBuilder top_heavy_stack() {
  GltfBuilder gltf("top_heavy_stack", {.duration = 5},
                   {.eye = {9.0, 9.4, 16.6}, .target = {0, 4.7, 0}, .yfov = 0.60, .friction = 0.6});
  Crates crates(gltf);
  crates.add_column(9);
  crates.add("top", 0, 9.5, 1000,
             {{crates.geometry(), finish::iron}, {studs(3, 0.2, 0.5, 0.04), finish::brass}});
  gltf.expect_standing(0.05, stands);
  return gltf;
}

GltfBuilder box_pyramid() {
  constexpr int base = 20;
  GltfBuilder gltf("box_pyramid", {.duration = 5},
                   {.eye = {17.0, 14.0, 39.0}, .target = {0, 9.4, 0}, .yfov = 0.58, .friction = 0.6});
  Crates crates(gltf);
  const auto looks = crates.looks("box_", woods);
  int number = 0;
  for (int row = 0; row < base; ++row) {
    for (int i = 0; i < base - row; ++i)
      crates.add(numbered("box", ++number), 1.1 * (i - (base - row - 1) / 2.0), row + 0.5, 1, looks[row % 4]);
  }
  gltf.expect_standing(0.05, stands);
  return gltf;
}

GltfBuilder brick_wall() {
  constexpr int rows = 10;
  constexpr int columns = 10;
  constexpr double shift = 0.15;
  GltfBuilder gltf("brick_wall", {.duration = 5},
                   {.eye = {8.5, 8.5, 18.5}, .target = {0, 4.6, 0}, .yfov = 0.60, .friction = 0.6});
  Crates crates(gltf);
  const auto looks = crates.looks("brick_", clay);
  int number = 0;
  for (int row = 0; row < rows; ++row) {
    const double left = (row % 2 == 0 ? -shift : shift) - (columns - 1) / 2.0;
    for (int i = 0; i < columns; ++i, ++number) {
      crates.add(numbered("brick", number + 1), left + i, row + 0.5, 1,
                 looks[static_cast<std::size_t>(noise(static_cast<std::uint64_t>(number)) * 3)]);
    }
  }
  gltf.expect_standing(0.05, stands);
  return gltf;
}

GltfBuilder heavy_on_light() {
  const Vector3 size(0.5, 0.5, 0.5);
  constexpr std::array masses{1.0, 10.0, 100.0, 1000.0, 10000.0};
  constexpr std::array finishes{finish::maple, finish::oak, finish::sandstone, finish::granite, finish::iron};
  GltfBuilder gltf("heavy_on_light", {.duration = 4},
                   {.eye = {1.2, 1.55, 4.6}, .target = {0, 0.50, 0}, .yfov = 0.50, .friction = 0.6});

  const Collider collider{gltf.box_shape(size), gltf.physics_material(0.6)};
  const int block = gltf.geometry(cuboid(size, 0.02));
  const int light = gltf.mesh("light", {{block, finish::maple}});
  gltf.material(finish::brass);
  for (int i = 0; i < 5; ++i) {
    const double x = 0.8 * (i - 2);
    gltf.body(numbered("light", i + 1), at(x, size.y() / 2, 0), {.mass = 1}, collider, light);
    std::vector<Primitive> primitives{{block, finishes[i]}};
    if (i > 0) primitives.push_back({studs(i, 0.09, size.z() / 2, 0.02), finish::brass});
    gltf.body(numbered("heavy", i + 1), at(x, 1.5 * size.y(), 0), {.mass = masses[i]}, collider, primitives);
  }
  for (int i = 1; i <= 5; ++i)
    gltf.expect_standing(0.025, "each pair is in equilibrium, and friction holds it",
                         {numbered("light", i), numbered("heavy", i)});
  return gltf;
}

GltfBuilder overlap() {
  constexpr double side = 0.5;
  constexpr double pitch = 0.75 * side;
  constexpr int base = 4;
  constexpr std::array finishes{finish::teal, finish::ivory, finish::terracotta, finish::mustard};
  GltfBuilder gltf("overlap", {.duration = 3, .poster = 0.1},
                   {.eye = {2.1, 1.9, 5.4}, .target = {0, 0.92, 0}, .yfov = 0.50, .friction = 0.6});

  const Collider collider{gltf.box_shape(Vector3::Constant(side)), gltf.physics_material(0.6)};
  const int cube = gltf.geometry(cuboid(Vector3::Constant(side), 0.03));
  int number = 0;
  for (int row = 0; row < base; ++row) {
    for (int i = 0; i < base - row; ++i, ++number) {
      gltf.body(numbered("box", number + 1),
                at(pitch * (i - (base - row - 1) / 2.0), side / 2 + pitch * row, 0), {.mass = 1}, collider,
                {{cube, finishes[number % 4]}});
    }
  }
  const std::string_view source = "what starts overlapping shall come apart, and not be blown apart";
  gltf.expect({"fastest body", "speed"}, any_time, at_most(2), 0.2, source);
  gltf.expect({"fastest body at 3 s", "speed"}, at_time(3), 0, 0.1, source);
  return gltf;
}

/// Returns the volume of `prism(outline, height, top_scale)`, m³.
double prism_volume(const Outline& outline, double height, double top_scale) {
  double twice_area = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const PlanePoint& p = outline[i];
    const PlanePoint& q = outline[(i + 1) % outline.size()];
    twice_area += p.u * q.v - q.u * p.v;
  }
  return twice_area / 2 * height * (1 + top_scale + top_scale * top_scale) / 3;
}

/// Outlines of the pyramid's stones. Multiples of 1/64 m, and a top scaled by 15/16, are exact in the file's
/// 32-bit floats: each side stays flat.
std::vector<Outline> stone_outlines() {
  return {Outline({point(-0.5, -0.09375), point(-0.25, -0.40625), point(0.28125, -0.375), point(0.5, 0.0625),
                   point(0.21875, 0.40625), point(-0.3125, 0.375)}),
          Outline({point(-0.5, 0.125), point(-0.34375, -0.375), point(0.3125, -0.40625), point(0.5, -0.03125),
                   point(0.40625, 0.34375), point(-0.1875, 0.40625)}),
          Outline({point(-0.5, -0.21875), point(0, -0.4375), point(0.5, -0.1875), point(0.375, 0.375),
                   point(-0.34375, 0.40625)}),
          Outline({point(-0.5, -0.15625), point(-0.15625, -0.40625), point(0.34375, -0.34375),
                   point(0.5, 0.03125), point(0.375, 0.3125), point(0, 0.4375), point(-0.40625, 0.21875)}),
          Outline({point(-0.5, 0), point(-0.3125, -0.375), point(0.21875, -0.40625), point(0.5, -0.125),
                   point(0.4375, 0.28125), point(0.03125, 0.421875), point(-0.34375, 0.34375)})};
}

GltfBuilder stone_pyramid() {
  constexpr int courses = 5;
  constexpr double height = 0.5;
  constexpr double pitch = 1.1;
  constexpr double density = 2500;  // of limestone, kg/m³
  constexpr double top_scale = 15.0 / 16;
  constexpr std::array finishes{finish::limestone, finish::sandstone, finish::granite, finish::brick};
  GltfBuilder gltf("stone_pyramid", {.duration = 5},
                   {.eye = {2.3, 2.4, 6.9}, .target = {0, 1.05, 0}, .yfov = 0.56, .friction = 0.6});

  const int friction = gltf.physics_material(0.6);
  struct Cut {
    int rough;  // node of the stone with sharp edges, which the hull is made of
    int geometry;
    double mass;
  };
  std::vector<Cut> cuts;
  for (const Outline& outline : stone_outlines()) {
    const Polyhedron solid = prism(outline, height, top_scale);
    const int rough = gltf.detached_node(numbered("rough_stone", static_cast<int>(cuts.size()) + 1),
                                         {{faceted(solid), finish::limestone}});
    cuts.push_back({rough, gltf.geometry(rounded(solid, 0.045, 2)),
                    std::round(density * prism_volume(outline, height, top_scale))});
  }
  int number = 0;
  for (int course = 0; course < courses; ++course) {
    const int stones = courses - course;
    for (int i = 0; i < stones; ++i, ++number) {
      const Cut& cut = cuts[number % cuts.size()];
      gltf.body(numbered("stone", number + 1),
                at(pitch * (i - (stones - 1) / 2.0), height * (course + 0.5), 0), {.mass = cut.mass},
                {cut.rough, friction, Collider::Kind::hull},
                {{cut.geometry, finishes[(number * 3 + course) % finishes.size()]}});
    }
  }
  gltf.expect_standing(0.025, stands);
  return gltf;
}

GltfBuilder card_house() {
  constexpr double height = 0.4;
  constexpr double thickness = 0.012;
  constexpr double width = 0.28;
  constexpr double lean = 25 * pi / 180;
  constexpr double pitch = height + 0.004;
  constexpr int levels = 3;
  GltfBuilder gltf("card_house", {.duration = 5, .poster = 1},
                   {.eye = {0.9, 1.1, 2.7}, .target = {0, 0.55, 0}, .yfov = 0.50, .friction = 0.7});

  // An ivory card with a coloured panel on each face.
  const Vector3 size(thickness, height, width);
  const Collider collider{gltf.box_shape(size), gltf.physics_material(0.7)};
  const int edge = gltf.geometry(cuboid(size, 0.003, 1));
  Mesh backs;
  for (const int side : {-1, 1})
    backs +=
        at(side * (thickness / 2 - 0.0012), 0, 0) * cuboid({0.004, height - 0.05, width - 0.05}, 0.0015, 1);
  const int back = gltf.geometry(backs);
  const std::array looks{gltf.mesh("red_card", {{edge, finish::ivory}, {back, finish::terracotta}}),
                         gltf.mesh("blue_card", {{edge, finish::ivory}, {back, finish::blue}})};
  int number = 0;
  const auto add_card = [&](const Pose& pose, int look) {
    gltf.body(numbered("card", ++number), pose, {.mass = 0.1}, collider, looks[look]);
  };
  // Find a leaning card's centre: `out` from the apex, and `up` from the card's lowest edge.
  const auto [sine, cosine] = sine_cosine(lean);
  const double out = (thickness * cosine + height * sine) / 2;
  const double up = (thickness * sine + height * cosine) / 2;
  double floor = 0;
  for (int level = 0; level < levels; ++level) {
    const int pairs = levels - level;
    for (int i = 0; i < pairs; ++i) {
      const double apex = pitch * (i - (pairs - 1) / 2.0);
      for (const int side : {-1, 1})
        add_card(at(apex + side * out, floor + up, 0) * turn(Z, side * lean), level % 2);
    }
    floor += 2 * up;
    for (int i = 0; i + 1 < pairs; ++i)
      add_card(at(pitch * (i - (pairs - 2) / 2.0), floor + thickness / 2, 0) * turn(Z, pi / 2),
               1 - level % 2);
    floor += thickness;
  }
  gltf.expect_standing(0.05 * height, "a pair stands if μ ≥ ½ tan θ, under load if μ ≥ tan θ = 0.466");
  return gltf;
}

struct Arch {
  std::string name;
  double thickness;  // m
  double middle;     // x of its centre, m
  std::array<Finish, 2> finishes;
};

/// Adds a semicircle of stones of mean radius 1 m between two plinths.
void add_arch(GltfBuilder& gltf, const Arch& arch, int stones, int grip) {
  constexpr double radius = 1;
  constexpr double depth = 0.4;
  constexpr double density = 2300;
  constexpr double plinth = 0.35;
  const double angle = pi / stones;
  const auto [sine, cosine] = sine_cosine(angle / 2);
  const double inner = radius - arch.thickness / 2;
  const double outer = radius + arch.thickness / 2;
  for (const int side : {-1, 1})
    gltf.fixed_box(arch.name + (side < 0 ? "_left_plinth" : "_right_plinth"), {0.36, plinth, depth + 0.14},
                   at(arch.middle + side * radius, plinth / 2, 0), grip, finish::basalt);
  // A stone's frame: X outwards, Y the depth.
  const Polyhedron solid =
      prism({point(inner * cosine - radius, -inner * sine), point(outer * cosine - radius, -outer * sine),
             point(outer * cosine - radius, outer * sine), point(inner * cosine - radius, inner * sine)},
            depth);
  const int hull = gltf.detached_node(arch.name + "_rough_stone", {{faceted(solid), finish::limestone}});
  const int dressed = gltf.geometry(rounded(solid, 0.012, 2));
  const double mass = std::round(density * depth * arch.thickness * radius * 2 * sine * cosine);
  for (int i = 0; i < stones; ++i) {
    const Pose pose =
        at(arch.middle, plinth, 0) * turn(Z, angle * (i + 0.5)) * at(radius, 0, 0) * turn(X, pi / 2);
    const Finish& look = i == stones / 2 ? finish::terracotta : arch.finishes[i % 2];
    gltf.body(numbered(arch.name + "_stone", i + 1), pose, {.mass = mass}, {hull, grip, Collider::Kind::hull},
              {{dressed, look}});
  }
}

GltfBuilder masonry_arch() {
  constexpr int stones = 11;
  GltfBuilder gltf("masonry_arch", {.duration = 3, .poster = 0.1},
                   {.eye = {1.6, 1.9, 5.9}, .target = {0, 0.66, 0}, .yfov = 0.52, .friction = 0.7});
  const int grip = gltf.physics_material(0.7);
  add_arch(gltf, {"thick", 0.18, -1.35, {finish::sandstone, finish::limestone}}, stones, grip);
  add_arch(gltf, {"thin", 0.07, 1.35, {finish::brick, finish::granite}}, stones, grip);
  gltf.expect_standing(0.01, "Milankovitch (1907): a semicircle stands from 0.1075 of its radius on",
                       numbered("thick_stone", 1, stones));
  gltf.expect({"fall of the thin arch's crown at 3 s", "way", {"thin_stone_6"}, -Y}, at_time(3),
              at_least(0.5), 0.05,
              "Milankovitch (1907): a semicircle thinner than 0.1075 of its radius cannot stand");
  return gltf;
}

}  // namespace

std::vector<SceneFunction> stack_scenes() {
  return {box_stack,      tall_stack, top_heavy_stack, box_pyramid, brick_wall,
          heavy_on_light, overlap,    stone_pyramid,   card_house,  masonry_arch};
}

}  // namespace substep::scenes
