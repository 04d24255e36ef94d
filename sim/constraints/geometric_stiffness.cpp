#include "sim/constraints/geometric_stiffness.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace substep {
namespace {

/// K of a force at an arm.
Matrix3 stiffness_of(const Vector3& arm, const Vector3& force) {
  const Matrix3 product = arm * force.transpose();
  return product.trace() * Matrix3::Identity() - (product + product.transpose()) / 2;
}

}  // namespace

double transverse_frequency(const Problem& problem, double duration, double least,
                            std::vector<Matrix3>& stiffness) {
  stiffness.assign(problem.rotations.size(), Matrix3::Zero());
  for (const Block& x : problem.c.blocks) {
    if (x.kind != Block::Kind::lock) continue;
    const Lock& lock = problem.model->locks[x.source];
    if (lock.kind != Lock::Kind::point) continue;
    const Row& row = problem.c.rows[x.first];
    const Vector3 force = row.impulse / duration * row.linear;
    stiffness[x.a] += stiffness_of(lock.at.frame_a.position, problem.rotations[x.a].transpose() * force);
    stiffness[x.b] -= stiffness_of(lock.at.frame_b.position, problem.rotations[x.b].transpose() * force);
  }
  double squared = least * least;
  for (std::size_t i = 0; i < stiffness.size(); ++i) {
    const Vector3& root = problem.model->masses[i].root_inverse_inertia;
    if (stiffness[i].isZero(0) || root.isZero(0)) continue;
    const Matrix3 weighted = root.asDiagonal() * stiffness[i] * root.asDiagonal();
    if (weighted.squaredNorm() <= squared * squared) continue;  // no eigenvalue is larger than the norm
    const Eigen::SelfAdjointEigenSolver<Matrix3> solver(weighted, Eigen::EigenvaluesOnly);
    squared = std::max(squared, solver.eigenvalues()[2]);
  }
  return std::sqrt(squared);
}

}  // namespace substep
