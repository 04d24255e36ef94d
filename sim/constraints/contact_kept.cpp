// Patches that are kept from step to step, and the memory of points.

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/constraints/contact_finder.h"
#include "sim/constraints/contact_thresholds.h"

namespace substep {
namespace {

/// Motion of the bodies below which a patch is kept, relative to the smaller shape, and rad.
constexpr double barely_moved = 1e-3;

}  // namespace

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
  const Matrix3& rotation_b = rotations_[patch.b];
  const Coordinates& qa = state.q[patch.a];
  const Coordinates& qb = state.q[patch.b];
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
  const Velocity& va = state.v[patch.a];
  const Velocity& vb = state.v[patch.b];
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

/// Finds where each collider's points and patches begin among those remembered, which are sorted by it.
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

/// Sets the memory of the nearest of these colliders' points, if it is the same point.
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
    // A force on a point of one body stays wherever the point slides on the other.
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

/// Sets the memory from two colliders' patch.
void ContactFinder::remember(const PatchShape& patch, const Vector3& slip, double overlap,
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
