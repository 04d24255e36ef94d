#pragma once
/// The solver's model of a scene, with only those parts that the scene needs.
///
/// Kinds of rows; two-sided ones can be 'stable' (Settings::joints):
/// - Lock: position-level, two-sided, in blocks; can be stable.
/// - Limit: position-level, one-sided; two-sided where both bounds are equal, and then stable if a distance.
/// - Limit, soft: an implicit spring, between position- and velocity-level; one row per axis where its bound
///   of several axes is 0.
/// - Drive: velocity-level without stiffness, with it like a soft limit; two-sided within ±max_force.
/// - Contact: position-level, one-sided; velocity-level in the sub-step in which it bounces.
/// - Friction: position-level while it holds, velocity-level where it slides; within μ × normal impulse.

#include <string>
#include <vector>

#include "sim/math/vector.h"
#include "sim/scene/scene.h"

namespace substep {

struct State;

struct BodyMass {
  double inverse_mass;      ///< 1/kg
  Vector3 inverse_inertia;  ///< principal, 1/(kg m²)
  double gravity_factor;
  double root_inverse_mass;      ///< of M^(−1/2)
  Vector3 root_inverse_inertia;  ///< of M^(−1/2)
};

/// Returns true where an impulse can move the body.
inline bool moves(const BodyMass& mass) {
  return mass.inverse_mass > 0 || mass.inverse_inertia.maxCoeff() > 0;
}

/// The two attachment frames of a joint. As in KHR_physics_rigid_bodies, a is the connected node's body and b
/// the joint node's. Coordinates are those of a's frame in b's, along whose axes limits and drives act.
struct Attachment {
  int a;         ///< the body of the connected node
  int b;         ///< the body of the joint's node
  Pose frame_a;  ///< attachment frame → body frame of a
  Pose frame_b;
};

/// Directions that a joint locks: one block of bilateral position-level rows.
struct Lock {
  enum class Kind {
    point,        ///< the frames' origins coincide: 3 rows
    line,         ///< the origin of a lies on an axis of b: 2 rows
    direction,    ///< an axis of a is parallel to that of b: 2 rows; with `point` a hinge
    orientation,  ///< the frames' axes are parallel: 3 rows
  };
  Kind kind;
  Attachment at;
  int axis = 0;  ///< line, direction: the axis that is left free
};

/// A coordinate of one frame relative to the other, on which a limit or a drive acts.
struct JointCoordinate {
  enum class Kind {
    position,  ///< of a's origin along an axis of b, m
    radius,    ///< of a's origin from an axis of b, m
    distance,  ///< between the origins, m
    twist,     ///< angle of a about an axis of b, rad
    cone,      ///< angle between an axis of a and that of b, rad
    turn,      ///< angle of the whole rotation from b to a, rad
    // Springs with rest length 0 have these, whose directions stay defined where a's frame passes through
    // b's.
    offset,           ///< of a's origin from b's along an axis of the world, m
    rotation_vector,  ///< component along an axis of b of the rotation vector from b to a, rad
    sway,             ///< across the plane in which `cone` opens: 0 rad, and its rate
  };
  Kind kind;
  int axis = 0;       ///< radius, cone, sway: the axis that is measured from; else along or about it
  double middle = 0;  ///< twist: the angle lies within ±π of it
};

/// A bound of a coordinate: a position-level row, one-sided, or two-sided where both bounds are the same.
/// With stiffness it is a spring that acts beyond the bound, taken implicitly.
struct Limit {
  Attachment at;
  JointCoordinate coordinate;
  enum class Side { low, high, both } side;
  double bound;
  bool soft;
  double stiffness;  ///< N/m or N·m/rad
  double damping;    ///< N·s/m or N·m·s/rad
};

/// A driven coordinate: force = stiffness (position_target − x) + damping (velocity_target − ẋ), within
/// ±max_force, taken implicitly. Without stiffness a velocity-level row (a motor).
struct Drive {
  Attachment at;
  JointCoordinate coordinate;
  double position_target;  ///< m or rad
  double velocity_target;  ///< m/s or rad/s
  double stiffness;        ///< N/m or N·m/rad
  double damping;          ///< N·s/m or N·m·s/rad
  double max_force;        ///< N or N·m
  bool per_mass;  ///< mode 'acceleration': stiffness, damping and max_force are per unit of effective mass
};

/// A contact point that the contact search finds for the whole step, in body frames; b is the static body
/// where there is one. The normal and the tangents are in b's frame at the step's start, or in A3, whose
/// normals turn, at the start of the sub-step in which the bodies meet.
struct Contact {
  int a;
  int b;
  int collider_a;  ///< indices of Scene::colliders
  int collider_b;
  Vector3 arm_a;
  Vector3 arm_b;
  Vector3 normal_b;  ///< from b to a
  Vector3 tangent_b1;
  Vector3 tangent_b2;
  int meets_in = 0;  ///< A3: the sub-step in which the bodies meet
  double margin;     ///< distance within which the manifold's points were found, m
  double friction;
  static constexpr double no_impact = -1;
  double restitution = no_impact;  ///< of an impact, or no_impact
  bool closes;  ///< an impact without restitution closes the gap in its sub-step, and is stopped in the next
  double resting_acceleration;  ///< m/s²: a contact slower than this times a (sub-)step does not bounce
  double acceleration;          ///< by gravity, of a towards b along the normal, m/s²
  double left_over;             ///< part of the overlap that later steps recover, m
  /// Added to the points' distance along the normal, m. Contact made later in the step: minus its change by
  /// rotation until then. Contact at the start: the overlap left to other parts of a divided step.
  double gap_offset;
  double displacement_1;  ///< along the tangents, since the contact was made or last slid, m
  double displacement_2;
  Vector3 force = Vector3::Zero();      ///< ContactMemory::force, along the normal and the tangents, N
  Vector3 stiffness = Vector3::Zero();  ///< ContactMemory::stiffness, N/m
  bool slid;                            ///< the contact slid already when the step began
  /// Rolling: A3 formulates again with it, and no patch has such contacts. A body's surface at the contact is
  /// an ellipsoid's (touching_ellipsoid.h): as the body rolls, the point is where the normal meets the
  /// ellipsoid, in place of `arm_a` or `arm_b`.
  bool rolls_a;
  bool rolls_b;
  /// The normal turns with b where b is flat or has an edge or corner; else so with a; else with neither.
  bool turns_with_a;
  bool turns_with_neither;
  Vector3 centre_a = Vector3::Zero();  ///< of the ellipsoid, body frame
  Vector3 centre_b = Vector3::Zero();
  /// Q diag(squares of the half axes) Qᵀ, body frame: r² 1 of a ball, r² (1 − u uᵀ) of a circle about u.
  Matrix3 ellipsoid_a = Matrix3::Zero();
  Matrix3 ellipsoid_b = Matrix3::Zero();
};

struct Model {
  Vector3 gravity;
  std::vector<BodyMass> masses;  ///< one per body, the world first
  std::vector<int> gyroscopic;   ///< bodies with finite moments that differ; none without Scene::gyroscopic
  std::vector<char> has_joints;  ///< by body
  std::vector<Vector3> inertia;  ///< principal moments of all bodies (0 where infinite)
  std::vector<Lock> locks;
  std::vector<Limit> limits;
  std::vector<Drive> drives;
  std::vector<std::pair<int, int>> jointed;  ///< body pairs that do not collide, without the world's, sorted
  /// Pairs that do not collide of one of the world's colliders and a body, sorted.
  std::vector<std::pair<int, int>> jointed_to_static;
  bool contacts = false;  ///< true where some colliders can meet
  bool friction = false;
  bool restitution = false;
};

/// Returns true where the joint keeps its frames' origins together: its three linear axes are locked.
bool holds_anchors_together(const Joint& joint);

/// Returns true where the body's numbers are finite, its orientations have unit length, and its mass and
/// moments are not negative.
bool is_valid(const Body& body);

/// Throws Error that names the body whose numbers are not finite or whose quaternion is not of length 1, or
/// says that the scene has another number of bodies.
void require_valid(const State& state, const Scene& scene);

/// Builds the model. Throws Error that names a body, collider or joint that cannot be modelled.
Model build_model(const Scene& scene);

/// Returns a summary: "2 locked points, 1 drive; contacts with friction; no gyroscopic term".
std::string description(const Model& model);

}  // namespace substep
