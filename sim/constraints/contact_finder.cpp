#include "sim/constraints/contact_finder.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>

#include "sim/geometry/round_shapes.h"

namespace substep {
namespace {

/// Motion of the bodies below which a patch is kept, relative to the smaller shape, and rad.
constexpr double barely_moved = 1e-3;

bool meets(const Collider& one, const Collider& other) {
  return other.in_no_system || (other.member & one.collides_with) != 0;
}

/// Returns the radius of a ball about the shape's origin that contains the shape, m; 0 for a plane.
double reach_of(const Shape& shape) {
  if (const auto* polytope = std::get_if<Polytope>(&shape))
    return polytope->centre.norm() + polytope->bounding_radius;
  if (const auto* mesh = std::get_if<TriangleMesh>(&shape)) {
    const Bounds& box = mesh->nodes[0].bounds;
    return box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).norm();
  }
  const auto solid = as_revolved(shape, {});
  return solid ? solid->reach() : 0;
}

}  // namespace

ContactFinder::ContactFinder(const Scene& scene, const Model& model, bool reformulates)
    : model_(model), reformulates_(reformulates) {
  if (!model.contacts) return;
  for (const Collider& collider : scene.colliders) {
    const double size = reach_of(collider.shape);
    const double known_size = size > 0 ? size : infinity;
    candidates_.push_back(
        {&collider, collider.placement.position.norm() + size, known_size, is_curved(collider.shape)});
  }
  poses_.resize(candidates_.size());
  bounds_.resize(candidates_.size());
  margins_.resize(candidates_.size());
  // Reserve memory for a dense pile, so that steps after the first need no more.
  const auto reserve = [](std::size_t count, auto&... vectors) { (vectors.reserve(count), ...); };
  const std::size_t colliders = candidates_.size();
  reserve(16 * colliders, pairs_, contacts_, patches_of_, kept_, touching_, neighbours_, groups_);
  reserve(colliders + 1, begins_, patch_begins_, group_of_);
  reserve(4 * colliders, meetings_);
  reserve(64, points_, ahead_, held_, overlaps_);
  const std::size_t bodies = model.masses.size();
  motions_.resize(bodies);
  rotations_.resize(bodies);
  moved_.resize(bodies);
  reserve(bodies, is_deflected_, is_pushed_, is_at_rest_, is_left_out_, earliest_);
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

const std::vector<Contact>& ContactFinder::find(const State& state, double duration, int substeps,
                                                bool aligned, double part, bool all) {
  state_ = &state;
  aligned_ = aligned;
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
  first_bounce_ = infinity;
  is_at_rest_.assign(state.q.size(), false);
  list_remembered();
  double fastest = 0;
  for (std::size_t i = 0; i < state.q.size(); ++i) {
    const Coordinates& q = state.q[i];
    const Velocity& v = state.v[i];
    rotations_[i] = q.angular.toRotationMatrix();
    motions_[i] = {q.linear, q.angular, v.linear, fall_of(static_cast<int>(i)), whole_substep_, v.angular};
    fastest = std::max(fastest, v.linear.norm());
  }
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    const Collider& collider = *candidates_[i].collider;
    const Coordinates& q = state.q[collider.body];
    const Velocity& v = state.v[collider.body];
    poses_[i] = Pose{q.linear, q.angular} * collider.placement;
    margins_[i] = duration * ((all ? fastest : 0) + v.angular.norm() * candidates_[i].reach +
                              duration * fall_of(collider.body).norm());
    double enlargement = margins_[i] + duration * v.linear.norm();
    if (std::isfinite(candidates_[i].size)) enlargement += touching * candidates_[i].size;
    bounds_[i] = bounds(collider.shape, poses_[i]);
    bounds_[i].min().array() -= enlargement;
    bounds_[i].max().array() += enlargement;
  }
  broad_phase_.find_pairs(bounds_, pairs_);
  for (const auto& [i, j] : pairs_) {
    if (!may_meet(i, j)) continue;
    // Take the static body as b, in which the normal is fixed, else the first in the file.
    const bool is_first_a = model_.masses[body_of(j)].inverse_mass == 0;
    const std::size_t before = groups_.size();
    find_pair(is_first_a ? i : j, is_first_a ? j : i);
    if (groups_.size() > before) touching_.emplace_back(i, j);
  }
  keep_first_impacts();
  add_neighbours();
  drop_flush();
  remove_dropped();
  return contacts_;
}

