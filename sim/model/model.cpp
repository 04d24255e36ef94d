#include "sim/model/model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/error.h"
#include "sim/geometry/round_shapes.h"
#include "sim/model/state.h"

namespace substep {
namespace {

bool is_valid(const Pose& pose) {
  return pose.position.allFinite() && std::abs(pose.orientation.norm() - 1) < 1e-6;
}

/// Returns false where the shape is empty or its measures are not a solid's.
bool is_valid(const Shape& shape) {
  if (const auto* const polytope = std::get_if<Polytope>(&shape)) return polytope->face_count() > 0;
  if (const auto* const mesh = std::get_if<TriangleMesh>(&shape)) return !mesh->nodes.empty();
  const std::optional<RevolvedSolid> solid = as_revolved(shape, {});
  return !solid || solid->is_valid();
}

bool is_valid(const ContactMaterial& material) {
  return material.static_friction >= 0 && material.dynamic_friction >= 0 && material.restitution >= 0;
}

using Axes = std::array<bool, 3>;

int count(const Axes& axes) {
  return axes[0] + axes[1] + axes[2];
}

/// Returns the first axis that is in the set or, without `is_in`, the first that is not.
int first(const Axes& axes, bool is_in) {
  return axes[0] == is_in ? 0 : axes[1] == is_in ? 1 : 2;
}

bool is_lock(const JointLimit& limit) {
  return limit.min == 0 && limit.max == 0 && !limit.stiffness;
}

/// Returns the linear or angular axes that hard limits, one or several, lock at zero.
Axes locked_axes(const Joint& joint, bool angular) {
  Axes locked{};
  for (const JointLimit& limit : joint.limits) {
    if (limit.angular != angular || !is_lock(limit)) continue;
    for (int axis = 0; axis < 3; ++axis) locked[axis] = locked[axis] || limit.axes[axis];
  }
  return locked;
}

/// Throws Error that names the first part of the scene that cannot be modelled.
void check(const Scene& scene) {
  const auto require = [&](bool is_met, const std::string& part, const char* needs) {
    if (!is_met)
      throw Error("{}: {} needs {}", scene.file.empty() ? "the scene" : scene.file.string(), part, needs);
  };
  const auto is_body = [&](int i) { return i >= 0 && i < static_cast<int>(scene.bodies.size()); };
  const auto is_held = [&](int i) { return is_body(i) && scene.bodies[i].is_kinematic(); };
  require(is_held(world_body), "it", "the world as its first body, which no force moves");
  const Body& world = scene.bodies[world_body];
  require(world.pose.position.isZero(0) && world.pose.orientation.vec().isZero(0) &&
              world.linear_velocity.isZero(0) && world.angular_velocity.isZero(0),
          "the world", "the identity pose and no velocity");
  require(scene.gravity.allFinite(), "its gravity", "finite numbers");
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    require(is_valid(scene.bodies[i]), fmt::format("body {} ({})", i, scene.bodies[i].name),
            "finite numbers, unit quaternions, and no negative mass or moment");
  }
  for (std::size_t i = 0; i < scene.colliders.size(); ++i) {
    const Collider& collider = scene.colliders[i];
    const std::string part = fmt::format("collider {}", i);
    require(is_body(collider.body) && is_valid(collider.placement) && is_valid(collider.material), part,
            "a body of the scene, a finite placement with a unit quaternion, and no negative coefficient");
    require(is_valid(collider.shape), part, "a shape with faces, or with a positive radius and height");
    require(!std::holds_alternative<Plane>(collider.shape) || collider.body == world_body, part,
            "to belong to the world: it is a plane");
    require(!std::holds_alternative<TriangleMesh>(collider.shape) || is_held(collider.body), part,
            "a body that no force moves: it is a triangle mesh");
  }
  const auto is_collider = [&](int i) { return i >= 0 && i < static_cast<int>(scene.colliders.size()); };
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    const Joint& joint = scene.joints[i];
    const std::string part = fmt::format("joint {} ({})", i, joint.name);
    require(is_body(joint.body_a) && is_body(joint.body_b) && joint.body_a != joint.body_b &&
                std::ranges::all_of(joint.silent_colliders, is_collider),
            part, "two bodies, and silent colliders, of the scene");
    require(is_valid(joint.frame_a) && is_valid(joint.frame_b), part, "finite frames with unit quaternions");
    for (const JointLimit& limit : joint.limits) {
      require(count(limit.axes) > 0 && limit.min <= limit.max && limit.stiffness.value_or(0) >= 0 &&
                  limit.damping >= 0,
              part, "limits with an axis, min ≤ max, and no negative stiffness or damping");
    }
    for (const JointDrive& drive : joint.drives) {
      require(drive.axis >= 0 && drive.axis < 3 && drive.max_force >= 0 && drive.stiffness >= 0 &&
                  drive.damping >= 0 && drive.stiffness + drive.damping > 0 &&
                  std::isfinite(drive.position_target + drive.velocity_target),
              part, "drives with an axis from 0 to 2, finite targets, and stiffness or damping above 0");
    }
  }
}

