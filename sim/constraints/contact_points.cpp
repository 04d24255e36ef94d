// The contacts of two colliders: directions, friction, impacts, and the cached data of each point.

#include <algorithm>

#include "sim/constraints/contact_finder.h"
#include "sim/geometry/round_shapes.h"

namespace substep {
namespace {

/// Returns the unit vector along the component of `velocity` perpendicular to `normal`, or perpendicular()
/// where that component is at most `rounding`.
Vector3 along_slip(const Vector3& normal, const Vector3& velocity, double rounding) {
  const Vector3 slip = velocity - normal * normal.dot(velocity);
  return slip.norm() > rounding ? Vector3(slip.normalized()) : perpendicular(normal);
}

/// Combines a coefficient of two materials.
double combine(Combine how, double a, double b) {
  switch (how) {
    case Combine::average:
    case Combine::unstated:
      return 0.5 * (a + b);
    case Combine::minimum:
      return std::min(a, b);
    case Combine::maximum:
      return std::max(a, b);
    case Combine::multiply:
      break;
  }
  return a * b;
}

/// Approach speed below which bodies rest on each other, as a fraction of `Pair::speed`.
constexpr double resting_fraction = 0.01;

/// Slip in a step above which bodies slide past each other, as a fraction of the smaller shape.
constexpr double passing_fraction = 0.02;

}  // namespace

PairMaterial::PairMaterial(const ContactMaterial& one, const ContactMaterial& other) {
  const Combine of_friction = std::min(one.friction_combine, other.friction_combine);
  dynamic_friction = combine(of_friction, one.dynamic_friction, other.dynamic_friction);
  static_friction = combine(of_friction, one.static_friction, other.static_friction);
  restitution = combine(std::min(one.restitution_combine, other.restitution_combine), one.restitution,
                        other.restitution);
}

/// Two colliders in contact.
struct ContactFinder::Pair {
  std::uint32_t a;
  std::uint32_t b;
  const Velocity& va;
  const Velocity& vb;
  Pose body_a;  ///< pose of a's body when the colliders touch
  Pose body_b;
  // Orientations at the start of the step.
  const Quaternion& start_a;
  const Quaternion& start_b;
  // Rotations from the world to the bodies' frames when the rows that solve the meeting are formulated: in
  // the world, arms and normals have the directions that they have when the bodies meet.
  Quaternion to_a;
  Quaternion to_b;
  int formulated = 0;  ///< sub-step that formulates those rows, from 0
  PairMaterial material;
  Vector3 acceleration;                       ///< by gravity, of a relative to b, m/s²
  double fall;                                ///< speed that gravity gives a relative to b in a step, m/s
  double speed;                               ///< of a relative to b, plus what gravity adds in a step, m/s
  double size;                                ///< of the smaller shape, m
  double time;                                ///< until the colliders meet, s
  Vector3 path = Vector3::Zero();             ///< of a relative to b until they meet, m
  std::span<const ContactMemory> remembered;  ///< the pair's points in the contact cache
  const PatchShape* patch;                    ///< the pair's patch of the step before, or null
  Vector3 patch_slip = Vector3::Zero();       ///< slip of `patch` along its tangents, m; twist, rad

