// Algorithm 2, Γ̂(t,h): essential stepping, iterative.
//
// | line | A1                        | here                                                  | measured by    |
// |------|---------------------------|-------------------------------------------------------|----------------|
// | 5–9  | all rows at once, exactly | row by row; projected successive over-relaxation by ω | claims 1, 2, 3 |
//
// The limits hold for a row's total impulse, and v̂ moves by the change of the total. The report leaves the
// order of the rows and contacts open. Joints come first, then the manifolds of contacts, as patches
// (contact_patch.h) or by points (contact_batch.h); manifolds far from fixed bodies come before near ones.
// Rows are in the bodies' frames, and v is v̆ while they are solved, as in A1: J v = J̆ v̆ (III).

#include <cmath>

#include "sim/algorithms.h"
#include "sim/math/rotation.h"

namespace substep {

void proc2(CoordinateVector& q, VelocityVector& v, const Settings& settings, Problem& problem, Work& work) {
  const double h = settings.step;
  Constraints& c = problem.c;

  // Step velocities
  VelocityVector& v_hat = v;
  to_local(problem.rotations, v);
  clear_impulses(c);
  start_substep(problem, v_hat);
  add_external(problem, h, v_hat);  // proc2:3
  // Iterate
  double moved = infinity;
  const int cap = sweeps_of(problem, settings.iterations);
  for (int p = 0; p < cap && moved > settings.tolerance; ++p) {  // proc2:5
    moved = 0;
    for (const Block& x : c.blocks) {  // proc2:6
      // Solve for λ in  // proc2:7
      // J_x(v̂ + M_x⁻¹J_xᵀλ) = β_x(h) : lo_x, hi_x
      const double change = solve_relaxed(c, x, settings.relaxation, v_hat);  // proc2:8
      apply(c, x, {change}, v_hat);                                           // proc2:9
      moved = std::max(moved, std::abs(change) / c.rows[x.first].effective_mass);
    }
    for (const ContactBatch& x : c.contacts.batches) {
      solve_and_apply(c.contacts, x, {.omega = settings.relaxation}, v_hat, &moved);
    }
    work.row_solves += c.row_count();
  }
  renew_free_rotation(problem, h, v);
  to_world(problem.rotations, v);
  // v' = v̂, in place  // proc2:10

  // Step coordinates; body 0 is the world
  for (std::size_t i = 1; i < q.size(); ++i) {
    q[i].linear += h * v[i].linear;                                               // proc2:12
    q[i].angular = compose(rotation_quaternion(h * v[i].angular), q[i].angular);  // proc2:13
  }
  carry_momenta(problem, h, q, v);
}

}  // namespace substep
