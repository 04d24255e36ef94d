#include "sim/constraints/contact_finder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/constraints/contact_thresholds.h"
#include "sim/geometry/touching_ellipsoid.h"

namespace substep {
namespace {

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
  patch_begins_.reserve(candidates_.size() + 1);
  patches_of_.reserve(16 * candidates_.size());
  kept_.reserve(16 * candidates_.size());
  touching_.reserve(16 * candidates_.size());
  neighbours_.reserve(16 * candidates_.size());
  is_pushed_.reserve(model.masses.size());
  groups_.reserve(16 * candidates_.size());
  group_of_.reserve(candidates_.size());
  meetings_.reserve(4 * candidates_.size());
  motions_.resize(model.masses.size());
  rotations_.resize(model.masses.size());
  moved_.resize(model.masses.size());
  has_motion_.reserve(model.masses.size());
  is_off_.reserve(model.masses.size());
  is_at_rest_.reserve(model.masses.size());
  is_left_out_.reserve(model.masses.size());
  earliest_.reserve(model.masses.size());
}

bool ContactFinder::may_meet(std::uint32_t i, std::uint32_t j) const {
  const Collider& one = *candidates_[i].collider;
  const Collider& other = *candidates_[j].collider;
  if (one.body == other.body) return false;
  if (model_.masses[one.body].inverse_mass == 0 && model_.masses[other.body].inverse_mass == 0) return false;
  if (!meets(one, other) || !meets(other, one)) return false;
  const auto is_silent = [&](std::uint32_t fixed, int body) {
    return std::ranges::binary_search(model_.jointed_to_static, std::pair(static_cast<int>(fixed), body));
  };
  if (one.body == world_body) return !is_silent(i, other.body);
  if (other.body == world_body) return !is_silent(j, one.body);
  const std::pair<int, int> bodies = std::minmax(one.body, other.body);
  return !std::ranges::binary_search(model_.jointed, bodies);
}

std::pair<std::uint32_t, std::uint32_t> ContactFinder::in_order(std::uint32_t i, std::uint32_t j) const {
  // The normal is fixed in b. The static one is b; else the one that comes first in the file.
  const bool swap = model_.masses[candidates_[j].collider->body].inverse_mass == 0;
  return swap ? std::pair(i, j) : std::pair(j, i);
}

const std::vector<Contact>& ContactFinder::find(const State& state, double duration, int substeps,
                                                bool aligned, double part, bool all) {
  part_ = part;
  all_ = all;
  duration_ = duration;
  fall_ = duration * duration * model_.gravity.norm();
  substep_ = duration / substeps;
  whole_substep_ = substep_ / part;
  contacts_.clear();
  meetings_.clear();
  touching_.clear();
  neighbours_.clear();
  groups_.clear();
  kept_.clear();
  has_motion_.assign(state.q.size(), false);
  is_at_rest_.assign(state.q.size(), false);
  list_remembered(state);
  state_ = &state;
  for (std::size_t i = 0; i < state.q.size(); ++i) rotations_[i] = state.q[i].angular.toRotationMatrix();
  double fastest = 0;
  for (const Velocity& v : state.v) fastest = std::max(fastest, v.linear.norm());
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    const Collider& collider = *candidates_[i].collider;
    const Coordinates& q = state.q[collider.body];
    const Velocity& v = state.v[collider.body];
    poses_[i] = Pose{q.linear, q.angular} * collider.placement;
    margins_[i] = duration * ((all ? fastest : v.linear.norm()) + v.angular.norm() * candidates_[i].reach +
                              duration * fall_of(collider.body).norm());
    if (std::isfinite(candidates_[i].size)) margins_[i] += touching * candidates_[i].size;
    bounds_[i] = bounds(collider.shape, poses_[i]);
    bounds_[i].lower.array() -= margins_[i];
    bounds_[i].upper.array() += margins_[i];
  }
  broad_phase_.find_pairs(bounds_, pairs_);
  for (const auto& [i, j] : pairs_) {
    if (!may_meet(i, j)) continue;
    const auto [a, b] = in_order(i, j);
    const std::size_t before = groups_.size();
    find_pair(state, aligned, a, b);
    if (groups_.size() > before) touching_.emplace_back(i, j);
  }
  keep_first_impacts();
  add_neighbours(state, aligned);
  drop_flush();
  remove_dropped();
  return contacts_;
}

