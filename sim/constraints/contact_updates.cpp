// Updates contacts' rows between sub-steps: impacts, origins of friction's limits, biases.

#include <span>

#include "sim/constraints/contact_patch.h"
#include "sim/constraints/lanes.h"

namespace substep {
namespace {

/// Returns the speed after an impact that keeps e² of the energy, m/s. With x the gap, u the approach, and g
/// the acceleration towards the contact, steps of v' = v + g hs, x' = x − hs v' keep ½u² + ½ g hs u + g x in
/// flight. With e = 1 a ball so returns to the height from which it fell.
SUBSTEP_KERNEL Lanes rebound(const RestitutionRow& row, const Lanes& gap, const Lanes& approach, double hs) {
  const Lanes squared = row.coefficient * row.coefficient;
  const Lanes gain = row.acceleration * all(hs);
  const Lanes before = squared * (approach * approach + gain * approach);
  const Lanes height = all(2) * row.acceleration * larger(gap, all(0)) * (all(1) - squared);
  const Lanes inner = all(0.25) * gain * gain + before - height;
  return larger(root(larger(inner, all(0))) - all(0.5) * gain, all(0));
}

/// Returns a mask of the contacts whose impact was in the sub-step before. The impulse of an impact remains,
/// but the velocity after it is no longer required: in Newton's cradle other contacts pass it on, and
/// restoring it would add energy.
SUBSTEP_KERNEL auto had_impact(const RestitutionRow& row) {
  return row.impact * (row.coefficient + all(1) - row.closes) > all(0);
}

/// Moves the origin of a point's friction to its impulses by a mask, so that friction can turn with the slip.
template <typename Mask>
SUBSTEP_KERNEL void move_origin(const Mask& mask, const Lanes& normal, FrictionRows& rows) {
  for (int k = 0; k < 2; ++k) rows.origin[k] = choose(mask, rows.row[k].impulse, rows.origin[k]);
  rows.origin_normal = choose(mask, normal, rows.origin_normal);
}

/// Sets whether a contact has an impact in the sub-step that starts, and the normal velocity after it.
SUBSTEP_KERNEL void start_impact(NormalRow& normal, RestitutionRow& row, const Lanes& gap,
                                 const Lanes& approach, double hs) {
  const Lanes zero = all(0);
  const Lanes gain = row.acceleration * all(hs);
  normal.low = choose(had_impact(row), normal.row.impulse, normal.low);
  const auto meets = gap <= all(hs) * (approach + gain);
  const Lanes fast = choose(approach > row.resting_acceleration * all(hs), all(1), zero);
  row.impact = fast * choose(row.coefficient >= zero, all(1), zero);
  // Let bodies approach freely before they meet. With τ < 1 the position-level row would brake them.
  const Lanes let_through = all(-2) * (approach + gain);
  const Lanes stopped = -row.closes * larger(gap, zero) / all(hs);
  // Bodies that stay pressed together take back their overlap, as without restitution.
  const Lanes bounced = larger(rebound(row, gap, approach, hs), -gap / all(hs));
  const Lanes after = choose(row.coefficient > zero, bounced, stopped);
  row.right[0] = choose(meets, after, let_through);
}

/// Starts the impacts of a batch.
SUBSTEP_KERNEL void start_impacts(ContactBatches& contacts, const ContactBatch& x, double hs,
                                  const std::vector<Velocity>& v, const std::vector<Velocity>& offset,
                                  const std::vector<Velocity>* sum_v) {
  const Lanes zero = all(0);
  const PointRows rows = contacts.points_of(x);
  const BodyVelocities a = gather(v, x.a);
  const BodyVelocities b = gather(v, x.b);
  const BodyVelocities offset_a = gather(offset, x.a);
  const BodyVelocities offset_b = gather(offset, x.b);
  const BodyVelocities sum_a = gather(sum_v ? *sum_v : v, x.a);
  const BodyVelocities sum_b = gather(sum_v ? *sum_v : v, x.b);
  for (int i = 0; i < x.contacts; ++i) {
    NormalRow& normal = rows.normals[i];
    RestitutionRow& row = rows.restitutions[i];
    const ContactDirections& along = rows.directions[i];
    // Limit friction anew after an impact: the normal force of the impact is over.
    if (x.has_friction) move_origin(had_impact(row), normal.row.impulse, rows.frictions[i]);
    const Lanes approach = -row_velocity(along.normal, normal.row, a, b);
    const Lanes gap = row.gap + all(hs) * row_velocity(along.normal, normal.row, offset_a, offset_b);
    start_impact(normal, row, gap, approach, hs);
    contacts.has_impact = contacts.has_impact || any(row.impact > zero);
    contacts.bounces = contacts.bounces || any(row.impact * row.coefficient > zero);
    if (sum_v) row.right[0] += row_velocity(along.normal, normal.row, sum_a, sum_b);
    for (int k = 0; k < 2 && x.has_friction; ++k) {
      const ContactRow& slip = rows.frictions[i].row[k];
      row.right[1 + k] = sum_v ? row_velocity(along.tangent[k], slip, sum_a, sum_b) : zero;
    }
  }
}

/// Moves the origin of a sliding patch's friction to its impulses.
SUBSTEP_KERNEL void move_origin(Patch& patch, std::span<PatchCorner> corners) {
  const auto is_released = keeps_sliding(patch) > all(0);
  for (int k = 0; k < 3; ++k) patch.origin[k] = choose(is_released, patch.impulse[k], patch.origin[k]);
  patch.origin_normal = choose(is_released, larger(patch.normal_impulse[0], all(0)), patch.origin_normal);
  for (PatchCorner& corner : corners) {
    for (Lanes& friction : corner.friction) friction = choose(is_released, all(0), friction);
  }
}

}  // namespace

void start_substep(ContactBatches& contacts, double hs, const std::vector<Velocity>& v,
                   const std::vector<Velocity>& offset, const std::vector<Velocity>* sum_v) {
  run_wide([&]() __attribute__((always_inline)) {
    contacts.has_impact = contacts.bounces = false;
    for (std::size_t batch = 0; batch < contacts.batches.size(); ++batch) {
      const ContactBatch& x = contacts.batches[batch];
      const bool slides = contacts.slides[batch] != 0;
      if (x.patch >= 0) {
        if (!slides) continue;
        move_origin(contacts.patches[x.patch],
                    std::span(contacts.patch_corners).subspan(x.first_corner, x.corners));
        continue;
      }
      const PointRows rows = contacts.points_of(x);
      for (int i = 0; i < x.contacts && slides; ++i) {
        FrictionRows& friction = rows.frictions[i];
        move_origin(keeps_sliding(friction) > all(0), rows.normals[i].row.impulse, friction);
      }
      if (x.has_impacts) start_impacts(contacts, x, hs, v, offset, sum_v);
    }
  });
}

void box_biases(ContactBatches& contacts, const Stabilization& by) {
  const Lanes factor = all(by.tau / by.kappa);
  for (const ContactBatch& x : contacts.batches) {
    for_each_row(contacts, x, x.contacts,
                 [&](int, int, const LaneVectors&, ContactRow& row) { row.beta *= factor; });
  }
  for (Patch& patch : contacts.patches) {
    for (Lanes& beta : patch.normal_beta) beta *= factor;
    for (Lanes& beta : patch.beta) beta *= factor;
  }
}

void add_to_biases(ContactBatches& contacts, double factor, const std::vector<Velocity>& change) {
  run_wide([&]() __attribute__((always_inline)) {
    for (const ContactBatch& x : contacts.batches) {
      const BodyVelocities a = gather(change, x.a);
      const BodyVelocities b = gather(change, x.b);
      if (x.patch < 0) {
        for_each_row(
            contacts, x, x.contacts,
            [&](int, int, const LaneVectors& direction, ContactRow& row) __attribute__((always_inline)) {
              row.beta += all(factor) * row_velocity(direction, row, a, b);
            });
        continue;
      }
      Patch& patch = contacts.patches[x.patch];
      const RelativeMotion motion = relative_motion(patch, a, b);
      const LaneVectors along_normals = of_normals(motion);
      const LaneVectors slip = of_friction(motion);
      for (int k = 0; k < 3; ++k) {
        patch.normal_beta[k] += all(factor) * along_normals[k];
        patch.beta[k] += all(factor) * slip[k];
      }
    }
  });
}

void release_sliding(ContactBatches& contacts, double hs, const std::vector<Velocity>* sum_v,
                     const std::vector<Velocity>& offset) {
  run_wide([&]() __attribute__((always_inline)) {
    for (std::size_t batch = 0; batch < contacts.batches.size(); ++batch) {
      if (contacts.slides[batch] == 0) continue;
      const ContactBatch& x = contacts.batches[batch];
      const BodyVelocities a = gather(sum_v ? *sum_v : offset, x.a);
      const BodyVelocities b = gather(sum_v ? *sum_v : offset, x.b);
      const Lanes has_sum = all(sum_v ? 1 : 0);
      const BodyVelocities offset_a = gather(offset, x.a);
      const BodyVelocities offset_b = gather(offset, x.b);
      if (x.patch >= 0) {
        Patch& patch = contacts.patches[x.patch];
        const auto is_released = keeps_sliding(patch) > all(0);
        const LaneVectors given = of_friction(relative_motion(patch, a, b));
        const LaneVectors displacement = of_friction(relative_motion(patch, offset_a, offset_b));
        for (int k = 0; k < 3; ++k) {
          patch.reference[k] = choose(is_released, -(all(hs) * displacement[k]), patch.reference[k]);
          patch.beta[k] = choose(is_released, has_sum * given[k], patch.beta[k]);
        }
        continue;
      }
      const PointRows rows = contacts.points_of(x);
      for (int i = 0; i < x.contacts; ++i) {
        FrictionRows& friction = rows.frictions[i];
        const auto is_released = keeps_sliding(friction) > all(0);
        if (!any(is_released)) continue;
        for (int k = 0; k < 2; ++k) {
          const LaneVectors& tangent = rows.directions[i].tangent[k];
          ContactRow& row = friction.row[k];
          const Lanes displacement = all(hs) * row_velocity(tangent, row, offset_a, offset_b);
          friction.reference[k] = choose(is_released, -displacement, friction.reference[k]);
          row.beta = choose(is_released, has_sum * row_velocity(tangent, row, a, b), row.beta);
        }
      }
    }
  });
}

}  // namespace substep
