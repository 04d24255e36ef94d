#pragma once
/// A1's solver: a sparse factorisation for joints alone, else the general solver of mlcp.h.

#include <array>
#include <vector>

#include "sim/direct/block_factor.h"
#include "sim/direct/mlcp.h"
#include "sim/math/vector.h"

namespace substep {

/// Solves problems whose rows all have infinite limits, where λ solves one linear system. Γ + S is factored
/// as a sparse matrix of 3×3 blocks, of groups of up to three rows between the same two bodies. Joints in
/// loops may make Γ singular: then Γ + S + εD is factored, D = diag(Γ), and rounds of refinement solve the
/// problem itself, until the residual lies in directions in which Γ is almost 0 (mlcp.h).
class JointSolver {
 public:
  /// Returns false, without a solution, where a row has limits, Γ is singular without loops, or the rounds do
  /// not converge.
  bool solve(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report);

  /// Returns Gᵀλ of the last solution, by body.
  const std::vector<Vector6>& impulses() const { return y_; }

 private:
  bool is_known(const Mlcp& problem) const;
  void analyse(const Mlcp& problem);
  /// Calls `what` with the index of each row's group, and the row's index in the group and in the problem.
  template <typename Function>
  void for_each_row(const Function& what) const {
    for (std::size_t group = 0; group < groups_.size(); ++group) {
      for (int k = 0; k < groups_[group].rows; ++k) what(group, k, groups_[group].row[k]);
    }
  }
  /// Returns true where joints close a loop, fixed bodies being one, or two bodies share more than six rows.
  bool has_loops(const Mlcp& problem) const;
  bool factor(const Mlcp& problem, double shift);
  bool solve_tree(const Mlcp& problem, MlcpReport& report);
  bool solve_loops(const Mlcp& problem, MlcpReport& report);
  /// Sets the residuals b − (Γ + S)λ and Gᵀλ. Returns the largest, relative to the largest right side.
  double residual(const Mlcp& problem);
  double squared_residual(const Mlcp::Row& row, int i, double missing) const;
  /// Sets `impulses` to Gᵀ of a combination of rows.
  void set_impulses(const Mlcp& problem, const std::vector<Vector3>& combination,
                    std::vector<Vector6>& impulses) const;
  /// Returns true where the residual lies in directions in which Γ + S is nearly zero.
  bool rest_is_redundant(const Mlcp& problem);
  /// Returns the number of rows whose residual is beyond the tolerance.
  int violated(const Mlcp& problem) const;

  /// Up to three rows between the same two bodies.
  struct Group {
    std::array<int, 3> row;
    int rows;
    int a;
    int b;
  };
  /// An addition to an off-diagonal block of Γ: products of one body's parts of two groups' rows.
  struct Product {
    int pair;
    int row;  ///< group of the block's rows
    int column;
    bool row_is_a;
    bool column_is_a;
  };

  std::size_t rows_ = 0;       ///< of the problem analysed last
  std::vector<Group> groups_;  ///< of the problem analysed last
  bool has_loops_ = false;
  std::vector<Product> products_;
  BlockFactor factor_;
  std::vector<double> gamma_;          ///< by row: Γ_xx
  std::vector<double> inverse_gamma_;  ///< by row: 1/Γ_xx
  double squared_scale_ = 0;           ///< largest b²/Γ_xx
  // By group:
  std::vector<Vector3> multipliers_;  ///< λ
  std::vector<Vector3> left_;         ///< residuals; in solve_tree() also the change of λ
  std::vector<Vector3> best_;
  std::vector<Vector3> step_;    ///< of λ, in a round of loops
  std::vector<Vector6> y_;       ///< Gᵀλ by body
  std::vector<Vector6> step_y_;  ///< Gᵀ of `step_`
};

/// Solves joints by JointSolver, and problems with limits island by island. An island is all bodies that rows
/// connect, directly or through others. Islands at rest thus need not take the active sets of moving ones.
class DirectSolver {
 public:
  /// Solves the problem, and reports the worst island's residual, status and active sets.
  MlcpReport solve(const Mlcp& problem, std::vector<double>& lambda);

  /// Returns Gᵀλ = M^(−1/2)Jᵀλ of the last solution, by body.
  const std::vector<Vector6>& impulses() const { return impulses_; }

 private:
  struct Island {
    std::vector<int> rows;    ///< of the whole problem
    std::vector<int> bodies;  ///< of the whole problem
    Mlcp problem;
    std::vector<double> lambda;
    JointSolver joints;
    MlcpSolver general;
  };
  /// Sets the islands' rows and bodies. Returns how many islands there are.
  int list_islands(const Mlcp& problem);
  /// Sets the island's problem.
  void copy_rows(const Mlcp& problem, Island& island);

  JointSolver joints_;
  MlcpSolver general_;           ///< for problems of one island
  std::vector<Island> islands_;  ///< the last may be unused
  std::vector<int> island_of_;   ///< by root of connected bodies
  std::vector<int> index_;       ///< of a body in its island
  std::vector<int> row_index_;   ///< of a row in its island
  std::vector<Vector6> impulses_;
};

}  // namespace substep
