#include "sim/direct/mlcp_matrix.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "sim/direct/mlcp_friction.h"

namespace substep {
namespace {

constexpr int most_sweeps_of_minimise = 3000;
/// Sets after a minimum that are taken whole; of later ones every other is taken by a quarter, so that rows
/// which all but stick do not change sides for ever. Siconos' rock pile of 463 contacts ends at 1e-7, at 1e-5
/// without.
constexpr int whole_sets = 5;
constexpr double part_of_set = 0.25;
constexpr double converged = 1e-12;  // change of a sweep, relative to the largest impulse

Eigen::Map<const Eigen::VectorXd> as_vector(const std::vector<double>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

}  // namespace

void MlcpMatrixSolver::prepare(const Mlcp& problem) {
  MlcpSolver::prepare(problem);
  sets_since_minimum_ = -1;
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

double MlcpMatrixSolver::sweep_about_centre(const Mlcp& problem, std::vector<double>& lambda,
                                            VectorX& velocity) {
  double largest = 0;
  double moved = 0;
  const auto target = [&](std::size_t i) {
    const double own = proximal_ * gamma_[i];
    const double missing =
        problem.rows[i].right - velocity[static_cast<Eigen::Index>(i)] - own * (lambda[i] - centre_[i]);
    return lambda[i] + missing / (gamma_[i] + own);
  };
  const auto take = [&](std::size_t i, double total) {
    const double change = total - lambda[i];
    for (SparseMatrix::InnerIterator entry(matrix_, static_cast<Eigen::Index>(i)); entry; ++entry)
      velocity[entry.row()] += entry.value() * change;
    lambda[i] = total;
    largest = std::max(largest, std::abs(total));
    moved = std::max(moved, std::abs(change));
  };
  for (std::size_t i = 0; i < lambda.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    if (!(gamma_[i] > 0) || pair_[i] == Pair::second) continue;
    if (pair_[i] == Pair::first) {
      const double radius = limit(row, lambda[row.normal]);
      const Vector2 total = onto_disc({target(i), target(i + 1)}, radius);
      take(i, total.x());
      take(i + 1, total.y());
    } else {
      take(i, std::clamp(target(i), row.low, row.high));
    }
  }
  return largest > 0 ? moved / largest : 0;
}

void MlcpMatrixSolver::sweep(const Mlcp& problem, std::vector<double>& lambda, int sweeps) {
  VectorX velocity = matrix_ * as_vector(lambda);
  centre_ = lambda;
  proximal_ = 0;
  for (int s = 0; s < sweeps; ++s) sweep_about_centre(problem, lambda, velocity);
}

bool MlcpMatrixSolver::rest_is_redundant(const Mlcp& /*problem*/) {
  double of_rows = 0;
  for (std::size_t i = 0; i < natural_.size(); ++i) of_rows += natural_[i] * natural_[i] * gamma_[i];
  const auto rest = as_vector(natural_);
  return std::abs(rest.dot(matrix_ * rest)) <= rank_tolerance * of_rows;
}

void MlcpMatrixSolver::factor(const Mlcp& problem, Friction friction) {
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
        if (friction == Friction::follows && normal >= 0)
          changes.emplace_back(row + k, normal, problem.rows[i].friction * slip_[i].along[k]);
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
  VectorX change = factors_.solve(missing);
  if (sets_since_minimum_ >= 0 && ++sets_since_minimum_ > whole_sets && sets_since_minimum_ % 2 == 1)
    change *= part_of_set;
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

void MlcpMatrixSolver::minimise(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report) {
  sets_since_minimum_ = 0;
  VectorX velocity = matrix_ * as_vector(lambda);
  for (int s = 0; s < most_sweeps_of_minimise; ++s) {
    report.row_solves += static_cast<std::int64_t>(lambda.size());
    if (!(sweep_about_centre(problem, lambda, velocity) > converged)) break;
  }
}

}  // namespace substep
