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

/// Solves Γλ = right, and returns impulses by body: with the joints' solver, else densely, where λ may not be
/// unique.
class RowSolver {
 public:
  void solve(const Mlcp& problem);
  const std::vector<Vector6>& impulses() const { return impulses_; }
  const std::vector<double>& lambda() const { return lambda_; }

 private:
  JointSolver joints_;
  std::vector<double> lambda_;
  std::vector<Vector6> impulses_;
};

/// The dynamics of rigid two-sided rows, whose λ is solved for, and of springs and drives, which are forces.
/// Velocities are local ones, v̆.
class ConstrainedDynamics {
 public:
  /// `size`: of the scene, m. One-sided limits are no rows before they are held.
  ConstrainedDynamics(const Model& model, double size);
  ConstrainedDynamics(const ConstrainedDynamics&) = delete;
  ConstrainedDynamics& operator=(const ConstrainedDynamics&) = delete;

  /// Makes these one-sided limits two-sided rows, and no others.
  void hold(const std::vector<Limit>& bounds);

  /// Returns λ of the limits that are held, N or N·m.
  std::vector<double> pushes(const CoordinateVector& q, const VelocityVector& v);

  /// By drive: the limit of its force that it is stepped with (1, −1; 0: within the limits), and the limit
  /// that it has reached.
  const std::vector<int>& drive_sides() const { return drive_sides_; }
  void set_drive_sides(std::vector<int> sides) { drive_sides_ = std::move(sides); }
  std::vector<int> drive_sides_at(const CoordinateVector& q, const VelocityVector& v);

  /// Returns the largest |C(q)| of a row.
  double violation(const CoordinateVector& q);

  /// Leaves out redundant rows until the next call. A row is redundant where its direction, of unit length in
  /// the metric of the masses, depends linearly on the others to `tolerance`. Redundant rows of a closed loop
  /// agree only where C(q) = 0. Inner points of a step drift off, where those rows would contradict one
  /// another.
  void choose_rows(const CoordinateVector& q, double tolerance);

  /// Returns the accelerations v̆' at q and v̆.
  const VelocityVector& accelerate(const CoordinateVector& q, const VelocityVector& v);

  /// Projects q onto C(q) = 0 by Newton's method in the metric of the masses, then v̆ onto J̆ v̆ = 0.
  void project(CoordinateVector& q, VelocityVector& v);

  std::int64_t row_solves() const { return row_solves_; }

 private:
  /// Adds springs and drives as in joint_rows.cpp, with hs → 0: force = stiffness · deflection − damping ·
  /// rate.
  void add_forces(const CoordinateVector& q, const VelocityVector& v);
  /// Returns the force of a drive without its limit. With hs = 1, β is that force over stiffness + damping.
  double drive_force(const Block& x, const VelocityVector& v) const;
  /// Returns 1 at the greatest force, −1 at the opposite one, 0 between.
  int side_of(const Block& x, const VelocityVector& v) const;
  /// Adds M̆⁻¹J̆ᵀλ to v such that J̆ v = β, with the current rows.
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