  /// Returns a direction in b's frame, turned as the contact's normal turns until the rows are formulated.
  Vector3 in_b(const Contact& contact, const Vector3& direction) const {
    if (formulated > 0 && contact.turns_with_a) return start_b.conjugate() * (start_a * (to_a * direction));
    return contact.turns_with_neither ? start_b.conjugate() * direction : to_b * direction;
  }
  /// Returns the velocity of a point of a relative to the point of b that it touches, m/s, world.
  Vector3 velocity_at(const Vector3& arm_a, const Vector3& arm_b) const {
    return va.linear + va.angular.cross(arm_a) - vb.linear - vb.angular.cross(arm_b);
  }
};

/// Returns two colliders `time` s after the state, moved under gravity alone.
ContactFinder::Pair ContactFinder::pair_of(std::uint32_t a, std::uint32_t b, double time) const {
  const Collider& on_a = *candidates_[a].collider;
  const Collider& on_b = *candidates_[b].collider;
  const Coordinates& qa = state_->q[on_a.body];
  const Coordinates& qb = state_->q[on_b.body];
  const Velocity& va = state_->v[on_a.body];
  const Velocity& vb = state_->v[on_b.body];
  const Vector3 acceleration = fall_of(on_a.body) - fall_of(on_b.body);
  Pair pair{.a = a,
            .b = b,
            .va = va,
            .vb = vb,
            .body_a = {qa.linear, qa.angular},
            .body_b = {qb.linear, qb.angular},
            .start_a = qa.angular,
            .start_b = qb.angular,
            .to_a = qa.angular.conjugate(),
            .to_b = qb.angular.conjugate(),
            .material = {on_a.material, on_b.material},
            .acceleration = acceleration,
            .fall = (acceleration * duration_).norm(),
            .speed = (va.linear - vb.linear).norm() + duration_ * model_.gravity.norm(),
            .size = smaller_size(a, b),
            .time = time,
            .remembered = remembered_of(a, b),
            .patch = aligned_ ? nullptr : patch_of(a, b)};
  if (time > 0) {
    pair.path = motions_[on_a.body].displacement(time) - motions_[on_b.body].displacement(time);
    pair.body_a = motions_[on_a.body].at(time);
    pair.body_b = motions_[on_b.body].at(time);
    if (reformulates_ && time > substep_) {
      pair.formulated = static_cast<int>(std::ceil(time / substep_)) - 1;
      const double from = pair.formulated * substep_;
      pair.to_a = motions_[on_a.body].at(from).orientation.conjugate();
      pair.to_b = motions_[on_b.body].at(from).orientation.conjugate();
    }
  }
  if (pair.patch) {
    pair.patch_slip = slip_of(*pair.patch, pair.to_b * (qa.linear - qb.linear),
                              (pair.to_b * qa.angular).toRotationMatrix());
  }
  return pair;
}

/// Adds the contacts of `points_`, at which two colliders touch after `time` s.
void ContactFinder::add_contacts(std::uint32_t a, std::uint32_t b, double time) {
  if (points_.empty()) return;
  const Pair pair = pair_of(a, b, time);
  groups_.push_back({.begin = contacts_.size(),
                     .end = contacts_.size() + points_.size(),
                     .normal = points_[0].normal,
                     .colliders = {static_cast<int>(a), static_cast<int>(b)},
                     .points = static_cast<int>(points_.size()),
                     .arm_a = pair.to_a * (points_[0].on_a - pair.body_a.position),
                     .arm_b = pair.to_b * (points_[0].on_b - pair.body_b.position)});
  const Pose pose_a = pair.body_a * candidates_[a].collider->placement;
  const Pose pose_b = pair.body_b * candidates_[b].collider->placement;
  approach_ = 0;
  separates_ = pair.material.restitution > 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const ContactPoint& point = points_[i];
    const Vector3 arm_a = point.on_a - pair.body_a.position;
    const Vector3 arm_b = point.on_b - pair.body_b.position;
    const Vector3 velocity = pair.velocity_at(arm_a, arm_b);
    const double slip_speed = (velocity - point.normal * point.normal.dot(velocity)).norm();
    Contact& contact = contacts_.emplace_back();
    contact.a = body_of(a);
    contact.b = body_of(b);
    contact.collider_a = static_cast<int>(a);
    contact.collider_b = static_cast<int>(b);
    contact.meets_in = pair.formulated;
    contact.arm_a = pair.to_a * arm_a;
    contact.arm_b = pair.to_b * arm_b;
    if (candidates_[a].curved || candidates_[b].curved) {
      set_rolling(point, pose_a, pose_b, contact);
    } else if (reformulates_ && std::holds_alternative<Polytope>(candidates_[b].collider->shape)) {
      // Let the normal turn with a where a's face meets an edge or corner of b.
      contact.turns_with_a = face_towards(a, pose_a.orientation, -point.normal, same_direction) &&
                             !face_towards(b, pose_b.orientation, point.normal, cosine_of_tilt);
    }
    if (!aligned_ && i > 0 && points_[i - 1].normal == point.normal) {
      const Contact& before = *std::prev(contacts_.end(), 2);
      contact.normal_b = before.normal_b;
      contact.tangent_b1 = before.tangent_b1;
      contact.tangent_b2 = before.tangent_b2;
    } else {
      const Vector3 along = aligned_ ? along_slip(point.normal, velocity + pair.acceleration * duration_,
                                                  1e-9 * (pair.speed + pair.vb.linear.norm()))
                                     : perpendicular(point.normal);
      contact.normal_b = pair.in_b(contact, point.normal);
      contact.tangent_b1 = pair.in_b(contact, along);
      contact.tangent_b2 = pair.in_b(contact, point.normal.cross(along));
    }
    contact.margin = margin_of(a, b) + (pair.patch ? spare_margin * pair.size : 0);
    contact.slid = slip_speed > pair.fall;
    contact.friction = contact.slid ? pair.material.dynamic_friction : pair.material.static_friction;
    set_impact(pair, point, velocity, slip_speed, contact);
    if (time > 0) {
      set_meeting(pair, point, contact);
    } else {
      recall(pair, point, slip_speed, contact);
    }
  }
}

