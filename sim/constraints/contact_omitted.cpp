// Contacts that are left out: those after an impact, those at the inner edges of flush faces, and those that
// a step turns out to miss.

#include <algorithm>
#include <cmath>

#include "sim/constraints/contact_finder.h"
#include "sim/geometry/time_of_impact.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

/// Depth below another face's plane at which a face is flush with it, relative to the smaller shape.
constexpr double flush = 1e-4;

/// Depth that touching shapes may gain in a part of a step, relative to the smaller.
constexpr double deep = 0.05;

}  // namespace

/// Leaves out the meetings of a body after an impact that turns it aside, which may never happen, and its
/// contacts with shapes that it leaves before such an impact. missed() finds those that happen.
void ContactFinder::keep_first_impacts() {
  first_impact_ = first_timed_impact_ = infinity;
  is_left_out_.assign(model_.masses.size(), false);
  if (meetings_.empty() || all_) return;
  earliest_.assign(model_.masses.size(), infinity);
  for (const Meeting& meeting : meetings_) {
    if (!meeting.turns_aside) continue;
    for (const std::uint32_t i : {meeting.a, meeting.b}) {
      const int body = body_of(i);
      if (model_.masses[body].inverse_mass > 0) earliest_[body] = std::min(earliest_[body], meeting.time);
    }
  }
  // Keep meetings that are simultaneous up to rounding.
  const double at_once = 1e-6 * duration_;
  for (const Meeting& meeting : meetings_) {
    const auto is_after = [&](std::uint32_t i) {
      const double earliest = earliest_[body_of(i)];
      return meeting.separates ? earliest < duration_ : meeting.time > earliest + at_once;
    };
    const bool is_late = is_after(meeting.a) || is_after(meeting.b);
    const bool is_ahead = meeting.time > 0 && !is_late;
    if (meeting.turns_aside && is_ahead) first_impact_ = std::min(first_impact_, meeting.time);
    const auto turns = [&](std::uint32_t i) {
      constexpr double small_angle = 0.02;
      return duration_ * motions_[body_of(i)].spin.norm() > small_angle;
    };
    const bool is_timed = meeting.is_impact ? turns(meeting.a) || turns(meeting.b) : substep_ == duration_;
    if (is_ahead && meeting.turns_aside && is_timed) {
      first_timed_impact_ = std::min(first_timed_impact_, meeting.time);
    }
    if (!is_late) continue;
    groups_[meeting.group].dropped = true;
    const std::pair<std::uint32_t, std::uint32_t> pair = std::minmax(meeting.a, meeting.b);
    // Keep a pair that touches elsewhere: its group comes before.
    const std::size_t g = meeting.group;
    if (g == 0 || groups_[g].colliders != groups_[g - 1].colliders) std::erase(touching_, pair);
    is_left_out_[body_of(meeting.a)] = is_left_out_[body_of(meeting.b)] = true;
  }
}

/// Leaves out the contacts of a collider with shapes that lie wholly below the plane of another of its
/// contacts: flush faces are one floor, whose inner edges stop nothing. Two kept patches were compared when
/// they were found.
void ContactFinder::drop_flush() {
  group_of_.assign(candidates_.size(), -1);
  bool any_shared = false;
  bool any_points = false;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    Group& group = groups_[g];
    if (group.dropped) continue;
    any_points = any_points || group.patch < 0;
    for (int k = 0; k < 2; ++k) {
      int& last = group_of_[group.colliders[k]];
      any_shared = any_shared || last >= 0;
      group.earlier[k] = last;
      last = static_cast<int>(g);
    }
  }
  if (!any_shared || !any_points) return;
  for (std::uint32_t collider = 0; collider < candidates_.size(); ++collider) {
    if (!moves(model_.masses[body_of(collider)])) continue;
    const auto next_of = [&](int g) {
      return groups_[g].earlier[groups_[g].colliders[0] == static_cast<int>(collider) ? 0 : 1];
    };
    for (int floor = group_of_[collider]; floor >= 0; floor = next_of(floor)) {
      if (groups_[floor].dropped) continue;
      for (int other = group_of_[collider]; other >= 0; other = next_of(other)) {
        if (other == floor || groups_[other].dropped) continue;
        if (groups_[floor].patch >= 0 && groups_[other].patch >= 0) continue;
        groups_[other].dropped = is_flush(static_cast<int>(collider), groups_[floor], groups_[other]);
      }
    }
  }
}

