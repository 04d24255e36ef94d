// Meetings of a step that its contacts did not know.

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/constraints/contact_finder.h"
#include "sim/constraints/contact_thresholds.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

/// Depth that touching shapes may gain in a part of a step, relative to the smaller.
constexpr double deep = 0.05;

}  // namespace

/// Returns how far two shapes overlap after a time, m.
double ContactFinder::depth_after(const MovingShape& a, const MovingShape& b, double time) {
  points_.clear();
  find_contacts(*a.shape, a.motion.at(time) * a.placement, *b.shape, b.motion.at(time) * b.placement, 0,
                points_);
  double depth = 0;
  for (const ContactPoint& point : points_) depth = std::max(depth, -point.distance);
  return depth;
}

std::optional<double> ContactFinder::missed(const State& state, const std::vector<Coordinates>& end,
                                            double duration) {
  const double fall = 1.5 * duration * duration * model_.gravity.norm();
  is_off_.assign(end.size(), false);
  bool any_off = false;
  for (const Candidate& candidate : candidates_) {
    const int body = candidate.collider->body;
    if (!moves(model_.masses[body])) continue;
    const RigidMotion& expected = motion_of(state, body);
    const Vector3 way = end[body].linear - state.q[body].linear;
    const Quaternion turned = end[body].angular * state.q[body].angular.conjugate();
    constexpr double small_sine = 0.05;
    const Vector3 turn = turned.vec().squaredNorm() < small_sine * small_sine ? Vector3(2 * turned.vec())
                                                                              : rotation_vector(turned);
    const double off = (way - expected.displacement(duration)).norm() +
                       candidate.reach * (turn - duration * expected.spin).norm();
    if (off <= std::max(tolerated_overlap * candidate.size, fall) && !is_left_out_[body]) continue;
    is_off_[body] = any_off = true;
  }
  if (!any_off) return std::nullopt;
  for (std::size_t body = 0; body < end.size(); ++body) {
    const Coordinates& q = state.q[body];
    moved_[body] = {
        q.linear,        q.angular, (end[body].linear - q.linear) / duration,
        Vector3::Zero(), 0,         rotation_vector(end[body].angular * q.angular.conjugate()) / duration};
  }
  const auto moved = [&](std::uint32_t i) -> MovingShape {
    const Collider& collider = *candidates_[i].collider;
    return {&collider.shape, collider.placement, candidates_[i].reach, moved_[collider.body]};
  };
  for (std::uint32_t i = 0; i < candidates_.size(); ++i) bounds_[i] = swept_bounds(moved(i), duration);
  broad_phase_.find_pairs(bounds_, pairs_);
  std::optional<double> first;
  for (const auto& pair : pairs_) {
    const auto [i, j] = pair;
    if (!is_off_[candidates_[i].collider->body] && !is_off_[candidates_[j].collider->body]) continue;
    if (!may_meet(i, j)) continue;
    const double size = smaller_size(i, j);
    const MovingShape a = moved(i);
    const MovingShape b = moved(j);
    if (std::ranges::binary_search(touching_, pair)) {
      // Shapes that touch in one place may come down in another, of which the contacts know nothing.
      constexpr double shortest = 1.0 / 16;
      if (part_ > shortest && depth_after(a, b, duration) > depth_after(a, b, 0) + deep * size) {
        first = std::min(first.value_or(duration), duration / 2);
      }
      continue;
    }
    const auto impact = time_of_impact(a, b, first.value_or(duration), touching * size / 2);
    if (!impact) continue;
    const Vector3 arm = Vector3::Zero();
    const Vector3 closing = b.motion.velocity - a.motion.velocity + arm;
    const double turning = impact->normal.cross(a.motion.spin).norm() * a.reach +
                           impact->normal.cross(b.motion.spin).norm() * b.reach;
    const double overlap = (duration - impact->time) * (impact->normal.dot(closing) + turning);
    if (overlap > tolerated_overlap * size) first = impact->time;
  }
  return first;
}

}  // namespace substep
