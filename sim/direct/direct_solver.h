#pragma once
/// A1's solver: the envelope method where it applies, else the general one of mlcp.h.

#include <vector>

#include "sim/direct/mlcp.h"
#include "sim/math/vector.h"

namespace substep {

/// Solves problems whose rows all have infinite limits, where λ is one linear system. Rows between the same
/// two bodies are taken by threes; Γ + S, in blocks of 3×3, is factored as L D Lᵀ in its envelope, blocks
/// ordered by reverse Cuthill–McKee: which costs as much as there are rows for chains and little more for
/// trees and rings. Γ must be regular.
class EnvelopeSolver {
 public:
  /// False where the problem has limits, a large envelope or a Γ that is singular but for rounding: `lambda`
  /// is no solution then.
  bool solve(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report);

  /// Gᵀλ of the last solution, by body.
  const std::vector<Vector6>& impulses() const { return y_; }

 private:
  bool is_known(const Mlcp& problem) const;
  void analyse(const Mlcp& problem);
  void order_groups(const Mlcp& problem);
  /// Whether bodies are joined in a loop, what does not move being one of them; or by more rows than two can
  /// have.
  bool has_loops(const Mlcp& problem) const;
  bool factor(const Mlcp& problem);
  void add_solution(std::vector<double>& lambda);
  double residual(const Mlcp& problem, const std::vector<double>& lambda);
  bool is_mostly_redundant(const Mlcp& problem, const std::vector<double>& lambda) const;

  /// Up to three rows, one after the other, between the same two bodies.
  struct Group {
    int first;
    int rows;
    int a;
    int b;
  };
  /// A block of Γ left of its diagonal gets the products of one body's parts of two groups' rows.
  struct Product {
    std::ptrdiff_t block;
    Group row;
    Group column;
    bool row_is_a;
    bool column_is_a;
  };

  std::size_t rows_ = 0;       ///< of the problem analysed last
  std::vector<Group> groups_;  ///< of the problem analysed last, by place
  bool small_ = false;         ///< the envelope is
  bool has_loops_ = false;
  std::vector<int> first_;             ///< by place: the first column of its envelope
  std::vector<std::ptrdiff_t> shift_;  ///< by place: of an envelope's block from its column
  std::vector<Product> products_;
  std::vector<double> gamma_;          ///< by row: Γ_xx
  std::vector<double> inverse_gamma_;  ///< by row: 1/Γ_xx
  std::vector<Matrix3> lower_;         ///< L, row by row
  std::vector<Matrix3> inverse_diagonal_;
  std::vector<Vector3> right_;  ///< by place: what is to be solved
  std::vector<Vector6> y_;      ///< Gᵀλ by body
};

class DirectSolver {
 public:
  MlcpReport solve(const Mlcp& problem, std::vector<double>& lambda) {
    MlcpReport report;
    enveloped_ = envelope_.solve(problem, lambda, report);
    return enveloped_ ? report : general_.solve(problem, lambda);
  }

  /// Gᵀλ = M^(−1/2)Jᵀλ of the last solution, by body.
  const std::vector<Vector6>& impulses() const {
    return enveloped_ ? envelope_.impulses() : general_.impulses();
  }

 private:
  EnvelopeSolver envelope_;
  MlcpSolver general_;
  bool enveloped_ = false;  ///< whether that was the last one's
};

}  // namespace substep
