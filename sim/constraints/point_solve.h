#pragma once
/// The kernel of manifolds that are solved point by point: the normals as one block, then the friction of
/// each point. Part of contact_solve.cpp.

#include <algorithm>

#include "sim/constraints/contact_visit.h"

namespace substep {

/// Sweeps over the normals of a manifold, in the space of their impulses, that solve their block.
inline constexpr int normal_sweeps = 8;
/// v ← v + M⁻¹J_xᵀ impulse.
[[gnu::always_inline]] inline void apply(const Visit& at, const LaneVectors& direction, const ContactRow& row,
                                         const Lanes& impulse, Moving& a, Moving& b) {
  const ContactBatch& x = at.x;
  const Lanes impulse_a = x.inverse_mass_a * impulse;
  const Lanes impulse_b = x.inverse_mass_b * impulse;
  for (int k = 0; k < 3; ++k) {
    a.linear[k] += direction[k] * impulse_a;
    b.linear[k] -= direction[k] * impulse_b;
  }
  for (int k = 0; k < 3; ++k) {
    a.angular[k] += x.inverse_inertia_a[k] * row.angular_a[k] * impulse;
    b.angular[k] += x.inverse_inertia_b[k] * row.angular_b[k] * impulse;
  }
}

[[gnu::always_inline]] inline const LaneVectors& normal_of(const Visit& at, int i) {
  return at.directions[i].normal;
}

/// Returns the velocity that a normal lacks in a row's equation. An impact is over in its sub-step: κ < 1
/// would leave a part of it to later ones, of which the step may have none.
template <Kind kind>
[[gnu::always_inline]] inline Lanes missing_of_normal(const Visit& at, int i, const Lanes& velocity) {
  const Lanes missing = times<kind>(at.how.tau, at.normals[i].row.beta) - times<kind>(at.how.kappa, velocity);
  if (!at.restitutions) return missing;
  const RestitutionRow& restitution = at.restitutions[i];
  const Lanes of_impact = (restitution.right - velocity) / all(at.how.scale);
  return choose(restitution.impact > all(0), of_impact, missing);
}

/// Returns the velocity that the i-th slip lacks. In an impact it is stopped at once, as its normal is: κ < 1
/// would leave a part of it to later sub-steps, in which nothing presses.
template <Kind kind>
[[gnu::always_inline]] inline Lanes missing_of_slip(const Visit& at, int i, int k, const Lanes& velocity) {
  const Lanes missing =
      times<kind>(at.how.tau, at.frictions[i].row[k].beta) - times<kind>(at.how.kappa, velocity);
  if (!at.restitutions) return missing;
  const RestitutionRow& restitution = at.restitutions[at.x.contact_of[i]];
  return choose(restitution.impact > all(0), (restitution.right_of_slip[k] - velocity) / all(at.how.scale),
                missing);
}

/// The manifold's normals as one block: their LCP, by Gauss–Seidel in the space of their impulses, from the
/// `wanted` changes without the others. `known` is their number where the compiler is to know it, so that a
/// manifold stays in registers; else 0.
///
/// A sweep waits for one impulse after the other, so each takes the one before it last: that is a product, a
/// difference and a comparison to wait for.
template <int known>
[[gnu::always_inline]] inline void solve_block(const Visit& at, int count, const Lanes* wanted,
                                               const Lanes* least, Lanes* change) {
  if constexpr (known) count = known;
  for (int i = 0; i < count; ++i) {
    Lanes one = wanted[i];
    for (int j = 0; j < i; ++j) one -= at.coupling[i * count + j].share * change[j];
    change[i] = larger(one, least[i]);
  }
  const int sweeps = count == 1 ? 1 : normal_sweeps;
  for (int sweep = 1; sweep < sweeps; ++sweep) {
    for (int i = 0; i < count; ++i) {
      Lanes one = wanted[i];
      for (int j = i + 1; j < count; ++j) one -= at.coupling[i * count + j].share * change[j];
      for (int j = 0; j < i; ++j) one -= at.coupling[i * count + j].share * change[j];
      change[i] = larger(one, least[i]);
    }
  }
}

/// The i-th normal's impulse, changed: what it gave more.
template <Kind kind>
[[gnu::always_inline]] inline Lanes take(const Visit& at, int i, int count, const Lanes& change,
                                         Lanes& most) {
  NormalRow& normal = at.normals[i];
  const Lanes before = normal.row.impulse;
  const Lanes total = larger(before + times<kind>(at.how.omega, change), normal.low);
  const Lanes given = total - before;
  normal.row.impulse = total;
  if (kind.any) {
    most = larger(most, choose(given < all(0), -given, given) * at.coupling[i * count + i].share);
  }
  return all(at.how.scale) * given;
}

/// The block of normals, from the velocities and to them.
template <Kind kind, int known>
[[gnu::always_inline]] inline void solve_normal_block(const Visit& at, Moving& a, Moving& b, Lanes& most) {
  const int count = known ? known : at.x.contacts;
  constexpr int room = known ? known : most_in_manifold;
  Lanes wanted[room];  // changes of impulses: without the others, at least, and so far
  Lanes least[room];
  Lanes change[room];
  for (int i = 0; i < count; ++i) {
    const NormalRow& normal = at.normals[i];
    const Lanes velocity = row_velocity(normal_of(at, i), normal.row, a, b);
    wanted[i] = missing_of_normal<kind>(at, i, velocity) * normal.effective_mass;
    least[i] = normal.low - normal.row.impulse;
  }
  solve_block<known>(at, count, wanted, least, change);
  for (int i = 0; i < count; ++i) {
    const Lanes given = take<kind>(at, i, count, change[i], most);
    apply(at, normal_of(at, i), at.normals[i].row, given, a, b);
  }
}

template <Kind kind>
[[gnu::always_inline]] inline void solve_normals(const Visit& at, Moving& a, Moving& b, Lanes& most) {
  switch (at.x.contacts) {
    case 1:
      return solve_normal_block<kind, 1>(at, a, b, most);
    case 2:
      return solve_normal_block<kind, 2>(at, a, b, most);
    case 4:
      return solve_normal_block<kind, 4>(at, a, b, most);
    default:
      return solve_normal_block<kind, 0>(at, a, b, most);
  }
}

/// Two components, along the tangents.
struct Tangential {
  Lanes first;
  Lanes second;
};

/// Γ⁻¹ of a point's two rows, times `right`.
[[gnu::always_inline]] inline Tangential solve_two(const FrictionRows& rows, const Tangential& right) {
  return {(rows.gamma[2] * right.first - rows.gamma[1] * right.second) * rows.inverse_determinant,
          (rows.gamma[0] * right.second - rows.gamma[1] * right.first) * rows.inverse_determinant};
}

/// Coulomb's law of a point that slides: the projection of `before` + (what velocity is missing)/γ on the
/// disc's edge, with γ the larger eigenvalue of Γ. Where it stays, the velocity that is left points against
/// the impulse, so that friction is the same in all directions.
[[gnu::always_inline]] inline Tangential slide(const FrictionRows& rows, const Lanes& limit,
                                               const Tangential& before, const Tangential& missing) {
  const Lanes zero = all(0);
  const Tangential target{before.first + missing.first * rows.inverse_largest,
                          before.second + missing.second * rows.inverse_largest};
  const Lanes length = root(target.first * target.first + target.second * target.second);
  const Lanes factor = choose(length > zero, limit / length, zero);
  return {target.first * factor, target.second * factor};
}

/// Reduces the origin of friction where the normal takes back some of what it had given when the point slid,
/// in proportion.
[[gnu::always_inline]] inline void give_back(FrictionRows& rows, const Lanes& normal) {
  const auto less = normal < rows.origin_normal;
  if (!any(less)) return;
  const Lanes part = choose(less, normal / rows.origin_normal, all(1));
  rows.origin[0] *= part;
  rows.origin[1] *= part;
  rows.origin_normal *= part;
}

/// Solves a point's friction: two rows as one block, within the disc that its normal's impulse gives. The
/// i-th point's; returns what changes of its impulses.
template <Kind kind>
[[gnu::always_inline]] inline Tangential solve_disc(const Visit& at, int i, const Tangential& missing,
                                                    Lanes& most, Lanes& any_slides) {
  const Lanes zero = all(0);
  FrictionRows& rows = at.frictions[i];
  const Lanes normal = at.normals[at.x.contact_of[i]].row.impulse;
  give_back(rows, normal);
  const Tangential free = solve_two(rows, missing);
  const Tangential before{rows.row[0].impulse - rows.origin[0], rows.row[1].impulse - rows.origin[1]};
  Tangential change{times<kind>(at.how.omega, free.first), times<kind>(at.how.omega, free.second)};
  const Tangential after{before.first + change.first, before.second + change.second};
  const Lanes limit = rows.coefficient * (normal - rows.origin_normal);
  const auto slides = after.first * after.first + after.second * after.second >= limit * limit;
  rows.slides = choose(slides, all(1), zero);
  if (any(slides)) {
    const Tangential sliding =
        slide(rows, limit, before,
              {times<kind>(at.how.omega, missing.first), times<kind>(at.how.omega, missing.second)});
    change.first = choose(slides, sliding.first - before.first, change.first);
    change.second = choose(slides, sliding.second - before.second, change.second);
  }
  any_slides += keeps_sliding(rows);
  rows.row[0].impulse += change.first;
  rows.row[1].impulse += change.second;
  if (kind.any) {
    most = larger(most, choose(change.first < zero, -change.first, change.first) * rows.gamma[0]);
    most = larger(most, choose(change.second < zero, -change.second, change.second) * rows.gamma[2]);
  }
  return {all(at.how.scale) * change.first, all(at.how.scale) * change.second};
}

/// The i-th point's friction, from the velocities and to them.
template <Kind kind>
[[gnu::always_inline]] inline void solve_friction(const Visit& at, int i, Moving& a, Moving& b, Lanes& most,
                                                  Lanes& any_slides) {
  FrictionRows& rows = at.frictions[i];
  const ContactDirections& along = at.directions[at.x.contact_of[i]];
  const Tangential missing{
      missing_of_slip<kind>(at, i, 0, row_velocity(along.tangent[0], rows.row[0], a, b)),
      missing_of_slip<kind>(at, i, 1, row_velocity(along.tangent[1], rows.row[1], a, b))};
  const Tangential given = solve_disc<kind>(at, i, missing, most, any_slides);
  apply(at, along.tangent[0], rows.row[0], given.first, a, b);
  apply(at, along.tangent[1], rows.row[1], given.second, a, b);
}

/// Returns whether any point goes on sliding.
template <Kind kind>
[[gnu::always_inline]] inline bool solve_lanes(const Visit& at, std::vector<Velocity>& v, double* moved) {
  Lanes most = all(0);
  Lanes any_slides = all(0);
  Moving a = gather(v, at.x.a);
  Moving b = gather(v, at.x.b);
  solve_normals<kind>(at, a, b, most);
  for (int i = 0; i < at.x.frictions; ++i) solve_friction<kind>(at, i, a, b, most, any_slides);
  scatter(a, at.x.a, at.x.manifolds, v);
  scatter(b, at.x.b, at.x.manifolds, v);
  if (kind.any && moved) {
    for (int lane = 0; lane < lanes; ++lane) *moved = std::max(*moved, most[lane]);
  }
  return any(any_slides > all(0));
}

}  // namespace substep
