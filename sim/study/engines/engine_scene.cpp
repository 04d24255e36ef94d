#include "sim/study/engines/engine_scene.h"

#include <fmt/format.h>

#include <algorithm>

#include "sim/error.h"
#include "sim/model/model.h"

namespace substep {
namespace {

bool is_fixed(const Body& body) {
  return body.inverse_mass == 0;
}

void check(const Body& body) {
  if (is_fixed(body)) {
    if (!body.linear_velocity.isZero() || !body.angular_velocity.isZero()) {
      throw Error(fmt::format("{} is a kinematic body that moves", body.name));
    }
    return;
  }
  if (!(body.inverse_inertia.minCoeff() > 0)) {
    throw Error(fmt::format("{} has an infinite moment of inertia", body.name));
  }
  if (body.gravity_factor != 1) throw Error(fmt::format("{} has a gravity of its own", body.name));
}

EngineJoint engine_joint(const Scene& scene, const Joint& joint) {
  if (!joint.drives.empty()) throw Error(fmt::format("joint {} has a drive", joint.name));
  std::array<bool, 3> linear{};
  std::array<bool, 3> angular{};
  for (const JointLimit& limit : joint.limits) {
    if (limit.min != 0 || limit.max != 0 || limit.stiffness) {
      throw Error(fmt::format("joint {} has a limit or a spring", joint.name));
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (limit.axes[axis]) (limit.angular ? angular : linear)[axis] = true;
    }
  }
  const auto locked = std::ranges::count(angular, true);
  if (std::ranges::count(linear, true) != 3 || (locked != 0 && locked != 2 && locked != 3)) {
    throw Error(fmt::format("joint {} is no ball joint, hinge or fixed joint", joint.name));
  }
  EngineJoint result{locked == 0   ? EngineJoint::Kind::ball
                     : locked == 2 ? EngineJoint::Kind::hinge
                                   : EngineJoint::Kind::fixed,
                     joint.body_a,
                     joint.body_b,
                     joint.frame_a.position,
                     joint.frame_b.position,
                     Vector3::UnitX(),
                     Vector3::UnitX()};
  const int free = static_cast<int>(std::ranges::find(angular, false) - angular.begin());
  if (locked == 2) {
    result.axis_a = joint.frame_a.orientation * Vector3::Unit(free);
    result.axis_b = joint.frame_b.orientation * Vector3::Unit(free);
  }
  const auto is_held = [&](int body) { return body == world_body || is_fixed(scene.bodies[body]); };
  if (is_held(result.a)) {
    std::swap(result.a, result.b);
    std::swap(result.anchor_a, result.anchor_b);
    std::swap(result.axis_a, result.axis_b);
  }
  if (is_held(result.a)) throw Error(fmt::format("joint {} holds nothing that moves", joint.name));
  if (result.b != world_body && is_fixed(scene.bodies[result.b])) {
    throw Error(fmt::format("joint {} hangs on a kinematic body", joint.name));
  }
  return result;
}

}  // namespace

EngineScene engine_scene(const Scene& scene) {
  EngineScene result;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) check(scene.bodies[i]);
  for (const Joint& joint : scene.joints) result.joints.push_back(engine_joint(scene, joint));
  result.has_contacts = build_model(scene).contacts;
  if (!result.has_contacts) return result;
  for (const Joint& joint : scene.joints) {
    if (joint.enable_collision) throw Error(fmt::format("joint {} lets its bodies collide", joint.name));
  }
  const ContactMaterial& first = scene.colliders.front().material;
  for (const Collider& collider : scene.colliders) {
    const ContactMaterial& material = collider.material;
    if (material.restitution != 0) throw Error("there is restitution");
    if (material.static_friction != material.dynamic_friction ||
        material.dynamic_friction != first.dynamic_friction ||
        material.friction_combine == Combine::multiply) {
      throw Error("there is more than one coefficient of friction");
    }
    if (!collider.in_no_system || ~collider.collides_with != 0) throw Error("there are collision filters");
  }
  result.friction = first.dynamic_friction;
  return result;
}

}  // namespace substep
