// Solves a batch in a sweep. The kernel of manifolds that are solved by points is here: the normals as one
// block, then the friction of each point. Patches are in patch_solve.h.

#include "sim/constraints/patch_solve.h"

namespace substep {
namespace {

/// Sweeps over the normals of a manifold, in the space of their impulses, that solve their block.
constexpr int normal_sweeps = 8;

/// Applies v ← v + M⁻¹J_xᵀ impulse.
SUBSTEP_KERNEL void apply(const KernelData& at, const LaneVectors& direction, const ContactRow& row,
                          const Lanes& impulse, BodyVelocities& a, BodyVelocities& b) {
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

/// Returns the target velocity of a point's row less `velocity`: of the normal, k = 0, or a tangent. An
/// impact is solved at once in its sub-step: κ < 1 would leave a fraction of the impact to later sub-steps,
/// of which the step may have none.
template <KernelKind kind>
SUBSTEP_KERNEL Lanes missing(const KernelData& at, int i, int k, const ContactRow& row,
                             const Lanes& velocity) {
  const Lanes missing = times<kind>(at.how.tau, row.beta) - times<kind>(at.how.kappa, velocity);
  if (!at.rows.restitutions) return missing;
  const RestitutionRow& restitution = at.rows.restitutions[i];
  return choose(restitution.impact > all(0), (restitution.right[k] - velocity) / all(at.how.scale), missing);
}

/// Solves a manifold's normals as one block: their LCP, by Gauss–Seidel in the space of their impulses, from
/// the change that each alone would make. `known`: the number of normals where it is a compile-time constant,
/// so that a manifold stays in registers; else 0.
///
/// A sweep waits for one impulse after the other. Each row therefore subtracts the impulse just before it
/// last, so that only a product, a difference and a comparison wait for it.
template <int known>
SUBSTEP_KERNEL void solve_block(const KernelData& at, int count, const Lanes* wanted, const Lanes* least,
                                Lanes* change) {
  if constexpr (known) count = known;
  for (int i = 0; i < count; ++i) {
    Lanes one = wanted[i];
    for (int j = 0; j < i; ++j) one -= at.rows.couplings[i * count + j].value * change[j];
    change[i] = larger(one, least[i]);
  }
  const int sweeps = count == 1 ? 1 : normal_sweeps;
  for (int sweep = 1; sweep < sweeps; ++sweep) {
    for (int i = 0; i < count; ++i) {
      Lanes one = wanted[i];
      for (int j = i + 1; j < count; ++j) one -= at.rows.couplings[i * count + j].value * change[j];
      for (int j = 0; j < i; ++j) one -= at.rows.couplings[i * count + j].value * change[j];
      change[i] = larger(one, least[i]);
    }
  }
}

/// Changes the i-th normal's impulse within the limit. Returns the change times the scale.
template <KernelKind kind>
SUBSTEP_KERNEL Lanes take(const KernelData& at, int i, int count, const Lanes& change, Lanes& most) {
  NormalRow& normal = at.rows.normals[i];
  const Lanes before = normal.row.impulse;
  const Lanes total = larger(before + times<kind>(at.how.omega, change), normal.low);
  const Lanes given = total - before;
  normal.row.impulse = total;
  if (kind == KernelKind::general) {
    most = larger(most, magnitude(given) * at.rows.couplings[i * count + i].value);
  }
  return all(at.how.scale) * given;
}

/// Solves the block of normals from the velocities, and applies its impulses to them.
template <KernelKind kind, int known>
SUBSTEP_KERNEL void solve_normal_block(const KernelData& at, BodyVelocities& a, BodyVelocities& b,
                                       Lanes& most) {
  const int count = known ? known : at.x.contacts;
  constexpr int room = known ? known : most_in_manifold;
  Lanes wanted[room];  // changes of the impulses: of each alone, the least allowed, and the solution
  Lanes least[room];
  Lanes change[room];
  for (int i = 0; i < count; ++i) {
    const NormalRow& normal = at.rows.normals[i];
    const Lanes velocity = row_velocity(at.rows.directions[i].normal, normal.row, a, b);
    wanted[i] = missing<kind>(at, i, 0, normal.row, velocity) * normal.effective_mass;
    least[i] = normal.low - normal.row.impulse;
  }
  solve_block<known>(at, count, wanted, least, change);
  for (int i = 0; i < count; ++i) {
    const Lanes given = take<kind>(at, i, count, change[i], most);
    apply(at, at.rows.directions[i].normal, at.rows.normals[i].row, given, a, b);
  }
}

template <KernelKind kind>
SUBSTEP_KERNEL void solve_normals(const KernelData& at, BodyVelocities& a, BodyVelocities& b, Lanes& most) {
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

/// Returns Γ⁻¹ of a point's two rows times `right`.
SUBSTEP_KERNEL Tangential solve_two(const FrictionRows& rows, const Tangential& right) {
  return {(rows.gamma[2] * right.first - rows.gamma[1] * right.second) * rows.inverse_determinant,
          (rows.gamma[0] * right.second - rows.gamma[1] * right.first) * rows.inverse_determinant};
}

/// Returns the friction of a point that slides, by Coulomb's law: the projection of `before` + `missing`/γ on
/// the disc's edge, with γ the larger eigenvalue of Γ. At its fixed point the slip is opposite to the
/// impulse, so that friction is the same in all directions.
SUBSTEP_KERNEL Tangential slide(const FrictionRows& rows, const Lanes& limit, const Tangential& before,
                                const Tangential& missing) {
  const Lanes zero = all(0);
  const Tangential target{before.first + missing.first * rows.inverse_largest,
                          before.second + missing.second * rows.inverse_largest};
  const Lanes length = root(target.first * target.first + target.second * target.second);
  const Lanes factor = choose(length > zero, limit / length, zero);
  return {target.first * factor, target.second * factor};
}

/// Solves the i-th point's friction, two rows as one block within the disc of its normal's impulse. Returns
/// the change of its impulses times the scale.
template <KernelKind kind>
SUBSTEP_KERNEL Tangential solve_disc(const KernelData& at, int i, const Tangential& missing, Lanes& most,
                                     Lanes& any_slides) {
  const Lanes zero = all(0);
  FrictionRows& rows = at.rows.frictions[i];
  const Lanes normal = at.rows.normals[i].row.impulse;
  reduce_origin(rows, normal);
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
  if (kind == KernelKind::general) {
    most = larger(most, magnitude(change.first) * rows.gamma[0]);
    most = larger(most, magnitude(change.second) * rows.gamma[2]);
  }
  return {all(at.how.scale) * change.first, all(at.how.scale) * change.second};
}

/// Solves the i-th point's friction from the velocities, and applies its impulses to them.
template <KernelKind kind>
SUBSTEP_KERNEL void solve_friction(const KernelData& at, int i, BodyVelocities& a, BodyVelocities& b,
                                   Lanes& most, Lanes& any_slides) {
  FrictionRows& rows = at.rows.frictions[i];
  const ContactDirections& along = at.rows.directions[i];
  const auto lacks = [&](int k) __attribute__((always_inline)) {
    return missing<kind>(at, i, 1 + k, rows.row[k], row_velocity(along.tangent[k], rows.row[k], a, b));
  };
  const Tangential given = solve_disc<kind>(at, i, {lacks(0), lacks(1)}, most, any_slides);
  apply(at, along.tangent[0], rows.row[0], given.first, a, b);
  apply(at, along.tangent[1], rows.row[1], given.second, a, b);
}

/// Solves a batch by points. Returns whether any point continues to slide.
template <KernelKind kind>
SUBSTEP_KERNEL bool solve_points(const KernelData& at, std::vector<Velocity>& v, double* moved) {
  Lanes most = all(0);
  Lanes any_slides = all(0);
  BodyVelocities a = gather(v, at.x.a);
  BodyVelocities b = gather(v, at.x.b);
  solve_normals<kind>(at, a, b, most);
  for (int i = 0; i < at.x.contacts && at.x.has_friction; ++i)
    solve_friction<kind>(at, i, a, b, most, any_slides);
  scatter(a, at.x.a, at.x.manifolds, v);
  scatter(b, at.x.b, at.x.manifolds, v);
  raise_to_largest<kind>(most, moved);
  return any(any_slides > all(0));
}

/// Solves a batch. For four corners, which boxes have, the kernel knows their number when it is compiled.
template <KernelKind kind>
SUBSTEP_KERNEL bool solve_batch(ContactBatches& contacts, const KernelData& at, std::vector<Velocity>& v,
                                double* moved) {
  if (at.x.patch < 0) return solve_points<kind>(at, v, moved);
  Patch& patch = contacts.patches[at.x.patch];
  PatchCorner* const corners = contacts.patch_corners.data() + at.x.first_corner;
  if (at.x.corners == 4) return solve_patch<kind, 4>(at, corners, patch, v, moved);
  return solve_patch<kind, 0>(at, corners, patch, v, moved);
}

}  // namespace

void solve_and_apply(ContactBatches& contacts, const ContactBatch& x, const RowSolve& how,
                     std::vector<Velocity>& v, double* moved) {
  const KernelData at{x, how, contacts.points_of(x)};
  const bool is_general = moved || how.kappa != 1 || how.tau != 1 || how.omega != 1;
  const bool slides = run_wide([&]() __attribute__((always_inline)) {
    return is_general ? solve_batch<KernelKind::general>(contacts, at, v, moved)
                      : solve_batch<KernelKind::unscaled>(contacts, at, v, nullptr);
  });
  contacts.slides[&x - contacts.batches.data()] = slides ? 1 : 0;
}

}  // namespace substep
