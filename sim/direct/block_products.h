#pragma once
/// Products of 6×6 blocks, in the widest vectors that the processor has: the same operations, so the same
/// bits.

#include <Eigen/Core>

namespace substep {

/// Subtracts lower · upper[2k] from blocks[targets[k]], for each k below `count`.
void subtract_products(const Eigen::Matrix<double, 6, 6>& lower, const Eigen::Matrix<double, 6, 6>* upper,
                       const int* targets, int count, Eigen::Matrix<double, 6, 6>* blocks);

/// Adds columns[k] · rows[k]ᵀ to the block, for each k below `count`, one after another.
void add_products(const Eigen::Matrix<double, 6, 1>* columns, const Eigen::Matrix<double, 6, 1>* rows,
                  int count, Eigen::Matrix<double, 6, 6>& block);

}  // namespace substep
