#pragma once
/// Operations on the lanes of contact_batch.h, and the data that its kernels share. All functions are inlined
/// into the kernels, which are compiled with and without four-wide instructions (four_wide.h), since wide
/// vectors are passed differently with each instruction set.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <vector>

#include "sim/constraints/contact_batch.h"

namespace substep {

SUBSTEP_KERNEL Lanes all(double value) {
  return Lanes{value, value, value, value};
}

/// Returns `yes` in lanes where `mask` is all ones, else `no`, without arithmetic: a NaN stays in its lane.
template <typename Mask>
SUBSTEP_KERNEL Lanes choose(const Mask& mask, const Lanes& yes, const Lanes& no) {
  return mask ? yes : no;
}

template <typename Mask>
SUBSTEP_KERNEL LaneVectors choose(const Mask& mask, const LaneVectors& yes, const LaneVectors& no) {
  return {{choose(mask, yes[0], no[0]), choose(mask, yes[1], no[1]), choose(mask, yes[2], no[2])}};
}

/// Returns true if a comparison holds in any lane.
template <typename Mask>
SUBSTEP_KERNEL bool any(const Mask& mask) {
  using Two = double __attribute__((vector_size(16)));
  const auto either = __builtin_shufflevector(mask, mask, 0, 1) | __builtin_shufflevector(mask, mask, 2, 3);
  return __builtin_ia32_movmskpd(reinterpret_cast<Two>(either)) != 0;
}

SUBSTEP_KERNEL Lanes larger(const Lanes& a, const Lanes& b) {
  return choose(a < b, b, a);
}

SUBSTEP_KERNEL Lanes magnitude(const Lanes& x) {
  return choose(x < all(0), -x, x);
}

/// Returns 1/x where x is positive, else 0.
SUBSTEP_KERNEL Lanes inverse_or_zero(const Lanes& x) {
  return choose(x > all(0), all(1) / x, all(0));
}

SUBSTEP_KERNEL Lanes root(const Lanes& x) {
  return Lanes{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
}

/// Returns the larger eigenvalue of the symmetric 2×2 matrix (xx, xy; xy, yy).
SUBSTEP_KERNEL Lanes larger_eigenvalue(const Lanes& xx, const Lanes& xy, const Lanes& yy) {
  const Lanes half_difference = all(0.5) * (xx - yy);
  return all(0.5) * (xx + yy) + root(half_difference * half_difference + xy * xy);
}

SUBSTEP_KERNEL Lanes dot(const LaneVectors& a, const LaneVectors& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

SUBSTEP_KERNEL LaneVectors cross(const LaneVectors& a, const LaneVectors& b) {
  return {{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}

SUBSTEP_KERNEL LaneVectors operator+(const LaneVectors& a, const LaneVectors& b) {
  return {{a[0] + b[0], a[1] + b[1], a[2] + b[2]}};
}

SUBSTEP_KERNEL LaneVectors operator-(const LaneVectors& a, const LaneVectors& b) {
  return {{a[0] - b[0], a[1] - b[1], a[2] - b[2]}};
}

SUBSTEP_KERNEL LaneVectors operator*(const Lanes& factor, const LaneVectors& v) {
  return {{factor * v[0], factor * v[1], factor * v[2]}};
}

/// Returns the component-wise product.
SUBSTEP_KERNEL LaneVectors product(const LaneVectors& a, const LaneVectors& b) {
  return {{a[0] * b[0], a[1] * b[1], a[2] * b[2]}};
}

SUBSTEP_KERNEL LaneVectors gather(const Vector3& v0, const Vector3& v1, const Vector3& v2,
                                  const Vector3& v3) {
  return {{Lanes{v0.x(), v1.x(), v2.x(), v3.x()}, Lanes{v0.y(), v1.y(), v2.y(), v3.y()},
           Lanes{v0.z(), v1.z(), v2.z(), v3.z()}}};
}

/// Velocities of body a, or of body b, of each manifold.
struct BodyVelocities {
  LaneVectors linear;
  LaneVectors angular;
};

/// Two neighbouring components of a body's velocity. Velocities are loaded and stored in pairs, since a
/// processor forwards a store only to a load of the same bytes.
using TwoDoubles = double __attribute__((vector_size(16)));
constexpr int pairs_of_velocity = 3;

SUBSTEP_KERNEL BodyVelocities gather(const std::vector<Velocity>& v, const std::array<int, lanes>& body) {
  Lanes component[2 * pairs_of_velocity];
  for (int k = 0; k < pairs_of_velocity; ++k) {
    TwoDoubles pair[lanes];
    for (int lane = 0; lane < lanes; ++lane)
      std::memcpy(&pair[lane], v[body[lane]].linear.data() + 2 * k, sizeof(TwoDoubles));
    // Transpose pairs of lanes 0 and 2, then of 1 and 3, into a vector for each component.
    const Lanes even = __builtin_shufflevector(pair[0], pair[2], 0, 1, 2, 3);
    const Lanes odd = __builtin_shufflevector(pair[1], pair[3], 0, 1, 2, 3);
    component[2 * k] = __builtin_shufflevector(even, odd, 0, 4, 2, 6);
    component[2 * k + 1] = __builtin_shufflevector(even, odd, 1, 5, 3, 7);
  }
  return {{{component[0], component[1], component[2]}}, {{component[3], component[4], component[5]}}};
}

/// Writes the velocities of the first `count` lanes to their bodies.
SUBSTEP_KERNEL void scatter(const BodyVelocities& from, const std::array<int, lanes>& body, int count,
                            std::vector<Velocity>& v) {
  const Lanes component[2 * pairs_of_velocity] = {from.linear[0],  from.linear[1],  from.linear[2],
                                                  from.angular[0], from.angular[1], from.angular[2]};
  TwoDoubles pair[pairs_of_velocity][lanes];
  for (int k = 0; k < pairs_of_velocity; ++k) {
    const Lanes even = __builtin_shufflevector(component[2 * k], component[2 * k + 1], 0, 4, 2, 6);
    const Lanes odd = __builtin_shufflevector(component[2 * k], component[2 * k + 1], 1, 5, 3, 7);
    pair[k][0] = __builtin_shufflevector(even, even, 0, 1);
    pair[k][1] = __builtin_shufflevector(odd, odd, 0, 1);
    pair[k][2] = __builtin_shufflevector(even, even, 2, 3);
    pair[k][3] = __builtin_shufflevector(odd, odd, 2, 3);
  }
  for (int lane = 0; lane < lanes; ++lane) {
    if (lane >= count) break;
    for (int k = 0; k < pairs_of_velocity; ++k)
      std::memcpy(v[body[lane]].linear.data() + 2 * k, &pair[k][lane], sizeof(TwoDoubles));
  }
}

/// Returns J_x v.
SUBSTEP_KERNEL Lanes row_velocity(const LaneVectors& direction, const ContactRow& row,
                                  const BodyVelocities& a, const BodyVelocities& b) {
  return dot(direction, a.linear - b.linear) + dot(row.angular_a, a.angular) + dot(row.angular_b, b.angular);
}

/// Returns 1 where a point or patch slides as it did in the last step, so that friction does not pull its
/// displacement back; else 0. A point that begins to slide keeps its displacement, since its normal impulse
/// may be too small after one sweep.
template <typename Friction>
SUBSTEP_KERNEL Lanes keeps_sliding(const Friction& friction) {
  return friction.slides * friction.slid;
}

/// A contact or a patch for each lane.
template <typename Item>
using Four = std::array<const Item*, lanes>;

/// Returns the i-th contact of each manifold, or its last one where it has fewer.
SUBSTEP_KERNEL Four<Contact> contacts_of(const ContactBatch& x, int i, const std::vector<Contact>& found) {
  const auto of_lane = [&](int lane) __attribute__((always_inline)) {
    return &found[x.source[lane] + (i < x.count[lane] ? i : x.count[lane] - 1)];
  };
  return {of_lane(0), of_lane(1), of_lane(2), of_lane(3)};
}

template <typename Item>
SUBSTEP_KERNEL LaneVectors gather(const Four<Item>& of, Vector3 Item::*member) {
  return gather(of[0]->*member, of[1]->*member, of[2]->*member, of[3]->*member);
}

/// Returns a number of each item: the value of a member or function. True is 1.
template <typename Item, typename Value>
SUBSTEP_KERNEL Lanes gather(const Four<Item>& of, const Value& value) {
  const auto of_lane = [&](int lane) __attribute__((always_inline)) {
    return static_cast<double>(std::invoke(value, *of[lane]));
  };
  return Lanes{of_lane(0), of_lane(1), of_lane(2), of_lane(3)};
}

/// Four 3×3 matrices, by columns.
struct LaneMatrices {
  LaneVectors column[3];
};

SUBSTEP_KERNEL LaneMatrices gather_matrices(const Matrix3& m0, const Matrix3& m1, const Matrix3& m2,
                                            const Matrix3& m3) {
  LaneMatrices result;
  for (int k = 0; k < 9; ++k)
    result.column[k / 3][k % 3] = Lanes{m0.data()[k], m1.data()[k], m2.data()[k], m3.data()[k]};
  return result;
}

SUBSTEP_KERNEL LaneMatrices gather(const std::vector<Matrix3>& rotations,
                                   const std::array<int, lanes>& body) {
  return gather_matrices(rotations[body[0]], rotations[body[1]], rotations[body[2]], rotations[body[3]]);
}

SUBSTEP_KERNEL LaneMatrices gather(const Four<Contact>& of, Matrix3 Contact::*member) {
  return gather_matrices(of[0]->*member, of[1]->*member, of[2]->*member, of[3]->*member);
}

/// Returns R v.
SUBSTEP_KERNEL LaneVectors turned(const LaneMatrices& r, const LaneVectors& v) {
  return {{r.column[0][0] * v[0] + r.column[1][0] * v[1] + r.column[2][0] * v[2],
           r.column[0][1] * v[0] + r.column[1][1] * v[1] + r.column[2][1] * v[2],
           r.column[0][2] * v[0] + r.column[1][2] * v[1] + r.column[2][2] * v[2]}};
}

/// Returns Rᵀ v.
SUBSTEP_KERNEL LaneVectors turned_back(const LaneMatrices& r, const LaneVectors& v) {
  return {{dot(r.column[0], v), dot(r.column[1], v), dot(r.column[2], v)}};
}

/// The input from which rows of contacts are formulated.
struct Formulation {
  const std::vector<Contact>& contacts;
  const std::vector<Coordinates>& q;
  const std::vector<Matrix3>& rotations;
  double hs;    ///< duration of a sub-step, s
  int substep;  ///< from 0
  const std::vector<Matrix3>& first_rotations;
};

/// Quantities of a batch's bodies that its rows are formulated from.
struct BatchBodies {
  LaneMatrices rotation_a;
  LaneMatrices rotation_b;
  LaneVectors offset;  ///< from b's centre of mass to a's, m, world
  Lanes inverse_mass;  ///< sum of both bodies', 1/kg
};

SUBSTEP_KERNEL BatchBodies bodies_of(const ContactBatch& x, const Formulation& from) {
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

/// Kinds of kernels. Unscaled ones omit κ = τ = ω = 1 and do not compute the largest change.
enum class KernelKind { unscaled, general };

/// Returns factor · x, or x in an unscaled kernel.
template <KernelKind kind>
SUBSTEP_KERNEL Lanes times(double factor, const Lanes& x) {
  if constexpr (kind == KernelKind::unscaled) return x;
  return all(factor) * x;
}

/// A kernel's data: a batch, κ, τ, ω and scale, and the batch's rows if it is solved by points.
struct KernelData {
  const ContactBatch& x;
  const RowSolve& how;
  PointRows rows;
};

/// Scales the impulses of the last slip by the ratio of the normal impulses, where that is below 1.
template <typename Friction>
SUBSTEP_KERNEL void reduce_origin(Friction& friction, const Lanes& normal) {
  const auto is_less = normal < friction.origin_normal;
  if (!any(is_less)) return;
  const Lanes fraction = choose(is_less, normal / friction.origin_normal, all(1));
  for (Lanes& origin : friction.origin) origin *= fraction;
  friction.origin_normal *= fraction;
}

/// Sets `*moved` to the largest of itself and the lanes of `most`, if the caller requests it.
template <KernelKind kind>
SUBSTEP_KERNEL void raise_to_largest(const Lanes& most, double* moved) {
  if (kind == KernelKind::unscaled || !moved) return;
  for (int lane = 0; lane < lanes; ++lane) *moved = std::max(*moved, most[lane]);
}

}  // namespace substep
