#pragma once
/// A1's solver: the envelope method where it applies, else the general one of mlcp.h.

#include <vector>

#include "sim/mlcp.h"

namespace substep {

/// Solves problems whose rows all have infinite limits, where λ is one linear system: Γ + S is factored as
/// L D Lᵀ in its envelope, rows ordered by reverse Cuthill–McKee, which costs as much as there are rows for
/// chains and little more for trees and rings. Γ must be regular.
class EnvelopeSolver {
 public:
  /// False where the problem has limits, a large envelope or a singular Γ: `lambda` is no solution then.
  bool solve(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report);

 private:
  bool is_known(const Mlcp& problem) const;
  void analyse(const Mlcp& problem);
  void order_rows(const Mlcp& problem);
  bool factor(const Mlcp& problem);
  void add_solution(std::vector<double>& lambda);
  double residual(const Mlcp& problem, const std::vector<double>& lambda);

  /// An entry of Γ left of its diagonal gets the product of one body's parts of two rows.
  struct Product {
    std::ptrdiff_t entry;
    int row;
    int column;  ///< row's and column's indices in the problem
    bool row_is_a;
    bool column_is_a;
  };
  struct Bodies {
    int a;
    int b;
    bool operator==(const Bodies&) const = default;
  };

  std::vector<Bodies> pattern_;        ///< of the rows analysed last
  bool small_ = false;                 ///< the envelope is
  std::vector<int> order_;             ///< rows, by place
  std::vector<int> first_;             ///< by place: the first column of its envelope
  std::vector<std::ptrdiff_t> shift_;  ///< by place: of an envelope's entry from its column
  std::vector<Product> products_;
  std::vector<double> gamma_;  ///< by row: Γ_xx
  std::vector<double> lower_;  ///< L, row by row
  std::vector<double> inverse_diagonal_;
  std::vector<double> right_;  ///< by row, then by place: what is to be solved
  std::vector<Vector6> y_;     ///< Gᵀλ by body
};

class DirectSolver {
 public:
  MlcpReport solve(const Mlcp& problem, std::vector<double>& lambda) {
    MlcpReport report;
    if (envelope_.solve(problem, lambda, report)) return report;
    return general_.solve(problem, lambda);
  }

 private:
  EnvelopeSolver envelope_;
  MlcpSolver general_;
};

}  // namespace substep
