/// Scenes of what stands because its parts lean on each other: card houses, arches.

#include <cmath>

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/math/rotation.h"
#include "stage.h"

namespace substep::scenes {

std::string card_house() {
  constexpr double height = 0.4;
  constexpr double thickness = 0.012;
  constexpr double width = 0.28;
  constexpr double lean = 25 * pi / 180;
  constexpr double pitch = height + 0.004;
  constexpr int levels = 3;

  GltfBuilder gltf("card_house", 5);
  gltf.poster(1);
  set_view(gltf, {0.9, 1.1, 2.7}, {0, 0.55, 0}, 0.50);
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
  set_view(gltf, {1.6, 1.9, 5.9}, {0, 0.66, 0}, 0.52);
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

}  // namespace substep::scenes
