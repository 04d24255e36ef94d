// Contacts in motion: what rolls and slides over a mesh moves as it does over a plane.

#include <gtest/gtest.h>

#include "sim/geometry/mass_properties.h"
#include "tests/geometry/solids.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

Scene ground_scene(const Shape& ground, double friction) {
  Scene scene = test::floor_scene(friction);
  scene.colliders[0].shape = ground;
  return scene;
}

void add_solid(Scene& scene, const Shape& shape, double mass, const Pose& pose, const Vector3& velocity,
               const Vector3& spin, double friction) {
  const MassProperties properties = with_mass(mass_properties(shape), mass);
  Body body;
  body.name = "solid";
  body.inverse_mass = 1 / mass;
  body.inverse_inertia = properties.inertia.diagonal().cwiseInverse();
  body.pose = pose;
  body.linear_velocity = velocity;
  body.angular_velocity = spin;
  Collider collider;
  collider.body = static_cast<int>(scene.bodies.size());
  collider.shape = shape;
  collider.material.dynamic_friction = collider.material.static_friction = friction;
  scene.bodies.push_back(body);
  scene.colliders.push_back(collider);
}

State after(const Scene& scene, Algorithm algorithm, int steps) {
  Settings settings;
  settings.algorithm = algorithm;
  settings.step = 1.0 / 60;
  settings.substeps = 4;
  settings.iterations = 4;
  return test::run(scene, settings, steps * settings.step);
}

/// A solid sent over a plane, an even and an uneven flat mesh: it is where it is over the plane.
void expect_alike(const Shape& shape, const Pose& pose, const Vector3& spin, double friction) {
  const auto scene_on = [&](const Shape& ground) {
    Scene scene = ground_scene(ground, friction);
    add_solid(scene, shape, 1, pose, {1.3, 0, 0.4}, spin, friction);
    return scene;
  };
  for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a5}) {
    const State on_plane = after(scene_on(Plane{}), algorithm, 120);
    for (const double uneven : {0.0, 0.3}) {
      const State on_mesh = after(scene_on(test::flat_mesh(16, 0.5, uneven)), algorithm, 120);
      EXPECT_LT(position_difference(on_plane, on_mesh), 1e-9) << uneven;
      EXPECT_LT(test::velocity_difference(on_plane, on_mesh), 1e-9) << uneven;
      EXPECT_GT(on_mesh.q[1].linear.x(), pose.position.x() + 1);
    }
  }
}

TEST(ContactMotion, SphereRollsOverMeshAsOverPlane) {
  expect_alike(Sphere{0.25}, {{-2, 0.25, 0.1}, Quaternion::Identity()}, Vector3(0.4, 0, -1.3) / 0.25, 0.5);
}

}  // namespace
}  // namespace substep
