#pragma once
/// A1's solver for problems of which only the matrix is known.

#include <Eigen/SparseCore>
#include <Eigen/SparseLU>
#include <vector>

#include "sim/direct/mlcp.h"

namespace substep {

/// The active sets and centres of MlcpSolver, with the linear systems in the space of the rows:
/// (W + εD) of the rows that are free or slide, factored as it is, symmetric or not. Friction must be in
/// pairs of rows. The rows' parts are not read.
class MlcpMatrixSolver : public MlcpSolver {
 public:
  /// Keeps a reference to W = Γ + S.
  explicit MlcpMatrixSolver(const Eigen::SparseMatrix<double>& matrix) : matrix_(matrix) {}

 protected:
  using SparseMatrix = Eigen::SparseMatrix<double>;
  using VectorX = Eigen::VectorXd;

  void prepare(const Mlcp& problem) override;
  void velocities(const Mlcp& problem, const std::vector<double>& lambda) override;
  bool rest_is_redundant(const Mlcp& problem) override;
  void factor(const Mlcp& problem) override;
  void solve_free(const Mlcp& problem, std::vector<double>& lambda) override;
  bool solve_interior(const Mlcp& /*problem*/, std::vector<double>& /*lambda*/,
                      MlcpReport& /*report*/) override {
    return false;
  }

 private:
  const SparseMatrix& matrix_;
  std::vector<int>
      unknown_;  ///< by row: column of the free row, or of the sliding pair whose first row it is
  Eigen::SparseLU<SparseMatrix> factors_;
  bool is_regular_ = false;
};

}  // namespace substep
