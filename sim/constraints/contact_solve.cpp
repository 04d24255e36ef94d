// The kernels of a sweep: a batch's normals as one block, then the friction of each point.

#include <algorithm>

#include "sim/constraints/four_wide.h"
#include "sim/constraints/lanes.h"

namespace substep {
namespace {

/// Sweeps over the normals of a manifold, in the space of their impulses, that solve their block.
constexpr int normal_sweeps = 8;

/// v ← v + M⁻¹J_xᵀ impulse.
[[gnu::always_inline]] inline void apply(const ContactRow& row, const ContactBatch& x, const Lanes& impulse,
                                         Moving& a, Moving& b) {
  const Lanes impulse_a = x.inverse_mass_a * impulse;
  const Lanes impulse_b = x.inverse_mass_b * impulse;
  for (int k = 0; k < 3; ++k) {
    a.linear[k] += row.linear[k] * impulse_a;
    a.angular[k] += row.response_a[k] * impulse;
    b.linear[k] -= row.linear[k] * impulse_b;
    b.angular[k] += row.response_b[k] * impulse;
  }
}

/// What a kernel works on: a batch, its rows, and how they are solved.
struct Visit {
  const ContactBatch& x;
  NormalRow* normals;
  FrictionRows* frictions;
  const RestitutionRow* restitutions;  ///< null: none bounces
  const Coupling* coupling;
  const RowSolve& how;
  const ContactReading& reading;
};

/// What a normal's velocity lacks, in the equation of a row. An impact is over in its sub-step: κ < 1 would
/// leave a part of it to later ones, of which the step may have none.
[[gnu::always_inline]] inline Lanes missing_of_normal(const Visit& at, int i, const Moving& a,
                                                      const Moving& b) {
  const ContactRow& row = at.normals[i].row;
  const Lanes velocity = row_velocity(row, a, b);
  const Lanes missing = all(at.how.tau) * row.beta - all(at.how.kappa) * velocity;
  if (!at.restitutions) return missing;
  const RestitutionRow& restitution = at.restitutions[i];
  const Lanes of_impact = at.reading.velocity_level_apart
                              ? (restitution.right - velocity) / all(at.how.scale)
                              : all(at.how.tau) * restitution.right - all(at.how.kappa) * velocity;
  return choose(restitution.impact > all(0), of_impact, missing);
}

/// The manifold's normals as one block: their LCP, by Gauss–Seidel in the space of their impulses; then what
/// changed goes to the velocities. `known` is their number where the compiler is to know it, so that a
/// manifold stays in registers; else 0.
template <int known>
[[gnu::always_inline]] inline void solve_normal_block(const Visit& at, Moving& a, Moving& b, Lanes& most,
                                                      bool measured) {
  const int count = known ? known : at.x.contacts;
  Lanes missing[known ? known : most_in_manifold];
  Lanes lambda[known ? known : most_in_manifold];
  for (int i = 0; i < count; ++i) {
    missing[i] = missing_of_normal(at, i, a, b);
    lambda[i] = at.normals[i].row.impulse;
  }
  const int sweeps = count == 1 ? 1 : normal_sweeps;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (int i = 0; i < count; ++i) {
      const NormalRow& normal = at.normals[i];
      const Lanes total = larger(lambda[i] + missing[i] * normal.effective_mass, normal.low);
      const Lanes change = total - lambda[i];
      lambda[i] = total;
      for (int j = 0; j < count; ++j) missing[j] -= at.coupling[i * count + j].gamma * change;
    }
  }
  for (int i = 0; i < count; ++i) {
    NormalRow& normal = at.normals[i];
    const Lanes before = normal.row.impulse;
    const Lanes total = larger(before + all(at.how.omega) * (lambda[i] - before), normal.low);
    const Lanes change = total - before;
    normal.row.impulse = total;
    apply(normal.row, at.x, all(at.how.scale) * change, a, b);
    if (measured) {
      most = larger(most, choose(change < all(0), -change, change) * at.coupling[i * count + i].gamma);
    }
  }
}

[[gnu::always_inline]] inline void solve_normals(const Visit& at, Moving& a, Moving& b, Lanes& most,
                                                 bool measured) {
  switch (at.x.contacts) {
    case 1:
      return solve_normal_block<1>(at, a, b, most, measured);
    case 2:
      return solve_normal_block<2>(at, a, b, most, measured);
    case 4:
      return solve_normal_block<4>(at, a, b, most, measured);
    default:
      return solve_normal_block<0>(at, a, b, most, measured);
  }
}

/// Ablation: the normals one after the other, each with what the one before left.
[[gnu::always_inline]] inline void solve_normals_in_turn(const Visit& at, Moving& a, Moving& b) {
  for (int i = 0; i < at.x.contacts; ++i) {
    NormalRow& normal = at.normals[i];
    const Lanes missing = missing_of_normal(at, i, a, b);
    const Lanes total =
        larger(normal.row.impulse + all(at.how.omega) * missing * normal.effective_mass, normal.low);
    const Lanes change = total - normal.row.impulse;
    normal.row.impulse = total;
    apply(normal.row, at.x, all(at.how.scale) * change, a, b);
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

/// Where the normal takes back what it had given when the point slid, friction gives back in proportion.
[[gnu::always_inline]] inline void give_back(FrictionRows& rows, const Lanes& normal) {
  const auto less = normal < rows.origin_normal;
  if (!any(less)) return;
  const Lanes part = choose(less, normal / rows.origin_normal, all(1));
  rows.origin[0] *= part;
  rows.origin[1] *= part;
  rows.origin_normal *= part;
}

/// A point's friction: two rows as one block, within the disc that its normal's impulse gives.
template <bool ablated>
[[gnu::always_inline]] inline void solve_friction(const Visit& at, FrictionRows& rows, Moving& a, Moving& b,
                                                  Lanes& most, bool measured) {
  const Lanes zero = all(0);
  const Lanes omega = all(at.how.omega);
  const Lanes normal = at.normals[rows.normal].row.impulse;
  give_back(rows, normal);
  const Tangential missing{
      all(at.how.tau) * rows.row[0].beta - all(at.how.kappa) * row_velocity(rows.row[0], a, b),
      all(at.how.tau) * rows.row[1].beta - all(at.how.kappa) * row_velocity(rows.row[1], a, b)};
  const Tangential free = solve_two(rows, missing);
  const Tangential before{rows.row[0].impulse - rows.origin[0], rows.row[1].impulse - rows.origin[1]};
  Tangential after{before.first + omega * free.first, before.second + omega * free.second};
  const Lanes limit = rows.coefficient * (normal - rows.origin_normal);
  const auto slides = after.first * after.first + after.second * after.second >= limit * limit;
  rows.slides = choose(slides, all(1), zero);
  rows.keeps_sliding = rows.slides * rows.slid;
  if (any(slides)) {
    const Tangential sliding = slide(rows, limit, before, {omega * missing.first, omega * missing.second});
    after.first = choose(slides, sliding.first, after.first);
    after.second = choose(slides, sliding.second, after.second);
  }
  if constexpr (ablated) {
    if (!at.reading.friction_memory) rows.keeps_sliding = rows.slides = all(1);
  }
  const Lanes change[2] = {after.first - before.first, after.second - before.second};
  for (int k = 0; k < 2; ++k) {
    rows.row[k].impulse += change[k];
    apply(rows.row[k], at.x, all(at.how.scale) * change[k], a, b);
    if (measured) most = larger(most, choose(change[k] < zero, -change[k], change[k]) * rows.gamma[2 * k]);
  }
}

/// Ablation: each of a point's two rows by itself, within ±μ λ_n: a square.
[[gnu::always_inline]] inline void solve_friction_in_turn(const Visit& at, FrictionRows& rows, Moving& a,
                                                          Moving& b) {
  const Lanes limit =
      rows.coefficient * larger(at.normals[rows.normal].row.impulse - rows.origin_normal, all(0));
  rows.slides = all(at.reading.friction_memory ? 0 : 1);
  for (int k = 0; k < 2; ++k) {
    ContactRow& row = rows.row[k];
    const Lanes missing = all(at.how.tau) * row.beta - all(at.how.kappa) * row_velocity(row, a, b);
    const Lanes gamma = rows.gamma[2 * k];
    const Lanes free =
        row.impulse - rows.origin[k] + choose(gamma > all(0), all(at.how.omega) * missing / gamma, all(0));
    const auto over = free >= limit;
    const auto under = free <= -limit;
    const Lanes total = rows.origin[k] + choose(over, limit, choose(under, -limit, free));
    rows.slides = choose(over || under, all(1), rows.slides);
    rows.keeps_sliding = rows.slides * larger(rows.slid, all(at.reading.friction_memory ? 0 : 1));
    const Lanes change = total - row.impulse;
    row.impulse = total;
    apply(row, at.x, all(at.how.scale) * change, a, b);
  }
}

template <bool measured, bool ablated>
[[gnu::always_inline]] inline void solve_lanes(const Visit& at, std::vector<Velocity>& v, double* moved) {
  Lanes most = all(0);
  Moving a = gather(v, at.x.a);
  Moving b = gather(v, at.x.b);
  if (ablated && !at.reading.manifold_blocks) {
    solve_normals_in_turn(at, a, b);
  } else {
    solve_normals(at, a, b, most, measured);
  }
  for (int i = 0; i < at.x.frictions; ++i) {
    if (ablated && !at.reading.isotropic_friction) {
      solve_friction_in_turn(at, at.frictions[i], a, b);
    } else {
      solve_friction<ablated>(at, at.frictions[i], a, b, most, measured);
    }
  }
  scatter(a, at.x.a, at.x.manifolds, v);
  scatter(b, at.x.b, at.x.manifolds, v);
  if constexpr (measured) {
    for (int lane = 0; lane < lanes; ++lane) *moved = std::max(*moved, most[lane]);
  }
}

[[gnu::always_inline]] inline void solve_any(const Visit& at, std::vector<Velocity>& v, double* moved) {
  const ContactReading& reading = at.reading;
  if (!reading.isotropic_friction || !reading.manifold_blocks || !reading.friction_memory) {
    solve_lanes<false, true>(at, v, nullptr);
  } else if (moved) {
    solve_lanes<true, false>(at, v, moved);
  } else {
    solve_lanes<false, false>(at, v, nullptr);
  }
}

using Solve = void(const Visit&, std::vector<Velocity>&, double*);
void solve_two_wide(const Visit& at, std::vector<Velocity>& v, double* moved) {
  solve_any(at, v, moved);
}
[[gnu::target("avx2")]] void solve_four_wide(const Visit& at, std::vector<Velocity>& v, double* moved) {
  solve_any(at, v, moved);
}

}  // namespace

void solve_and_apply(ContactBatches& contacts, const ContactBatch& x, const RowSolve& how,
                     std::vector<Velocity>& v, double* moved) {
  static Solve* const solve = is_four_wide() ? solve_four_wide : solve_two_wide;
  solve({x, contacts.normals.data() + x.first_normal, contacts.frictions.data() + x.first_friction,
         x.first_restitution < 0 ? nullptr : contacts.restitutions.data() + x.first_restitution,
         contacts.couplings.data() + x.first_coupling, how, contacts.reading},
        v, moved);
}

}  // namespace substep
