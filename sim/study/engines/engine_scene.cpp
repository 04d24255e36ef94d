#include "sim/study/engines/engine_scene.h"

#include <algorithm>
#include <array>

#include "sim/error.h"
#include "sim/model/model.h"

namespace substep {
namespace {

bool is_fixed(const Body& body) {
  return body.inverse_mass == 0;
}

void check(const Body& body, bool has_filters_and_motion) {
  if (is_fixed(body)) {
    const bool moves = !body.linear_velocity.isZero() || !body.angular_velocity.isZero();
    if (moves && !has_filters_and_motion) throw Error("{} is a kinematic body that moves", body.name);
    return;
  }
  if (!(body.inverse_inertia.minCoeff() > 0)) throw Error("{} has an infinite moment of inertia", body.name);
  if (body.gravity_factor != 1) throw Error("{} has a gravity of its own", body.name);
}

EngineJoint engine_joint(const Scene& scene, const Joint& joint, bool has_filters_and_motion) {
  if (!joint.drives.empty()) throw Error("joint {} has a drive", joint.name);
  std::array<bool, 3> linear{};
  std::array<bool, 3> angular{};
  for (const JointLimit& limit : joint.limits) {
    if (limit.min != 0 || limit.max != 0 || limit.stiffness)
      throw Error("joint {} has a limit or a spring", joint.name);
    for (int axis = 0; axis < 3; ++axis) {
      if (limit.axes[axis]) (limit.angular ? angular : linear)[axis] = true;
    }
  }
  const auto locked = std::ranges::count(angular, true);
  if (std::ranges::count(linear, true) != 3 || (locked != 0 && locked != 2 && locked != 3))
    throw Error("joint {} is no ball joint, hinge or fixed joint", joint.name);
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
  if (is_held(result.a)) throw Error("joint {} holds nothing that moves", joint.name);
  if (result.b != world_body && is_fixed(scene.bodies[result.b]) && !has_filters_and_motion)
    throw Error("joint {} hangs on a kinematic body", joint.name);
  return result;
}

bool has_filter(const Collider& collider) {
  return !collider.in_no_system || ~collider.collides_with != 0;
}

bool meet(const Collider& one, const Collider& other) {
  const auto lets = [](const Collider& a, const Collider& b) {
    return b.in_no_system || (b.member & a.collides_with) != 0;
  };
  return lets(one, other) && lets(other, one);
}

/// Returns the pairs of units that filters and joints keep apart. Throws Error where some colliders of two
/// units meet and others do not.
std::set<std::pair<int, int>> pairs_apart(const Scene& scene) {
  std::set<std::pair<int, int>> apart;
  std::set<std::pair<int, int>> together;
  const bool has_filters = std::ranges::any_of(scene.colliders, has_filter);
  const int colliders = has_filters ? static_cast<int>(scene.colliders.size()) : 0;
  for (int i = 0; i < colliders; ++i) {
    for (int k = 0; k < i; ++k) {
      const std::pair<int, int> units = std::minmax({unit_of(scene, i), unit_of(scene, k)});
      if (units.first == units.second) continue;
      const auto at = [&](int index) -> const Collider& {
        return scene.colliders[static_cast<std::size_t>(index)];
      };
      (meet(at(i), at(k)) ? together : apart).insert(units);
    }
  }
  for (const auto& units : together) {
    if (apart.contains(units)) throw Error("colliders of one body have several collision filters");
  }
  for (const Joint& joint : scene.joints) {
    if (joint.enable_collision) continue;
    const int body = std::max(joint.body_a, joint.body_b);
    if (std::min(joint.body_a, joint.body_b) != world_body) {
      apart.insert(std::minmax(joint.body_a, joint.body_b));
    } else {
      for (const int collider : joint.silent_colliders) apart.emplace(body, unit_of(scene, collider));
    }
  }
  return apart;
}

}  // namespace

EngineScene engine_scene(const Scene& scene, bool has_filters_and_motion) {
  EngineScene result;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) check(scene.bodies[i], has_filters_and_motion);
  for (const Joint& joint : scene.joints)
    result.joints.push_back(engine_joint(scene, joint, has_filters_and_motion));
  result.has_contacts = build_model(scene).contacts;
  if (!result.has_contacts) return result;
  for (const Joint& joint : scene.joints) {
    if (!has_filters_and_motion && (joint.enable_collision || !joint.silent_colliders.empty()))
      throw Error("joint {} lets its bodies collide, or silences the world's colliders", joint.name);
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
    if (has_filter(collider) && !has_filters_and_motion) throw Error("there are collision filters");
  }
  if (has_filters_and_motion) result.apart = pairs_apart(scene);
  result.friction = first.dynamic_friction;
  return result;
}

}  // namespace substep
