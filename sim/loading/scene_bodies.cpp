#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <variant>
#include <vector>

#include "sim/loading/collider_shapes.h"
#include "sim/loading/scene_draft.h"
#include "sim/math/rotation.h"
#include "sim/model/model.h"

namespace substep {
namespace {

constexpr const char* out_of_range = "its mass, size or velocity is too large or too small to compute with";

/// Returns the moment of inertia of a ball of the default density. The cube root is Newton's, since libm's
/// differs between machines.
double inertia_of_ball(double mass) {
  const double cube = mass / (4.0 / 3 * std::numbers::pi * default_density);
  double radius = 1;
  for (int i = 0; i < 2000; ++i) {
    const double next = (2 * radius + cube / (radius * radius)) / 3;
    if (next == radius) break;
    radius = next;
  }
  return 0.4 * mass * radius * radius;
}

/// Returns 1/value; 0 for 0, which stands for an infinite mass or moment.
double inverse_of(double value) {
  return value == 0 ? 0 : 1 / value;
}

/// Returns a pose in the frame of a body that has its own.
Pose in_body(const Body& body, const Pose& in_node) {
  Pose pose = body.body_from_node * in_node;
  pose.orientation.normalize();
  return pose;
}

/// Returns all colliders of the body as one solid, in its node's frame; an overlap counts twice.
MassProperties shape_properties(const SceneDraft& draft, int body) {
  MassProperties sum;
  for (const int index : draft.colliders_of[body]) {
    const Collider& collider = draft.scene.colliders[index];
    const auto solid = draft.solids.find(index);
    const MassProperties one = transformed(
        solid != draft.solids.end() ? solid->second : mass_properties(collider.shape), collider.placement);
    sum = sum.mass > 0 ? combined(sum, one) : one;
  }
  return sum;
}

/// Sets mass, inertia and the body's frame. `shapes` are the colliders as one solid.
void set_mass(Body& body, const MotionProperties& motion, const MassProperties& shapes,
              const NodeTransform& world, const JsonValue& place) {
  Pose node_from_body;
  node_from_body.position = shapes.centre_of_mass;
  if (motion.centre_of_mass) node_from_body.position = world.scale.cwiseProduct(*motion.centre_of_mass);

  double mass = motion.mass.value_or(shapes.mass * default_density);
  if (!motion.kinematic && !motion.mass && shapes.mass == 0) {
    mass = 1;
    place.warn("has neither 'mass' nor a collider to take it from: it gets 1 kg");
  }
  if (!motion.kinematic) body.inverse_mass = inverse_of(mass);

  if (motion.inertia_diagonal) {
    node_from_body.orientation = motion.inertia_orientation;
    if (!motion.kinematic) body.inverse_inertia = motion.inertia_diagonal->unaryExpr(&inverse_of);
  } else if (shapes.mass > 0) {
    // About the shapes' own centre, also where the file places the centre of mass elsewhere: how the mass
    // is then spread is not known.
    const PrincipalInertia principal = symmetric_principal_inertia(with_mass(shapes, mass).inertia);
    node_from_body.orientation = principal.orientation;
    if (!principal.moments.allFinite()) place.fail("{}", out_of_range);
    if (body.inverse_mass > 0) body.inverse_inertia = principal.moments.cwiseInverse();
  } else if (body.inverse_mass > 0) {
    body.inverse_inertia.setConstant(1 / inertia_of_ball(mass));
    place.warn(
        "has neither 'inertiaDiagonal' nor a collider to take it from: it gets that of a ball of water");
  }
  body.body_from_node = node_from_body.inverse();
  body.pose = Pose{world.translation, world.rotation} * node_from_body;
  body.pose.orientation.normalize();
}

void place_body(SceneDraft& draft, int index) {
  Body& body = draft.scene.bodies[index];
  const int node = draft.node_of_body[index];
  const MotionProperties& motion = *draft.physics[node].motion;
  const NodeTransform& world = draft.document.nodes[node].world;
  const JsonValue place = draft.extension(node, "motion");
  const MassProperties shapes = shape_properties(draft, index);
  const bool has_volume = std::ranges::any_of(draft.colliders_of[index], [&](int collider) {
    return !std::holds_alternative<TriangleMesh>(draft.scene.colliders[collider].shape);
  });
  if (!std::isfinite(shapes.mass) || (has_volume && !(shapes.mass > 0))) place.fail("{}", out_of_range);
  set_mass(body, motion, shapes, world, place);
  body.gravity_factor = motion.gravity_factor;
  // A mirroring node maps vectors by −rotation, and angular velocities, pseudovectors, by rotation.
  body.linear_velocity = world.rotation * motion.linear_velocity;
  if (world.mirrors()) body.linear_velocity = -body.linear_velocity;
  body.angular_velocity = world.rotation * motion.angular_velocity;
  for (const int collider : draft.colliders_of[index]) {
    Pose& placement = draft.scene.colliders[collider].placement;
    placement = in_body(body, placement);
  }
}

/// Returns the world's colliders at a node of the world, above it and below it: the object that a joint to
/// this node connects. A collider without motion is an object of its own in the extension, unlike a body's.
std::vector<int> static_colliders_of(const SceneDraft& draft, int node) {
  std::vector<int> result;
  const auto add = [&](int at) {
    const int collider = draft.collider_of_node[at];
    if (collider >= 0 && draft.attachments[at].body == world_body) result.push_back(collider);
  };
  for (int at = draft.document.nodes[node].parent; at >= 0; at = draft.document.nodes[at].parent) add(at);
  std::vector<int> pending{node};
  while (!pending.empty()) {
    const int at = pending.back();
    pending.pop_back();
    add(at);
    const std::vector<int>& children = draft.document.nodes[at].children;
    pending.insert(pending.end(), children.begin(), children.end());
  }
  std::ranges::sort(result);
  return result;
}

/// Warns of a joint that starts open where hard limits lock it: by more than a hundredth of its smaller
/// body's radius of gyration about it, or 1°.
void warn_of_open(const Joint& joint, const std::vector<Body>& bodies, const JsonValue& place) {
  const Body& a = bodies[joint.body_a];
  const Body& b = bodies[joint.body_b];
  const Pose apart = (a.pose * joint.frame_a).inverse() * (b.pose * joint.frame_b);
  Vector3 gap = Vector3::Zero();
  Vector3 turn = Vector3::Zero();  // vector part of the quaternion
  for (const JointLimit& limit : joint.limits) {
    if (limit.min != 0 || limit.max != 0 || limit.stiffness) continue;
    for (int axis = 0; axis < 3; ++axis) {
      if (!limit.axes[axis]) continue;
      (limit.angular ? turn : gap)[axis] =
          limit.angular ? apart.orientation.vec()[axis] : apart.position[axis];
    }
  }
  double lever = infinity;
  for (const auto& [body, frame] : {std::pair(&a, &joint.frame_a), std::pair(&b, &joint.frame_b)}) {
    if (body->inverse_mass == 0) continue;
    const double squared = body->inverse_mass / body->inverse_inertia.minCoeff();
    lever = std::min(lever, std::sqrt(squared + frame->position.squaredNorm()));
  }
  if (gap.norm() > lever / 100) place.warn("'{}' starts {:.3g} m open", joint.name, gap.norm());
  const double cosine = std::sqrt(std::max(1 - turn.squaredNorm(), 0.0));
  const double degrees = 360 / std::numbers::pi * angle_of(turn.norm(), cosine);
  if (degrees > 1) place.warn("'{}' starts {:.3g}° open", joint.name, degrees);
}

void add_joint(SceneDraft& draft, int node) {
  const JsonValue place = draft.extension(node, "joint");
  place.warn_of_unknown({"connectedNode", "joint", "enableCollision"});
  const std::vector<GltfNode>& nodes = draft.document.nodes;
  const JsonValue connection = place.require("connectedNode");
  const int connected = draft.document.index_of(connection, "nodes", "node");
  if (!nodes[connected].in_scene) {
    connection.fail("the joint leads to node {} ('{}'), which is not in the scene", connected,
                    nodes[connected].name);
  }
  const std::vector<Joint>& descriptions = draft.tables.joints;
  Joint joint = descriptions[place.require("joint").index(descriptions.size(), "physics joint")];
  joint.name = nodes[node].name;
  place.read("enableCollision", joint.enable_collision, &JsonValue::boolean);
  const auto frame = [&](int end, int& body) {
    const NodeAttachment& attached = draft.attachments[end];
    if (!attached.in_node.has_rotation) {
      place.fail("node {} ('{}') is sheared or flat, so the joint has no frame there", end, nodes[end].name);
    }
    if (attached.in_node.sheared) {
      place.warn(
          "node {} ('{}') is turned inside an unequal scale; the joint's frame is turned without the "
          "scale",
          end, nodes[end].name);
    }
    body = attached.body;
    return in_body(draft.scene.bodies[body], attached.in_node.rigid());
  };
  joint.frame_a = frame(node, joint.body_a);
  joint.frame_b = frame(connected, joint.body_b);
  if (joint.body_a == world_body && joint.body_b == world_body) {
    place.fail("joins two nodes of which neither belongs to a body: give one of them a 'motion'");
  }
  if (joint.body_a == joint.body_b) {
    place.fail("joins the body '{}' to itself", draft.scene.bodies[joint.body_a].name);
  }
  if (joint.body_a == world_body) joint.silent_colliders = static_colliders_of(draft, node);
  if (joint.body_b == world_body) joint.silent_colliders = static_colliders_of(draft, connected);
  warn_of_open(joint, draft.scene.bodies, place);
  draft.scene.joints.push_back(std::move(joint));
}

}  // namespace

void add_bodies(SceneDraft& draft) {
  const std::vector<GltfNode>& nodes = draft.document.nodes;
  draft.scene.bodies.emplace_back().name = "world";
  draft.node_of_body.push_back(-1);
  draft.attachments.resize(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!draft.physics[i].motion) continue;
    if (nodes[i].world.sheared) {
      draft.node_json(i).fail(
          "carries a body, but is sheared or flat: a turned node stands in an unequal scale; apply the "
          "scale");
    }
    draft.attachments[i].body = static_cast<int>(draft.scene.bodies.size());
    draft.scene.bodies.emplace_back().name = nodes[i].name;
    draft.node_of_body.push_back(static_cast<int>(i));
  }
  for (const int index : draft.document.parents_first) {
    const GltfNode& node = nodes[index];
    NodeAttachment& own = draft.attachments[index];
    const NodeAttachment* const parent = node.parent < 0 ? nullptr : &draft.attachments[node.parent];
    if (draft.physics[index].motion) {
      own.in_node = scaling(node.world.scale);
    } else if (parent && parent->body != world_body) {
      own = {parent->body, compose(parent->in_node, node.local)};
    } else {
      own.in_node = node.world;
    }
  }
}