/// Removes the contacts of the pairs that were dropped.
void ContactFinder::remove_dropped() {
  std::size_t kept = 0;
  for (const Group& group : groups_) {
    for (std::size_t i = group.begin; i < group.end && !group.dropped; ++i, ++kept) {
      if (kept != i) contacts_[kept] = contacts_[i];
    }
  }
  contacts_.resize(kept);
  for (const Group& group : groups_) {
    if (group.dropped && group.patch >= 0) kept_[group.patch].collider_a = -1;
  }
  std::erase_if(kept_, [](const PatchShape& patch) { return patch.collider_a < 0; });
}

/// Returns the normal of a collider's face in a direction, to an angle with that cosine, or nothing.
std::optional<Vector3> ContactFinder::face_towards(std::uint32_t collider, const Quaternion& orientation,
                                                   const Vector3& direction, double cosine) const {
  const auto* polytope = std::get_if<Polytope>(&candidates_[collider].collider->shape);
  if (!polytope) return std::nullopt;
  const Vector3 local = orientation.conjugate() * direction;
  for (const Vector3& normal : polytope->face_normals) {
    if (normal.dot(local) > cosine) return orientation * normal;
  }
  return std::nullopt;
}

/// Returns whether the shape that a collider touches in the contacts of `other` is below the plane of
/// `floor`.
bool ContactFinder::is_flush(int collider, const Group& floor, const Group& other) const {
  const bool is_a = floor.colliders[0] == collider;
  const bool is_a_of_other = other.colliders[0] == collider;
  const int below = other.colliders[is_a_of_other ? 1 : 0];
  // Take the normal of the floor's own face, since a body on it may tilt a little.
  const int under = floor.colliders[is_a ? 1 : 0];
  const Vector3 floor_up = (is_a ? 1 : -1) * floor.normal;
  const Vector3 up =
      face_towards(under, poses_[under].orientation, floor_up, cosine_of_tilt).value_or(floor_up);
  const Vector3 other_up = (is_a_of_other ? 1 : -1) * other.normal;
  const double cosine = up.dot(other_up);
  if (cosine < -0.5) return false;
  // Keep a face that the body stands on; only edges and sides can be inside the floor.
  constexpr int corners_of_face = 3;
  const auto is_of_face = [&](int of, const Vector3& normal) {
    const Quaternion& turned = poses_[of].orientation;
    return face_towards(of, turned, normal, same_direction) ||
           face_towards(of, turned, -normal, same_direction);
  };
  if (cosine > cosine_of_tilt &&
      (other.points >= corners_of_face || is_of_face(below, other_up) || is_of_face(collider, other_up))) {
    return false;
  }
  const Shape& shape = candidates_[below].collider->shape;
  const double size = std::min(smaller_size(collider, below), smaller_size(collider, under));
  const auto point_on = [&](const Group& group, bool on_b) -> Vector3 {
    const Coordinates& q = state_->q[body_of(group.colliders[on_b ? 1 : 0])];
    return q.linear + q.angular * (on_b ? group.arm_b : group.arm_a);
  };
  const Vector3 on_floor = point_on(floor, is_a);
  const Vector3 on_other = point_on(other, is_a_of_other);
  if (std::abs(up.dot(on_other - on_floor)) > std::max(same_place * size, 2 * fall_)) return false;
  if (std::holds_alternative<TriangleMesh>(shape) || std::holds_alternative<Plane>(shape)) return false;
  // Keep the contacts beside a floor that is struck, which may yield.
  const auto speed_of = [&](int k, const Vector3& arm) -> Vector3 {
    const int body = body_of(floor.colliders[k]);
    return state_->v[body].linear + state_->v[body].angular.cross(state_->q[body].angular * arm);
  };
  const Vector3 closing = speed_of(1, floor.arm_b) - speed_of(0, floor.arm_a);
  const bool is_struck =
      duration_ * up.dot(closing) * (is_a ? 1 : -1) > std::max(tolerated_overlap * size, fall_);
  if (is_struck && moves(model_.masses[body_of(under)])) return false;
  const ConvexSolid solid(shape, poses_[below]);
  return up.dot(solid.support(up) - on_floor) + solid.radius() <= flush * size;
}

