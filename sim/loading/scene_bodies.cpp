#include "sim/loading/scene_bodies.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <variant>
#include <vector>

#include "sim/loading/body_inertia.h"

namespace substep {
namespace {

constexpr const char* out_of_range = "its mass, size or velocity is too large or too small to compute with";

// Moment of inertia of a ball of the default density. The cube root is Newton's: libm's differs between
// machines.
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

double inverse_or_infinite(double value) {
  return value == 0 ? 0 : 1 / value;
}

// All colliders of the body as one solid, in its node's frame. Where they overlap, the overlap counts
// twice.
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

// Sets the body's masses, frame and velocities, and moves its colliders into that frame.
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
  if (!std::isfinite(shapes.mass) || (has_volume && !(shapes.mass > 0))) place.fail(out_of_range);

  Pose node_from_body;
  node_from_body.position = shapes.centre_of_mass;
  if (motion.centre_of_mass) node_from_body.position = world.scale.cwiseProduct(*motion.centre_of_mass);

  double mass = motion.mass.value_or(shapes.mass * default_density);
  if (!motion.kinematic && !motion.mass && shapes.mass == 0) {
    mass = 1;
    draft.scene.warnings.push_back(place.path() +
                                   ": has neither 'mass' nor a collider to take it from: it gets 1 kg");
  }
  if (!motion.kinematic) body.inverse_mass = inverse_or_infinite(mass);

  if (motion.inertia_diagonal) {
    node_from_body.orientation = motion.inertia_orientation;
    if (!motion.kinematic) body.inverse_inertia = motion.inertia_diagonal->unaryExpr(&inverse_or_infinite);
  } else if (shapes.mass > 0) {
    // About the shapes' own centre, also where the file places the centre of mass elsewhere: how the mass
    // is then spread is not known.
    const PrincipalInertia principal = symmetric_principal_inertia(with_mass(shapes, mass).inertia);
    node_from_body.orientation = principal.orientation;
    if (body.inverse_mass > 0) body.inverse_inertia = principal.moments.cwiseInverse();
  } else if (body.inverse_mass > 0) {
    body.inverse_inertia.setConstant(1 / inertia_of_ball(mass));
    draft.scene.warnings.push_back(
        place.path() +
        ": has neither 'inertiaDiagonal' nor a collider to take it from: it gets that of a ball of water");
  }

  body.gravity_factor = motion.gravity_factor;
  body.body_from_node = node_from_body.inverse();
  body.pose = world.rigid() * node_from_body;
  body.pose.orientation.normalize();
  // A mirroring node turns its directions round; an axis of rotation is turned round twice.
  body.linear_velocity = world.rotation * motion.linear_velocity;
  if (world.mirrors()) body.linear_velocity = -body.linear_velocity;
  body.angular_velocity = world.rotation * motion.angular_velocity;

  for (const int collider : draft.colliders_of[index]) {
    Pose& placement = draft.scene.colliders[collider].placement;
    placement = in_body(body, placement);
  }
}

// Numbers that are fine one by one can overflow together.
void check_bodies(const SceneDraft& draft) {
  const auto finite = [](const Pose& pose) {
    return pose.position.allFinite() && pose.orientation.coeffs().allFinite();
  };
  for (std::size_t i = 1; i < draft.scene.bodies.size(); ++i) {
    const Body& body = draft.scene.bodies[i];
    if (!std::isfinite(body.inverse_mass) || !body.inverse_inertia.allFinite() ||
        !(body.inverse_inertia.minCoeff() >= 0) || !finite(body.pose) || !finite(body.body_from_node) ||
        !body.linear_velocity.allFinite() || !body.angular_velocity.allFinite()) {
      draft.extension(draft.node_of_body[i], "motion").fail(out_of_range);
    }
  }
}

}  // namespace

void warn_of_floating_bodies(SceneDraft& draft) {
  for (std::size_t i = 1; i < draft.scene.bodies.size(); ++i) {
    const Body& body = draft.scene.bodies[i];
    const MotionProperties& motion = *draft.physics[draft.node_of_body[i]].motion;
    const bool is_infinite = !motion.kinematic && motion.mass && *motion.mass == 0;
    if (!is_infinite || !body.linear_velocity.isZero(0) || !body.angular_velocity.isZero(0)) continue;
    const auto holds = [&](const Joint& joint) {
      return joint.body_a == static_cast<int>(i) || joint.body_b == static_cast<int>(i);
    };
    if (std::ranges::any_of(draft.scene.joints, holds)) continue;
    draft.scene.warnings.push_back(draft.extension(draft.node_of_body[i], "motion").path() +
                                   "/mass: 0 is infinite, so the body floats: leave 'mass' out for that of "
                                   "its colliders, or 'motion' for "
                                   "what stands still");
  }
}

void add_bodies(SceneDraft& draft) {
  draft.scene.bodies.emplace_back().name = "world";
  draft.node_of_body.push_back(-1);
  draft.body_of_node.assign(draft.physics.size(), world_body);
  for (std::size_t i = 0; i < draft.physics.size(); ++i) {
    if (!draft.physics[i].motion) continue;
    const GltfNode& node = draft.document.nodes[i];
    const int index = static_cast<int>(i);
    if (node.world.sheared) {
      draft.document.node_json(index).fail(
          "carries a body, but is sheared or flat: a turned node stands in an unequal scale; apply the "
          "scale");
    }
    draft.body_of_node[i] = static_cast<int>(draft.scene.bodies.size());
    draft.scene.bodies.emplace_back().name = node.name;
    draft.node_of_body.push_back(index);
  }
}

void find_attachments(SceneDraft& draft) {
  draft.attachments.resize(draft.document.nodes.size());
  std::vector<int> pending;
  for (std::size_t i = 0; i < draft.document.nodes.size(); ++i) {
    if (draft.document.nodes[i].parent < 0) pending.push_back(static_cast<int>(i));
  }
  while (!pending.empty()) {
    const int index = pending.back();
    pending.pop_back();
    const GltfNode& node = draft.document.nodes[index];
    NodeAttachment& own = draft.attachments[index];
    if (draft.physics[index].motion) {
      own.body = draft.body_of_node[index];
      own.in_node = make_transform(Vector3::Zero(), Quaternion::Identity(), node.world.scale);
    } else if (node.parent >= 0 && draft.attachments[node.parent].body != world_body) {
      own.body = draft.attachments[node.parent].body;
      own.in_node = compose(draft.attachments[node.parent].in_node, node.local);
    } else {
      own.in_node = node.world;
    }
    pending.insert(pending.end(), node.children.begin(), node.children.end());
  }
}

void place_bodies(SceneDraft& draft) {
  for (std::size_t body = 1; body < draft.scene.bodies.size(); ++body)
    place_body(draft, static_cast<int>(body));
  check_bodies(draft);
}

Pose in_body(const Body& body, const Pose& in_node) {
  Pose pose = body.body_from_node * in_node;
  pose.orientation.normalize();
  return pose;
}

}  // namespace substep