/// Sets a point's restitution, or that it has no impact, and updates `approach_` and `separates_` of the
/// pair. `velocity`: of the point on a relative to b, m/s.
void ContactFinder::set_impact(const Pair& pair, const ContactPoint& point, const Vector3& velocity,
                               double slip_speed, Contact& contact) {
  const double restitution = pair.material.restitution;
  // Exceed two sub-steps' fall from rest by more than rounding, which would decide whether it bounces.
  // Without gravity, rounding alone would let pressed bodies bounce.
  contact.resting_acceleration =
      (2 + 1e-9) * pair.acceleration.norm() + 1e-9 * pair.size * part_ / (duration_ * substep_);
  contact.acceleration = -point.normal.dot(pair.acceleration);
  // Give no impact to bodies that do not approach at the start of the step, though others may press them
  // together: the law of impact holds for all contacts of a step at once.
  const double approach = duration_ * contact.acceleration - point.normal.dot(velocity);
  // In a step of one sub-step, stop at once only bodies that slide past each other: stopping leaves a gap.
  const bool passes_by = substep_ < duration_ || duration_ * slip_speed > passing_fraction * pair.size;
  const bool is_met =
      point.distance <= touching * pair.size && point.distance >= -tolerated_overlap * pair.size;
  const bool is_hard = is_met && passes_by && duration_ * (approach - pair.fall) > hard * pair.size;
  const bool is_impact = approach > resting_fraction * pair.speed && (restitution > 0 || is_hard);
  contact.restitution = is_impact ? restitution : Contact::no_impact;
  contact.closes = substep_ < duration_ && substep_ * slip_speed <= passing_fraction * pair.size;
  // Count a bounce's path in the whole step: a short part must not mix a bounce and a contact that opens.
  const double path = duration_ * approach / (restitution > 0 ? part_ : 1);
  separates_ = separates_ && path < -tolerated_overlap * pair.size;
  if (is_impact && path > (restitution > 0 ? tolerated_overlap : aside) * pair.size) {
    approach_ = std::max(approach_, approach - duration_ * contact.resting_acceleration);
  }
}

/// Sets the gap and the displacements that two points which meet later have at the start, from their path
/// until then and the turning of their arms.
void ContactFinder::set_meeting(const Pair& pair, const ContactPoint& point, Contact& contact) const {
  const Vector3 arm_a = point.on_a - pair.body_a.position;
  const Vector3 arm_b = point.on_b - pair.body_b.position;
  const Vector3 turning = (pair.time - pair.formulated * substep_) *
                          (pair.va.angular.cross(arm_a) - pair.vb.angular.cross(arm_b));
  contact.gap_offset = -point.normal.dot(turning);
  Vector3 apart = point.on_a - point.on_b - pair.path;
  if (pair.formulated > 0)
    apart += pair.start_a * contact.arm_a - arm_a - (pair.start_b * contact.arm_b - arm_b);
  contact.displacement_1 = -(pair.start_b * contact.tangent_b1).dot(apart);
  contact.displacement_2 = -(pair.start_b * contact.tangent_b2).dot(apart);
}

/// Restores a touching point's cached data, and sets the overlap that later steps recover.
void ContactFinder::recall(const Pair& pair, const ContactPoint& point, double slip_speed,
                           Contact& contact) const {
  const double slip = duration_ * slip_speed;
  contact.left_over = std::max(0.0, -point.distance - recovered(contact));
  if (!pair.patch) {
    recall_point(pair.remembered, -point.distance, slip, contact);
  } else if (slip < same_place * pair.size) {
    recall_patch(*pair.patch, pair.patch_slip, -point.distance, contact);
  }
  // Recover an overlap in a part of a step at the speed of the whole step.
  contact.gap_offset = (1 - part_) * std::max(0.0, -point.distance - contact.left_over);
}

