#pragma once
/// Scenes made of shapes alone, and pictures of them.

#include <vector>

#include "render/renderer.h"
#include "sim/geometry/convex_hull.h"
#include "sim/math/rotation.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// Returns a scene of the world alone, with a floor at y = 0 where `with_floor`.
inline Scene empty_scene(bool with_floor = true) {
  Scene scene;
  scene.name = "test";
  scene.bodies.emplace_back();
  if (with_floor) scene.colliders.emplace_back().shape = Plane{};
  return scene;
}

/// Adds a body of one shape; returns its index.
inline int add_body(Scene& scene, const Shape& shape, const Vector3& position,
                    const Quaternion& orientation = Quaternion::Identity()) {
  Body& body = scene.bodies.emplace_back();
  body.inverse_mass = 1;
  body.inverse_inertia = Vector3::Ones();
  body.pose = {position, orientation};
  Collider& collider = scene.colliders.emplace_back();
  collider.body = static_cast<int>(scene.bodies.size()) - 1;
  collider.shape = shape;
  return collider.body;
}

/// Returns a box on the floor, a ball beside it and a capsule in the air, with camera and sun.
inline Scene three_shapes() {
  Scene scene = empty_scene();
  add_body(scene, box({1, 1, 1}), {0, 0.5, 0});
  add_body(scene, Sphere{0.4}, {1.2, 0.4, 0.2});
  add_body(scene, Capsule{0.5, 0.15}, {-1.1, 1.0, 0}, rotation_quaternion({0, 0, 0.6}));
  scene.camera = Camera{{{0, 1.4, 5}, rotation_quaternion({-0.17, 0, 0})}, 0.7};
  scene.sun = Sun{{-0.4, -1, -0.5}, {1, 0.95, 0.88}, 3};
  return scene;
}

inline std::vector<Coordinates> start_of(const Scene& scene) {
  return initial_state(scene).q;
}

inline Image picture_of(const Scene& scene, const RenderSettings& settings) {
  return Renderer(scene, settings).draw(start_of(scene));
}

}  // namespace substep::render
