#include "test_scenes.h"

#include "sim/geometry/convex_hull.h"
#include "sim/math/rotation.h"

namespace substep::render {

Scene empty_scene(bool with_floor) {
  Scene scene;
  scene.name = "test";
  scene.bodies.emplace_back();
  if (with_floor) scene.colliders.emplace_back().shape = Plane{};
  return scene;
}

int add_body(Scene& scene, const Shape& shape, const Vector3& position, const Quaternion& orientation) {
  const int index = static_cast<int>(scene.bodies.size());
  Body& body = scene.bodies.emplace_back();
  body.inverse_mass = 1;
  body.inverse_inertia = Vector3::Ones();
  body.pose = {position, orientation};
  Collider& collider = scene.colliders.emplace_back();
  collider.body = index;
  collider.shape = shape;
  return index;
}

Scene three_shapes() {
  Scene scene = empty_scene();
  add_body(scene, box({1, 1, 1}), {0, 0.5, 0});
  add_body(scene, Sphere{0.4}, {1.2, 0.4, 0.2});
  add_body(scene, Capsule{0.5, 0.15}, {-1.1, 1.0, 0}, rotation_quaternion({0, 0, 0.6}));
  Camera& camera = scene.camera.emplace();
  camera.pose.position = {0, 1.4, 5};
  camera.pose.orientation = rotation_quaternion({-0.17, 0, 0});
  camera.vertical_field_of_view = 0.7;
  scene.sun = Sun{{-0.4, -1, -0.5}, {1, 0.95, 0.88}, 3};
  return scene;
}

}  // namespace substep::render
