// The geometric stiffness of taut joints, which makes light bodies stiff in the transverse direction, and the
// energy of springs.

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "sim/constraints/formulate.h"
#include "sim/direct/direct_solver.h"

namespace substep {
namespace {

/// Returns K of a force at an arm.
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

double frequency_at_rest(const Model& model, const std::vector<Contact>& contacts,
                         const std::vector<Coordinates>& q, double h) {
  Problem problem;
  problem.model = &model;
  problem.contacts = &contacts;
  problem.substeps.part = 0;  // gaps at the start are no loads
  build_blocks(problem, Joints::rows);
  formulate(problem, q, h);
  std::vector<Vector3> gravities{model.gravity};
  const auto is_point = [](const Lock& lock) { return lock.kind == Lock::Kind::point; };
  for (int axis = 0; axis < 3 && std::ranges::all_of(model.locks, is_point); ++axis) {
    for (const double sign : {-1.0, 1.0})
      gravities.emplace_back(sign * model.gravity.norm() * Vector3::Unit(axis));
  }
  double frequency = 0;
  DirectSolver solver;
  Mlcp mlcp;
  std::vector<double> lambda;
  std::vector<Matrix3> stiffness;
  for (const Vector3& gravity : gravities) {
    std::vector<Velocity> v(q.size());
    for (std::size_t i = 1; i < v.size(); ++i) {
      if (model.masses[i].inverse_mass > 0) v[i].linear = h * model.masses[i].gravity_factor * gravity;
    }
    make_mlcp(problem, v, mlcp);
    if (solver.solve(mlcp, lambda).status == MlcpReport::Status::unsolved) continue;
    for (std::size_t i = 0; i < problem.c.blocks.size(); ++i)
      problem.c.rows[problem.c.blocks[i].first].impulse = lambda[i];
    frequency = std::max(frequency, transverse_frequency(problem, h, 0, stiffness));
  }
  return frequency;
}

double energy_of_springs(const Model& model, const std::vector<Coordinates>& q) {
  double energy = 0;
  for (const Limit& limit : model.limits) {
    if (!limit.soft) continue;
    const double beyond = value_of(limit.coordinate, limit.at, q) - limit.bound;
    const bool is_held = limit.side == Limit::Side::both || (limit.side == Limit::Side::high) == (beyond > 0);
    if (is_held) energy += limit.stiffness * beyond * beyond / 2;
  }
  for (const Drive& drive : model.drives) {
    const double off = value_of(drive.coordinate, drive.at, q) - drive.position_target;
    if (!drive.per_mass) energy += drive.stiffness * off * off / 2;
  }
  return energy;
}

}  // namespace substep
