/// Scenes of many bodies in contact: piles, houses, arches, what falls over.

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/rotation.h"
#include "stage.h"

namespace substep::make {

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
  return gltf.text();
}

std::string overlap() {
  constexpr double side = 0.5;
  constexpr double pitch = 0.75 * side;
  constexpr int base = 4;
  constexpr std::array finishes{finish::teal, finish::ivory, finish::terracotta, finish::mustard};

  GltfBuilder gltf("overlap", 3);
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
  return gltf.text();
}

}  // namespace substep::make