JointCoordinate coordinate_of(const JointLimit& limit) {
  using Kind = JointCoordinate::Kind;
  // Bounds beyond half a turn, up to rounding, have no effect.
  const bool is_bounded = std::max(-limit.min, limit.max) < std::numbers::pi + 1e-5;
  const double middle = is_bounded ? (limit.min + limit.max) / 2 : 0;
  switch (count(limit.axes)) {
    case 1:
      return {limit.angular ? Kind::twist : Kind::position, first(limit.axes, true), middle};
    case 2:
      return {limit.angular ? Kind::cone : Kind::radius, first(limit.axes, false)};
    default:
      return {limit.angular ? Kind::turn : Kind::distance, 0};
  }
}

void add_limit(const JointLimit& limit, const Attachment& at, Model& model) {
  const bool soft = limit.stiffness.has_value();
  const double stiffness = limit.stiffness.value_or(0);
  // A spring of no stiffness and no damping does nothing.
  if (soft && stiffness == 0 && limit.damping == 0) return;
  JointCoordinate coordinate = coordinate_of(limit);
  const auto add = [&](Limit::Side side, double bound) {
    model.limits.push_back({at, coordinate, side, bound, soft, stiffness, limit.damping});
  };
  const int axes = count(limit.axes);
  const bool is_non_negative = axes > 1;
  if (soft && is_non_negative && limit.max <= 0) {
    // One row would cease to act once the frames pass each other within a step.
    using Kind = JointCoordinate::Kind;
    if (coordinate.kind == Kind::cone) {
      add(Limit::Side::both, 0);
      coordinate.kind = Kind::sway;
      add(Limit::Side::both, 0);
      return;
    }
    for (int axis = 0; axis < 3; ++axis) {
      coordinate = {axes == 2 ? Kind::position : limit.angular ? Kind::rotation_vector : Kind::offset, axis};
      if (limit.axes[axis]) add(Limit::Side::both, 0);
    }
    return;
  }
  if (limit.min == limit.max) {
    add(is_non_negative && limit.max <= 0 ? Limit::Side::high : Limit::Side::both, limit.max);
    return;
  }
  if (std::isfinite(limit.min) && !(is_non_negative && limit.min <= 0)) add(Limit::Side::low, limit.min);
  if (std::isfinite(limit.max)) add(Limit::Side::high, limit.max);
}

void add_joint(const Joint& joint, Model& model) {
  const Attachment at{joint.body_b, joint.body_a, joint.frame_b, joint.frame_a};  // there b has the node
  for (const JointLimit& limit : joint.limits) {
    if (!is_lock(limit)) add_limit(limit, at, model);
  }
  // Two or three locked axes form a block, one alone is a row
  const Axes linear = locked_axes(joint, false);
  const Axes angular = locked_axes(joint, true);
  const auto lock_one = [&](JointCoordinate::Kind kind, int axis) {
    model.limits.push_back({at, {kind, axis}, Limit::Side::both, 0, false, 0, 0});
  };
  if (count(linear) == 3) model.locks.push_back({Lock::Kind::point, at, 0});
  if (count(linear) == 2) model.locks.push_back({Lock::Kind::line, at, first(linear, false)});
  if (count(linear) == 1) lock_one(JointCoordinate::Kind::position, first(linear, true));
  if (count(angular) == 3) model.locks.push_back({Lock::Kind::orientation, at, 0});
  if (count(angular) == 2) model.locks.push_back({Lock::Kind::direction, at, first(angular, false)});
  if (count(angular) == 1) lock_one(JointCoordinate::Kind::twist, first(angular, true));
  for (const JointDrive& drive : joint.drives) {
    const auto kind = drive.angular ? JointCoordinate::Kind::twist : JointCoordinate::Kind::position;
    model.drives.push_back({at,
                            {kind, drive.axis, drive.position_target},
                            drive.position_target,
                            drive.velocity_target,
                            drive.stiffness,
                            drive.damping,
                            drive.max_force,
                            drive.acceleration});
  }
}

/// Adds the pairs that the joint keeps from colliding. The world's colliders are objects of their own, so a
/// joint to the world silences only those that it names.
void add_silent_pairs(const Joint& joint, Model& model) {
  const auto [first, second] = std::minmax(joint.body_a, joint.body_b);
  if (first != world_body) {
    model.jointed.emplace_back(first, second);
    return;
  }
  for (const int collider : joint.silent_colliders) model.jointed_to_static.emplace_back(collider, second);
}

}  // namespace

