#pragma once
/// The equations of motion with their constraints differentiated twice (index 1), and the projection onto the
/// constraints, as long as no event changes the set of rows. Internal to the reference integrator.

#include <cstdint>
#include <utility>
#include <vector>

#include "sim/algorithms.h"
#include "sim/direct/direct_solver.h"
#include "sim/measure/jacobian_rate.h"

namespace substep {

/// Γλ = right, and the impulses by body: by the envelope method, else densely, where λ may not be unique.
class RowSolver {
 public:
  void solve(const Mlcp& problem);
  const std::vector<Vector6>& impulses() const { return impulses_; }
  const std::vector<double>& lambda() const { return lambda_; }

 private:
  EnvelopeSolver envelope_;
  std::vector<double> lambda_;
  std::vector<Vector6> impulses_;
};

/// Rigid two-sided rows, of which λ is asked, and springs and drives, which are forces. Velocities are local
/// ones, v̆.
class ConstrainedDynamics {
 public:
  /// `size`: of the scene, m. One-sided limits are no rows before they are held.
  ConstrainedDynamics(const Model& model, double size);
  ConstrainedDynamics(const ConstrainedDynamics&) = delete;
  ConstrainedDynamics& operator=(const ConstrainedDynamics&) = delete;

  /// Makes these one-sided limits two-sided rows, and no others.
  void hold(const std::vector<Limit>& bounds);

  /// λ of the limits that are held, N or N·m.
  std::vector<double> pushes(const CoordinateVector& q, const VelocityVector& v);

  /// By drive: which of its greatest forces it is at as it is stepped (1, −1; 0: within), and which it would
  /// be at.
  const std::vector<int>& drive_sides() const { return drive_sides_; }
  void set_drive_sides(std::vector<int> sides) { drive_sides_ = std::move(sides); }
  std::vector<int> drive_sides_at(const CoordinateVector& q, const VelocityVector& v);

  /// Largest |C(q)| of a row.
  double violation(const CoordinateVector& q);

  /// Which rows count until this is called again: of rows that say the same at q, those that are needed. A
  /// closed loop's redundant rows agree where C(q) = 0 only: where a step's inner points have drifted off,
  /// they contradict one another, and what is left out holds by itself. Rows' directions, of unit length in
  /// the metric of the masses, are redundant where what they have beyond the others' is shorter than
  /// `tolerance`.
  void choose_rows(const CoordinateVector& q, double tolerance);
  /// Rows that are left out.
  int redundant_rows() const { return redundant_rows_; }

  /// v̆' at q and v̆.
  const VelocityVector& accelerate(const CoordinateVector& q, const VelocityVector& v);

  /// Onto C(q) = 0 by Newton's method, the nearest in the metric of the masses; then onto J̆ v̆ = 0.
  void project(CoordinateVector& q, VelocityVector& v);

  std::int64_t row_solves() const { return row_solves_; }

 private:
  /// Springs and drives as in formulate.cpp, with hs → 0: force = stiffness · way − damping · rate.
  void add_forces(const CoordinateVector& q, const VelocityVector& v);
  /// What a drive would do without its greatest force: formulated with hs = 1, β is the pull over stiffness +
  /// damping.
  double drive_force(const Block& x, const VelocityVector& v) const;
  /// 1: at its greatest force, −1: at the opposite, 0: within.
  int side_of(const Block& x, const VelocityVector& v) const;
  /// v ← v + M̆⁻¹J̆ᵀλ such that J̆ v = β, with the rows as they are.
  void respond(VelocityVector& v);
  /// By row of rigid_.
  double lambda_of(int row) const;

  double size_;
  std::vector<Contact> no_contacts_;
  Model rigid_model_;
  Model force_model_;
  std::size_t two_sided_;  // of rigid_model_.limits, the first
  std::vector<int> drive_sides_;
  Problem rigid_;
  Problem force_;
  JacobianRate jacobian_rate_;
  Mlcp mlcp_;
  RowSolver solver_;
  std::vector<int> place_;  // by row of rigid_: among those that count; −1: redundant. Empty: all count
  int redundant_rows_ = 0;
  std::int64_t row_solves_ = 0;
  VelocityVector change_;
  VelocityVector acceleration_;
};

}  // namespace substep
