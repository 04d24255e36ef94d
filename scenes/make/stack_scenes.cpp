/// Scenes of boxes on boxes: stacks, pyramids, a wall.

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "stage.h"

namespace substep::scenes {
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
    set_view(gltf, eye, target, view);
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
  set_view(gltf, {1.2, 1.55, 4.6}, {0, 0.50, 0}, 0.50);
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
  set_view(gltf, {2.1, 1.9, 5.4}, {0, 0.92, 0}, 0.50);
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

}  // namespace substep::scenes
