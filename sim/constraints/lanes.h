#pragma once
/// Operations on the lanes of contact_batch.h, and the data that its kernels share. The calling convention of
/// wide vectors depends on the processor, so all functions are inlined into kernels that are compiled for
/// both widths (four_wide.h).

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "sim/constraints/contact_batch.h"

namespace substep {

[[gnu::always_inline]] inline Lanes all(double value) {
  return Lanes{value, value, value, value};
}

/// Selects `yes` where `mask` is all ones, else `no`. Computes with neither, so a NaN stays in its lane.
template <typename Mask>
[[gnu::always_inline]] inline Lanes choose(const Mask& mask, const Lanes& yes, const Lanes& no) {
  return mask ? yes : no;
}

template <typename Mask>
[[gnu::always_inline]] inline LaneVectors choose(const Mask& mask, const LaneVectors& yes,
                                                 const LaneVectors& no) {
  return {{choose(mask, yes[0], no[0]), choose(mask, yes[1], no[1]), choose(mask, yes[2], no[2])}};
}

/// Returns true where any lane of a comparison holds.
template <typename Mask>
[[gnu::always_inline]] inline bool any(const Mask& mask) {
  using Two = double __attribute__((vector_size(16)));
  const auto either = __builtin_shufflevector(mask, mask, 0, 1) | __builtin_shufflevector(mask, mask, 2, 3);
  return __builtin_ia32_movmskpd(reinterpret_cast<Two>(either)) != 0;
}

[[gnu::always_inline]] inline Lanes larger(const Lanes& a, const Lanes& b) {
  return choose(a < b, b, a);
}

[[gnu::always_inline]] inline Lanes magnitude(const Lanes& x) {
  return choose(x < all(0), -x, x);
}

/// Returns 1/x where x is positive, else 0.
[[gnu::always_inline]] inline Lanes inverse_or_zero(const Lanes& x) {
  return choose(x > all(0), all(1) / x, all(0));
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

[[gnu::always_inline]] inline LaneVectors operator+(const LaneVectors& a, const LaneVectors& b) {
  return {{a[0] + b[0], a[1] + b[1], a[2] + b[2]}};
}

[[gnu::always_inline]] inline LaneVectors operator-(const LaneVectors& a, const LaneVectors& b) {
  return {{a[0] - b[0], a[1] - b[1], a[2] - b[2]}};
}

[[gnu::always_inline]] inline LaneVectors operator*(const Lanes& factor, const LaneVectors& v) {
  return {{factor * v[0], factor * v[1], factor * v[2]}};
}

/// Returns the products of components.
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

/// Two neighbouring components of a body's velocity. Velocities are loaded and stored in pairs, since a
/// processor forwards a store to a load only where both are of the same bytes.
using Pair = double __attribute__((vector_size(16)));
constexpr int pairs_of_velocity = 3;

[[gnu::always_inline]] inline Moving gather(const std::vector<Velocity>& v,
                                            const std::array<int, lanes>& body) {
  Lanes component[2 * pairs_of_velocity];
  for (int k = 0; k < pairs_of_velocity; ++k) {
    Pair of[lanes];
    for (int lane = 0; lane < lanes; ++lane)
      std::memcpy(&of[lane], v[body[lane]].linear.data() + 2 * k, sizeof(Pair));
    const Lanes even = __builtin_shufflevector(of[0], of[2], 0, 1, 2, 3);
    const Lanes odd = __builtin_shufflevector(of[1], of[3], 0, 1, 2, 3);
    component[2 * k] = __builtin_shufflevector(even, odd, 0, 4, 2, 6);
    component[2 * k + 1] = __builtin_shufflevector(even, odd, 1, 5, 3, 7);
  }
  return {{{component[0], component[1], component[2]}}, {{component[3], component[4], component[5]}}};
}

[[gnu::always_inline]] inline void scatter(const Moving& from, const std::array<int, lanes>& body, int count,
                                           std::vector<Velocity>& v) {
  const Lanes component[2 * pairs_of_velocity] = {from.linear[0],  from.linear[1],  from.linear[2],
                                                  from.angular[0], from.angular[1], from.angular[2]};
  Pair of[pairs_of_velocity][lanes];
  for (int k = 0; k < pairs_of_velocity; ++k) {
    const Lanes even = __builtin_shufflevector(component[2 * k], component[2 * k + 1], 0, 4, 2, 6);
    const Lanes odd = __builtin_shufflevector(component[2 * k], component[2 * k + 1], 1, 5, 3, 7);
    of[k][0] = __builtin_shufflevector(even, even, 0, 1);
    of[k][1] = __builtin_shufflevector(odd, odd, 0, 1);
    of[k][2] = __builtin_shufflevector(even, even, 2, 3);
    of[k][3] = __builtin_shufflevector(odd, odd, 2, 3);
  }
  for (int lane = 0; lane < lanes; ++lane) {
    if (lane >= count) break;
    for (int k = 0; k < pairs_of_velocity; ++k)
      std::memcpy(v[body[lane]].linear.data() + 2 * k, &of[k][lane], sizeof(Pair));
  }
}

/// Returns J_x v.
[[gnu::always_inline]] inline Lanes row_velocity(const LaneVectors& direction, const ContactRow& row,
                                                 const Moving& a, const Moving& b) {
  return dot(direction, a.linear - b.linear) + dot(row.angular_a, a.angular) + dot(row.angular_b, b.angular);
}

/// Returns 1 where a point or patch continues to slide and restores no displacement, else 0. One that only
/// begins to slide may do so for want of its normal's impulse, which one sweep leaves short, and keeps its
/// displacement.
template <typename Friction>
[[gnu::always_inline]] inline Lanes keeps_sliding(const Friction& friction) {
  return friction.slides * friction.slid;
}

using FourContacts = std::array<const Contact*, lanes>;

/// Returns the i-th contact of each manifold; of those that have no more, the last.
[[gnu::always_inline]] inline FourContacts contacts_of(const ContactBatch& x, int i,
                                                       const std::vector<Contact>& found) {
  const auto of_lane = [&](int lane) {
    return &found[x.source[lane] + (i < x.count[lane] ? i : x.count[lane] - 1)];
  };
  return {of_lane(0), of_lane(1), of_lane(2), of_lane(3)};
}

[[gnu::always_inline]] inline LaneVectors gather(const FourContacts& contact, Vector3 Contact::*member) {
  return gather(contact[0]->*member, contact[1]->*member, contact[2]->*member, contact[3]->*member);
}

/// Returns a number of each contact; true is 1.
template <typename Number>
[[gnu::always_inline]] inline Lanes gather(const FourContacts& contact, Number Contact::*member) {
  return Lanes{static_cast<double>(contact[0]->*member), static_cast<double>(contact[1]->*member),
               static_cast<double>(contact[2]->*member), static_cast<double>(contact[3]->*member)};
}

/// A matrix of each of four, by columns.
struct LaneMatrices {
  LaneVectors column[3];
};

[[gnu::always_inline]] inline LaneMatrices gather_matrices(const Matrix3& m0, const Matrix3& m1,
                                                           const Matrix3& m2, const Matrix3& m3) {
  LaneMatrices result;
  for (int k = 0; k < 9; ++k)
    result.column[k / 3][k % 3] = Lanes{m0.data()[k], m1.data()[k], m2.data()[k], m3.data()[k]};
  return result;
}

[[gnu::always_inline]] inline LaneMatrices gather(const std::vector<Matrix3>& rotations,
                                                  const std::array<int, lanes>& body) {
  return gather_matrices(rotations[body[0]], rotations[body[1]], rotations[body[2]], rotations[body[3]]);
}

[[gnu::always_inline]] inline LaneMatrices gather(const FourContacts& contact, Matrix3 Contact::*member) {
  return gather_matrices(contact[0]->*member, contact[1]->*member, contact[2]->*member, contact[3]->*member);
}

/// Returns R v.
[[gnu::always_inline]] inline LaneVectors turned(const LaneMatrices& r, const LaneVectors& v) {
  return {{r.column[0][0] * v[0] + r.column[1][0] * v[1] + r.column[2][0] * v[2],
           r.column[0][1] * v[0] + r.column[1][1] * v[1] + r.column[2][1] * v[2],
           r.column[0][2] * v[0] + r.column[1][2] * v[1] + r.column[2][2] * v[2]}};
}

/// Returns Rᵀ v.
[[gnu::always_inline]] inline LaneVectors turned_back(const LaneMatrices& r, const LaneVectors& v) {
  return {{dot(r.column[0], v), dot(r.column[1], v), dot(r.column[2], v)}};
}

/// The data that a step's rows are formulated from.
struct Formulation {
  const std::vector<Contact>& contacts;
  const std::vector<Coordinates>& q;
  const std::vector<Matrix3>& rotations;
  double hs;
  bool anew;  ///< the step's rows were formulated before
  const std::vector<Matrix3>& first_rotations;
};

/// The bodies' part of a batch's formulation.
struct BatchBodies {
  LaneMatrices rotation_a;
  LaneMatrices rotation_b;
  LaneVectors offset;  ///< from b's centre of mass to a's
  Lanes inverse_mass;  ///< both bodies'
};

[[gnu::always_inline]] inline BatchBodies bodies_of(const ContactBatch& x, const Formulation& from) {
  const auto& q = from.q;
  BatchBodies at;
  at.rotation_a = gather(from.rotations, x.a);
  at.rotation_b = gather(from.rotations, x.b);
  const auto centres = [&](const std::array<int, lanes>& body) {
    return gather(q[body[0]].linear, q[body[1]].linear, q[body[2]].linear, q[body[3]].linear);
  };
  at.offset = centres(x.a) - centres(x.b);
  at.inverse_mass = x.inverse_mass_a + x.inverse_mass_b;
  return at;
}

/// Properties of a solution that are known where its kernel is compiled.
struct Kind {
  bool by_one;  ///< κ, τ and ω are 1, and multiply nothing
  bool any;     ///< the largest change may be asked for
};
inline constexpr Kind plain{true, false};
inline constexpr Kind any_kind{false, true};

template <Kind kind>
[[gnu::always_inline]] inline Lanes times(double factor, const Lanes& x) {
  if constexpr (kind.by_one) return x;
  return all(factor) * x;
}

/// A kernel's data: a batch, the factors of its solution, and its rows if it is solved by points.
struct Visit {
  const ContactBatch& x;
  const RowSolve& how;
  PointRows rows;
};

/// Reduces the origin of friction where the normal impulse falls below that of the last slide, in proportion.
template <typename Friction>
[[gnu::always_inline]] inline void reduce_origin(Friction& friction, const Lanes& normal) {
  const auto is_less = normal < friction.origin_normal;
  if (!any(is_less)) return;
  const Lanes fraction = choose(is_less, normal / friction.origin_normal, all(1));
  for (Lanes& origin : friction.origin) origin *= fraction;
  friction.origin_normal *= fraction;
}

/// Raises the largest change of a velocity to the lanes' ones, if it is asked for.
template <Kind kind>
[[gnu::always_inline]] inline void raise(const Lanes& most, double* moved) {
  if (!kind.any || !moved) return;
  for (int lane = 0; lane < lanes; ++lane) *moved = std::max(*moved, most[lane]);
}

}  // namespace substep