void place_bodies(SceneDraft& draft) {
  const int count = static_cast<int>(draft.scene.bodies.size());
  for (int i = 1; i < count; ++i) place_body(draft, i);
  for (int i = 1; i < count; ++i) {
    if (!is_valid(draft.scene.bodies[i])) {
      draft.extension(draft.node_of_body[i], "motion").fail("{}", out_of_range);
    }
  }
}

void add_joints(SceneDraft& draft) {
  for (std::size_t i = 0; i < draft.physics.size(); ++i) {
    if (draft.physics[i].has_joint) add_joint(draft, static_cast<int>(i));
  }
}

void warn_of_floating_bodies(const SceneDraft& draft) {
  for (int i = 1; i < static_cast<int>(draft.scene.bodies.size()); ++i) {
    const Body& body = draft.scene.bodies[i];
    const MotionProperties& motion = *draft.physics[draft.node_of_body[i]].motion;
    const bool is_infinite = !motion.kinematic && motion.mass && *motion.mass == 0;
    if (!is_infinite || !body.linear_velocity.isZero(0) || !body.angular_velocity.isZero(0)) continue;
    const auto holds = [&](const Joint& joint) { return joint.body_a == i || joint.body_b == i; };
    if (std::ranges::any_of(draft.scene.joints, holds)) continue;
    draft.extension(draft.node_of_body[i], "motion")
        .require("mass")
        .warn(
            "0 is infinite, so the body floats: leave 'mass' out for that of its colliders, or 'motion' "
            "for what stands still");
  }
}

}  // namespace substep
