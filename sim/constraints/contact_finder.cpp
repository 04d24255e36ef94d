#include "sim/constraints/contact_finder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/geometry/separation.h"
#include "sim/geometry/touching_ellipsoid.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

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

/// Motion of the bodies below which a patch is kept, relative to the smaller shape, and rad.
constexpr double barely_moved = 1e-3;

/// Extra distance at which points are found so that a patch can be kept, relative to the smaller shape.
constexpr double spare_margin = 2e-3;

/// Of the bodies' speeds: what approaches more slowly has met already.
constexpr double resting = 0.01;

/// Of the smaller shape: what is no farther apart touches.
constexpr double touching = 2e-4;

/// Of the smaller shape, and of what gravity moves it by in a step: what touched before and is no farther
/// apart goes on touching, for a pile that settles trembles by so much.
constexpr double touched_before = 0.05;
constexpr double falls_of_touched = 4;

/// Of the smaller shape, what an impact must take of a body's way in the step to turn it aside.
constexpr double aside = 0.25;

/// Of the smaller shape, what an impact must take of a body's way in the step to be given at once, bouncing
/// or not.
constexpr double hard = 0.01;

/// Of the smaller shape, the slip in a step by which bodies pass each other by.
constexpr double passing = 0.02;

/// Directions that differ by less are of one face that is tilted a little.
constexpr double cosine_of_tilt = 0.999;

/// Of the smaller shape, what two that touch may sink into each other by in a part of a step.
constexpr double deep = 0.05;

/// Of the smaller shape: a face this far below another's plane is flush with it.
constexpr double flush = 1e-4;

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

/// Returns what gravity does to a body's velocity, m/s².
Vector3 ContactFinder::fall_of(int body) const {
  if (model_.masses[body].inverse_mass == 0) return Vector3::Zero();
  return model_.gravity * model_.masses[body].gravity_factor;
}

/// Returns what of an overlap a step recovers: as much as gravity takes back in the next, so that the bodies
/// do not fly apart. Without gravity it takes ten seconds for the smaller shape's size.
double ContactFinder::recovered(const Contact& contact) const {
  const double gravity = model_.gravity.norm();
  const double speed =
      gravity > 0 ? duration_ * gravity : 0.1 * smaller_size(contact.collider_a, contact.collider_b);
  return duration_ * speed;
}

