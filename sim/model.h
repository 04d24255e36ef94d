#pragma once
/// What the solver builds of a scene: only what the scene needs.

#include <string>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/vector.h"

namespace substep {

struct BodyMass {
  double inverse_mass;      ///< 1/kg
  Vector3 inverse_inertia;  ///< principal, 1/(kg m²)
  double gravity_factor;
};

/// Two points, one of each body, that coincide: three position-level rows. Anchors in the body frames.
struct PointJoint {
  int a;
  int b;
  Vector3 anchor_a;
  Vector3 anchor_b;
};

/// An axis of a that stays perpendicular to two axes of b, so parallel to b's third: two position-level rows.
/// With a PointJoint this is a hinge. Body frames.
struct AxisJoint {
  int a;
  int b;
  Vector3 axis_a;
  Vector3 across_b1;
  Vector3 across_b2;
};

/// A motor: torque = damping · (velocity_target − ω), within ±max_torque, ω the angular velocity of a
/// relative to b about an axis fixed in b. One velocity-level row.
struct VelocityDrive {
  int a;
  int b;
  Vector3 axis_b;
  double velocity_target;  ///< rad/s
  double damping;          ///< N·m·s, or 1/s per unit of the row's effective inertia
  bool per_inertia;        ///< mode 'acceleration': damping and max_torque are per unit of effective inertia
  double max_torque;       ///< N·m, or rad/s²
};

/// A contact point as s1 leaves it, fixed for the whole step. The normal and the tangents are fixed in b,
/// which is the static body where there is one. Body frames.
struct Contact {
  int a;
  int b;
  Vector3 arm_a;
  Vector3 arm_b;
  Vector3 normal_b;  ///< from b to a
  Vector3 tangent_b1;
  Vector3 tangent_b2;
  double friction;
};

/// Where two colliders may meet.
struct Model {
  Vector3 gravity;
  std::vector<BodyMass> masses;  ///< one per body, the world first
  std::vector<int> gyroscopic;   ///< bodies whose moments differ
  std::vector<Vector3> inertia;  ///< principal moments of all bodies (0 where infinite)
  std::vector<PointJoint> points;
  std::vector<AxisJoint> axes;
  std::vector<VelocityDrive> drives;
  std::vector<std::pair<int, int>> jointed;  ///< body pairs that do not collide, sorted
  bool contacts = false;                     ///< whether any two colliders can meet
  bool friction = false;
};

/// Throws Error naming the joint or body that asks for what is not modelled.
Model build_model(const Scene& scene);

/// "2 ball joints, 1 hinge, 1 velocity drive; contacts with friction; no gyroscopic term"
std::string description(const Model& model);

}  // namespace substep
