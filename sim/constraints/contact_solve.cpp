// The kernels of a sweep: a batch's normals as one block, then the friction of each point.

#include <algorithm>

#include "sim/constraints/contact_face.h"
#include "sim/constraints/four_wide.h"
#include "sim/constraints/lanes.h"

namespace substep {
namespace {

/// Sweeps over the normals of a manifold, in the space of their impulses, that solve their block.
constexpr int normal_sweeps = 8;

/// What a kernel works on: a batch, its rows, and how they are solved.
struct Visit {
  const ContactBatch& x;
  const ContactDirections* directions;
  const RowResponses* responses;  ///< null: rows are in the bodies' frames
  NormalRow* normals;
  FrictionRows* frictions;
  const RestitutionRow* restitutions;  ///< null: none bounces
  const Coupling* coupling;
  const ContactFace* face;      ///< null: the manifolds have none
  const FaceInertias* inertia;  ///< null: rows are in the bodies' frames
  const RowSolve& how;
  const ContactReading& reading;
};

/// What is known of a visit where its kernel is compiled.
struct Kind {
  bool in_world;  ///< rows may be in the world's frame
  bool by_one;    ///< κ, τ, ω and the scale are 1, and multiply nothing
  bool any;       ///< the largest change may be asked for, and the reading be another
};
constexpr Kind plain{false, true, false};
constexpr Kind plain_in_world{true, true, false};
constexpr Kind any_kind{true, false, true};

template <Kind kind>
[[gnu::always_inline]] inline Lanes times(double factor, const Lanes& x) {
  if constexpr (kind.by_one) return x;
  return all(factor) * x;
}

/// v ← v + M⁻¹J_xᵀ impulse, for the `place`-th of the batch's rows.
template <Kind kind>
[[gnu::always_inline]] inline void apply(const Visit& at, int place, const LaneVectors& direction,
                                         const ContactRow& row, const Lanes& impulse, Moving& a, Moving& b) {
  const ContactBatch& x = at.x;
  const Lanes impulse_a = x.inverse_mass_a * impulse;
  const Lanes impulse_b = x.inverse_mass_b * impulse;
  for (int k = 0; k < 3; ++k) {
    a.linear[k] += direction[k] * impulse_a;
    b.linear[k] -= direction[k] * impulse_b;
  }
  if (kind.in_world && at.responses) {
    for (int k = 0; k < 3; ++k) {
      a.angular[k] += at.responses[place].a[k] * impulse;
      b.angular[k] += at.responses[place].b[k] * impulse;
    }
  } else {
    for (int k = 0; k < 3; ++k) {
      a.angular[k] += x.inverse_inertia_a[k] * row.angular_a[k] * impulse;
      b.angular[k] += x.inverse_inertia_b[k] * row.angular_b[k] * impulse;
    }
  }
}

[[gnu::always_inline]] inline const LaneVectors& normal_of(const Visit& at, int i) {
  return at.directions[i * at.x.direction_step].normal;
}

/// What a normal's velocity lacks, in the equation of a row. An impact is over in its sub-step: κ < 1 would
/// leave a part of it to later ones, of which the step may have none.
template <Kind kind>
[[gnu::always_inline]] inline Lanes missing_of_normal(const Visit& at, int i, const Lanes& velocity) {
  const Lanes missing = times<kind>(at.how.tau, at.normals[i].row.beta) - times<kind>(at.how.kappa, velocity);
  if (!at.restitutions) return missing;
  const RestitutionRow& restitution = at.restitutions[i];
  const Lanes of_impact = at.reading.velocity_level_apart
                              ? (restitution.right - velocity) / all(at.how.scale)
                              : all(at.how.tau) * restitution.right - all(at.how.kappa) * velocity;
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
  if (!at.reading.velocity_level_apart) return missing;
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
  return times<kind>(at.how.scale, given);
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
    apply<kind>(at, i, normal_of(at, i), at.normals[i].row, given, a, b);
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

/// Ablation: the normals one after the other, each with what the one before left.
[[gnu::always_inline]] inline void solve_normals_in_turn(const Visit& at, Moving& a, Moving& b) {
  for (int i = 0; i < at.x.contacts; ++i) {
    NormalRow& normal = at.normals[i];
    const Lanes missing =
        missing_of_normal<any_kind>(at, i, row_velocity(normal_of(at, i), normal.row, a, b));
    const Lanes total =
        larger(normal.row.impulse + all(at.how.omega) * missing * normal.effective_mass, normal.low);
    const Lanes change = total - normal.row.impulse;
    normal.row.impulse = total;
    apply<any_kind>(at, i, normal_of(at, i), normal.row, all(at.how.scale) * change, a, b);
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
  if (kind.any && !at.reading.friction_memory) rows.slides = rows.slid = all(1);
  any_slides += keeps_sliding(rows);
  rows.row[0].impulse += change.first;
  rows.row[1].impulse += change.second;
  if (kind.any) {
    most = larger(most, choose(change.first < zero, -change.first, change.first) * rows.gamma[0]);
    most = larger(most, choose(change.second < zero, -change.second, change.second) * rows.gamma[2]);
  }
  return {times<kind>(at.how.scale, change.first), times<kind>(at.how.scale, change.second)};
}

/// The i-th point's friction, from the velocities and to them.
template <Kind kind>
[[gnu::always_inline]] inline void solve_friction(const Visit& at, int i, Moving& a, Moving& b, Lanes& most,
                                                  Lanes& any_slides) {
  FrictionRows& rows = at.frictions[i];
  const ContactDirections& along = at.directions[at.x.contact_of[i] * at.x.direction_step];
  const Tangential missing{
      missing_of_slip<kind>(at, i, 0, row_velocity(along.tangent[0], rows.row[0], a, b)),
      missing_of_slip<kind>(at, i, 1, row_velocity(along.tangent[1], rows.row[1], a, b))};
  const Tangential given = solve_disc<kind>(at, i, missing, most, any_slides);
  const int place = at.x.contacts + 2 * i;
  apply<kind>(at, place, along.tangent[0], rows.row[0], given.first, a, b);
  apply<kind>(at, place + 1, along.tangent[1], rows.row[1], given.second, a, b);
}

/// A face's normals, from the relative motion: the force along the normal and the torques about the tangents.
template <Kind kind, int known>
[[gnu::always_inline]] inline void solve_face_normals(const Visit& at, const RelativeMotion& motion,
                                                      Wrench& wrench, Lanes& most) {
  const int count = known ? known : at.x.contacts;
  constexpr int room = known ? known : most_in_manifold;
  Lanes wanted[room];
  Lanes least[room];
  Lanes change[room];
  for (int i = 0; i < count; ++i) {
    const NormalRow& normal = at.normals[i];
    const Lanes velocity =
        motion.linear[0] + (motion.angular[1] * normal.place[1] - motion.angular[2] * normal.place[0]);
    wanted[i] = missing_of_normal<kind>(at, i, velocity) * normal.effective_mass;
    least[i] = normal.low - normal.row.impulse;
  }
  solve_block<known>(at, count, wanted, least, change);
  for (int i = 0; i < count; ++i) {
    const NormalRow& normal = at.normals[i];
    const Lanes given = take<kind>(at, i, count, change[i], most);
    wrench.force[0] += given;
    wrench.torque[1] += normal.place[1] * given;
    wrench.torque[2] -= normal.place[0] * given;
  }
}

/// A face's friction, point by point, each from the motion that those before it leave: along the tangents and
/// about the normal.
template <Kind kind>
[[gnu::always_inline]] inline void solve_face_friction(const Visit& at, const RelativeMotion& motion,
                                                       Wrench& wrench, Lanes& most, Lanes& any_slides) {
  const Lanes(&gamma)[6] = at.face->gamma;
  const Lanes(&by)[9] = at.face->by_normals;
  Lanes moves[3] = {motion.linear[1], motion.linear[2], motion.angular[0]};
  for (int k = 0; k < 3; ++k) {
    moves[k] +=
        by[3 * k] * wrench.force[0] + by[3 * k + 1] * wrench.torque[1] + by[3 * k + 2] * wrench.torque[2];
  }
  for (int i = 0; i < at.x.frictions; ++i) {
    const Lanes(&place)[2] = at.normals[at.x.contact_of[i]].place;
    const Tangential missing{missing_of_slip<kind>(at, i, 0, moves[0] - place[1] * moves[2]),
                             missing_of_slip<kind>(at, i, 1, moves[1] + place[0] * moves[2])};
    const Tangential given = solve_disc<kind>(at, i, missing, most, any_slides);
    wrench.force[1] += given.first;
    wrench.force[2] += given.second;
    wrench.torque[0] += place[0] * given.second - place[1] * given.first;
    const Lanes by_first[3] = {gamma[0] - place[1] * gamma[2], gamma[1] - place[1] * gamma[4],
                               gamma[2] - place[1] * gamma[5]};
    const Lanes by_second[3] = {gamma[1] + place[0] * gamma[2], gamma[3] + place[0] * gamma[4],
                                gamma[4] + place[0] * gamma[5]};
    for (int k = 0; k < 3; ++k) moves[k] += by_first[k] * given.first + by_second[k] * given.second;
  }
}

/// A face's points. Returns whether any goes on sliding.
template <Kind kind>
[[gnu::always_inline]] inline bool solve_face(const Visit& at, std::vector<Velocity>& v, double* moved) {
  const Lanes zero = all(0);
  Lanes most = zero;
  Lanes any_slides = zero;
  Moving a = gather(v, at.x.a);
  Moving b = gather(v, at.x.b);
  const RelativeMotion motion = relative_motion(*at.face, a, b);
  Wrench wrench{{{zero, zero, zero}}, {{zero, zero, zero}}};
  switch (at.x.contacts) {
    case 2:
      solve_face_normals<kind, 2>(at, motion, wrench, most);
      break;
    case 4:
      solve_face_normals<kind, 4>(at, motion, wrench, most);
      break;
    default:
      solve_face_normals<kind, 0>(at, motion, wrench, most);
  }
  solve_face_friction<kind>(at, motion, wrench, most, any_slides);
  give(at.x, *at.face, kind.in_world ? at.inertia : nullptr, wrench, a, b);
  scatter(a, at.x.a, at.x.manifolds, v);
  scatter(b, at.x.b, at.x.manifolds, v);
  if (kind.any && moved) {
    for (int lane = 0; lane < lanes; ++lane) *moved = std::max(*moved, most[lane]);
  }
  return any(any_slides > zero);
}

/// Ablation: each of a point's two rows by itself, within ±μ λ_n: a square.
[[gnu::always_inline]] inline void solve_friction_in_turn(const Visit& at, int i, Moving& a, Moving& b,
                                                          Lanes& any_slides) {
  FrictionRows& rows = at.frictions[i];
  const ContactDirections& along = at.directions[at.x.contact_of[i] * at.x.direction_step];
  const Lanes normal = at.normals[at.x.contact_of[i]].row.impulse;
  const Lanes limit = rows.coefficient * larger(normal - rows.origin_normal, all(0));
  rows.slides = all(at.reading.friction_memory ? 0 : 1);
  if (!at.reading.friction_memory) rows.slid = all(1);
  for (int k = 0; k < 2; ++k) {
    ContactRow& row = rows.row[k];
    const Lanes missing =
        all(at.how.tau) * row.beta - all(at.how.kappa) * row_velocity(along.tangent[k], row, a, b);
    const Lanes gamma = rows.gamma[2 * k];
    const Lanes free =
        row.impulse - rows.origin[k] + choose(gamma > all(0), all(at.how.omega) * missing / gamma, all(0));
    const auto over = free >= limit;
    const auto under = free <= -limit;
    const Lanes total = rows.origin[k] + choose(over, limit, choose(under, -limit, free));
    rows.slides = choose(over || under, all(1), rows.slides);
    const Lanes change = total - row.impulse;
    row.impulse = total;
    apply<any_kind>(at, at.x.contacts + 2 * i + k, along.tangent[k], row, all(at.how.scale) * change, a, b);
  }
  any_slides += keeps_sliding(rows);
}

/// Returns whether any point goes on sliding.
template <Kind kind>
[[gnu::always_inline]] inline bool solve_lanes(const Visit& at, std::vector<Velocity>& v, double* moved) {
  Lanes most = all(0);
  Lanes any_slides = all(0);
  Moving a = gather(v, at.x.a);
  Moving b = gather(v, at.x.b);
  if (kind.any && !at.reading.manifold_blocks) {
    solve_normals_in_turn(at, a, b);
  } else {
    solve_normals<kind>(at, a, b, most);
  }
  for (int i = 0; i < at.x.frictions; ++i) {
    if (kind.any && !at.reading.isotropic_friction) {
      solve_friction_in_turn(at, i, a, b, any_slides);
    } else {
      solve_friction<kind>(at, i, a, b, most, any_slides);
    }
  }
  scatter(a, at.x.a, at.x.manifolds, v);
  scatter(b, at.x.b, at.x.manifolds, v);
  if (kind.any && moved) {
    for (int lane = 0; lane < lanes; ++lane) *moved = std::max(*moved, most[lane]);
  }
  return any(any_slides > all(0));
}

[[gnu::always_inline]] inline bool solve_any(const Visit& at, std::vector<Velocity>& v, double* moved) {
  const ContactReading& reading = at.reading;
  const RowSolve& how = at.how;
  if (!reading.isotropic_friction || !reading.manifold_blocks || !reading.friction_memory) {
    return solve_lanes<any_kind>(at, v, nullptr);
  }
  const bool by_one = how.kappa == 1 && how.tau == 1 && how.omega == 1 && how.scale == 1;
  if (at.face) {
    if (moved || !by_one) return solve_face<any_kind>(at, v, moved);
    return at.inertia ? solve_face<plain_in_world>(at, v, nullptr) : solve_face<plain>(at, v, nullptr);
  }
  if (moved || !by_one) return solve_lanes<any_kind>(at, v, moved);
  return at.responses ? solve_lanes<plain_in_world>(at, v, nullptr) : solve_lanes<plain>(at, v, nullptr);
}

using Solve = bool(const Visit&, std::vector<Velocity>&, double*);
bool solve_two_wide(const Visit& at, std::vector<Velocity>& v, double* moved) {
  return solve_any(at, v, moved);
}
[[gnu::target("avx2")]] bool solve_four_wide(const Visit& at, std::vector<Velocity>& v, double* moved) {
  return solve_any(at, v, moved);
}

}  // namespace

void solve_and_apply(ContactBatches& contacts, const ContactBatch& x, const RowSolve& how,
                     std::vector<Velocity>& v, double* moved) {
  static Solve* const solve = is_four_wide() ? solve_four_wide : solve_two_wide;
  const Visit at{x,
                 contacts.directions.data() + x.first_direction,
                 contacts.responses.empty() ? nullptr : contacts.responses.data() + x.first_response,
                 contacts.normals.data() + x.first_normal,
                 contacts.frictions.data() + x.first_friction,
                 x.first_restitution < 0 ? nullptr : contacts.restitutions.data() + x.first_restitution,
                 contacts.couplings.data() + x.first_coupling,
                 x.face < 0 ? nullptr : contacts.faces.data() + x.face,
                 x.face < 0 || contacts.inertias.empty() ? nullptr : contacts.inertias.data() + x.face,
                 how,
                 contacts.reading};
  contacts.slides[&x - contacts.batches.data()] = solve(at, v, moved) ? 1 : 0;
}

}  // namespace substep
