// Updates of contacts' rows between sub-steps: impacts, origins of friction's limits, biases.

#include <span>

#include "sim/constraints/contact_patch.h"
#include "sim/constraints/lanes.h"
#include "sim/math/four_wide.h"

namespace substep {
namespace {

/// Resets the displacement of a point that slides: from here on it counts from `offset`, the sum of
/// velocities.
[[gnu::always_inline]] inline void let_go(const ContactDirections& along, FrictionRows& rows, double hs,
                                          const Moving& offset_a, const Moving& offset_b) {
  const auto lets_go = keeps_sliding(rows) > all(0);
  for (int k = 0; k < 2; ++k) {
    const Lanes displacement = all(hs) * row_velocity(along.tangent[k], rows.row[k], offset_a, offset_b);
    rows.reference[k] = choose(lets_go, -displacement, rows.reference[k]);
  }
}

/// Resets the displacement of a patch that slides.
[[gnu::always_inline]] inline void let_go(Patch& patch, double hs, const Moving& offset_a,
                                          const Moving& offset_b) {
  const auto lets_go = keeps_sliding(patch) > all(0);
  const LaneVectors displacement = of_friction(relative_motion(patch, offset_a, offset_b));
  for (int k = 0; k < 3; ++k) {
    patch.reference[k] = choose(lets_go, -(all(hs) * displacement[k]), patch.reference[k]);
  }
}

/// Adds `share` of J̆ change to the biases of all rows.
[[gnu::always_inline]] inline void add_to_biases_lanes(ContactBatches& contacts, double share,
                                                       const std::vector<Velocity>& change) {
  for (const ContactBatch& x : contacts.batches) {
    const Moving a = gather(change, x.a);
    const Moving b = gather(change, x.b);
    if (x.patch >= 0) {
      Patch& patch = contacts.patches[x.patch];
      const RelativeMotion motion = relative_motion(patch, a, b);
      const LaneVectors along_normals = of_normals(motion);
      const LaneVectors slip = of_friction(motion);
      for (int k = 0; k < 3; ++k) {
        patch.normal_beta[k] += all(share) * along_normals[k];
        patch.beta[k] += all(share) * slip[k];
      }
      continue;
    }
    const ContactDirections* const directions = contacts.directions.data() + x.first_normal;
    for (int i = 0; i < x.contacts; ++i) {
      ContactRow& row = contacts.normals[x.first_normal + i].row;
      row.beta += all(share) * row_velocity(directions[i].normal, row, a, b);
    }
    for (int i = 0; i < x.frictions; ++i) {
      FrictionRows& rows = contacts.frictions[x.first_friction + i];
      const ContactDirections& along = directions[x.contact_of[i]];
      for (int k = 0; k < 2; ++k)
        rows.row[k].beta += all(share) * row_velocity(along.tangent[k], rows.row[k], a, b);
    }
  }
}

/// Lets friction that slides follow nothing: its bias is J̆ sv, or 0 where there is no sum of velocities.
[[gnu::always_inline]] inline void let_go_of_sliding_lanes(ContactBatches& contacts, double hs,
                                                           const std::vector<Velocity>* sum_v,
                                                           const std::vector<Velocity>& offset) {
  for (std::size_t batch = 0; batch < contacts.batches.size(); ++batch) {
    if (contacts.slides[batch] == 0) continue;
    const ContactBatch& x = contacts.batches[batch];
    const ContactDirections* const directions = contacts.directions.data() + x.first_normal;
    const Moving a = gather(sum_v ? *sum_v : offset, x.a);
    const Moving b = gather(sum_v ? *sum_v : offset, x.b);
    const Lanes share = all(sum_v ? 1 : 0);
    const Moving offset_a = gather(offset, x.a);
    const Moving offset_b = gather(offset, x.b);
    if (x.patch >= 0) {
      Patch& patch = contacts.patches[x.patch];
      const auto lets_go = keeps_sliding(patch) > all(0);
      const LaneVectors given = of_friction(relative_motion(patch, a, b));
      let_go(patch, hs, offset_a, offset_b);
      for (int k = 0; k < 3; ++k) patch.beta[k] = choose(lets_go, share * given[k], patch.beta[k]);
      continue;
    }
    for (int i = 0; i < x.frictions; ++i) {
      FrictionRows& rows = contacts.frictions[x.first_friction + i];
      const auto lets_go = keeps_sliding(rows) > all(0);
      if (!any(lets_go)) continue;
      const ContactDirections& along = directions[x.contact_of[i]];
      let_go(along, rows, hs, offset_a, offset_b);
      for (int k = 0; k < 2; ++k) {
        ContactRow& row = rows.row[k];
        row.beta = choose(lets_go, share * row_velocity(along.tangent[k], row, a, b), row.beta);
      }
    }
  }
}

/// Returns the speed after an impact that has e² of the energy before it, in the discrete motion: with x the
/// gap, u the approach, and g the acceleration towards the contact, steps of v' = v + g hs, x' = x − hs v'
/// keep ½u² + ½ g hs u + g x in flight. With e = 1 the ball so comes back to the height it fell from.
[[gnu::always_inline]] inline Lanes rebound(const RestitutionRow& row, const Lanes& gap,
                                            const Lanes& approach, double hs) {
  const Lanes squared = row.coefficient * row.coefficient;
  const Lanes gain = row.acceleration * all(hs);
  const Lanes before = squared * (approach * approach + gain * approach);
  const Lanes height = all(2) * row.acceleration * larger(gap, all(0)) * (all(1) - squared);
  const Lanes inner = all(0.25) * gain * gain + before - height;
  return larger(root(larger(inner, all(0))) - all(0.5) * gain, all(0));
}

/// Returns whether a contact had an impact in the sub-step before, whose impulse stays given. It is over with
/// its sub-step: to hold on to its velocity for the rest of the step, while others pass it on, feeds energy
/// into the cradle.
[[gnu::always_inline]] inline auto had_impact(const RestitutionRow& row) {
  return row.impact * (row.coefficient + all(1) - row.closes) > all(0);
}

/// Spends the friction of an impact: what presses no longer holds nothing.
[[gnu::always_inline]] inline void spend_friction(const RestitutionRow& row, const Lanes& normal,
                                                  FrictionRows& rows) {
  const auto is_over = had_impact(row);
  for (int k = 0; k < 2; ++k) rows.origin[k] = choose(is_over, rows.row[k].impulse, rows.origin[k]);
  rows.origin_normal = choose(is_over, normal, rows.origin_normal);
}

/// Sets whether a contact has an impact in the sub-step that starts, and the velocity that it leaves.
[[gnu::always_inline]] inline void start_impact(NormalRow& normal, RestitutionRow& row, const Lanes& gap,
                                                const Lanes& approach, double hs) {
  const Lanes zero = all(0);
  const Lanes gain = row.acceleration * all(hs);
  normal.low = choose(had_impact(row), normal.row.impulse, normal.low);
  const auto meets = gap <= all(hs) * (approach + gain);
  const Lanes fast = choose(approach > row.resting_acceleration * all(hs), all(1), zero);
  row.impact = fast * choose(row.coefficient >= zero, all(1), zero);
  // Before they meet nothing brakes them: with τ < 1 the position-level row would, and take from the impact.
  const Lanes let_through = all(-2) * (approach + gain);
  const Lanes stopped = -row.closes * larger(gap, zero) / all(hs);
  const Lanes after = choose(row.coefficient > zero, rebound(row, gap, approach, hs), stopped);
  row.velocity = choose(meets, after, let_through);
}

/// Starts the impacts of a batch.
[[gnu::always_inline]] inline void start_impacts(ContactBatches& contacts, const ContactBatch& x, double hs,
                                                 const std::vector<Velocity>& v,
                                                 const std::vector<Velocity>& offset,
                                                 const std::vector<Velocity>* sum_v) {
  const Lanes zero = all(0);
  NormalRow* const normals = contacts.normals.data() + x.first_normal;
  RestitutionRow* const restitutions = contacts.restitutions.data() + x.first_restitution;
  const ContactDirections* const directions = contacts.directions.data() + x.first_normal;
  FrictionRows* const frictions = contacts.frictions.data() + x.first_friction;
  for (int i = 0; i < x.frictions; ++i) {
    const int contact = x.contact_of[i];
    spend_friction(restitutions[contact], normals[contact].row.impulse, frictions[i]);
  }
  const Moving a = gather(v, x.a);
  const Moving b = gather(v, x.b);
  const Moving offset_a = gather(offset, x.a);
  const Moving offset_b = gather(offset, x.b);
  const Moving sum_a = gather(sum_v ? *sum_v : v, x.a);
  const Moving sum_b = gather(sum_v ? *sum_v : v, x.b);
  for (int i = 0; i < x.contacts; ++i) {
    NormalRow& normal = normals[i];
    RestitutionRow& row = restitutions[i];
    const LaneVectors& along = directions[i].normal;
    const Lanes approach = -row_velocity(along, normal.row, a, b);
    const Lanes gap = row.gap + all(hs) * row_velocity(along, normal.row, offset_a, offset_b);
    start_impact(normal, row, gap, approach, hs);
    contacts.has_impact = contacts.has_impact || any(row.impact > zero);
    contacts.bounces = contacts.bounces || any(row.impact * row.coefficient > zero);
    row.right = row.velocity;
    if (sum_v) row.right += row_velocity(along, normal.row, sum_a, sum_b);
  }
  for (int i = 0; i < x.frictions; ++i) {
    const ContactDirections& along = directions[x.contact_of[i]];
    RestitutionRow& row = restitutions[x.contact_of[i]];
    for (int k = 0; k < 2; ++k) {
      row.right_of_slip[k] = sum_v ? row_velocity(along.tangent[k], frictions[i].row[k], sum_a, sum_b) : zero;
    }
  }
}

/// Spends what a sliding point has been displaced by, so that its friction can turn with the slip.
[[gnu::always_inline]] inline void start_slide(const Lanes& normal, FrictionRows& rows) {
  const auto lets_go = keeps_sliding(rows) > all(0);
  for (int k = 0; k < 2; ++k) rows.origin[k] = choose(lets_go, rows.row[k].impulse, rows.origin[k]);
  rows.origin_normal = choose(lets_go, normal, rows.origin_normal);
}

/// Spends what a sliding patch has been displaced by.
[[gnu::always_inline]] inline void start_slide(Patch& patch, std::span<PatchCorner> corners) {
  const auto lets_go = keeps_sliding(patch) > all(0);
  for (int k = 0; k < 3; ++k) patch.origin[k] = choose(lets_go, patch.impulse[k], patch.origin[k]);
  patch.origin_normal = choose(lets_go, larger(patch.normal_impulse[0], all(0)), patch.origin_normal);
  for (PatchCorner& corner : corners) {
    for (Lanes& friction : corner.friction) friction = choose(lets_go, all(0), friction);
  }
}

[[gnu::always_inline]] inline void start_substep_lanes(ContactBatches& contacts, double hs,
                                                       const std::vector<Velocity>& v,
                                                       const std::vector<Velocity>& offset,
                                                       const std::vector<Velocity>* sum_v) {
  contacts.has_impact = contacts.bounces = false;
  for (std::size_t batch = 0; batch < contacts.batches.size(); ++batch) {
    const ContactBatch& x = contacts.batches[batch];
    if (contacts.slides[batch] != 0 && x.patch >= 0) {
      start_slide(contacts.patches[x.patch],
                  std::span(contacts.patch_corners).subspan(x.first_corner, x.corners));
    } else if (contacts.slides[batch] != 0) {
      for (int i = 0; i < x.frictions; ++i) {
        start_slide(contacts.normals[x.first_normal + x.contact_of[i]].row.impulse,
                    contacts.frictions[x.first_friction + i]);
      }
    }
    if (x.patch < 0 && x.first_restitution >= 0) start_impacts(contacts, x, hs, v, offset, sum_v);
  }
}

}  // namespace

void start_substep(ContactBatches& contacts, double hs, const std::vector<Velocity>& v,
                   const std::vector<Velocity>& offset, const std::vector<Velocity>* sum_v) {
  run_wide([&]() __attribute__((always_inline)) { start_substep_lanes(contacts, hs, v, offset, sum_v); });
}

void box_biases(ContactBatches& contacts, const Stabilization& by) {
  const Lanes factor = all(by.tau / by.kappa);
  for (NormalRow& normal : contacts.normals) normal.row.beta *= factor;
  for (FrictionRows& rows : contacts.frictions) {
    for (ContactRow& row : rows.row) row.beta *= factor;
  }
  for (Patch& patch : contacts.patches) {
    for (int k = 0; k < 3; ++k) {
      patch.normal_beta[k] *= factor;
      patch.beta[k] *= factor;
    }
  }
}

void add_to_biases(ContactBatches& contacts, double share, const std::vector<Velocity>& change) {
  run_wide([&]() __attribute__((always_inline)) { add_to_biases_lanes(contacts, share, change); });
}

void let_go_of_sliding(ContactBatches& contacts, double hs, const std::vector<Velocity>* sum_v,
                       const std::vector<Velocity>& offset) {
  run_wide([&]() __attribute__((always_inline)) { let_go_of_sliding_lanes(contacts, hs, sum_v, offset); });
}

}  // namespace substep
