#include "sim/measure/weight_scene.h"

namespace substep {

Scene weight_on_a_joint(double height, const JointLimit& limit) {
  Scene scene;
  scene.name = "one weight";
  scene.gravity.setZero();
  scene.bodies.resize(2);
  scene.bodies[0].name = "world";
  Body& weight = scene.bodies[1];
  weight.name = "weight";
  weight.inverse_mass = 1;
  weight.inverse_inertia = Vector3::Constant(10);
  weight.pose.position = {0, height, 0};
  Joint joint;
  joint.name = "joint";
  joint.body_a = world_body;
  joint.body_b = 1;
  joint.limits.push_back(limit);
  scene.joints.push_back(joint);
  return scene;
}

}  // namespace substep
