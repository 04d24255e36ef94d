#pragma once
/// 𝒞: the velocity constraints of one (sub-)step, as rows of the Jacobian in contiguous arrays.
///
/// A row holds one line of J̆, with angular parts in the bodies' frames, the matching part of M̆⁻¹J̆ᵀ, its bias
/// and its limits. Each function here is one line of a listing. The loops over sub-steps, micro-iterations
/// and rows are in the listings' files.

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/constraints/contact_batch.h"
#include "sim/math/vector.h"
#include "sim/model/settings.h"
#include "sim/model/state.h"

namespace substep {

/// J of one row between bodies a and b; angular parts in the bodies' frames.
struct Jacobian {
  Vector3 linear;     ///< ₜJ of body a; that of b is −linear
  Vector3 angular_a;  ///< ᵣJ
  Vector3 angular_b;
};

/// One constraint row, with its limits, bias and impulse.
struct Row : Jacobian {
  Vector3 response_a;  ///< ᵣM⁻¹ᵣJᵀ
  Vector3 response_b;
  double effective_mass;  ///< 1 / (J M⁻¹ Jᵀ + softness)
  double beta;            ///< β: m/s or rad/s
  double low;             ///< limits of the impulse λ, N·s or N·m·s, of one (sub-)step
  double high;
  double softness;  ///< added to Γ's diagonal: the row is a spring or damper; 0 is rigid
  double impulse;   ///< λ, the total of the (sub-)step
  double earlier;   ///< the impulse of the step's earlier sub-steps, since limits hold for the sum of all
};

/// A block constraint: up to three rows between the same two bodies, solved at once. Rows in a block of more
/// than one have infinite limits.
struct Block {
  enum class Kind : std::uint8_t { lock, limit, drive };
  Kind kind;
  bool stable;  ///< Jacobian taken at next-frame coordinates (IV.2.2, point 2)
  std::uint8_t rows;
  std::uint8_t component;  ///< index of its first row among the joint's
  int first;               ///< its rows are rows[first] … rows[first + rows − 1]
  int a;
  int b;
  int coupling = -1;  ///< index in Constraints::effective_masses of a block of several rows
  int source;         ///< index of its lock, limit or drive in Model
  /// Fraction of its β that follows the coordinates: 1 for a position-level row (β = −C/hs: the update rule
  /// of A4 and A5 fits), 0 for a velocity-level row (β is a velocity), in between for a spring with a damper.
  double positional_bias_fraction = 1;
  /// True where τ and κ stabilize it: it is rigid and follows the coordinates. Motors, springs and dampers
  /// have the fixed point of their own law, J v + softness λ = β, for all τ and κ.
  bool stabilized = true;
  double inverse_mass_a;
  double inverse_mass_b;
};

/// Change of λ of a block, for up to three rows.
using Impulse = std::array<double, 3>;

/// Returns J_x v of one row, or J_x Δq.
inline double row_velocity(const Jacobian& row, const Velocity& a, const Velocity& b) {
  return row.linear.dot(a.linear - b.linear) + row.angular_a.dot(a.angular) + row.angular_b.dot(b.angular);
}

struct Constraints {
  std::vector<Block> blocks;
  std::vector<Row> rows;
  std::vector<Matrix3> effective_masses;  ///< (J M⁻¹ Jᵀ)⁻¹ of each block of several rows
  /// Impulses of the rows in the last sub-step of the step before; empty without a warm start.
  std::vector<double> last_step_impulses;
  int limits_of = 1;          ///< number of sub-steps that have begun: limits are multiplied by it
  double bias_scale = 1;      ///< factor of stabilized rows' β: τ/κ in A5
  bool is_limit_hit = false;  ///< a rigid one-sided limit is hit in the sub-step
  ContactBatches contacts;    ///< a sweep solves them last