/// Returns the overlap that a step recovers, m: at most what gravity undoes in the next step, so that the
/// bodies do not separate. Without gravity, a tenth of the smaller shape's size per second.
double ContactFinder::recovered(const Contact& contact) const {
  const double gravity = model_.gravity.norm();
  const double speed =
      gravity > 0 ? duration_ * gravity : 0.1 * smaller_size(contact.collider_a, contact.collider_b);
  return duration_ * speed;
}

/// Sets how the point and the normal move where one or both of the colliders are curved.
void ContactFinder::set_rolling(const ContactPoint& point, const Pose& pose_a, const Pose& pose_b,
                                Contact& contact) const {
  const auto curves = [&](int collider, const Pose& pose, int other, const Vector3& on, const Vector3& normal,
                          bool& rolls, Vector3& centre, Matrix3& ellipsoid) {
    const Shape& shape = candidates_[collider].collider->shape;
    const Quaternion to_shape = pose.orientation.conjugate();
    const auto surface = touching_ellipsoid(shape, candidates_[other].collider->shape,
                                            to_shape * (on - pose.position), to_shape * normal);
    rolls = surface.has_value();
    if (surface) {
      const Pose& placement = candidates_[collider].collider->placement;
      const Matrix3 axes = placement.orientation.toRotationMatrix();
      centre = placement * surface->centre;
      ellipsoid = axes * surface->squares.asDiagonal() * axes.transpose();
    }
    return rolls || is_round(shape);
  };
  const bool a_is_curved = curves(contact.collider_a, pose_a, contact.collider_b, point.on_a, point.normal,
                                  contact.rolls_a, contact.centre_a, contact.ellipsoid_a);
  const bool b_is_curved = curves(contact.collider_b, pose_b, contact.collider_a, point.on_b, -point.normal,
                                  contact.rolls_b, contact.centre_b, contact.ellipsoid_b);
  contact.turns_with_a = b_is_curved && !a_is_curved;
  contact.turns_with_neither = b_is_curved && a_is_curved;
}

/// Restores force and displacement of the pair's nearest cached point, if that is the same point.
void ContactFinder::recall_point(std::span<const ContactMemory> remembered, double overlap, double slip,
                                 Contact& contact) const {
  if (remembered.empty()) return;
  const double same =
      same_place * std::min(candidates_[contact.collider_a].size, candidates_[contact.collider_b].size);
  double nearest = same * same;
  double nearest_force = remembered.size() > 1 ? same * same : infinity;
  double left_over = 0;
  for (const ContactMemory& memory : remembered) {
    left_over = std::max(left_over, memory.left_over);
    // Keep the force on a point of one body wherever the point slides on the other.
    const double beside =
        std::min((memory.arm_a - contact.arm_a).squaredNorm(), (memory.arm_b - contact.arm_b).squaredNorm());
    if (beside < nearest_force) {
      nearest_force = beside;
      contact.force = {contact.normal_b.dot(memory.force), contact.tangent_b1.dot(memory.force),
                       contact.tangent_b2.dot(memory.force)};
      contact.stiffness = memory.stiffness;
    }
    const double squared = std::max({(memory.arm_a - contact.arm_a).squaredNorm(),
                                     (memory.arm_b - contact.arm_b).squaredNorm(), slip * slip});
    if (!(squared < nearest)) continue;
    nearest = squared;
    contact.displacement_1 = contact.tangent_b1.dot(memory.displacement);
    contact.displacement_2 = contact.tangent_b2.dot(memory.displacement);
    contact.slid = memory.slides;
  }
  contact.left_over = std::clamp(overlap, 0.0, std::max(0.0, left_over - recovered(contact)));
}

/// Restores force and displacement from the pair's patch. `slip`: of the patch since it was found.
void ContactFinder::recall_patch(const PatchShape& patch, const Vector3& slip, double overlap,
                                 Contact& contact) const {
  const Vector3 displacement = displacement_at(patch, slip, contact.arm_b);
  contact.displacement_1 = contact.tangent_b1.dot(displacement);
  contact.displacement_2 = contact.tangent_b2.dot(displacement);
  contact.slid = patch.slid;
  const Vector3 force =
      patch.axes_in_b * Vector3(patch.force[0], patch.force[3], patch.force[4]) / patch.corners;
  contact.force = {contact.normal_b.dot(force), contact.tangent_b1.dot(force), contact.tangent_b2.dot(force)};
  contact.left_over = std::clamp(overlap, 0.0, std::max(0.0, patch.left_over - recovered(contact)));
}

}  // namespace substep
