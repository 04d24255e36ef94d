// The kernels of a sweep: patches; else a manifold's normals as one block, then the friction of each point.

#include <algorithm>

#include "sim/constraints/contact_patch.h"
#include "sim/constraints/lanes.h"
#include "sim/math/four_wide.h"

namespace substep {
namespace {

/// Sweeps over the normals of a manifold, in the space of their impulses, that solve their block.
constexpr int normal_sweeps = 8;

/// What a kernel works on: a batch, its rows, and how they are solved.
struct Visit {
  const ContactBatch& x;
  const ContactDirections* directions;
  NormalRow* normals;
  FrictionRows* frictions;
  const RestitutionRow* restitutions;  ///< null: none bounces
  const Coupling* coupling;
  const RowSolve& how;
};

/// What is known of a visit where its kernel is compiled.
struct Kind {
  bool by_one;  ///< κ, τ and ω are 1, and multiply nothing
  bool any;     ///< the largest change may be asked for
};
constexpr Kind plain{true, false};
constexpr Kind any_kind{false, true};

template <Kind kind>
[[gnu::always_inline]] inline Lanes times(double factor, const Lanes& x) {
  if constexpr (kind.by_one) return x;
  return all(factor) * x;
}

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

/// What a normal's velocity lacks, in the equation of a row. An impact is over in its sub-step: κ < 1 would
/// leave a part of it to later ones, of which the step may have none.
template <Kind kind>
[[gnu::always_inline]] inline Lanes missing_of_normal(const Visit& at, int i, const Lanes& velocity) {
  const Lanes missing = times<kind>(at.how.tau, at.normals[i].row.beta) - times<kind>(at.how.kappa, velocity);
  if (!at.restitutions) return missing;
  const RestitutionRow& restitution = at.restitutions[i];
  const Lanes of_impact = (restitution.right - velocity) / all(at.how.scale);
  return choose(restitution.impact > all(0), of_impact, missing);
}

/// What the slip of the i-th friction lacks. In an impact it is stopped at once, as its normal is: κ < 1
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

/// Where the normal takes back what it had given when the point slid, friction gives back in proportion.
[[gnu::always_inline]] inline void give_back(FrictionRows& rows, const Lanes& normal) {
  const auto less = normal < rows.origin_normal;
  if (!any(less)) return;
  const Lanes part = choose(less, normal / rows.origin_normal, all(1));
  rows.origin[0] *= part;
  rows.origin[1] *= part;
  rows.origin_normal *= part;
}

/// A point's friction: two rows as one block, within the disc that its normal's impulse gives. The i-th
/// point's; returns what changes of its impulses.
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

/// Moves wrenches that are outside of the cone of their patch to the nearest in it, in the metric of Γ: on
/// one of its planes, else on one of its rays, else to 0.
template <int known>
[[gnu::always_inline]] inline void move_into_cone(int count, const PatchCorner* corners,
                                                  LaneVectors& wrench) {
  if constexpr (known) count = known;
  const Lanes zero = all(0);
  constexpr double rounding = 1e-10;
  Lanes beyond[known ? known : most_in_manifold];
  beyond[0] = dot(corners[0].plane, wrench);
  auto open = beyond[0] < zero;
  for (int k = 1; k < count; ++k) {
    beyond[k] = dot(corners[k].plane, wrench);
    open = open | (beyond[k] < zero);
  }
  if (!any(open)) return;
  LaneVectors nearest = wrench;
  // Try the planes that the wrench is behind: the right one's projection is inside of all others.
  for (int k = 0; k < count; ++k) {
    const LaneVectors& back = corners[k].to_plane;
    const LaneVectors on_plane{
        {wrench[0] - back[0] * beyond[k], wrench[1] - back[1] * beyond[k], wrench[2] - back[2] * beyond[k]}};
    auto is_inside = open & (beyond[k] < zero);
    const Lanes limit = all(rounding) * beyond[k];
    for (int j = 0; j < count; ++j) {
      if (j != k) is_inside = is_inside & (dot(corners[j].plane, on_plane) >= limit);
    }
    for (int i = 0; i < 3; ++i) nearest[i] = choose(is_inside, on_plane[i], nearest[i]);
    open = open & ~is_inside;
  }
  // Else take the ray that comes nearest, or no impulse.
  if (any(open)) {
    Lanes most = zero;
    LaneVectors on_ray{{zero, zero, zero}};
    for (int k = 0; k < count; ++k) {
      const PatchCorner& corner = corners[k];
      const Lanes size = larger(dot(corner.to_ray, wrench), zero);
      const Lanes gain = size * size * corner.gamma;
      const auto is_better = gain > most;
      most = choose(is_better, gain, most);
      on_ray[0] = choose(is_better, size, on_ray[0]);
      on_ray[1] = choose(is_better, size * corner.place[1], on_ray[1]);
      on_ray[2] = choose(is_better, -(size * corner.place[0]), on_ray[2]);
    }
    for (int i = 0; i < 3; ++i) nearest[i] = choose(open, on_ray[i], nearest[i]);
  }
  wrench = nearest;
}

/// Solves the normals of a patch: the wrench in the cone that gives the velocities of β, or as near to them
/// as it can. Returns what the wrench changed by, times the scale.
template <Kind kind, int known>
[[gnu::always_inline]] inline LaneVectors solve_patch_normals(const Visit& at, const PatchCorner* corners,
                                                              const LaneVectors& velocity, Patch& patch,
                                                              Lanes& most) {
  const int count = known ? known : at.x.corners;
  LaneVectors missing;
  for (int k = 0; k < 3; ++k) {
    missing[k] = times<kind>(at.how.tau, patch.normal_beta[k]) - times<kind>(at.how.kappa, velocity[k]);
  }
  // w = λ + ω Γ⁻¹ (τ β − κ J v)
  const LaneVectors change = symmetric_product(patch.normal_inverse, missing);
  LaneVectors wrench;
  for (int k = 0; k < 3; ++k) wrench[k] = patch.normal_impulse[k] + times<kind>(at.how.omega, change[k]);
  move_into_cone<known>(count, corners, wrench);
  LaneVectors given;
  for (int k = 0; k < 3; ++k) {
    const Lanes difference = wrench[k] - patch.normal_impulse[k];
    given[k] = all(at.how.scale) * difference;
    patch.normal_impulse[k] = wrench[k];
  }
  if (kind.any) {
    const Lanes one = given[0] * patch.normal_gamma[0];
    most = larger(most, choose(one < all(0), -one, one));
  }
  return given;
}

/// Where the normals take back what they had given when the patch slid, friction gives back in proportion.
[[gnu::always_inline]] inline void give_back(Patch& patch, const Lanes& normal) {
  const auto less = normal < patch.origin_normal;
  if (!any(less)) return;
  const Lanes part = choose(less, normal / patch.origin_normal, all(1));
  for (int k = 0; k < 3; ++k) patch.origin[k] *= part;
  patch.origin_normal *= part;
}

/// Shares of a patch's normal force at its corners.
struct CornerShares {
  Lanes of[most_corners];
};

/// Returns the shares that have the normals' centre of pressure and vary linearly between the corners. A
/// corner bears no negative share.
template <int known>
[[gnu::always_inline]] inline CornerShares corner_shares(int count, const PatchCorner* corners,
                                                         const Patch& patch, const Lanes& normal) {
  if constexpr (known) count = known;
  const Lanes zero = all(0);
  const Lanes equal = all(1) / patch.corners;
  // Sum up the corners' moments about their centre; what repeats a corner does not count.
  Lanes counts[most_corners];
  Lanes centre[2] = {zero, zero};
  for (int i = 0; i < count; ++i) {
    counts[i] = choose(patch.corners > all(i), all(1), zero);
    for (int k = 0; k < 2; ++k) centre[k] += counts[i] * equal * corners[i].place[k];
  }
  Lanes xx = zero;
  Lanes xy = zero;
  Lanes yy = zero;
  for (int i = 0; i < count; ++i) {
    const Lanes x = corners[i].place[0] - centre[0];
    const Lanes y = corners[i].place[1] - centre[1];
    xx += counts[i] * x * x;
    xy += counts[i] * x * y;
    yy += counts[i] * y * y;
  }
  // Corners on a line have moments along it alone.
  const Lanes least = all(1e-9) * (xx + yy);
  xx += least;
  yy += least;
  const Lanes inverse_normal = choose(normal > zero, all(1) / normal, zero);
  const Lanes x = -patch.normal_impulse[2] * inverse_normal - centre[0];
  const Lanes y = patch.normal_impulse[1] * inverse_normal - centre[1];
  const Lanes determinant = xx * yy - xy * xy;
  const Lanes by_x = (yy * x - xy * y) / determinant;
  const Lanes by_y = (xx * y - xy * x) / determinant;
  CornerShares shares;
  Lanes sum = zero;
  for (int i = 0; i < count; ++i) {
    const Lanes share =
        equal + by_x * (corners[i].place[0] - centre[0]) + by_y * (corners[i].place[1] - centre[1]);
    shares.of[i] = counts[i] * larger(share, zero);
    sum += shares.of[i];
  }
  for (int i = 0; i < count; ++i) shares.of[i] = shares.of[i] / sum;
  return shares;
}

/// Returns the friction of a patch that slides, with a force of `limit` in all: that of each corner is
/// opposite to its slip. `missing`: what the slip lacks, along the tangents and of the twist. `slid`: whether
/// the corners' friction is that of the visit before.
template <int known>
[[gnu::always_inline]] inline LaneVectors sliding_friction(int count, PatchCorner* corners,
                                                           const Patch& patch, const CornerShares& shares,
                                                           const Lanes& slid, const Lanes& limit,
                                                           const LaneVectors& missing) {
  if constexpr (known) count = known;
  // Bound Γ of all corners' forces.
  const Lanes gamma = patch.corners * patch.largest * slid;
  LaneVectors friction{{all(0), all(0), all(0)}};
  for (int i = 0; i < count; ++i) {
    PatchCorner& corner = corners[i];
    const Lanes& x = corner.place[0];
    const Lanes& y = corner.place[1];
    const Lanes along[2] = {gamma * corner.friction[0] + (missing[0] - missing[2] * y),
                            gamma * corner.friction[1] + (missing[1] + missing[2] * x)};
    const Lanes length = root(along[0] * along[0] + along[1] * along[1]);
    const Lanes factor = choose(length > all(0), shares.of[i] * limit / length, all(0));
    for (int k = 0; k < 2; ++k) corner.friction[k] = factor * along[k];
    friction[0] += corner.friction[0];
    friction[1] += corner.friction[1];
    friction[2] += x * corner.friction[1] - y * corner.friction[0];
  }
  return friction;
}

/// Solves the friction of a patch, two tangents and the twist as one block: it holds inside of an ellipsoid,
/// else it slides by Coulomb's law at the corners. Returns what its impulses changed by, times the scale.
template <Kind kind, int known>
[[gnu::always_inline]] inline LaneVectors solve_patch_friction(const Visit& at, PatchCorner* corners,
                                                               const LaneVectors& slip,
                                                               const LaneVectors& normals, Patch& patch,
                                                               Lanes& most) {
  const Lanes normal = larger(patch.normal_impulse[0], all(0));  // rounding may leave less
  give_back(patch, normal);
  const Lanes(&by)[9] = patch.by_normals;
  LaneVectors missing;
  LaneVectors before;
  for (int k = 0; k < 3; ++k) {
    const Lanes velocity =
        slip[k] + (by[3 * k] * normals[0] + by[3 * k + 1] * normals[1] + by[3 * k + 2] * normals[2]);
    missing[k] = times<kind>(at.how.omega,
                             times<kind>(at.how.tau, patch.beta[k]) - times<kind>(at.how.kappa, velocity));
    before[k] = patch.impulse[k] - patch.origin[k];
  }
  // Where it holds: λ + ω Γ⁻¹ (τ β − κ J v)
  LaneVectors total = symmetric_product(patch.inverse, missing);
  for (int k = 0; k < 3; ++k) total[k] += before[k];
  const Lanes limit = patch.coefficient * (normal - patch.origin_normal);
  const Lanes twist = total[2] * patch.inverse_radius;
  const auto slides = total[0] * total[0] + total[1] * total[1] + twist * twist >= limit * limit;
  const Lanes slid = patch.slides;
  patch.slides = choose(slides, all(1), all(0));
  if (any(slides)) {
    const CornerShares shares = corner_shares<known>(at.x.corners, corners, patch, normal);
    LaneVectors sliding = sliding_friction<known>(at.x.corners, corners, patch, shares, slid, limit, missing);
    // Friction stops what it brakes, and does not drive it back.
    const LaneVectors response = symmetric_product(patch.gamma, sliding);
    const Lanes stopping = dot(sliding, missing) + dot(response, before);
    const Lanes full = dot(sliding, response);
    const Lanes part = choose(stopping < full, larger(stopping, all(0)) / full, all(1));
    for (int k = 0; k < 3; ++k) total[k] = choose(slides, part * sliding[k], total[k]);
  }
  LaneVectors given;
  for (int k = 0; k < 3; ++k) {
    given[k] = all(at.how.scale) * (total[k] - before[k]);
    patch.impulse[k] = total[k] + patch.origin[k];
  }
  if (kind.any) {
    for (int k = 0; k < 2; ++k) {
      const Lanes one = given[k] * patch.gamma[3 * k];
      most = larger(most, choose(one < all(0), -one, one));
    }
  }
  return given;
}

/// Solves four patches. Returns whether any goes on sliding.
template <Kind kind, int known>
[[gnu::always_inline]] inline bool solve_patch(const Visit& at, PatchCorner* corners, Patch& patch,
                                               std::vector<Velocity>& v, double* moved) {
  Lanes most = all(0);
  Moving a = gather(v, at.x.a);
  Moving b = gather(v, at.x.b);
  const RelativeMotion motion = relative_motion(patch, a, b);
  const LaneVectors normals = solve_patch_normals<kind, known>(at, corners, of_normals(motion), patch, most);
  const LaneVectors friction =
      solve_patch_friction<kind, known>(at, corners, of_friction(motion), normals, patch, most);
  give(at.x, patch, normals, friction, a, b);
  scatter(a, at.x.a, at.x.manifolds, v);
  scatter(b, at.x.b, at.x.manifolds, v);
  if (kind.any && moved) {
    for (int lane = 0; lane < lanes; ++lane) *moved = std::max(*moved, most[lane]);
  }
  return any(keeps_sliding(patch) > all(0));
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

/// Four corners are known where the kernel is compiled, as boxes have them.
template <Kind kind>
[[gnu::always_inline]] inline bool solve_batch(ContactBatches& contacts, const Visit& at,
                                               std::vector<Velocity>& v, double* moved) {
  if (at.x.patch < 0) return solve_lanes<kind>(at, v, moved);
  Patch& patch = contacts.patches[at.x.patch];
  PatchCorner* const corners = contacts.patch_corners.data() + at.x.first_corner;
  if (at.x.corners == 4) return solve_patch<kind, 4>(at, corners, patch, v, moved);
  return solve_patch<kind, 0>(at, corners, patch, v, moved);
}

[[gnu::always_inline]] inline bool solve_any(ContactBatches& contacts, const Visit& at,
                                             std::vector<Velocity>& v, double* moved) {
  const RowSolve& how = at.how;
  const bool by_one = how.kappa == 1 && how.tau == 1 && how.omega == 1;
  if (moved || !by_one) return solve_batch<any_kind>(contacts, at, v, moved);
  return solve_batch<plain>(contacts, at, v, nullptr);
}

using Solve = bool(ContactBatches&, const Visit&, std::vector<Velocity>&, double*);
bool solve_two_wide(ContactBatches& contacts, const Visit& at, std::vector<Velocity>& v, double* moved) {
  return solve_any(contacts, at, v, moved);
}
[[gnu::target("avx2")]] bool solve_four_wide(ContactBatches& contacts, const Visit& at,
                                             std::vector<Velocity>& v, double* moved) {
  return solve_any(contacts, at, v, moved);
}

}  // namespace

void solve_and_apply(ContactBatches& contacts, const ContactBatch& x, const RowSolve& how,
                     std::vector<Velocity>& v, double* moved) {
  static Solve* const solve = is_four_wide() ? solve_four_wide : solve_two_wide;
  const Visit at{x,
                 contacts.directions.data() + x.first_normal,
                 contacts.normals.data() + x.first_normal,
                 contacts.frictions.data() + x.first_friction,
                 x.first_restitution < 0 ? nullptr : contacts.restitutions.data() + x.first_restitution,
                 contacts.couplings.data() + x.first_coupling,
                 how};
  contacts.slides[&x - contacts.batches.data()] = solve(contacts, at, v, moved) ? 1 : 0;
}

}  // namespace substep
