#include "sim/direct/block_products.h"

#include <cstring>

#include "sim/math/four_wide.h"

namespace substep {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Four = double __attribute__((vector_size(32)));
using Two = double __attribute__((vector_size(16)));

/// Six numbers of a block's column.
struct Column {
  Four first;
  Two last;
};

[[gnu::always_inline]] inline Column load(const double* from) {
  // A block may begin at any double.
  Column column;
  std::memcpy(&column.first, from, sizeof column.first);
  std::memcpy(&column.last, from + 4, sizeof column.last);
  return column;
}

[[gnu::always_inline]] inline void store(const Column& column, double* to) {
  std::memcpy(to, &column.first, sizeof column.first);
  std::memcpy(to + 4, &column.last, sizeof column.last);
}

[[gnu::always_inline]] inline void subtract_products_lanes(const Matrix6& lower, const Matrix6* upper,
                                                           const int* targets, int count, Matrix6* blocks) {
  for (int k = 0; k < count; ++k) {
    const double* const from = upper[2 * k].data();
    double* const to = blocks[targets[k]].data();
    // Two columns at a time, so that each of `lower` is loaded three times.
    for (int j = 0; j < 6; j += 2) {
      const double* const left = from + 6 * j;
      const double* const right = left + 6;
      Column sum_left = load(lower.data());
      Column sum_right = sum_left;
      sum_left = {sum_left.first * left[0], sum_left.last * left[0]};
      sum_right = {sum_right.first * right[0], sum_right.last * right[0]};
      for (int i = 1; i < 6; ++i) {
        const Column column = load(lower.data() + 6 * i);
        sum_left.first += column.first * left[i];
        sum_left.last += column.last * left[i];
        sum_right.first += column.first * right[i];
        sum_right.last += column.last * right[i];
      }
      const Column before_left = load(to + 6 * j);
      const Column before_right = load(to + 6 * j + 6);
      store({before_left.first - sum_left.first, before_left.last - sum_left.last}, to + 6 * j);
      store({before_right.first - sum_right.first, before_right.last - sum_right.last}, to + 6 * j + 6);
    }
  }
}

[[gnu::always_inline]] inline void add_products_lanes(const Vector6* columns, const Vector6* rows, int count,
                                                      Matrix6& block) {
  for (int j = 0; j < 6; ++j) {
    Column sum = load(block.data() + 6 * j);
    for (int k = 0; k < count; ++k) {
      const Column column = load(columns[k].data());
      sum.first += column.first * rows[k].data()[j];
      sum.last += column.last * rows[k].data()[j];
    }
    store(sum, block.data() + 6 * j);
  }
}

}  // namespace

void subtract_products(const Matrix6& lower, const Matrix6* upper, const int* targets, int count,
                       Matrix6* blocks) {
  run_wide([&]() __attribute__((always_inline)) {
    subtract_products_lanes(lower, upper, targets, count, blocks);
  });
}

void add_products(const Vector6* columns, const Vector6* rows, int count, Matrix6& block) {
  run_wide([&]() __attribute__((always_inline)) { add_products_lanes(columns, rows, count, block); });
}

}  // namespace substep
