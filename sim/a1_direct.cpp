// Algorithm 1, Γ(t,h): essential stepping.
//
// The direct solver is in mlcp.h. It works on weighted rows J M^(−1/2), so that Γ is their product with
// themselves.

#include "sim/algorithms.h"
#include "sim/rotation.h"

namespace substep {

void proc1(CoordinateVector& q, VelocityVector& v, const Settings& settings, Problem& problem, Work& work) {
  const double h = settings.step;
  const Model& model = *problem.model;
  Constraints& c = problem.c;

  // Step velocities
  add_external(model, q, Frame::world, h, v);  // [v + ext]
  make_mlcp(problem, v, work.mlcp);
  work.report = work.solver.solve(work.mlcp, work.lambda);  // proc1:3
  // J([v + ext] + M⁻¹Jᵀλ) = β(h) : lo, hi  // proc1:4
  work.row_solves += work.report.row_solves;
  for (const Block& x : c.blocks) {
    Row& row = c.rows[x.first];
    row.impulse = work.lambda[x.first];
    apply(c, x, {row.impulse}, v);  // proc1:5
  }

  // Step coordinates
  for (std::size_t i = 0; i < q.size(); ++i) {
    q[i].linear += h * v[i].linear;                                               // proc1:7
    q[i].angular = compose(rotation_quaternion(h * v[i].angular), q[i].angular);  // proc1:8
  }
}

}  // namespace substep