/// Adds the contacts of near colliders that do not meet under gravity alone, where their bodies touch other
/// moving ones, which may push them together. This saves parts of steps in piles.
void ContactFinder::add_neighbours() {
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
                  margin_of(a, b), points_);
    if (points_.empty()) continue;
    add_contacts(a, b, 0);
    touching_.emplace_back(std::min(a, b), std::max(a, b));
    is_at_rest_[body_of(a)] = is_at_rest_[body_of(b)] = true;
  }
  std::ranges::sort(touching_);
}

/// Returns the distance within which points of two colliders are found, m. It does not depend on how fast
/// both fly together, nor on the larger shape: a patch with points far from the other body turns wrongly.
double ContactFinder::margin_of(std::uint32_t a, std::uint32_t b) const {
  const Vector3 velocity = motions_[body_of(a)].velocity - motions_[body_of(b)].velocity;
  return margins_[a] + margins_[b] + duration_ * velocity.norm() + 2 * touching * smaller_size(a, b);
}

MovingShape ContactFinder::moving(std::uint32_t i, const std::vector<RigidMotion>& motions) const {
  const Collider& collider = *candidates_[i].collider;
  return {&collider.shape, collider.placement, candidates_[i].reach, motions[collider.body]};
}

/// Returns the cached patch of two colliders, or null.
const PatchShape* ContactFinder::patch_of(std::uint32_t a, std::uint32_t b) const {
  for (int i = patch_begins_[a]; i < patch_begins_[a + 1]; ++i) {
    const PatchShape& patch = state_->patches[patches_of_[i]];
    if (patch.collider_b == static_cast<int>(b)) return &patch;
  }
  return nullptr;
}

/// Keeps a patch of the step before if its bodies have barely moved relative to each other since it was
/// found, and do not collide. Returns true if the patch is kept.
bool ContactFinder::keep_patch(const PatchShape& patch, double margin) {
  if (part_ != 1 || all_ || patch.left_over > 0 || margin > patch.margin) return false;
  const auto a = static_cast<std::uint32_t>(patch.collider_a);
  const auto b = static_cast<std::uint32_t>(patch.collider_b);
  const double size = smaller_size(a, b);
  const Matrix3& rotation_b = rotations_[patch.b];
  const Coordinates& qa = state_->q[patch.a];
  const Coordinates& qb = state_->q[patch.b];
  const Vector3 apart = qa.linear - qb.linear;
  const double farthest = barely_moved * size;
  if ((apart - rotation_b * patch.position).squaredNorm() > farthest * farthest) return false;
  const double cosine = qb.angular.coeffs().dot((qa.angular * patch.turn.conjugate()).coeffs());
  const double squared_turn = 4 * (1 - cosine * cosine);  // of half the angle
  if (squared_turn > barely_moved * barely_moved) return false;
  const Vector3 normal = rotation_b * patch.axes_in_b.col(0);
  const Vector3 arm_a = rotations_[patch.a] * patch.arm_a;
  const Vector3 arm_b = rotation_b * patch.arm_b;
  if (normal.dot(apart + arm_a - arm_b) > std::max(touched_before * size, falls_of_touched * fall_))
    return false;
  // Leave impacts to contacts by points.
  const Velocity& va = state_->v[patch.a];
  const Velocity& vb = state_->v[patch.b];
  const Vector3 before = va.linear + va.angular.cross(arm_a) - vb.linear - vb.angular.cross(arm_b);
  const Vector3 turning = va.angular - vb.angular;
  const double approach = -normal.dot(before);
  const double twist = normal.dot(turning);
  const double slow = hard * size / duration_ - approach;
  const double squared_tilting = patch.radius * patch.radius * (turning - twist * normal).squaredNorm();
  if (slow < 0 || squared_tilting > slow * slow) return false;
  kept_.push_back(patch);
  PatchShape& kept = kept_.back();
  kept.is_kept = true;
  const double squared_slip =
      (before + approach * normal).squaredNorm() + patch.radius * patch.radius * twist * twist;
  const PairMaterial material(candidates_[a].collider->material, candidates_[b].collider->material);
  const double squared_at_rest = duration_ * duration_ * (fall_of(patch.a) - fall_of(patch.b)).squaredNorm();
  kept.friction = squared_slip > squared_at_rest ? material.dynamic_friction : material.static_friction;
  is_at_rest_[patch.a] = is_at_rest_[patch.b] = true;
  groups_.push_back({.begin = contacts_.size(),
                     .end = contacts_.size(),
                     .normal = normal,
                     .colliders = {patch.collider_a, patch.collider_b},
                     .patch = static_cast<int>(kept_.size()) - 1,
                     .points = patch.corners,
                     .arm_a = patch.arm_a,
                     .arm_b = patch.arm_b});
  return true;
}

