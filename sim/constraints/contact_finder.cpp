#include "sim/constraints/contact_finder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/geometry/touching_ellipsoid.h"

namespace substep {
namespace {

double combine(Combine how, double a, double b) {
  switch (how) {
    case Combine::average:
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

bool meets(const Collider& one, const Collider& other) {
  return other.in_no_system || (other.member & one.collides_with) != 0;
}

struct Reach {
  double operator()(const Sphere& s) const { return s.radius; }
  double operator()(const Capsule& c) const { return c.half_length + c.radius; }
  double operator()(const Plane&) const { return 0; }
  double operator()(const Polytope& p) const { return p.centre.norm() + p.bounding_radius; }
  double operator()(const Cylinder& c) const {
    const double radius = std::max(c.radius_bottom, c.radius_top);
    return std::sqrt(c.half_height * c.half_height + radius * radius);
  }
  double operator()(const TaperedCapsule& c) const {
    return c.half_length + std::max(c.radius_bottom, c.radius_top);
  }
  double operator()(const TriangleMesh& m) const {
    const Bounds& b = m.nodes[0].bounds;
    return b.lower.cwiseAbs().cwiseMax(b.upper.cwiseAbs()).norm();
  }
};

/// A unit vector across `normal`, by the world axis that it is farthest from.
Vector3 across(const Vector3& normal) {
  Eigen::Index least = 0;
  normal.cwiseAbs().minCoeff(&least);
  return normal.cross(Vector3::Unit(least)).normalized();
}

/// A unit vector along what `velocity` has across `normal`; where that is no more than `rounding`, which has
/// no direction worth following, across().
Vector3 along_slip(const Vector3& normal, const Vector3& velocity, double rounding) {
  const Vector3 slip = velocity - normal * normal.dot(velocity);
  return slip.norm() > rounding ? Vector3(slip.normalized()) : across(normal);
}

/// A face's points have one normal, which says what the tangents are.
void share_directions(const Contact& from, Contact& to) {
  to.normal_b = from.normal_b;
  to.tangent_b1 = from.tangent_b1;
  to.tangent_b2 = from.tangent_b2;
}

/// Of the smaller shape: a point that has moved by less on both bodies, and slips by less in a step, is the
/// same. A fast rolling body's is not: what it rolls over in a step would count as displacement, by up to a
/// sixth of its angle squared.
constexpr double same_place = 0.02;

/// Of the bodies' speeds: what approaches more slowly has met already.
constexpr double touching = 0.01;

/// What the two materials make of a coefficient each.
struct PairMaterial {
  PairMaterial(const ContactMaterial& one, const ContactMaterial& other)
      : dynamic_friction(combine(std::min(one.friction_combine, other.friction_combine), one.dynamic_friction,
                                 other.dynamic_friction)),
        static_friction(combine(std::min(one.friction_combine, other.friction_combine), one.static_friction,
                                other.static_friction)),
        restitution(combine(std::min(one.restitution_combine, other.restitution_combine), one.restitution,
                            other.restitution)) {}
  double dynamic_friction;
  double static_friction;
  double restitution;
};

}  // namespace

ContactFinder::ContactFinder(const Scene& scene, const Model& model) : model_(model) {
  if (!model.contacts) return;
  for (const Collider& collider : scene.colliders) {
    const double size = std::visit(Reach{}, collider.shape);
    candidates_.push_back({
        &collider,
        collider.placement.position.norm() + size,
        size > 0 ? size : std::numeric_limits<double>::infinity(),
        is_curved(collider.shape),
    });
  }
  poses_.resize(candidates_.size());
  bounds_.resize(candidates_.size());
  margins_.resize(candidates_.size());
  // Room for a dense pile, so that steps after the first need no more.
  pairs_.reserve(16 * candidates_.size());
  points_.reserve(64);
  contacts_.reserve(16 * candidates_.size());
  begins_.reserve(candidates_.size() + 1);
}

bool ContactFinder::may_meet(std::uint32_t i, std::uint32_t j) const {
  const Collider& one = *candidates_[i].collider;
  const Collider& other = *candidates_[j].collider;
  if (one.body == other.body) return false;
  if (model_.masses[one.body].inverse_mass == 0 && model_.masses[other.body].inverse_mass == 0) return false;
  if (!meets(one, other) || !meets(other, one)) return false;
  const std::pair<int, int> bodies = std::minmax(one.body, other.body);
  return !std::ranges::binary_search(model_.jointed, bodies);
}

const std::vector<Contact>& ContactFinder::find(const State& state, double step, bool aligned) {
  contacts_.clear();
  list_remembered(state);
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    const Collider& collider = *candidates_[i].collider;
    const Coordinates& q = state.q[collider.body];
    const Velocity& v = state.v[collider.body];
    poses_[i] = Pose{q.linear, q.angular} * collider.placement;
    const double fall =
        model_.masses[collider.body].inverse_mass > 0
            ? step * std::abs(model_.masses[collider.body].gravity_factor) * model_.gravity.norm()
            : 0;
    margins_[i] = step * (v.linear.norm() + v.angular.norm() * candidates_[i].reach + fall);
    bounds_[i] = bounds(collider.shape, poses_[i]);
    bounds_[i].lower.array() -= margins_[i];
    bounds_[i].upper.array() += margins_[i];
  }
  broad_phase_.find_pairs(bounds_, pairs_);
  for (const auto& [i, j] : pairs_) {
    if (!may_meet(i, j)) continue;
    // The normal is fixed in b. The static one is b; else the one that comes first in the file.
    const bool swap = model_.masses[candidates_[j].collider->body].inverse_mass == 0;
    add_contacts(state, step, aligned, swap ? i : j, swap ? j : i);
  }
  return contacts_;
}

/// By gravity, m/s².
Vector3 ContactFinder::fall_of(int body) const {
  if (model_.masses[body].inverse_mass == 0) return Vector3::Zero();
  return model_.gravity * model_.masses[body].gravity_factor;
}

void ContactFinder::add_contacts(const State& state, double step, bool aligned, std::uint32_t a,
                                 std::uint32_t b) {
  const Collider& on_a = *candidates_[a].collider;
  const Collider& on_b = *candidates_[b].collider;
  points_.clear();
  find_contacts(on_a.shape, poses_[a], on_b.shape, poses_[b], margins_[a] + margins_[b], points_);
  if (points_.empty()) return;

  const Coordinates& qa = state.q[on_a.body];
  const Coordinates& qb = state.q[on_b.body];
  const Velocity& va = state.v[on_a.body];
  const Velocity& vb = state.v[on_b.body];
  const Quaternion to_a = qa.angular.conjugate();
  const Quaternion to_b = qb.angular.conjugate();
  const Vector3 acceleration = fall_of(on_a.body) - fall_of(on_b.body);
  const Vector3 external = acceleration * step;
  const PairMaterial material(on_a.material, on_b.material);
  // What gravity does in a step: slower than that is at rest. It has the scene's own scale.
  const double at_rest = external.norm();
  const double resting_acceleration = 2 * acceleration.norm();
  const double speed = va.linear.norm() + vb.linear.norm() + step * model_.gravity.norm();
  const std::span<const ContactMemory> remembered = remembered_of(state, a, b);
  const ContactPoint* before_this = nullptr;
  for (const ContactPoint& point : points_) {
    const Vector3 arm_a = point.on_a - qa.linear;
    const Vector3 arm_b = point.on_b - qb.linear;
    const Vector3 before = va.linear + va.angular.cross(arm_a) - vb.linear - vb.angular.cross(arm_b);
    const Vector3 slip_before = before - point.normal * point.normal.dot(before);
    const double slip_speed = slip_before.norm();
    Contact& contact = contacts_.emplace_back();
    contact.a = on_a.body;
    contact.b = on_b.body;
    contact.collider_a = static_cast<int>(a);
    contact.collider_b = static_cast<int>(b);
    contact.arm_a = to_a * arm_a;
    contact.arm_b = to_b * arm_b;
    if (!aligned && before_this && before_this->normal == point.normal) {
      share_directions(*std::prev(contacts_.end(), 2), contact);
    } else {
      const Vector3 along =
          aligned ? along_slip(point.normal, before + external, 1e-9 * speed) : across(point.normal);
      contact.normal_b = to_b * point.normal;
      contact.tangent_b1 = to_b * along;
      contact.tangent_b2 = to_b * point.normal.cross(along);
    }
    before_this = &point;
    contact.friction = slip_speed > at_rest ? material.dynamic_friction : material.static_friction;
    if (candidates_[a].curved || candidates_[b].curved) set_rolling(point, contact);
    contact.resting_acceleration = resting_acceleration;
    contact.acceleration = -point.normal.dot(acceleration);
    // What does not approach when the step begins is no impact, though others may press it together in the
    // step: the law of impact holds for all contacts of a step at once.
    const double approach = step * contact.acceleration - point.normal.dot(before);
    contact.restitution = approach > touching * speed ? material.restitution : 0;
    contact.left_over = std::max(0.0, -point.distance - recovery_speed * step);
    contact.slid = slip_speed > at_rest;
    remember(remembered, step, -point.distance, step * slip_speed, contact);
  }
}

/// Where the point goes, and the normal, as one or both of the colliders roll.
void ContactFinder::set_rolling(const ContactPoint& point, Contact& contact) const {
  const auto curves = [&](int collider, int other, const Vector3& on, const Vector3& normal, bool& rolls,
                          Vector3& centre, Matrix3& ellipsoid) {
    const Shape& shape = candidates_[collider].collider->shape;
    const Quaternion to_shape = poses_[collider].orientation.conjugate();
    const auto surface = touching_ellipsoid(shape, candidates_[other].collider->shape,
                                            to_shape * (on - poses_[collider].position), to_shape * normal);
    rolls = surface.has_value();
    if (surface) {
      const Pose& placement = candidates_[collider].collider->placement;
      const Matrix3 axes = placement.orientation.toRotationMatrix();
      centre = placement * surface->centre;
      ellipsoid = axes * surface->squares.asDiagonal() * axes.transpose();
    }
    return rolls || is_round(shape);
  };
  const bool a_is_curved = curves(contact.collider_a, contact.collider_b, point.on_a, point.normal,
                                  contact.rolls_a, contact.centre_a, contact.ellipsoid_a);
  const bool b_is_curved = curves(contact.collider_b, contact.collider_a, point.on_b, -point.normal,
                                  contact.rolls_b, contact.centre_b, contact.ellipsoid_b);
  contact.turns_with_a = b_is_curved && !a_is_curved;
  contact.turns_with_neither = b_is_curved && a_is_curved;
}

/// By the first collider of each, where it begins among those remembered, which are sorted.
void ContactFinder::list_remembered(const State& state) {
  begins_.assign(candidates_.size() + 1, 0);
  const auto count = static_cast<int>(candidates_.size());
  for (const ContactMemory& memory : state.contacts) {
    if (memory.collider_a >= 0 && memory.collider_a < count) ++begins_[memory.collider_a + 1];
  }
  for (std::size_t i = 1; i < begins_.size(); ++i) begins_[i] += begins_[i - 1];
}

std::span<const ContactMemory> ContactFinder::remembered_of(const State& state, std::uint32_t a,
                                                            std::uint32_t b) const {
  const auto first = state.contacts.begin();
  const int other = static_cast<int>(b);
  const auto begin = std::lower_bound(
      first + begins_[a], first + begins_[a + 1], other,
      [](const ContactMemory& memory, int collider) { return memory.collider_b < collider; });
  auto end = begin;
  while (end != first + begins_[a + 1] && end->collider_b == other) ++end;
  return {begin, end};
}

/// What is remembered of the nearest of these colliders' points, if it is the same.
void ContactFinder::remember(std::span<const ContactMemory> remembered, double step, double overlap,
                             double slip, Contact& contact) const {
  if (remembered.empty()) return;
  const double same =
      same_place * std::min(candidates_[contact.collider_a].size, candidates_[contact.collider_b].size);
  double nearest = same * same;
  double left_over = 0;
  for (const ContactMemory& memory : remembered) {
    left_over = std::max(left_over, memory.left_over);
    const double squared = std::max({(memory.arm_a - contact.arm_a).squaredNorm(),
                                     (memory.arm_b - contact.arm_b).squaredNorm(), slip * slip});
    if (!(squared < nearest)) continue;
    nearest = squared;
    contact.displacement_1 = contact.tangent_b1.dot(memory.displacement);
    contact.displacement_2 = contact.tangent_b2.dot(memory.displacement);
    contact.slid = memory.slides;
  }
  contact.left_over = std::clamp(overlap, 0.0, std::max(0.0, left_over - recovery_speed * step));
}

}  // namespace substep
