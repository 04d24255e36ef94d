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

double transverse_frequency(const Problem& problem, const std::vector<double>& lambda, double duration) {
  std::vector<Matrix3> stiffness(problem.rotations.size(), Matrix3::Zero());  // in the bodies' frames
  for (std::size_t i = 0; i < problem.c.blocks.size(); ++i) {
    const Block& x = problem.c.blocks[i];
    if (x.kind != Block::Kind::lock) continue;
    const Lock& lock = problem.model->locks[x.source];
    if (lock.kind != Lock::Kind::point) continue;
    const Vector3 force = lambda[i] / duration * problem.c.rows[x.first].linear;
    stiffness[x.a] += stiffness_of(lock.at.frame_a.position, problem.rotations[x.a].transpose() * force);
    stiffness[x.b] -= stiffness_of(lock.at.frame_b.position, problem.rotations[x.b].transpose() * force);
  }
  double squared = 0;
  for (std::size_t i = 0; i < stiffness.size(); ++i) {
    const Vector3& root = problem.model->masses[i].root_inverse_inertia;
    if (stiffness[i].isZero(0) || root.isZero(0)) continue;
    const Matrix3 weighted = root.asDiagonal() * stiffness[i] * root.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Matrix3> solver(weighted, Eigen::EigenvaluesOnly);
    squared = std::max(squared, solver.eigenvalues()[2]);
  }
  return std::sqrt(squared);
}

}  // namespace substep
