#pragma once
/// The order in which a sweep goes through the blocks.

#include <vector>

#include "sim/constraints/constraint.h"
#include "sim/model/model.h"

namespace substep {

/// A block waits for the velocities that the block before it leaves where they share a body, and the wait
/// is most of its time. Blocks that have no moving body in common can overlap.
class BlockOrder {
 public:
  /// Sorts the blocks and renumbers their rows, such that blocks in succession seldom share a moving body.
  /// Those that do keep their order, so that a sweep computes the same bits as before. Rows are to be
  /// formulated afterwards. Keeps its memory from step to step.
  void interleave(const Model& model, Constraints& c);

 private:
  std::vector<int> depth_;  ///< by body: blocks on the longest chain of waits that ends in it
  std::vector<int> level_;  ///< by block: how many it has to wait for
  std::vector<int> begin_;  ///< by level: place of its next block
  std::vector<Block> sorted_;
};

}  // namespace substep
