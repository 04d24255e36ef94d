#include "sim/direct/mlcp_matrix.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "sim/direct/mlcp_friction.h"

namespace substep {
namespace {

Eigen::Map<const Eigen::VectorXd> as_vector(const std::vector<double>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

}  // namespace

void MlcpMatrixSolver::prepare(const Mlcp& problem) {
  MlcpSolver::prepare(problem);
  for (std::size_t i = 0; i < gamma_.size(); ++i) {
    const auto row = static_cast<int>(i);
    gamma_[i] = matrix_.coeff(row, row);
    if (pair_[i] != Pair::second) continue;
    const double between = (matrix_.coeff(row - 1, row) + matrix_.coeff(row, row - 1)) / 2;
    const Eigen::Matrix2d block{{gamma_[i - 1], between}, {between, gamma_[i]}};
    gamma_[i - 1] = gamma_[i] =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(block, Eigen::EigenvaluesOnly).eigenvalues()[1];
  }
}

void MlcpMatrixSolver::velocities(const Mlcp& problem, const std::vector<double>& lambda) {
  const VectorX product = matrix_ * as_vector(lambda);
  for (std::size_t i = 0; i < lambda.size(); ++i)
    w_[i] = product[static_cast<Eigen::Index>(i)] - problem.rows[i].right;
}

bool MlcpMatrixSolver::rest_is_redundant(const Mlcp& /*problem*/) {
  double of_rows = 0;
  for (std::size_t i = 0; i < natural_.size(); ++i) of_rows += natural_[i] * natural_[i] * gamma_[i];
  const auto rest = as_vector(natural_);
  return std::abs(rest.dot(matrix_ * rest)) <= rank_tolerance * of_rows;
}

void MlcpMatrixSolver::factor(const Mlcp& problem) {
  using Triplet = Eigen::Triplet<double>;
  std::vector<Triplet> changes;    // of rows by unknowns
  std::vector<Triplet> equations;  // the equation of each unknown as a combination of rows
  std::vector<Triplet> across_slip;
  unknown_.assign(set_.size(), -1);
  int unknowns = 0;
  SparseMatrix with_proximal = matrix_;
  for (std::size_t i = 0; i < set_.size(); ++i) {
    const auto row = static_cast<int>(i);
    if (gamma_[i] > 0) with_proximal.coeffRef(row, row) += proximal_ * gamma_[i];
    if (set_[i] == Set::free) {
      changes.emplace_back(row, unknowns, 1);
      equations.emplace_back(row, unknowns, 1);
      unknown_[i] = unknowns++;
    } else if (set_[i] == Set::slides && pair_[i] == Pair::first) {
      const Vector2 aside = across(slip_[i].along);
      for (int k = 0; k < 2; ++k) {
        changes.emplace_back(row + k, unknowns, aside[k]);
        equations.emplace_back(row + k, unknowns, aside[k]);
        // A normal comes before its friction, so its unknown is known.
        const int normal = unknown_[static_cast<std::size_t>(problem.rows[i].normal)];
        if (normal >= 0) changes.emplace_back(row + k, normal, problem.rows[i].friction * slip_[i].along[k]);
      }
      across_slip.emplace_back(unknowns, unknowns, slip_[i].across);
      unknown_[i] = unknowns++;
    }
  }
  is_regular_ = unknowns > 0;
  if (!is_regular_) return;
  const auto rows = static_cast<Eigen::Index>(set_.size());
  SparseMatrix change(rows, unknowns);
  SparseMatrix equation(rows, unknowns);
  SparseMatrix softness(unknowns, unknowns);
  change.setFromTriplets(changes.begin(), changes.end());
  equation.setFromTriplets(equations.begin(), equations.end());
  softness.setFromTriplets(across_slip.begin(), across_slip.end());
  const SparseMatrix product = with_proximal * change;
  SparseMatrix system = SparseMatrix(equation.transpose()) * product + softness;
  system.makeCompressed();
  factors_.compute(system);
  is_regular_ = factors_.info() == Eigen::Success;
}

void MlcpMatrixSolver::solve_free(const Mlcp& /*problem*/, std::vector<double>& lambda) {
  if (!is_regular_) return;
  VectorX missing(factors_.rows());
  for (std::size_t i = 0; i < unknown_.size(); ++i) {
    if (unknown_[i] < 0) continue;
    if (set_[i] == Set::free) {
      missing[unknown_[i]] = -w_[i];
    } else {
      const double soft = slip_[i].across;
      missing[unknown_[i]] =
          -across(slip_[i].along).dot(Vector2(w_[i] + soft * lambda[i], w_[i + 1] + soft * lambda[i + 1]));
    }
  }
  const VectorX change = factors_.solve(missing);
  for (std::size_t i = 0; i < unknown_.size(); ++i) {
    if (unknown_[i] < 0) continue;
    if (set_[i] == Set::free) {
      lambda[i] += change[unknown_[i]];
    } else {
      const Vector2 total = change[unknown_[i]] * across(slip_[i].along);
      lambda[i] += total.x();
      lambda[i + 1] += total.y();
    }
  }
}

}  // namespace substep