/// Returns whether two shapes pass each other that come within the search's tolerance after a time, at
/// `points_`: when the slowest of these points would have closed twice the tolerance, the shapes do not
/// overlap.
bool ContactFinder::pass(const MovingShape& a, const MovingShape& b, double time, double size) {
  const Vector3 centre_a = a.motion.at(time).position;
  const Vector3 centre_b = b.motion.at(time).position;
  const Vector3 velocity =
      a.motion.velocity - b.motion.velocity + time * (a.motion.acceleration - b.motion.acceleration);
  double slowest = infinity;
  for (const ContactPoint& point : points_) {
    if (point.distance > touching * size) continue;
    const Vector3 turning =
        a.motion.spin.cross(point.on_a - centre_a) - b.motion.spin.cross(point.on_b - centre_b);
    const double approach = -point.normal.dot(velocity + turning);
    if (approach > 0) slowest = std::min(slowest, approach);
  }
  constexpr double rounding = 1e-9;
  const double later = time + std::min(touching * size / slowest, duration_);
  return slowest < infinity && depth_after(a, b, later) <= rounding * size;
}

/// Returns how far two shapes overlap after a time, m.
double ContactFinder::depth_after(const MovingShape& a, const MovingShape& b, double time) {
  overlaps_.clear();
  find_contacts(*a.shape, a.motion.at(time) * a.placement, *b.shape, b.motion.at(time) * b.placement, 0,
                overlaps_);
  double depth = 0;
  for (const ContactPoint& point : overlaps_) depth = std::max(depth, -point.distance);
  return depth;
}

std::optional<double> ContactFinder::missed(const std::vector<Coordinates>& begin,
                                            const std::vector<Coordinates>& end, double duration) {
  const double fall = 1.5 * duration * duration * model_.gravity.norm();
  is_deflected_.assign(end.size(), false);
  bool any_deflected = false;
  for (const Candidate& candidate : candidates_) {
    const int body = candidate.collider->body;
    if (!moves(model_.masses[body])) continue;
    const RigidMotion& expected = motions_[body];
    const Vector3 way = end[body].linear - begin[body].linear;
    const Quaternion turned = end[body].angular * begin[body].angular.conjugate();
    constexpr double small_sine = 0.05;
    const Vector3 turn = turned.vec().squaredNorm() < small_sine * small_sine ? Vector3(2 * turned.vec())
                                                                              : rotation_vector(turned);
    const double off = (way - expected.displacement(duration)).norm() +
                       candidate.reach * (turn - duration * expected.spin).norm();
    if (off <= std::max(tolerated_overlap * candidate.size, fall) && !is_left_out_[body]) continue;
    is_deflected_[body] = any_deflected = true;
  }
  if (!any_deflected) return std::nullopt;
  for (std::size_t body = 0; body < end.size(); ++body) {
    const Coordinates& q = begin[body];
    moved_[body] = {
        q.linear,        q.angular, (end[body].linear - q.linear) / duration,
        Vector3::Zero(), 0,         rotation_vector(end[body].angular * q.angular.conjugate()) / duration};
  }
  for (std::uint32_t i = 0; i < candidates_.size(); ++i) {
    bounds_[i] = swept_bounds(moving(i, moved_), duration);
  }
  broad_phase_.find_pairs(bounds_, pairs_);
  std::optional<double> first;
  for (const auto& pair : pairs_) {
    const auto [i, j] = pair;
    if (!is_deflected_[body_of(i)] && !is_deflected_[body_of(j)]) continue;
    if (!may_meet(i, j)) continue;
    const double size = smaller_size(i, j);
    const MovingShape a = moving(i, moved_);
    const MovingShape b = moving(j, moved_);
    if (std::ranges::binary_search(touching_, pair)) {
      // Find shapes that touch at one point and come down at another, which has no contact.
      constexpr double shortest = 1.0 / 16;
      if (part_ > shortest && depth_after(a, b, duration) > depth_after(a, b, 0) + deep * size) {
        first = std::min(first.value_or(duration), duration / 2);
      }
      continue;
    }
    const auto impact = time_of_impact(a, b, first.value_or(duration), touching * size / 2);
    if (!impact) continue;
    const Vector3 closing = b.motion.velocity - a.motion.velocity;
    const double turning = impact->normal.cross(a.motion.spin).norm() * a.reach +
                           impact->normal.cross(b.motion.spin).norm() * b.reach;
    const double overlap = (duration - impact->time) * (impact->normal.dot(closing) + turning);
    if (overlap > tolerated_overlap * size) first = impact->time;
  }
  // An impact of touching shapes throws bodies back, so what they meet then comes after it.
  if (first && first_bounce_ < duration) first = std::max(*first, first_bounce_);
  return first;
}

}  // namespace substep
