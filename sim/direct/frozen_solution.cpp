// Solves frozen problems by A1's method on the matrix alone, or by sweeps, and measures errors of solutions.

#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/direct/direct_solver.h"
#include "sim/direct/frozen_problem.h"

namespace substep {
namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;

/// A1's solver for problems of which only the matrix is known: the active sets and centres of MlcpSolver,
/// with linear systems in the space of the rows. W + εD of the free and sliding rows is factored, symmetric
/// or not. Friction must be in pairs of rows. The bodies' parts of rows are ignored.
class MatrixSolver : public MlcpSolver {
 public:
  /// Keeps a reference to W = Γ + S.
  explicit MatrixSolver(const Eigen::SparseMatrix<double>& matrix) : matrix_(matrix) {}

 protected:
  using VectorX = Eigen::VectorXd;

  void prepare() override;
  void velocities() override;
  bool rest_is_redundant() override;
  void factor() override;
  void solve_free() override;
  bool solve_interior() override { return false; }

 private:
  const SparseMatrix& matrix_;
  std::vector<int> unknown_;  ///< by row: column of a free row, or of a sliding pair by its first row
  Eigen::SparseLU<SparseMatrix> factors_;
  bool is_regular_ = false;
};

Eigen::Map<const Eigen::VectorXd> as_vector(const std::vector<double>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

void MatrixSolver::prepare() {
  MlcpSolver::prepare();
  for (std::size_t i = 0; i < gamma_.size(); ++i) {
    const auto row = static_cast<int>(i);
    gamma_[i] = matrix_.coeff(row, row);
    if (pair_[i] != Pair::second) continue;
    const double between = (matrix_.coeff(row - 1, row) + matrix_.coeff(row, row - 1)) / 2;
    // Use the larger eigenvalue of the pair's block for both rows.
    gamma_[i - 1] = gamma_[i] =
        (gamma_[i - 1] + gamma_[i]) / 2 + std::hypot((gamma_[i - 1] - gamma_[i]) / 2, between);
  }
}

void MatrixSolver::velocities() {
  const VectorX product = matrix_ * as_vector(lambda_);
  for (std::size_t i = 0; i < lambda_.size(); ++i) w_[i] = product[i] - rows()[i].right;
}

bool MatrixSolver::rest_is_redundant() {
  double of_rows = 0;
  for (std::size_t i = 0; i < natural_.size(); ++i) of_rows += natural_[i] * natural_[i] * gamma_[i];
  const auto rest = as_vector(natural_);
  return std::abs(rest.dot(matrix_ * rest)) <= rank_tolerance * of_rows;
}

void MatrixSolver::factor() {
  using Triplet = Eigen::Triplet<double>;
  std::vector<Triplet> changes;      // of each row's λ by the unknowns
  std::vector<Triplet> equations;    // the equation of each unknown as a combination of rows
  std::vector<Triplet> across_slip;  // softness of each unknown across a slip
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
        // Use the normal's unknown, which has its number since a normal comes before its friction.
        const int normal = unknown_[rows()[i].normal];
        if (normal >= 0) changes.emplace_back(row + k, normal, rows()[i].friction * slip_[i].along[k]);
      }
      across_slip.emplace_back(unknowns, unknowns, slip_[i].across);
      unknown_[i] = unknowns++;
    }
  }
  is_regular_ = unknowns > 0;
  if (!is_regular_) return;
  const auto row_count = static_cast<Eigen::Index>(set_.size());
  SparseMatrix change(row_count, unknowns);
  SparseMatrix equation(row_count, unknowns);
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

void MatrixSolver::solve_free() {
  if (!is_regular_) return;
  VectorX missing(factors_.rows());
  for (std::size_t i = 0; i < unknown_.size(); ++i) {
    if (unknown_[i] < 0) continue;
    if (set_[i] == Set::free) {
      missing[unknown_[i]] = -w_[i];
    } else {
      const double soft = slip_[i].across;
      missing[unknown_[i]] =
          -across(slip_[i].along).dot(Vector2(w_[i] + soft * lambda_[i], w_[i + 1] + soft * lambda_[i + 1]));
    }
  }
  const VectorX change = factors_.solve(missing);
  for (std::size_t i = 0; i < unknown_.size(); ++i) {
    if (unknown_[i] < 0) continue;
    if (set_[i] == Set::free) {
      lambda_[i] += change[unknown_[i]];
    } else {
      const Vector2 total = change[unknown_[i]] * across(slip_[i].along);
      lambda_[i] += total.x();
      lambda_[i + 1] += total.y();
    }
  }
}

/// Returns the point of the cone |x_t| <= μ x_n that is nearest to x.
Vector3 onto_cone(const Vector3& x, double friction) {
  const double slip = x.tail<2>().norm();
  if (slip <= friction * x[0]) return x;
  if (friction * slip <= -x[0]) return Vector3::Zero();
  const double normal = (x[0] + friction * slip) / (1 + friction * friction);
  const double factor = friction * normal / slip;
  return {normal, factor * x[1], factor * x[2]};
}