/// Sets where each collider's points and patches begin in the contact cache, which is sorted by collider.
void ContactFinder::list_remembered() {
  begins_.assign(candidates_.size() + 1, 0);
  const auto count = static_cast<int>(candidates_.size());
  for (const ContactMemory& memory : state_->contacts) {
    if (memory.collider_a >= 0 && memory.collider_a < count) ++begins_[memory.collider_a + 1];
  }
  for (std::size_t i = 1; i < begins_.size(); ++i) begins_[i] += begins_[i - 1];
  patch_begins_.assign(candidates_.size() + 1, 0);
  for (const PatchShape& patch : state_->patches) ++patch_begins_[patch.collider_a];
  for (std::size_t i = 1; i < patch_begins_.size(); ++i) patch_begins_[i] += patch_begins_[i - 1];
  patches_of_.resize(state_->patches.size());
  for (int i = 0; i < static_cast<int>(state_->patches.size()); ++i) {
    patches_of_[--patch_begins_[state_->patches[i].collider_a]] = i;
  }
}

std::span<const ContactMemory> ContactFinder::remembered_of(std::uint32_t a, std::uint32_t b) const {
  const auto first = state_->contacts.begin();
  const auto last = first + begins_[a + 1];
  const int other = static_cast<int>(b);
  const auto begin =
      std::ranges::lower_bound(first + begins_[a], last, other, {}, &ContactMemory::collider_b);
  return {begin, std::ranges::upper_bound(begin, last, other, {}, &ContactMemory::collider_b)};
}

/// Adds the contacts of two colliders that touch or meet.
void ContactFinder::find_pair(std::uint32_t a, std::uint32_t b) {
  const Shape& shape_a = candidates_[a].collider->shape;
  const Shape& shape_b = candidates_[b].collider->shape;
  const double margin = margin_of(a, b);
  const PatchShape* const before = aligned_ ? nullptr : patch_of(a, b);
  if (before && keep_patch(*before, margin)) return;
  points_.clear();
  const double spare = before ? spare_margin * smaller_size(a, b) : 0;
  find_contacts(shape_a, poses_[a], shape_b, poses_[b], margin + spare, points_);
  if (points_.empty()) return;
  double gap = infinity;
  for (const ContactPoint& point : points_) gap = std::min(gap, point.distance);
  const double size = smaller_size(a, b);
  const bool touched = before || !remembered_of(a, b).empty();
  if (gap <= touching * size ||
      (gap <= std::max(touched_before * size, falls_of_touched * fall_) && touched)) {
    if (gap > 0 && !touched && pass(moving(a, motions_), moving(b, motions_), 0, size)) return;
    const std::optional<Impact> ahead = take_ahead(a, b, gap, margin);
    add_contacts(a, b, 0);
    if (approach_ > 0) first_bounce_ = std::min(first_bounce_, touching * size / approach_);
    if (approach_ > 0 || separates_) {
      meetings_.push_back({a, b, 0, true, !separates_, separates_, groups_.size() - 1});
    } else {
      is_at_rest_[body_of(a)] = is_at_rest_[body_of(b)] = true;
    }
    if (!ahead) return;
    points_.swap(ahead_);
    return add_meeting(a, b, *ahead);
  }
  const std::optional<Impact> impact =
      time_of_impact(moving(a, motions_), moving(b, motions_), duration_, touching * size / 2);
  if (!impact && all_) return add_contacts(a, b, 0);
  if (!impact) {
    const PairMaterial material(candidates_[a].collider->material, candidates_[b].collider->material);
    if (material.restitution == 0 && margin <= aside * size) neighbours_.emplace_back(a, b);
    return;
  }
  find_met(a, b, impact->time, margin, points_);
  add_meeting(a, b, *impact);
}