double ContactFinder::smaller_size(std::uint32_t a, std::uint32_t b) const {
  return std::min(candidates_[a].size, candidates_[b].size);
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
  const double fall = duration_ * duration_ * model_.gravity.norm();
  if (gap <= touching * size || (gap <= std::max(touched_before * size, falls_of_touched * fall) &&
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

/// Adds the contacts of `points_`, with which two colliders touch after `time`.
void ContactFinder::add_contacts(const State& state, bool aligned, std::uint32_t a, std::uint32_t b,
                                 double time) {
  const Collider& on_a = *candidates_[a].collider;
  const Collider& on_b = *candidates_[b].collider;
  const Velocity& va = state.v[on_a.body];
  const Velocity& vb = state.v[on_b.body];
  Pose body_a{state.q[on_a.body].linear, state.q[on_a.body].angular};
  Pose body_b{state.q[on_b.body].linear, state.q[on_b.body].angular};
  // Arms and normals keep the directions in the world that they have when the bodies meet.
  const Quaternion to_a = body_a.orientation.conjugate();
  const Quaternion to_b = body_b.orientation.conjugate();
  Vector3 way = Vector3::Zero();
  if (time > 0) {
    way = motions_[on_a.body].displacement(time) - motions_[on_b.body].displacement(time);
    body_a = motions_[on_a.body].at(time);
    body_b = motions_[on_b.body].at(time);
  }
  const Vector3 acceleration = fall_of(on_a.body) - fall_of(on_b.body);
  const Vector3 external = acceleration * duration_;
  const PairMaterial material(on_a.material, on_b.material);
  // What gravity does in a step: slower than that is at rest. It has the scene's own scale.
  const double at_rest = external.norm();
  const double resting_acceleration = 2 * acceleration.norm();
  const double speed = va.linear.norm() + vb.linear.norm() + duration_ * model_.gravity.norm();
  const std::span<const ContactMemory> remembered = remembered_of(state, a, b);
  if (points_.empty()) return;
  groups_.push_back({contacts_.size(),
                     contacts_.size() + points_.size(),
                     points_[0].normal,
                     {static_cast<int>(a), static_cast<int>(b)},
                     {-1, -1},
                     false,
                     -1,
                     static_cast<int>(points_.size()),
                     to_a * (points_[0].on_a - body_a.position),
                     to_b * (points_[0].on_b - body_b.position)});
  const PatchShape* const patch = aligned ? nullptr : patch_of(state, a, b);
  std::optional<PatchMotion> patch_motion;
  if (patch) {
    patch_motion.emplace(*patch, to_b * (state.q[on_a.body].linear - state.q[on_b.body].linear),
                         (to_b * state.q[on_a.body].angular).toRotationMatrix());
  }
  const double size = smaller_size(a, b);
  const ContactPoint* before_this = nullptr;
  approach_ = 0;
  separates_ = material.restitution > 0;
  for (const ContactPoint& point : points_) {
    const Vector3 arm_a = point.on_a - body_a.position;
    const Vector3 arm_b = point.on_b - body_b.position;
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
    contact.margin = margins_[a] + margins_[b] + (patch ? spare_margin * size : 0);
    contact.friction = slip_speed > at_rest ? material.dynamic_friction : material.static_friction;
    if (candidates_[a].curved || candidates_[b].curved) {
      set_rolling(point, body_a * on_a.placement, body_b * on_b.placement, contact);
    }
    contact.resting_acceleration = resting_acceleration;
    contact.acceleration = -point.normal.dot(acceleration);
    // What does not approach when the step begins is no impact, though others may press it together in the
    // step: the law of impact holds for all contacts of a step at once.
    const double approach = duration_ * contact.acceleration - point.normal.dot(before);
    // With one sub-step, what is stopped at once stays short of the surface: only where it would pass by.
    const bool passes_by = substep_ < duration_ || duration_ * slip_speed > passing * size;
    const bool is_met = point.distance <= touching * size && point.distance >= -tolerated_overlap * size;
    const bool is_hard = is_met && passes_by && duration_ * (approach - at_rest) > hard * size;
    const bool is_impact = approach > resting * speed && (material.restitution > 0 || is_hard);
    contact.restitution = is_impact ? material.restitution : Contact::no_impact;
    contact.closes = substep_ < duration_ && substep_ * slip_speed <= passing * size;
    contact.slid = slip_speed > at_rest;
    const double part_of_size = duration_ * approach / size;
    separates_ = separates_ && part_of_size < -tolerated_overlap;
    if (is_impact && part_of_size > (material.restitution > 0 ? tolerated_overlap : aside)) {
      approach_ = std::max(approach_, approach - duration_ * resting_acceleration);
    }
    if (time > 0) {
      // At the start the points are apart by their way until they meet, and by the turning of their arms.
      const Vector3 turning = time * (va.angular.cross(arm_a) - vb.angular.cross(arm_b));
      contact.gap_offset = -point.normal.dot(turning);
      const Vector3 apart = point.on_a - point.on_b - way;
      contact.displacement_1 = -(state.q[on_b.body].angular * contact.tangent_b1).dot(apart);
      contact.displacement_2 = -(state.q[on_b.body].angular * contact.tangent_b2).dot(apart);
      continue;
    }
    contact.left_over = std::max(0.0, -point.distance - recovered(contact));
    if (!patch) {
      remember(remembered, -point.distance, duration_ * slip_speed, contact);
    } else if (duration_ * slip_speed < same_place * size) {
      remember(*patch, *patch_motion, -point.distance, contact);
    }
    // A part of a step recovers its part of an overlap, at the speed at which the step would.
    contact.gap_offset = (1 - part_) * std::max(0.0, -point.distance - contact.left_over);
  }
}

/// Leaves out what a body meets only after an impact that turns it aside, for it may never get there, and
/// what it is flying away from when it has one, for to meet that again is another impact. missed() says if it
/// does.
void ContactFinder::keep_first_impacts() {
  first_impact_ = first_timed_impact_ = std::numeric_limits<double>::infinity();
  is_left_out_.assign(model_.masses.size(), false);
  if (meetings_.empty() || all_) return;
  earliest_.assign(model_.masses.size(), std::numeric_limits<double>::infinity());
  for (const Meeting& meeting : meetings_) {
    if (!meeting.turns_aside) continue;
    for (const std::uint32_t i : {meeting.a, meeting.b}) {
      const int body = candidates_[i].collider->body;
      if (model_.masses[body].inverse_mass > 0) earliest_[body] = std::min(earliest_[body], meeting.time);
    }
  }
  // What is met at once, but for rounding, is met by all.
  const double at_once = 1e-6 * duration_;
  for (const Meeting& meeting : meetings_) {
    const auto is_after = [&](std::uint32_t i) {
      const double earliest = earliest_[candidates_[i].collider->body];
      return meeting.separates ? earliest < duration_ : meeting.time > earliest + at_once;
    };
    const bool is_late = is_after(meeting.a) || is_after(meeting.b);
    const bool is_ahead = meeting.time > 0 && !is_late;
    if (meeting.turns_aside && is_ahead) first_impact_ = std::min(first_impact_, meeting.time);
    const auto turns = [&](std::uint32_t i) {
      constexpr double small_angle = 0.02;
      return duration_ * motions_[candidates_[i].collider->body].spin.norm() > small_angle;
    };
    const bool is_timed = meeting.is_impact ? turns(meeting.a) || turns(meeting.b) : substep_ == duration_;
    if (is_ahead && meeting.turns_aside && is_timed) {
      first_timed_impact_ = std::min(first_timed_impact_, meeting.time);
    }
    if (!is_late) continue;
    groups_[meeting.group].dropped = true;
    const std::pair<std::uint32_t, std::uint32_t> pair = std::minmax(meeting.a, meeting.b);
    std::erase(touching_, pair);
    is_left_out_[candidates_[meeting.a].collider->body] =
        is_left_out_[candidates_[meeting.b].collider->body] = true;
  }
}

/// Leaves out the contacts of a collider with what lies wholly below the plane of another contact of it:
/// flush faces are one floor, whose inner edges stop nothing. Two kept patches were compared when they were
/// found.
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
  for (std::size_t collider = 0; collider < candidates_.size(); ++collider) {
    if (!moves(model_.masses[candidates_[collider].collider->body])) continue;
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

/// Returns the normal of a collider's face that looks into a direction, to 0.05 rad; the direction where none
/// does.
Vector3 ContactFinder::face_towards(std::uint32_t collider, const Vector3& direction) const {
  const auto* polytope = std::get_if<Polytope>(&candidates_[collider].collider->shape);
  if (!polytope) return direction;
  const Quaternion& orientation = poses_[collider].orientation;
  const Vector3 local = orientation.conjugate() * direction;
  for (const Vector3& normal : polytope->face_normals) {
    if (normal.dot(local) > cosine_of_tilt) return orientation * normal;
  }
  return direction;
}

/// Returns whether a direction is across a face of a collider.
bool ContactFinder::is_of_face(std::uint32_t collider, const Vector3& direction) const {
  const auto* polytope = std::get_if<Polytope>(&candidates_[collider].collider->shape);
  if (!polytope) return false;
  const Vector3 local = poses_[collider].orientation.conjugate() * direction;
  return std::ranges::any_of(polytope->face_normals,
                             [&](const Vector3& normal) { return std::abs(normal.dot(local)) > 1 - 1e-12; });
}

/// Returns whether what a collider touches in the contacts of `other` is below the plane of `floor`.
bool ContactFinder::is_flush(int collider, const Group& floor, const Group& other) const {
  const bool is_a = floor.colliders[0] == collider;
  const bool is_a_of_other = other.colliders[0] == collider;
  const int below = other.colliders[is_a_of_other ? 1 : 0];
  // The floor's own face: what stands on it may tilt a little.
  const int under = floor.colliders[is_a ? 1 : 0];
  const Vector3 up = face_towards(static_cast<std::uint32_t>(under), (is_a ? 1 : -1) * floor.normal);
  const Vector3 other_up = (is_a_of_other ? 1 : -1) * other.normal;
  const double cosine = up.dot(other_up);
  if (cosine < -0.5) return false;
  // What stands on a face bears on it; only its edges and sides are inside the floor.
  constexpr int corners_of_face = 3;
  if (cosine > cosine_of_tilt &&
      (other.points >= corners_of_face || is_of_face(static_cast<std::uint32_t>(below), other_up) ||
       is_of_face(static_cast<std::uint32_t>(collider), other_up))) {
    return false;
  }
  const Shape& shape = candidates_[below].collider->shape;
  const double size = std::min(smaller_size(collider, below), smaller_size(collider, under));
  const auto point_on = [&](const Group& group, bool on_b) {
    return point_of(body_of(group.colliders[on_b ? 1 : 0]), on_b ? group.arm_b : group.arm_a);
  };
  const Vector3 on_floor = point_on(floor, is_a);
  const Vector3 on_other = point_on(other, is_a_of_other);
  const double fall = duration_ * duration_ * model_.gravity.norm();
  if (std::abs(up.dot(on_other - on_floor)) > std::max(same_place * size, 2 * fall)) return false;
  if (std::holds_alternative<TriangleMesh>(shape) || std::holds_alternative<Plane>(shape)) return false;
  // A floor that is struck may give way.
  const auto speed_of = [&](int k, const Vector3& arm) -> Vector3 {
    const int body = body_of(floor.colliders[k]);
    return state_->v[body].linear + state_->v[body].angular.cross(orientation_of(body) * arm);
  };
  const Vector3 closing = speed_of(1, floor.arm_b) - speed_of(0, floor.arm_a);
  const bool is_struck =
      duration_ * up.dot(closing) * (is_a ? 1 : -1) > std::max(tolerated_overlap * size, fall);
  if (is_struck && moves(model_.masses[candidates_[under].collider->body])) return false;
  const ConvexSolid solid(shape, poses_[below]);
  return up.dot(solid.support(up) - on_floor) + solid.radius() <= flush * size;
}

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
      // What touches in one place may come down in another, of which its contacts know nothing.
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

/// Returns what is remembered of two colliders as a patch, or null.
const PatchShape* ContactFinder::patch_of(const State& state, std::uint32_t a, std::uint32_t b) const {
  for (int i = patch_begins_[a]; i < patch_begins_[a + 1]; ++i) {
    const PatchShape& patch = state.patches[patches_of_[i]];
    if (patch.collider_b == static_cast<int>(b)) return &patch;
  }
  return nullptr;
}

/// Keeps a patch of the step before, if its bodies have barely moved relative to each other since it was
/// found, and do not collide. Returns whether it does.
bool ContactFinder::keep_patch(const State& state, const PatchShape& patch, double margin) {
  if (part_ != 1 || all_ || patch.left_over > 0 || margin > patch.margin) return false;
  const auto a = static_cast<std::uint32_t>(patch.collider_a);
  const auto b = static_cast<std::uint32_t>(patch.collider_b);
  const double size = smaller_size(a, b);
  const Matrix3& rotation_a = rotations_[patch.a];
  const Matrix3& rotation_b = rotations_[patch.b];
  const Vector3 position = rotation_b.transpose() * (state.q[patch.a].linear - state.q[patch.b].linear);
  if ((position - patch.position).squaredNorm() > barely_moved * barely_moved * size * size) return false;
  const PatchMotion motion(patch, position, rotation_b.transpose() * rotation_a);
  if (motion.squared_turn > barely_moved * barely_moved) return false;
  const double fall = duration_ * duration_ * model_.gravity.norm();
  if (motion.gap > std::max(touched_before * size, falls_of_touched * fall)) return false;
  // Leave impacts to contacts by points.
  const Velocity& va = state.v[patch.a];
  const Velocity& vb = state.v[patch.b];
  const Vector3 normal = rotation_b * patch.axes_in_b.col(0);
  const Vector3 before = va.linear + va.angular.cross(rotation_a * patch.arm_a) - vb.linear -
                         vb.angular.cross(rotation_b * patch.arm_b);
  const Vector3 turning = va.angular - vb.angular;
  const double approach = -normal.dot(before);
  const double twist = normal.dot(turning);
  const double tilting = patch.radius * (turning - twist * normal).norm();
  if (duration_ * (approach + tilting) > hard * size) return false;
  kept_.push_back(patch);
  PatchShape& kept = kept_.back();
  kept.is_kept = true;
  const double slip =
      std::sqrt((before + approach * normal).squaredNorm() + patch.radius * patch.radius * twist * twist);
  const PairMaterial material(candidates_[a].collider->material, candidates_[b].collider->material);
  const double at_rest = duration_ * (fall_of(patch.a) - fall_of(patch.b)).norm();
  kept.friction = slip > at_rest ? material.dynamic_friction : material.static_friction;
  is_at_rest_[patch.a] = is_at_rest_[patch.b] = true;
  groups_.push_back({contacts_.size(),
                     contacts_.size(),
                     normal,
                     {patch.collider_a, patch.collider_b},
                     {-1, -1},
                     false,
                     static_cast<int>(kept_.size()) - 1,
                     patch.corners,
                     patch.arm_a,
                     patch.arm_b});
  return true;
}

/// Where the point goes, and the normal, as one or both of the colliders roll.
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

/// By the first collider of each, where it begins among those remembered, which are sorted.
void ContactFinder::list_remembered(const State& state) {
  begins_.assign(candidates_.size() + 1, 0);
  const auto count = static_cast<int>(candidates_.size());
  for (const ContactMemory& memory : state.contacts) {
    if (memory.collider_a >= 0 && memory.collider_a < count) ++begins_[memory.collider_a + 1];
  }
  for (std::size_t i = 1; i < begins_.size(); ++i) begins_[i] += begins_[i - 1];
  patch_begins_.assign(candidates_.size() + 1, 0);
  for (const PatchShape& patch : state.patches) ++patch_begins_[patch.collider_a];
  for (std::size_t i = 1; i < patch_begins_.size(); ++i) patch_begins_[i] += patch_begins_[i - 1];
  patches_of_.resize(state.patches.size());
  for (int i = 0; i < static_cast<int>(state.patches.size()); ++i) {
    patches_of_[--patch_begins_[state.patches[i].collider_a]] = i;
  }
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
void ContactFinder::remember(std::span<const ContactMemory> remembered, double overlap, double slip,
                             Contact& contact) const {
  if (remembered.empty()) return;
  const double same =
      same_place * std::min(candidates_[contact.collider_a].size, candidates_[contact.collider_b].size);
  double nearest = same * same;
  double nearest_force = remembered.size() > 1 ? same * same : std::numeric_limits<double>::infinity();
  double left_over = 0;
  for (const ContactMemory& memory : remembered) {
    left_over = std::max(left_over, memory.left_over);
    // What bears on a point of one body bears on it wherever the point slides on the other.
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

/// The same of two colliders' patch.
void ContactFinder::remember(const PatchShape& patch, const PatchMotion& motion, double overlap,
                             Contact& contact) const {
  const Vector3 displacement = displacement_at(patch, motion, contact.arm_b);
  contact.displacement_1 = contact.tangent_b1.dot(displacement);
  contact.displacement_2 = contact.tangent_b2.dot(displacement);
  contact.slid = patch.slid;
  const Vector3 force =
      patch.axes_in_b * Vector3(patch.force[0], patch.force[3], patch.force[4]) / patch.corners;
  contact.force = {contact.normal_b.dot(force), contact.tangent_b1.dot(force), contact.tangent_b2.dot(force)};
  contact.left_over = std::clamp(overlap, 0.0, std::max(0.0, patch.left_over - recovered(contact)));
}

}  // namespace substep