/// Adds the contacts of colliders that are near, will not meet under gravity alone, and belong to bodies that
/// touch other moving ones: these may push them together. In a pile that saves taking the step in parts.
void ContactFinder::add_neighbours(const State& state, bool aligned) {
  if (neighbours_.empty()) return;
  is_pushed_.assign(model_.masses.size(), false);
  for (const auto& [i, j] : touching_) {
    if (moves(model_.masses[body_of(i)]) && moves(model_.masses[body_of(j)])) {
      is_pushed_[body_of(i)] = is_pushed_[body_of(j)] = true;
    }
  }
  for (const auto& [a, b] : neighbours_) {
    if (!is_pushed_[body_of(a)] && !is_pushed_[body_of(b)]) continue;
    points_.clear();
    find_contacts(candidates_[a].collider->shape, poses_[a], candidates_[b].collider->shape, poses_[b],
                  margins_[a] + margins_[b], points_);
    add_contacts(state, aligned, a, b, 0);
    touching_.emplace_back(std::min(a, b), std::max(a, b));
    is_at_rest_[body_of(a)] = is_at_rest_[body_of(b)] = true;
  }
  std::ranges::sort(touching_);
}

/// Returns how a body moves under gravity alone.
const RigidMotion& ContactFinder::motion_of(const State& state, int body) {
  if (!has_motion_[body]) {
    const Coordinates& q = state.q[body];
    const Velocity& v = state.v[body];
    motions_[body] = {q.linear, q.angular, v.linear, fall_of(body), whole_substep_, v.angular};
    has_motion_[body] = true;
  }
  return motions_[body];
}

MovingShape ContactFinder::moving(const State& state, std::uint32_t i) {
  const Collider& collider = *candidates_[i].collider;
  return {&collider.shape, collider.placement, candidates_[i].reach, motion_of(state, collider.body)};
}

/// Adds the contacts of two colliders that touch, or that are apart and meet.
void ContactFinder::find_pair(const State& state, bool aligned, std::uint32_t a, std::uint32_t b) {
  const Shape& shape_a = candidates_[a].collider->shape;
  const Shape& shape_b = candidates_[b].collider->shape;
  const double margin = margins_[a] + margins_[b];
  const PatchShape* const before = aligned ? nullptr : patch_of(state, a, b);
  if (before && keep_patch(state, *before, margin)) return;
  points_.clear();
  const double spare = before ? spare_margin * smaller_size(a, b) : 0;
  find_contacts(shape_a, poses_[a], shape_b, poses_[b], margin + spare, points_);
  if (points_.empty()) return;
  double gap = std::numeric_limits<double>::infinity();
  for (const ContactPoint& point : points_) gap = std::min(gap, point.distance);
  const double size = smaller_size(a, b);
  if (gap <= touching * size || (gap <= std::max(touched_before * size, falls_of_touched * fall_) &&
                                 (before || !remembered_of(state, a, b).empty()))) {
    add_contacts(state, aligned, a, b, 0);
    if (!(approach_ > 0) && !separates_) is_at_rest_[body_of(a)] = is_at_rest_[body_of(b)] = true;
    if (approach_ > 0 || separates_) {
      meetings_.push_back({a, b, 0, true, !separates_, separates_, groups_.size() - 1});
    }
    return;
  }
  const MovingShape moving_a = moving(state, a);
  const MovingShape moving_b = moving(state, b);
  const std::optional<Impact> impact = time_of_impact(moving_a, moving_b, duration_, touching * size / 2);
  if (!impact && all_) return add_contacts(state, aligned, a, b, 0);
  if (!impact) {
    const PairMaterial material(candidates_[a].collider->material, candidates_[b].collider->material);
    if (material.restitution == 0 && margin <= aside * size) neighbours_.emplace_back(a, b);
    return;
  }
  const Pose pose_a = moving_a.motion.at(impact->time) * moving_a.placement;
  const Pose pose_b = moving_b.motion.at(impact->time) * moving_b.placement;
  points_.clear();
  find_contacts(shape_a, pose_a, shape_b, pose_b, margin * (1 - impact->time / duration_) + touching * size,
                points_);
  const std::size_t first = contacts_.size();
  add_contacts(state, aligned, a, b, impact->time);
  if (contacts_.size() == first) return;
  const Vector3 closing = moving_b.motion.displacement(duration_) - moving_a.motion.displacement(duration_);
  const auto any_of_these = [&](auto&& property) {
    return std::any_of(contacts_.begin() + static_cast<std::ptrdiff_t>(first), contacts_.end(), property);
  };
  const bool bounces = any_of_these([](const Contact& contact) { return contact.restitution > 0; });
  const bool is_impact =
      any_of_these([](const Contact& contact) { return contact.restitution != Contact::no_impact; });
  const bool is_far = impact->normal.dot(closing) > aside * size;
  meetings_.push_back({a, b, impact->time, is_impact, bounces || is_far, false, groups_.size() - 1});
}

}  // namespace substep
