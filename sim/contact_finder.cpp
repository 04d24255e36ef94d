#include <algorithm>
#include <cmath>

#include "sim/formulate.h"

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

}  // namespace

ContactFinder::ContactFinder(const Scene& scene, const Model& model) : model_(model) {
  if (!model.contacts) return;
  for (const Collider& collider : scene.colliders) {
    candidates_.push_back(
        {&collider, collider.placement.position.norm() + std::visit(Reach{}, collider.shape)});
  }
  poses_.resize(candidates_.size());
  bounds_.resize(candidates_.size());
  margins_.resize(candidates_.size());
  // Room for a dense pile, so that steps after the first need no more.
  pairs_.reserve(16 * candidates_.size());
  points_.reserve(64);
  contacts_.reserve(16 * candidates_.size());
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

const std::vector<Contact>& ContactFinder::find(const State& state, double step) {
  contacts_.clear();
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
    const std::uint32_t first = swap ? i : j;
    const std::uint32_t second = swap ? j : i;
    const Collider& on_a = *candidates_[first].collider;
    const Collider& on_b = *candidates_[second].collider;
    points_.clear();
    find_contacts(on_a.shape, poses_[first], on_b.shape, poses_[second], margins_[i] + margins_[j], points_);
    if (points_.empty()) continue;

    const Coordinates& qa = state.q[on_a.body];
    const Coordinates& qb = state.q[on_b.body];
    const Velocity& va = state.v[on_a.body];
    const Velocity& vb = state.v[on_b.body];
    const Quaternion to_a = qa.angular.conjugate();
    const Quaternion to_b = qb.angular.conjugate();
    const auto fall = [&](int body) -> Vector3 {
      if (model_.masses[body].inverse_mass == 0) return Vector3::Zero();
      return model_.gravity * (model_.masses[body].gravity_factor * step);
    };
    const Vector3 external = fall(on_a.body) - fall(on_b.body);
    const Combine how = std::min(on_a.material.friction_combine, on_b.material.friction_combine);
    const double moving = combine(how, on_a.material.dynamic_friction, on_b.material.dynamic_friction);
    const double resting = combine(how, on_a.material.static_friction, on_b.material.static_friction);
    const double restitution =
        combine(std::min(on_a.material.restitution_combine, on_b.material.restitution_combine),
                on_a.material.restitution, on_b.material.restitution);
    // What the external forces do in a step: slower than that is at rest. It has the scene's own scale.
    const double at_rest = external.norm();
    const double speed = va.linear.norm() + vb.linear.norm() + external.norm();
    // Points come round the manifold's rim. They are taken crosswise, 0 2 1 3 of four: a sweep that went
    // round would leave a turn to the same side each time, and topple a stack.
    const std::size_t half = (points_.size() + 1) / 2;
    for (std::size_t k = 0; k < points_.size(); ++k) {
      const ContactPoint& point = points_[k % 2 == 0 ? k / 2 : half + k / 2];
      const Vector3 arm_a = point.on_a - qa.linear;
      const Vector3 arm_b = point.on_b - qb.linear;
      const Vector3 before = va.linear + va.angular.cross(arm_a) - vb.linear - vb.angular.cross(arm_b);
      const Vector3 relative = before + external;
      const Vector3 slip = relative - point.normal * point.normal.dot(relative);
      const double slip_speed = slip.norm();
      // Slip that is rounding beside the speeds has no direction worth following.
      const Vector3 along = slip_speed > 1e-9 * speed ? Vector3(slip / slip_speed) : across(point.normal);
      const double approach = -point.normal.dot(before);
      const double slipped = (before + approach * point.normal).norm();
      const double friction = slipped > at_rest ? moving : resting;
      // It bounces in the step in which it would touch, and if it comes faster than the forces alone can make
      // it.
      const bool touches = point.distance <= step * -point.normal.dot(relative);
      const double bounce = touches && approach > 2 * at_rest ? restitution * approach : 0;
      contacts_.push_back({on_a.body, on_b.body, to_a * arm_a, to_b * arm_b, to_b * point.normal,
                           to_b * along, to_b * point.normal.cross(along), friction, bounce});
    }
  }
  return contacts_;
}

}  // namespace substep
