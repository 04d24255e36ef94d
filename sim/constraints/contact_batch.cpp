#include "sim/constraints/contact_batch.h"

#ifdef __clang__
#define _Bool bool  // NOLINT: the next header is meant for C, and gcc's C++ knows this word of it
#endif
#include <sys/platform/x86.h>
#undef _Bool

#include <algorithm>
#include <cmath>
#include <tuple>

namespace substep {
namespace {

/// Sweeps over the normals of a manifold, in the space of their impulses, that solve their block.
constexpr int normal_sweeps = 8;

[[gnu::always_inline]] inline Lanes all(double value) {
  return Lanes{value, value, value, value};
}

/// Where `mask` is all ones, `yes`. Neither is computed with: a NaN stays where it is.
template <typename Mask>
[[gnu::always_inline]] inline Lanes choose(const Mask& mask, const Lanes& yes, const Lanes& no) {
  return mask ? yes : no;
}

template <typename Mask>
[[gnu::always_inline]] inline bool any(const Mask& mask) {
  return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
}

[[gnu::always_inline]] inline Lanes larger(const Lanes& a, const Lanes& b) {
  return choose(a < b, b, a);
}

[[gnu::always_inline]] inline Lanes root(const Lanes& x) {
  return Lanes{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
}

[[gnu::always_inline]] inline Lanes dot(const LaneVectors& a, const LaneVectors& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

[[gnu::always_inline]] inline LaneVectors cross(const LaneVectors& a, const LaneVectors& b) {
  return {{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}

[[gnu::always_inline]] inline LaneVectors product(const LaneVectors& a, const LaneVectors& b) {
  return {{a[0] * b[0], a[1] * b[1], a[2] * b[2]}};
}

[[gnu::always_inline]] inline LaneVectors gather(const Vector3& v0, const Vector3& v1, const Vector3& v2,
                                                 const Vector3& v3) {
  return {{Lanes{v0.x(), v1.x(), v2.x(), v3.x()}, Lanes{v0.y(), v1.y(), v2.y(), v3.y()},
           Lanes{v0.z(), v1.z(), v2.z(), v3.z()}}};
}

/// The velocities of one of the bodies of each manifold.
struct Moving {
  LaneVectors linear;
  LaneVectors angular;
};

[[gnu::always_inline]] inline Moving gather(const std::vector<Velocity>& v,
                                            const std::array<int, lanes>& body) {
  const Velocity& v0 = v[body[0]];
  const Velocity& v1 = v[body[1]];
  const Velocity& v2 = v[body[2]];
  const Velocity& v3 = v[body[3]];
  return {gather(v0.linear, v1.linear, v2.linear, v3.linear),
          gather(v0.angular, v1.angular, v2.angular, v3.angular)};
}

[[gnu::always_inline]] inline void scatter(const Moving& from, const std::array<int, lanes>& body, int count,
                                           std::vector<Velocity>& v) {
  for (int lane = 0; lane < count; ++lane) {
    double* const linear = v[body[lane]].linear.data();
    double* const angular = v[body[lane]].angular.data();
    for (int k = 0; k < 3; ++k) {
      linear[k] = from.linear[k][lane];
      angular[k] = from.angular[k][lane];
    }
  }
}

/// J_x v.
[[gnu::always_inline]] inline Lanes row_velocity(const ContactRow& row, const Moving& a, const Moving& b) {
  const LaneVectors relative{
      {a.linear[0] - b.linear[0], a.linear[1] - b.linear[1], a.linear[2] - b.linear[2]}};
  return dot(row.linear, relative) + dot(row.angular_a, a.angular) + dot(row.angular_b, b.angular);
}

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

using FourContacts = std::array<const Contact*, lanes>;

[[gnu::always_inline]] inline FourContacts contacts_of(const ContactBatch& x, int i,
                                                       const std::vector<Contact>& found) {
  return {&found[x.source[0] + i], &found[x.source[1] + i], &found[x.source[2] + i], &found[x.source[3] + i]};
}

[[gnu::always_inline]] inline LaneVectors gather(const FourContacts& contact, Vector3 Contact::*member) {
  return gather(contact[0]->*member, contact[1]->*member, contact[2]->*member, contact[3]->*member);
}

[[gnu::always_inline]] inline Lanes gather(const FourContacts& contact, bool Contact::*member) {
  return Lanes{contact[0]->*member ? 1.0 : 0.0, contact[1]->*member ? 1.0 : 0.0,
               contact[2]->*member ? 1.0 : 0.0, contact[3]->*member ? 1.0 : 0.0};
}

[[gnu::always_inline]] inline Lanes gather(const FourContacts& contact, double Contact::*member) {
  return Lanes{contact[0]->*member, contact[1]->*member, contact[2]->*member, contact[3]->*member};
}

/// A rotation matrix of each of four, by columns.
struct LaneMatrices {
  LaneVectors column[3];
};

[[gnu::always_inline]] inline LaneMatrices gather_rotations(const std::vector<Matrix3>& rotations,
                                                            const std::array<int, lanes>& body) {
  const double* const r0 = rotations[body[0]].data();
  const double* const r1 = rotations[body[1]].data();
  const double* const r2 = rotations[body[2]].data();
  const double* const r3 = rotations[body[3]].data();
  LaneMatrices result;
  for (int k = 0; k < 9; ++k) result.column[k / 3][k % 3] = Lanes{r0[k], r1[k], r2[k], r3[k]};
  return result;
}

/// R v.
[[gnu::always_inline]] inline LaneVectors turned(const LaneMatrices& r, const LaneVectors& v) {
  return {{r.column[0][0] * v[0] + r.column[1][0] * v[1] + r.column[2][0] * v[2],
           r.column[0][1] * v[0] + r.column[1][1] * v[1] + r.column[2][1] * v[2],
           r.column[0][2] * v[0] + r.column[1][2] * v[1] + r.column[2][2] * v[2]}};
}

/// Rᵀ v.
[[gnu::always_inline]] inline LaneVectors turned_back(const LaneMatrices& r, const LaneVectors& v) {
  return {{dot(r.column[0], v), dot(r.column[1], v), dot(r.column[2], v)}};
}

/// What a step's rows are formulated from.
struct Formulation {
  const Model& model;
  const std::vector<Contact>& contacts;
  const std::vector<Coordinates>& q;
  const std::vector<Matrix3>& rotations;
  bool in_body_frames;
  double hs;
};

/// The bodies' part of a batch's formulation.
struct BatchBodies {
  LaneMatrices rotation_a;
  LaneMatrices rotation_b;
  LaneVectors inverse_inertia_a;
  LaneVectors inverse_inertia_b;
  LaneVectors offset;  ///< from b's centre of mass to a's
  Lanes inverse_mass;  ///< both bodies'
};

[[gnu::always_inline]] inline BatchBodies bodies_of(const ContactBatch& x, const Formulation& from) {
  const auto& masses = from.model.masses;
  const auto& q = from.q;
  BatchBodies at;
  at.rotation_a = gather_rotations(from.rotations, x.a);
  at.rotation_b = gather_rotations(from.rotations, x.b);
  at.inverse_inertia_a = gather(masses[x.a[0]].inverse_inertia, masses[x.a[1]].inverse_inertia,
                                masses[x.a[2]].inverse_inertia, masses[x.a[3]].inverse_inertia);
  at.inverse_inertia_b = gather(masses[x.b[0]].inverse_inertia, masses[x.b[1]].inverse_inertia,
                                masses[x.b[2]].inverse_inertia, masses[x.b[3]].inverse_inertia);
  const LaneVectors to_a = gather(q[x.a[0]].linear, q[x.a[1]].linear, q[x.a[2]].linear, q[x.a[3]].linear);
  const LaneVectors to_b = gather(q[x.b[0]].linear, q[x.b[1]].linear, q[x.b[2]].linear, q[x.b[3]].linear);
  at.offset = {{to_a[0] - to_b[0], to_a[1] - to_b[1], to_a[2] - to_b[2]}};
  at.inverse_mass = x.inverse_mass_a + x.inverse_mass_b;
  return at;
}

/// J and M⁻¹Jᵀ of a row along `direction_b`, which is fixed in b; returns the contact's distance along it.
[[gnu::always_inline]] inline Lanes set_row(const BatchBodies& at, const LaneVectors& arm_a,
                                            const LaneVectors& arm_b, const LaneVectors& direction_b,
                                            bool in_body_frames, ContactRow& row) {
  const LaneVectors direction = turned(at.rotation_b, direction_b);
  const LaneVectors direction_a = turned_back(at.rotation_a, direction);
  const LaneVectors local_a = cross(arm_a, direction_a);
  const LaneVectors local_b = cross(direction_b, arm_b);
  const LaneVectors response_a = product(at.inverse_inertia_a, local_a);
  const LaneVectors response_b = product(at.inverse_inertia_b, local_b);
  row.linear = direction;
  if (in_body_frames) {
    row.angular_a = local_a;
    row.angular_b = local_b;
    row.response_a = response_a;
    row.response_b = response_b;
  } else {
    row.angular_a = turned(at.rotation_a, local_a);
    row.angular_b = turned(at.rotation_b, local_b);
    row.response_a = turned(at.rotation_a, response_a);
    row.response_b = turned(at.rotation_b, response_b);
  }
  return dot(direction, at.offset) + dot(direction_a, arm_a) - dot(direction_b, arm_b);
}

/// An element of Γ.
[[gnu::always_inline]] inline Lanes coupling(const BatchBodies& at, const ContactRow& one,
                                             const ContactRow& other) {
  return dot(one.linear, other.linear) * at.inverse_mass + dot(one.angular_a, other.response_a) +
         dot(one.angular_b, other.response_b);
}

/// What solving divides by. Where Γ is singular to rounding, its trace counts for both rows.
[[gnu::always_inline]] inline void invert(FrictionRows& rows) {
  const Lanes zero = all(0);
  const Lanes one = all(1);
  const Lanes trace = rows.gamma[0] + rows.gamma[2];
  const Lanes determinant = rows.gamma[0] * rows.gamma[2] - rows.gamma[1] * rows.gamma[1];
  const auto regular = determinant > all(1e-14) * trace * trace;
  rows.gamma[0] = choose(regular, rows.gamma[0], trace);
  rows.gamma[1] = choose(regular, rows.gamma[1], zero);
  rows.gamma[2] = choose(regular, rows.gamma[2], trace);
  rows.inverse_determinant =
      choose(regular, one / determinant, choose(trace > zero, one / (trace * trace), zero));
  const Lanes half_difference = all(0.5) * (rows.gamma[0] - rows.gamma[2]);
  const Lanes largest = all(0.5) * (rows.gamma[0] + rows.gamma[2]) +
                        root(half_difference * half_difference + rows.gamma[1] * rows.gamma[1]);
  rows.inverse_largest = choose(largest > zero, one / largest, zero);
}

[[gnu::always_inline]] inline void formulate_friction(const BatchBodies& at, const FourContacts& contact,
                                                      const LaneVectors& arm_a, const LaneVectors& arm_b,
                                                      const Formulation& from, FrictionRows& rows) {
  const auto lets_go = rows.keeps_sliding > all(0);
  rows.coefficient = gather(contact, &Contact::friction);
  int k = 0;
  for (const auto tangent : {&Contact::tangent_b1, &Contact::tangent_b2}) {
    ContactRow& row = rows.row[k];
    const Lanes distance = set_row(at, arm_a, arm_b, gather(contact, tangent), from.in_body_frames, row);
    rows.reference[k] = choose(lets_go, -distance, rows.reference[k]);
    row.beta = -(distance + rows.reference[k]) / all(from.hs);
    ++k;
  }
  rows.gamma[0] = coupling(at, rows.row[0], rows.row[0]);
  rows.gamma[1] = coupling(at, rows.row[0], rows.row[1]);
  rows.gamma[2] = coupling(at, rows.row[1], rows.row[1]);
  invert(rows);
}

/// Formulated anew in a step (A3), a round surface's point has turned away from where it pushed: what it has
/// given there is not taken back here. Else a ball that rolls would be braked.
template <typename Mask>
[[gnu::always_inline]] inline void keep_given(const Lanes& normal, const Mask& round, FrictionRows& rows) {
  for (int k = 0; k < 2; ++k) rows.origin[k] = choose(round, rows.row[k].impulse, rows.origin[k]);
  rows.origin_normal = choose(round, normal, rows.origin_normal);
}

[[gnu::always_inline]] inline void formulate_lanes(ContactBatches& contacts, const ContactBatch& x,
                                                   const Formulation& from) {
  const BatchBodies at = bodies_of(x, from);
  NormalRow* const normals = contacts.normals.data() + x.first_normal;
  FrictionRows* friction = contacts.frictions.data() + x.first_friction;
  for (int i = 0; i < x.contacts; ++i) {
    const FourContacts contact = contacts_of(x, i, from.contacts);
    const LaneVectors arm_a = gather(contact, &Contact::arm_a);
    const LaneVectors arm_b = gather(contact, &Contact::arm_b);
    ContactRow& row = normals[i].row;
    // A positive distance is admitted too: β lets it close, no more.
    const Lanes gap =
        set_row(at, arm_a, arm_b, gather(contact, &Contact::normal_b), from.in_body_frames, row) +
        gather(contact, &Contact::left_over);
    row.beta = -gap / all(from.hs);
    if (x.first_restitution >= 0) contacts.restitutions[x.first_restitution + i].gap = gap;
    const auto round = gather(contact, &Contact::round) > all(0);
    normals[i].low = choose(round, row.impulse, normals[i].low);
    if (contact[0]->friction == 0) continue;
    formulate_friction(at, contact, arm_a, arm_b, from, *friction);
    keep_given(row.impulse, round, *friction++);
  }
  Coupling* const gamma = contacts.couplings.data() + x.first_coupling;
  for (int i = 0; i < x.contacts; ++i) {
    for (int j = 0; j <= i; ++j) {
      gamma[i * x.contacts + j].gamma = gamma[j * x.contacts + i].gamma =
          coupling(at, normals[i].row, normals[j].row);
    }
    const Lanes own = gamma[i * x.contacts + i].gamma;
    normals[i].effective_mass = choose(own > all(0), all(1) / own, all(0));
  }
}

// The same operations with the vectors of every x86-64 and with wider ones, where the processor has them.
using Solve = void(const Visit&, std::vector<Velocity>&, double*);
void solve_two_wide(const Visit& at, std::vector<Velocity>& v, double* moved) {
  solve_any(at, v, moved);
}
[[gnu::target("avx2")]] void solve_four_wide(const Visit& at, std::vector<Velocity>& v, double* moved) {
  solve_any(at, v, moved);
}

void formulate_two_wide(ContactBatches& contacts, const Formulation& from) {
  for (const ContactBatch& x : contacts.batches) formulate_lanes(contacts, x, from);
}
[[gnu::target("avx2")]] void formulate_four_wide(ContactBatches& contacts, const Formulation& from) {
  for (const ContactBatch& x : contacts.batches) formulate_lanes(contacts, x, from);
}

/// A point that slides lets its displacement go: from here on it counts from `offset`, the sum of velocities.
[[gnu::always_inline]] inline void let_go(FrictionRows& rows, double hs, const Moving& offset_a,
                                          const Moving& offset_b) {
  const auto lets_go = rows.keeps_sliding > all(0);
  for (int k = 0; k < 2; ++k) {
    const Lanes displacement = all(hs) * row_velocity(rows.row[k], offset_a, offset_b);
    rows.reference[k] = choose(lets_go, -displacement, rows.reference[k]);
  }
}

[[gnu::always_inline]] inline void update_biases_lanes(ContactBatches& contacts, double hs,
                                                       const std::vector<Velocity>& v_local,
                                                       const std::vector<Velocity>& offset) {
  for (const ContactBatch& x : contacts.batches) {
    const Moving a = gather(v_local, x.a);
    const Moving b = gather(v_local, x.b);
    for (int i = 0; i < x.contacts; ++i) {
      ContactRow& row = contacts.normals[x.first_normal + i].row;
      row.beta -= row_velocity(row, a, b);
    }
    const Moving offset_a = gather(offset, x.a);
    const Moving offset_b = gather(offset, x.b);
    for (int i = 0; i < x.frictions; ++i) {
      FrictionRows& rows = contacts.frictions[x.first_friction + i];
      let_go(rows, hs, offset_a, offset_b);
      for (ContactRow& row : rows.row) {
        row.beta = choose(rows.keeps_sliding > all(0), all(0), row.beta - row_velocity(row, a, b));
      }
    }
  }
}
void update_biases_two_wide(ContactBatches& contacts, double hs, const std::vector<Velocity>& v_local,
                            const std::vector<Velocity>& offset) {
  update_biases_lanes(contacts, hs, v_local, offset);
}
[[gnu::target("avx2")]] void update_biases_four_wide(ContactBatches& contacts, double hs,
                                                     const std::vector<Velocity>& v_local,
                                                     const std::vector<Velocity>& offset) {
  update_biases_lanes(contacts, hs, v_local, offset);
}

/// Only what slides has nothing to follow: A5's sum of velocities is given back to it whole.
[[gnu::always_inline]] inline void undo_update_rule_lanes(ContactBatches& contacts, double hs,
                                                          const std::vector<Velocity>& sum_v,
                                                          const std::vector<Velocity>& offset) {
  for (const ContactBatch& x : contacts.batches) {
    const Moving a = gather(sum_v, x.a);
    const Moving b = gather(sum_v, x.b);
    const Moving offset_a = gather(offset, x.a);
    const Moving offset_b = gather(offset, x.b);
    for (int i = 0; i < x.frictions; ++i) {
      FrictionRows& rows = contacts.frictions[x.first_friction + i];
      const auto lets_go = rows.keeps_sliding > all(0);
      if (!any(lets_go)) continue;
      let_go(rows, hs, offset_a, offset_b);
      for (ContactRow& row : rows.row) row.beta = choose(lets_go, row_velocity(row, a, b), row.beta);
    }
  }
}
void undo_update_rule_two_wide(ContactBatches& contacts, double hs, const std::vector<Velocity>& sum_v,
                               const std::vector<Velocity>& offset) {
  undo_update_rule_lanes(contacts, hs, sum_v, offset);
}
[[gnu::target("avx2")]] void undo_update_rule_four_wide(ContactBatches& contacts, double hs,
                                                        const std::vector<Velocity>& sum_v,
                                                        const std::vector<Velocity>& offset) {
  undo_update_rule_lanes(contacts, hs, sum_v, offset);
}

/// As glibc sees it, so that its tunables can hide the instructions from a test.
bool is_four_wide() {
  static const bool answer = CPU_FEATURE_ACTIVE(AVX2);
  return answer;
}

/// The speed after an impact that has e² of the energy before it, in the discrete motion: with x the gap, u
/// the approach, and g the acceleration towards the contact, steps of v' = v + g hs, x' = x − hs v' keep
/// ½u² + ½ g hs u + g x in flight. With e = 1 the ball so comes back to the height it fell from.
[[gnu::always_inline]] inline Lanes rebound(const RestitutionRow& row, const Lanes& gap,
                                            const Lanes& approach, double hs) {
  const Lanes squared = row.coefficient * row.coefficient;
  const Lanes gain = row.acceleration * all(hs);
  const Lanes before = squared * (approach * approach + gain * approach);
  const Lanes height = all(2) * row.acceleration * larger(gap, all(0)) * (all(1) - squared);
  const Lanes inner = all(0.25) * gain * gain + before - height;
  return larger(root(larger(inner, all(0))) - all(0.5) * gain, all(0));
}

/// Whether a contact bounces in the sub-step that starts, and with what velocity.
void start_impact(NormalRow& normal, RestitutionRow& row, const Lanes& gap, const Lanes& approach,
                  double hs) {
  const Lanes zero = all(0);
  const Lanes gain = row.acceleration * all(hs);
  // What an impact has given stays given. It is over with its sub-step: to hold on to its velocity for the
  // rest of the step, while others pass it on, feeds energy into the cradle.
  normal.low = choose(row.impact > zero, normal.row.impulse, normal.low);
  const auto meets = gap <= all(hs) * (approach + gain);
  const Lanes fast = choose(approach > row.resting_acceleration * all(hs), all(1), zero);
  row.impact = fast * choose(row.coefficient > zero, all(1), zero);
  // Before they meet nothing brakes them: with τ < 1 the position-level row would, and take from the impact.
  const Lanes let_through = all(-2) * (approach + gain);
  row.velocity = choose(meets, rebound(row, gap, approach, hs), let_through);
}

/// Of its displacement, what a point keeps that has only begun to slide when the step ends. Measured on the
/// wall, the pyramid of 210 and the card house with other values here, for 3 s with ten sub-steps: with
/// nothing kept they give way by 11.6, 64 and 4.4 mm, with half by 6.7, 28 and 2.1 mm, with all by 6.4, 110
/// and 2.1 mm.
constexpr double kept_at_edge = 0.5;

}  // namespace

bool ContactBatches::Manifold::fits(const Manifold& other) const {
  return std::tie(level, contacts, friction) == std::tie(other.level, other.contacts, other.friction);
}

void ContactBatches::list_manifolds(const Model& model, const std::vector<Contact>& contacts) {
  manifolds_.clear();
  row_count = 0;
  for (std::size_t begin = 0, end = 0; begin < contacts.size(); begin = end) {
    Manifold manifold{0, 0, 0, 0, static_cast<int>(begin)};
    while (end < contacts.size() && manifold.contacts < most_in_manifold &&
           contacts[end].a == contacts[begin].a && contacts[end].b == contacts[begin].b) {
      const bool has_friction = contacts[end].friction != 0;
      if (has_friction) manifold.friction |= std::uint32_t{1} << manifold.contacts;
      row_count += has_friction ? 3 : 1;
      ++manifold.contacts;
      ++end;
    }
    manifolds_.push_back(manifold);
  }
  if (reading.far_first) {
    measure_distances(model, contacts);
    for (Manifold& manifold : manifolds_) {
      const Contact& contact = contacts[manifold.source];
      manifold.distance = std::min(distance_[contact.a], distance_[contact.b]);
    }
    std::ranges::sort(manifolds_, [](const Manifold& one, const Manifold& other) {
      return std::tie(other.distance, one.source) < std::tie(one.distance, other.source);
    });
  }
  depth_.assign(model.masses.size(), 0);
  for (Manifold& manifold : manifolds_) {
    const Contact& contact = contacts[manifold.source];
    manifold.level = std::max(depth_[contact.a], depth_[contact.b]);
    if (moves(model.masses[contact.a])) depth_[contact.a] = manifold.level + 1;
    if (moves(model.masses[contact.b])) depth_[contact.b] = manifold.level + 1;
  }
}

/// Breadth first from what cannot move, along contacts; what they do not lead to is farthest.
void ContactBatches::measure_distances(const Model& model, const std::vector<Contact>& contacts) {
  const int bodies = static_cast<int>(model.masses.size());
  begin_.assign(bodies + 1, 0);
  partners_.resize(2 * manifolds_.size());
  for (const Manifold& manifold : manifolds_) {
    ++begin_[contacts[manifold.source].a];
    ++begin_[contacts[manifold.source].b];
  }
  for (int body = 1; body <= bodies; ++body) begin_[body] += begin_[body - 1];
  for (const Manifold& manifold : manifolds_) {
    const Contact& contact = contacts[manifold.source];
    partners_[--begin_[contact.a]] = contact.b;
    partners_[--begin_[contact.b]] = contact.a;
  }
  distance_.assign(bodies, bodies);
  reached_.clear();
  for (int body = 0; body < bodies; ++body) {
    if (moves(model.masses[body])) continue;
    distance_[body] = 0;
    reached_.push_back(body);
  }
  for (std::size_t next = 0; next < reached_.size(); ++next) {
    const int body = reached_[next];
    for (int k = begin_[body]; k < begin_[body + 1]; ++k) {
      const int partner = partners_[k];
      if (distance_[partner] < bodies) continue;
      distance_[partner] = distance_[body] + 1;
      reached_.push_back(partner);
    }
  }
}

void ContactBatches::add_batch(const Model& model, const std::vector<Contact>& contacts,
                               const Manifold* first, int count) {
  ContactBatch x{};
  x.contacts = first->contacts;
  x.manifolds = count;
  x.first_normal = static_cast<int>(normals.size());
  x.first_friction = static_cast<int>(frictions.size());
  x.first_coupling = static_cast<int>(couplings.size());
  x.first_restitution = -1;
  for (int lane = 0; lane < lanes; ++lane) {
    const int source = first[lane < count ? lane : 0].source;
    x.source[lane] = source;
    x.a[lane] = contacts[source].a;
    x.b[lane] = contacts[source].b;
    x.inverse_mass_a[lane] = model.masses[x.a[lane]].inverse_mass;
    x.inverse_mass_b[lane] = model.masses[x.b[lane]].inverse_mass;
    for (int i = 0; i < x.contacts; ++i) {
      if (contacts[source + i].restitution > 0) x.first_restitution = static_cast<int>(restitutions.size());
    }
  }
  for (int i = 0; i < x.contacts; ++i) {
    const FourContacts contact = contacts_of(x, i, contacts);
    normals.emplace_back();  // all zero: the limits count from here
    if (x.first_restitution >= 0) {
      restitutions.emplace_back();
      restitutions.back().coefficient = gather(contact, &Contact::restitution);
      restitutions.back().resting_acceleration = gather(contact, &Contact::resting_acceleration);
      restitutions.back().acceleration = gather(contact, &Contact::acceleration);
    }
    if (contact[0]->friction == 0) continue;  // and the others' is, too
    frictions.emplace_back();
    frictions.back().normal = i;
    frictions.back().slid = gather(contact, &Contact::slid);
    frictions.back().reference[0] = gather(contact, &Contact::displacement_1);
    frictions.back().reference[1] = gather(contact, &Contact::displacement_2);
    ++x.frictions;
  }
  couplings.resize(couplings.size() + x.contacts * x.contacts);
  batches.push_back(x);
}

void ContactBatches::build(const Model& model, const std::vector<Contact>& contacts) {
  // There are at most as many manifolds as contacts.
  const std::size_t most = contacts.capacity();
  manifolds_.reserve(most);
  batches.reserve(most);
  normals.reserve(most);
  frictions.reserve(most);
  restitutions.reserve(most);
  couplings.reserve(8 * most);
  partners_.reserve(2 * most);
  remembered_.reserve(most);
  in_order_.reserve(most);
  reached_.reserve(model.masses.size());
  batches.clear();
  normals.clear();
  frictions.clear();
  restitutions.clear();
  couplings.clear();
  list_manifolds(model, contacts);
  std::ranges::sort(manifolds_, [](const Manifold& one, const Manifold& other) {
    return std::tie(one.level, one.contacts, one.friction, one.source) <
           std::tie(other.level, other.contacts, other.friction, other.source);
  });
  for (std::size_t begin = 0, end = 0; begin < manifolds_.size(); begin = end) {
    for (end = begin + 1; end < manifolds_.size() && end - begin < lanes; ++end) {
      if (!manifolds_[end].fits(manifolds_[begin])) break;
    }
    add_batch(model, contacts, &manifolds_[begin], static_cast<int>(end - begin));
  }
}

void solve_and_apply(ContactBatches& contacts, const ContactBatch& x, const RowSolve& how,
                     std::vector<Velocity>& v, double* moved) {
  static Solve* const solve = is_four_wide() ? solve_four_wide : solve_two_wide;
  solve({x, contacts.normals.data() + x.first_normal, contacts.frictions.data() + x.first_friction,
         x.first_restitution < 0 ? nullptr : contacts.restitutions.data() + x.first_restitution,
         contacts.couplings.data() + x.first_coupling, how, contacts.reading},
        v, moved);
}

void formulate(ContactBatches& contacts, const Model& model, const std::vector<Contact>& found,
               const std::vector<Coordinates>& q, const std::vector<Matrix3>& rotations, bool in_body_frames,
               double hs) {
  const Formulation from{model, found, q, rotations, in_body_frames, hs};
  is_four_wide() ? formulate_four_wide(contacts, from) : formulate_two_wide(contacts, from);
}

void start_substep(ContactBatches& contacts, double hs, const std::vector<Velocity>& v,
                   const std::vector<Velocity>& offset, const std::vector<Velocity>* sum_v) {
  const Lanes zero = all(0);
  if (!contacts.reading.limits_over_step) {
    for (NormalRow& normal : contacts.normals) normal.row.impulse = normal.low = zero;
    for (FrictionRows& rows : contacts.frictions) {
      rows.row[0].impulse = rows.row[1].impulse = rows.origin[0] = rows.origin[1] = rows.origin_normal = zero;
    }
  }
  for (const ContactBatch& x : contacts.batches) {
    for (int i = 0; i < x.frictions; ++i) {
      FrictionRows& rows = contacts.frictions[x.first_friction + i];
      const auto lets_go = rows.keeps_sliding > zero;
      if (!any(lets_go)) continue;
      for (int k = 0; k < 2; ++k) rows.origin[k] = choose(lets_go, rows.row[k].impulse, rows.origin[k]);
      const Lanes normal = contacts.normals[x.first_normal + rows.normal].row.impulse;
      rows.origin_normal = choose(lets_go, normal, rows.origin_normal);
    }
    if (x.first_restitution < 0) continue;
    for (int i = 0; i < x.contacts; ++i) {
      NormalRow& normal = contacts.normals[x.first_normal + i];
      RestitutionRow& row = contacts.restitutions[x.first_restitution + i];
      const Lanes approach = -row_velocity(normal.row, gather(v, x.a), gather(v, x.b));
      const Lanes gap =
          row.gap + all(hs) * row_velocity(normal.row, gather(offset, x.a), gather(offset, x.b));
      start_impact(normal, row, gap, approach, hs);
      row.right = row.velocity;
      if (sum_v) row.right += row_velocity(normal.row, gather(*sum_v, x.a), gather(*sum_v, x.b));
    }
  }
}

void update_biases(ContactBatches& contacts, double hs, const std::vector<Velocity>& v_local,
                   const std::vector<Velocity>& offset) {
  is_four_wide() ? update_biases_four_wide(contacts, hs, v_local, offset)
                 : update_biases_two_wide(contacts, hs, v_local, offset);
}

void box_biases(ContactBatches& contacts, double kappa, double tau) {
  for (NormalRow& normal : contacts.normals) normal.row.beta *= all(tau / kappa);
  for (FrictionRows& rows : contacts.frictions) {
    for (ContactRow& row : rows.row) row.beta *= all(tau / kappa);
  }
}

void undo_update_rule(ContactBatches& contacts, double hs, const std::vector<Velocity>& sum_v,
                      const std::vector<Velocity>& offset) {
  is_four_wide() ? undo_update_rule_four_wide(contacts, hs, sum_v, offset)
                 : undo_update_rule_two_wide(contacts, hs, sum_v, offset);
}

namespace {

/// The point's displacement at the step's end, in the body frame of b.
Vector3 displacement_at(const FrictionRows& rows, int lane, const Contact& contact,
                        const std::vector<Coordinates>& q) {
  const Coordinates& a = q[contact.a];
  const Coordinates& b = q[contact.b];
  const Vector3 apart = a.linear + a.angular * contact.arm_a - (b.linear + b.angular * contact.arm_b);
  const Vector3 apart_b = b.angular.conjugate() * apart;
  return contact.tangent_b1 * (rows.reference[0][lane] + contact.tangent_b1.dot(apart_b)) +
         contact.tangent_b2 * (rows.reference[1][lane] + contact.tangent_b2.dot(apart_b));
}

}  // namespace

void ContactBatches::remember(const std::vector<Contact>& found, const std::vector<Coordinates>& q,
                              std::vector<ContactMemory>& memory) {
  remembered_.resize(found.size());
  for (const ContactBatch& x : batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      int friction = x.first_friction;
      const int end = x.first_friction + x.frictions;
      for (int i = 0; i < x.contacts; ++i) {
        const Contact& contact = found[x.source[lane] + i];
        ContactMemory& point = remembered_[x.source[lane] + i];
        point = {contact.collider_a, contact.collider_b, contact.arm_a, contact.arm_b, Vector3::Zero(), true,
                 contact.left_over};
        if (friction < end && frictions[friction].normal == i) {
          const FrictionRows& rows = frictions[friction++];
          point.slides = rows.keeps_sliding[lane] > 0;
          if (!point.slides && reading.friction_memory) {
            const double part = rows.slides[lane] > 0 ? kept_at_edge : 1;
            point.displacement = part * displacement_at(rows, lane, contact, q);
          }
        }
      }
    }
  }
  // A total order: the points of two colliders by their places on the first.
  in_order_.resize(found.size());
  for (int i = 0; i < static_cast<int>(found.size()); ++i) {
    in_order_[i] = {found[i].collider_a, found[i].collider_b, i};
  }
  std::ranges::sort(in_order_, [&](const Place& one, const Place& other) {
    const auto colliders = [](const Place& place) { return std::tie(place.collider_a, place.collider_b); };
    if (colliders(one) != colliders(other)) return colliders(one) < colliders(other);
    const auto place = [&](const Place& of) {
      const Vector3& arm = found[of.point].arm_a;
      return std::tie(arm[0], arm[1], arm[2], of.point);
    };
    return place(one) < place(other);
  });
  memory.clear();
  for (const Place& place : in_order_) memory.push_back(remembered_[place.point]);
}

}  // namespace substep