bool holds_anchors_together(const Joint& joint) {
  return count(locked_axes(joint, false)) == 3;
}

bool is_valid(const Body& body) {
  return std::isfinite(body.inverse_mass) && body.inverse_mass >= 0 && body.inverse_inertia.allFinite() &&
         body.inverse_inertia.minCoeff() >= 0 && std::isfinite(body.gravity_factor) && is_valid(body.pose) &&
         is_valid(body.body_from_node) && body.linear_velocity.allFinite() &&
         body.angular_velocity.allFinite();
}

void require_valid(const State& state, const Scene& scene) {
  const std::vector<Body>& bodies = scene.bodies;
  if (state.q.size() != bodies.size() || state.v.size() != bodies.size()) {
    throw Error("{}: the state has {} poses and {} velocities, but the scene has {} bodies",
                scene.file.string(), state.q.size(), state.v.size(), bodies.size());
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    Body body = bodies[i];
    body.pose = {state.q[i].linear, state.q[i].angular};
    body.linear_velocity = state.v[i].linear;
    body.angular_velocity = state.v[i].angular;
    if (!is_valid(body)) {
      throw Error("{}: body {} ({}) in the state needs finite numbers and a unit quaternion",
                  scene.file.string(), i, body.name);
    }
  }
}

Model build_model(const Scene& scene) {
  check(scene);
  Model model;
  model.gravity = scene.gravity;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    model.masses.push_back({body.inverse_mass, body.inverse_inertia, body.gravity_factor,
                            std::sqrt(body.inverse_mass), body.inverse_inertia.cwiseSqrt()});
    const Vector3 inertia =
        (body.inverse_inertia.array() > 0).select(body.inverse_inertia.cwiseInverse(), 0.0);
    model.inertia.push_back(inertia);
    const bool finite = body.inverse_inertia.minCoeff() > 0;
    const bool equal = inertia[0] == inertia[1] && inertia[1] == inertia[2];
    if (scene.gyroscopic && finite && !equal) model.gyroscopic.push_back(static_cast<int>(i));
  }
  model.has_joints.assign(scene.bodies.size(), 0);
  for (const Joint& joint : scene.joints) {
    // Leave out joints of two bodies that no force moves: they constrain nothing.
    if (!moves(model.masses[joint.body_a]) && !moves(model.masses[joint.body_b])) continue;
    add_joint(joint, model);
    model.has_joints[joint.body_a] = model.has_joints[joint.body_b] = 1;
    if (!joint.enable_collision) add_silent_pairs(joint, model);
  }
  std::ranges::sort(model.jointed);
  std::ranges::sort(model.jointed_to_static);
  const auto any = [&](auto&& property) { return std::ranges::any_of(scene.colliders, property); };
  model.contacts = scene.colliders.size() > 1 &&
                   any([&](const Collider& c) { return scene.bodies[c.body].inverse_mass > 0; });
  model.friction = model.contacts && any([](const Collider& c) {
                     return c.material.dynamic_friction > 0 || c.material.static_friction > 0;
                   });
  model.restitution = model.contacts && any([](const Collider& c) { return c.material.restitution > 0; });
  return model;
}

std::string description(const Model& model) {
  std::string joints;
  const auto add = [&](std::size_t number, const char* thing) {
    if (number == 0) return;
    joints += fmt::format("{}{} {}{}", joints.empty() ? "" : ", ", number, thing, number == 1 ? "" : "s");
  };
  const auto locks = [&](Lock::Kind kind) {
    return static_cast<std::size_t>(std::ranges::count(model.locks, kind, &Lock::kind));
  };
  add(locks(Lock::Kind::point), "locked point");
  add(locks(Lock::Kind::line), "locked line");
  add(locks(Lock::Kind::direction), "locked direction");
  add(locks(Lock::Kind::orientation), "locked orientation");
  add(model.limits.size(), "limit");
  add(model.drives.size(), "drive");
  std::string contacts = "no contacts";
  if (model.contacts) {
    contacts = model.friction ? "contacts with friction" : "contacts without friction";
    contacts += model.restitution ? " and restitution" : "";
  }
  const std::string term = model.gyroscopic.empty()
                               ? std::string("no gyroscopic term")
                               : fmt::format("gyroscopic term of {} of {} bodies", model.gyroscopic.size(),
                                             model.masses.size() - 1);
  return fmt::format("{}; {}; {}", joints.empty() ? "no joints" : joints, contacts, term);
}

}  // namespace substep
