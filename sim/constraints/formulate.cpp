#include "sim/constraints/formulate.h"

#include "sim/constraints/joint_rows.h"

namespace substep {

void formulate(Problem& problem, const std::vector<Coordinates>& q, double hs) {
  problem.rotations.resize(q.size());
  for (std::size_t i = 0; i < q.size(); ++i) problem.rotations[i] = q[i].angular.toRotationMatrix();
  for (Block& x : problem.c.blocks) {
    formulate_block(problem, x, {q[x.a], q[x.b], problem.rotations[x.a], problem.rotations[x.b]}, hs);
  }
  formulate(problem.c.contacts, *problem.contacts, q, problem.rotations, hs);
}

}  // namespace substep
