#include "sim/constraints/block_order.h"

namespace substep {

void BlockOrder::interleave(const Model& model, Constraints& c) {
  level_.reserve(c.blocks.capacity());
  begin_.reserve(c.blocks.capacity() + 1);
  sorted_.reserve(c.blocks.capacity());

  // A block's level is one above those that it waits for.
  depth_.assign(model.masses.size(), 0);
  level_.resize(c.blocks.size());
  begin_.assign(1, 0);
  for (std::size_t i = 0; i < c.blocks.size(); ++i) {
    const Block& x = c.blocks[i];
    const int level = std::max(depth_[x.a], depth_[x.b]);
    if (moves(model.masses[x.a])) depth_[x.a] = level + 1;
    if (moves(model.masses[x.b])) depth_[x.b] = level + 1;
    level_[i] = level;
    if (static_cast<int>(begin_.size()) < level + 2) begin_.resize(level + 2, 0);
    ++begin_[level + 1];
  }
  for (std::size_t level = 1; level < begin_.size(); ++level) begin_[level] += begin_[level - 1];

  sorted_.resize(c.blocks.size());
  for (std::size_t i = 0; i < c.blocks.size(); ++i) sorted_[begin_[level_[i]]++] = c.blocks[i];
  c.blocks.swap(sorted_);

  int row = 0;
  for (Block& x : c.blocks) {
    x.first = row;
    row += x.rows;
  }
}

}  // namespace substep