/// Removes from `points_` those of a mesh b that a touches elsewhere and whose planes would stop a within the
/// step. Returns the meeting of a with their triangles, if any, and sets `ahead_` to the points and planes of
/// then: an edge's plane turns until they meet.
std::optional<Impact> ContactFinder::take_ahead(std::uint32_t a, std::uint32_t b, double gap, double margin) {
  if (!std::holds_alternative<TriangleMesh>(candidates_[b].collider->shape)) return std::nullopt;
  const double size = smaller_size(a, b);
  const MovingShape moving_a = moving(a, motions_);
  const MovingShape moving_b = moving(b, motions_);
  const bool bounces =
      PairMaterial(candidates_[a].collider->material, candidates_[b].collider->material).restitution > 0;
  const auto stops = [&](const ContactPoint& point) {
    const Vector3 velocity =
        moving_a.motion.velocity_at(point.on_a) - moving_b.motion.velocity_at(point.on_b);
    return point.distance > std::max(gap, touching * size) &&
           -duration_ * point.normal.dot(velocity) > std::max(hard * size, bounces ? 0 : point.distance);
  };
  held_.clear();
  std::ranges::remove_copy_if(points_, std::back_inserter(held_), stops);
  const auto is_held = [&](const ContactPoint& point) {
    return std::ranges::any_of(
        held_, [&](const ContactPoint& held) { return held.normal.dot(point.normal) > cosine_of_tilt; });
  };
  if (std::ranges::all_of(points_, is_held)) return std::nullopt;
  const std::optional<Impact> impact =
      time_of_impact(moving_a, moving_b, duration_, touching * size / 2, held_);
  if (!impact && all_) return std::nullopt;
  if (impact) {
    find_met(a, b, impact->time, margin, ahead_);
    std::erase_if(ahead_, is_held);
    if (ahead_.empty()) return std::nullopt;
  }
  std::erase_if(points_, std::not_fn(is_held));
  return impact;
}

/// Finds the points of two colliders that meet after `time`, within what is left of the margin then.
void ContactFinder::find_met(std::uint32_t a, std::uint32_t b, double time, double margin,
                             std::vector<ContactPoint>& points) const {
  const MovingShape moving_a = moving(a, motions_);
  const MovingShape moving_b = moving(b, motions_);
  points.clear();
  find_contacts(*moving_a.shape, moving_a.motion.at(time) * moving_a.placement, *moving_b.shape,
                moving_b.motion.at(time) * moving_b.placement,
                margin * (1 - time / duration_) + touching * smaller_size(a, b), points);
}

/// Adds the contacts of `points_`, with which two colliders meet.
void ContactFinder::add_meeting(std::uint32_t a, std::uint32_t b, const Impact& impact) {
  const double size = smaller_size(a, b);
  const MovingShape moving_a = moving(a, motions_);
  const MovingShape moving_b = moving(b, motions_);
  if (pass(moving_a, moving_b, impact.time, size)) return;
  const std::size_t first = contacts_.size();
  add_contacts(a, b, impact.time);
  if (contacts_.size() == first) return;
  const Vector3 closing = moving_b.motion.displacement(duration_) - moving_a.motion.displacement(duration_);
  const auto any_of_these = [&](auto&& property) {
    return std::any_of(contacts_.begin() + static_cast<std::ptrdiff_t>(first), contacts_.end(), property);
  };
  const bool bounces = any_of_these([](const Contact& contact) { return contact.restitution > 0; });
  const bool is_impact =
      any_of_these([](const Contact& contact) { return contact.restitution != Contact::no_impact; });
  const bool is_far = impact.normal.dot(closing) > aside * size;
  meetings_.push_back({a, b, impact.time, is_impact, bounces || is_far, false, groups_.size() - 1});
}

}  // namespace substep
