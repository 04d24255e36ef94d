#pragma once
/// L D Lᵀ of a sparse symmetric matrix of 3×3 blocks.

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "sim/math/vector.h"

namespace substep {

/// Factors symmetric positive matrices whose blocks have one pattern, in an order of little fill (approximate
/// minimum degree): as much work as there are blocks for chains and trees, n^1.5 for nets.
class BlockFactor {
 public:
  /// Takes the pattern: `count` diagonal blocks and those of the pairs (row, column), of which none is given
  /// twice. Swaps row and column of a pair whose transposed block is stored.
  void analyse(int count, std::vector<std::pair<int, int>>& pairs);

  /// Sets all blocks to zero.
  void clear();
  Matrix3& diagonal(int i) { return diagonal_[position_[i]]; }
  /// Returns the block of a pair, in the order that analyse() left.
  Matrix3& block(int pair) { return lower_[edge_of_pair_[pair]]; }

  /// Factors the blocks that were set. Returns false unless pivots exceed `least` × diagonal.
  bool factor(double least);

  /// Solves for `x`, in place, by index.
  void solve(std::vector<Vector3>& x);

 private:
  std::vector<int> position_;  ///< of an index in the order of elimination
  std::vector<int> index_;     ///< at a position
  /// By position: the later positions with which it has a block, ascending; a block has its edge's number.
  std::vector<int> begin_;
  std::vector<int> row_;
  std::vector<int> edge_of_pair_;
  /// By position, and pair of its edges: the block that the product of the two edges changes.
  std::vector<int> targets_;
  std::vector<Matrix3> diagonal_;
  std::vector<Matrix3> inverse_;
  std::vector<Matrix3> lower_;
  std::vector<Matrix3> column_;  ///< of the position that is being eliminated, before the column is scaled
  std::vector<Vector3> right_;
};

}  // namespace substep