/// Returns the limits of a row's impulse; those of friction follow from its normal's impulse.
std::pair<double, double> limits_of(const std::vector<Mlcp::Row>& rows, std::size_t i,
                                    const std::vector<double>& lambda) {
  const Mlcp::Row& row = rows[i];
  if (row.normal < 0) return {row.low, row.high};
  const double most = row.friction * std::max(0.0, lambda[row.normal]);
  return {-most, most};
}

}  // namespace

int FrozenProblem::contacts() const {
  int count = 0;
  for (std::size_t i = 0; i < mlcp.rows.size(); ++i) count += are_tangents(mlcp, i) ? 1 : 0;
  return count;
}

double FrozenProblem::asymmetry() const {
  const SparseMatrix difference = matrix - SparseMatrix(matrix.transpose());
  const auto largest = [](const SparseMatrix& m) {
    return m.nonZeros() == 0 ? 0 : m.coeffs().abs().maxCoeff();
  };
  const double scale = largest(matrix);
  return scale > 0 ? largest(difference) / scale : 0;
}

ConeError cone_error(const FrozenProblem& problem, const std::vector<double>& lambda) {
  const std::vector<Mlcp::Row>& rows = problem.mlcp.rows;
  const auto count = static_cast<Eigen::Index>(rows.size());
  const Eigen::Map<const Eigen::VectorXd> impulses(lambda.data(), count);
  Eigen::VectorXd right(count);
  for (Eigen::Index i = 0; i < count; ++i) right[i] = rows[i].right;
  const Eigen::VectorXd velocity = problem.matrix * impulses - right;
  std::vector<bool> has_cone(rows.size(), false);
  double squared = 0;
  double most_power = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!are_tangents(problem.mlcp, i)) continue;
    const Eigen::Index normal = rows[i].normal;
    const Vector3 impulse(impulses[normal], impulses[i], impulses[i + 1]);
    Vector3 u(velocity[normal], velocity[i], velocity[i + 1]);
    u[0] += rows[i].friction * u.tail<2>().norm();
    squared += (impulse - onto_cone(impulse - u, rows[i].friction)).squaredNorm();
    most_power = std::max(most_power, std::abs(impulse.dot(u)));
    has_cone[normal] = has_cone[i] = has_cone[i + 1] = true;
    ++i;
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (has_cone[i]) continue;
    const auto [least, most] = limits_of(rows, i, lambda);
    const double wrong = lambda[i] - std::clamp(lambda[i] - velocity[i], least, most);
    squared += wrong * wrong;
  }
  const double scale = std::max({right.norm(), impulses.norm(), velocity.norm()});
  if (!(scale > 0)) return {};
  return {std::sqrt(squared) / scale, most_power / (scale * scale)};
}

MlcpReport solve(const FrozenProblem& problem, std::vector<double>& lambda) {
  if (problem.has_bodies) return DirectSolver().solve(problem.mlcp, lambda);
  return MatrixSolver(problem.matrix).solve(problem.mlcp, lambda);
}

void sweep_rows(const FrozenProblem& problem, std::vector<double>& lambda, int sweeps) {
  const std::vector<Mlcp::Row>& rows = problem.mlcp.rows;
  lambda.resize(rows.size(), 0.0);
  const SparseMatrix& matrix = problem.matrix;
  Eigen::VectorXd velocity = matrix * Eigen::Map<const Eigen::VectorXd>(lambda.data(), matrix.cols());
  const auto set_impulse = [&](std::size_t i, double total) {
    for (SparseMatrix::InnerIterator entry(matrix, i); entry; ++entry)
      velocity[entry.row()] += entry.value() * (total - lambda[i]);
    lambda[i] = total;
  };
  const auto missing = [&](std::size_t i) { return rows[i].right - velocity[i]; };
  const auto diagonal = [&](std::size_t i) { return matrix.coeff(static_cast<int>(i), static_cast<int>(i)); };
  for (int s = 0; s < sweeps; ++s) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (!(diagonal(i) > 0)) continue;
      const auto [least, most] = limits_of(rows, i, lambda);
      if (!are_tangents(problem.mlcp, i)) {
        set_impulse(i, std::clamp(lambda[i] + missing(i) / diagonal(i), least, most));
        continue;
      }
      const auto first = static_cast<int>(i);
      const double between = (matrix.coeff(first, first + 1) + matrix.coeff(first + 1, first)) / 2;
      const Eigen::Matrix2d block{{diagonal(i), between}, {between, diagonal(i + 1)}};
      const Vector2 before(lambda[i], lambda[i + 1]);
      const Vector2 right(missing(i), missing(i + 1));
      Vector2 total = before + block.inverse() * right;
      if (!(total.norm() <= most)) {
        const double half = (block(0, 0) - block(1, 1)) / 2;
        const double largest = (block(0, 0) + block(1, 1)) / 2 + std::sqrt(half * half + between * between);
        total = before + right / largest;
        total *= total.norm() > 0 ? most / total.norm() : 0;
      }
      set_impulse(i, total.x());
      set_impulse(i + 1, total.y());
      ++i;
    }
  }
}

}  // namespace substep