  std::span<Row> rows_of(const Block& x) { return {rows.data() + x.first, x.rows}; }
  std::int64_t row_count() const { return std::ssize(rows) + contacts.row_count; }
};

/// Solves block x for the change of λ in  J_x(κ v̂ + M⁻¹J_xᵀλ) = τ β_x : lo, hi; where x is not stabilized,
/// in J_x(v̂ + M⁻¹J_xᵀλ) + softness λ = β_x: κ would make a spring softer. `limit_scale` is A5's 1/κ, by
/// which its λ and their limits are larger.
inline Impulse solve(Constraints& c, const Block& x, const Stabilization& by, const std::vector<Velocity>& v,
                     double limit_scale = 1) {
  const Velocity& a = v[x.a];
  const Velocity& b = v[x.b];
  Impulse change{};
  if (x.rows == 1) {
    Row& row = c.rows[x.first];
    const double velocity = row_velocity(row, a, b);
    const double wanted = x.stabilized ? by.tau * row.beta - by.kappa * velocity -
                                             row.softness * (by.kappa / limit_scale) * row.impulse
                                       : limit_scale * (row.beta - velocity) - row.softness * row.impulse;
    // The limits hold for the sum of all sub-steps so far: a later one may take back an earlier impulse. A
    // one-sided spring may not: it would pull.
    const double scale = limit_scale * c.limits_of;
    const double earlier = x.stabilized || row.low < 0 ? row.earlier : 0;
    const double before = row.impulse;
    row.impulse = std::clamp(before + wanted * row.effective_mass, row.low * scale - earlier,
                             row.high * scale - earlier);
    change[0] = row.impulse - before;
    return change;
  }
  Vector3 wanted = Vector3::Zero();
  for (int k = 0; k < x.rows; ++k) {
    const Row& row = c.rows[x.first + k];
    wanted[k] = by.tau * row.beta - by.kappa * row_velocity(row, a, b);
  }
  const Vector3 lambda = c.effective_masses[x.coupling] * wanted;
  for (int k = 0; k < x.rows; ++k) {
    c.rows[x.first + k].impulse += lambda[k];
    change[k] = lambda[k];
  }
  return change;
}

/// Solves a row of A2, λ_x ← clamp(λ_x + ω δ, lo, hi), and returns the change of λ. Blocks of one row only.
inline double solve_relaxed(Constraints& c, const Block& x, double omega, const std::vector<Velocity>& v) {
  Row& row = c.rows[x.first];
  const double before = row.impulse;
  const double wanted = row.beta - row_velocity(row, v[x.a], v[x.b]) - row.softness * before;
  row.impulse = std::clamp(before + omega * wanted * row.effective_mass, row.low, row.high);
  return row.impulse - before;
}

/// Applies a change of impulse: v ← v + scale · M⁻¹J_xᵀ change.
inline void apply(const Constraints& c, const Block& x, const Impulse& change, std::vector<Velocity>& v,
                  double scale = 1) {
  Velocity& a = v[x.a];
  Velocity& b = v[x.b];
  for (int k = 0; k < x.rows; ++k) {
    const Row& row = c.rows[x.first + k];
    const double impulse = scale * change[k];
    a.linear += row.linear * (x.inverse_mass_a * impulse);
    a.angular += row.response_a * impulse;
    b.linear -= row.linear * (x.inverse_mass_b * impulse);
    b.angular += row.response_b * impulse;
  }
}

/// Returns the impulses of block x's rows.
inline Impulse impulse_of(const Constraints& c, const Block& x) {
  Impulse impulse{};
  for (int k = 0; k < x.rows; ++k) impulse[k] = c.rows[x.first + k].impulse;
  return impulse;
}

/// Sets λ = 0 at the start of a step. With a warm start the first sub-step continues from
/// `last_step_impulses`.
inline void clear_impulses(Constraints& c) {
  for (Row& row : c.rows) row.impulse = row.earlier = 0;
  for (std::size_t i = 0; i < c.last_step_impulses.size(); ++i) {
    c.rows[i].impulse = c.last_step_impulses[i];
    c.rows[i].earlier = -c.last_step_impulses[i];
  }
  c.limits_of = 0;
}

}  // namespace substep
