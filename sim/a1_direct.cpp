// Algorithm 1, Γ(t,h): essential stepping.
//
// The direct solver is in direct_solver.h. It works on weighted rows G = J M^(−1/2), with Γ = G Gᵀ. As M
// rotates with the bodies, it uses J̆ M̆^(−1/2) and v̆ instead: J v = J̆ v̆ (III).
//
// The report leaves friction and restitution open. Here friction is Coulomb's disc, solved with all other
// rows (mlcp.h), and bodies that meet in the step bounce (contact_batch.h).

#include "sim/algorithms.h"
#include "sim/math/rotation.h"

namespace substep {

void proc1(CoordinateVector& q, VelocityVector& v, const Settings& settings, Problem& problem, Work& work) {
  const double h = settings.step;
  const Model& model = *problem.model;

  // Step velocities
  to_local(problem.rotations, v);
  start_substep(problem, v);
  add_external(problem, h, v);  // [v + ext]
  make_mlcp(problem, v, work.mlcp);
  work.report = work.solver.solve(work.mlcp, work.lambda);  // proc1:3
  // J([v + ext] + M⁻¹Jᵀλ) = β(h) : lo, hi  // proc1:4
  add_impulses(model, work.solver.impulses(), v);  // proc1:5
  renew_free_rotation(problem, h, v);
  to_world(problem.rotations, v);
  work.row_solves += work.report.row_solves;

  // Step coordinates; body 0 is the world
  for (std::size_t i = 1; i < q.size(); ++i) {
    q[i].linear += h * v[i].linear;                                               // proc1:7
    q[i].angular = compose(rotation_quaternion(h * v[i].angular), q[i].angular);  // proc1:8
  }
  carry_momenta(problem, h, q, v);
}

}  // namespace substep
