// Factors and solves the linear system of an active set in the bodies' space, by 6×6 blocks. Products of
// blocks use the widest vectors of the processor; every width does the same operations and gives the same
// bits.

#include <Eigen/LU>
#include <algorithm>
#include <cstring>

#include "sim/direct/mlcp.h"
#include "sim/math/four_wide.h"

namespace substep {
namespace {

using Four = double __attribute__((vector_size(32)));
using Two = double __attribute__((vector_size(16)));

/// A column of a 6×6 block.
struct Column {
  Four first;
  Two last;
};

SUBSTEP_KERNEL Column load(const double* from) {
  // A block may begin at any double.
  Column column;
  std::memcpy(&column.first, from, sizeof column.first);
  std::memcpy(&column.last, from + 4, sizeof column.last);
  return column;
}

SUBSTEP_KERNEL void store(const Column& column, double* to) {
  std::memcpy(to, &column.first, sizeof column.first);
  std::memcpy(to + 4, &column.last, sizeof column.last);
}

SUBSTEP_KERNEL void subtract_products_lanes(const Matrix6& lower, const Matrix6* upper, const int* targets,
                                            int count, Matrix6* blocks) {
  for (int k = 0; k < count; ++k) {
    const double* const from = upper[2 * k].data();
    double* const to = blocks[targets[k]].data();
    // Compute two columns at a time, so that each column of `lower` is loaded three times.
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

SUBSTEP_KERNEL void add_products_lanes(const Vector6* columns, const Vector6* rows, int count,
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

/// Subtracts lower · upper[2k] from blocks[targets[k]], for each k below `count`.
void subtract_products(const Matrix6& lower, const Matrix6* upper, const int* targets, int count,
                       Matrix6* blocks) {
  run_wide([&]() __attribute__((always_inline)) {
    subtract_products_lanes(lower, upper, targets, count, blocks);
  });
}

/// Adds columns[k] · rows[k]ᵀ to the block, for each k below `count`, one after another.
void add_products(const Vector6* columns, const Vector6* rows, int count, Matrix6& block) {
  run_wide([&]() __attribute__((always_inline)) { add_products_lanes(columns, rows, count, block); });
}

}  // namespace

/// Orders the bodies by minimum degree, of equal ones the lowest index first: chains, trees and stacks get
/// little fill. Lists each body's neighbours at its elimination.
void MlcpSolver::order_bodies() {
  const int bodies = problem_->bodies;
  std::vector<std::vector<int>> adjacent(bodies);
  for (const auto& [a, b] : pairs_) {
    adjacent[a].push_back(b);
    adjacent[b].push_back(a);
  }
  order_.clear();
  position_.assign(bodies, -1);
  std::vector<std::vector<int>> of_degree(bodies + 1);  // candidates; an entry may be out of date
  for (int body = bodies - 1; body >= 0; --body) of_degree[adjacent[body].size()].push_back(body);
  std::size_t degree = 0;
  while (static_cast<int>(order_.size()) < bodies) {
    while (of_degree[degree].empty()) ++degree;
    const int body = of_degree[degree].back();
    of_degree[degree].pop_back();
    if (position_[body] >= 0 || adjacent[body].size() != degree) continue;
    position_[body] = static_cast<int>(order_.size());
    order_.push_back(body);
    for (const int one : adjacent[body]) {
      std::vector<int>& list = adjacent[one];
      std::erase(list, body);
      for (const int other : adjacent[body]) {
        if (other != one && std::ranges::find(list, other) == list.end()) list.push_back(other);
      }
      of_degree[list.size()].push_back(one);
      degree = std::min(degree, list.size());
    }
  }
  neighbour_begin_.assign(1, 0);
  neighbours_.clear();
  for (const int body : order_) {
    for (const int other : adjacent[body]) neighbours_.push_back(position_[other]);
    std::sort(neighbours_.begin() + neighbour_begin_.back(), neighbours_.end());
    neighbour_begin_.push_back(static_cast<int>(neighbours_.size()));
  }
}

/// Returns the index of block (p, q), with positions in the elimination order: p where p = q, else that of
/// the pair's upper block (p < q), which its lower block (p > q) follows.
int MlcpSolver::block_of(int p, int q) const {
  if (p == q) return p;
  const int early = std::min(p, q);
  const auto begin = neighbours_.begin() + neighbour_begin_[early];
  const auto end = neighbours_.begin() + neighbour_begin_[early + 1];
  const int edge = static_cast<int>(std::lower_bound(begin, end, std::max(p, q)) - neighbours_.begin());
  return static_cast<int>(order_.size()) + 2 * edge + (p > q ? 1 : 0);
}

void MlcpSolver::list_updates() {
  const int n = static_cast<int>(order_.size());
  update_begin_.assign(1, 0);
  updates_.clear();
  for (int p = 0; p < n; ++p) {
    for (int i = neighbour_begin_[p]; i < neighbour_begin_[p + 1]; ++i) {
      for (int j = neighbour_begin_[p]; j < neighbour_begin_[p + 1]; ++j) {
        updates_.push_back(block_of(neighbours_[i], neighbours_[j]));
      }
    }
    update_begin_.push_back(static_cast<int>(updates_.size()));
  }
}

void MlcpSolver::analyse() {
  pairs_.clear();
  for (const Row& row : rows()) {
    const std::pair<int, int> pair = std::minmax(row.a, row.b);
    // Skip most repetitions: the rows of a manifold follow each other.
    if (pair.first >= 0 && (pairs_.empty() || pairs_.back() != pair)) pairs_.push_back(pair);
  }
  std::ranges::sort(pairs_);
  pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
  const bool known = pairs_ == pattern_ && static_cast<int>(order_.size()) == problem_->bodies;
  if (!known) {
    pattern_ = pairs_;
    order_bodies();
    list_updates();
    blocks_.resize(problem_->bodies + 2 * neighbours_.size());
    inverse_.resize(problem_->bodies);
  }
  row_blocks_.resize(2 * rows().size());
  for (std::size_t i = 0; i < rows().size(); ++i) {
    const Row& row = rows()[i];
    if (row.a < 0 || row.b < 0) continue;
    if (i > 0 && rows()[i - 1].a == row.a && rows()[i - 1].b == row.b) {
      row_blocks_[2 * i] = row_blocks_[2 * i - 2];
      row_blocks_[2 * i + 1] = row_blocks_[2 * i - 1];
      continue;
    }
    row_blocks_[2 * i] = block_of(position_[row.a], position_[row.b]);
    row_blocks_[2 * i + 1] = block_of(position_[row.b], position_[row.a]);
  }
}

void MlcpSolver::add_product(std::size_t row_index, const Vector6& column_a, const Vector6& column_b,
                             const Vector6& row_a, const Vector6& row_b, double factor) {
  const Row& row = rows()[row_index];
  const bool is_other_pair = row.a != products_.a || row.b != products_.b;
  if (products_.count == most_products || is_other_pair) add_waiting_products();
  if (products_.count == 0) products_.row = static_cast<int>(row_index);
  products_.a = row.a;
  products_.b = row.b;
  products_.columns_a[products_.count] = factor * column_a;
  products_.columns_b[products_.count] = factor * column_b;
  products_.rows_a[products_.count] = row_a;
  products_.rows_b[products_.count] = row_b;
  ++products_.count;
}

void MlcpSolver::add_waiting_products() {
  const auto& [row, a, b, count, columns_a, columns_b, rows_a, rows_b] = products_;
  if (count == 0) return;
  if (a >= 0) add_products(columns_a.data(), rows_a.data(), count, blocks_[position_[a]]);
  if (b >= 0) add_products(columns_b.data(), rows_b.data(), count, blocks_[position_[b]]);
  if (a >= 0 && b >= 0) {
    add_products(columns_a.data(), rows_b.data(), count, blocks_[row_blocks_[2 * row]]);
    add_products(columns_b.data(), rows_a.data(), count, blocks_[row_blocks_[2 * row + 1]]);
  }
  products_.count = 0;
}

void MlcpSolver::add_slide(std::size_t i) {
  const Row& one = rows()[i];
  const Row& two = rows()[i + 1];
  const Vector2& along = slip_[i].along;
  const Row& normal = rows()[one.normal];
  add_product(one.normal, along.x() * one.part_a + along.y() * two.part_a,
              along.x() * one.part_b + along.y() * two.part_b, normal.part_a, normal.part_b,
              one.friction / (proximal_ * gamma_[one.normal] + normal.softness));
  const Vector2 aside = across(along);
  const Vector6 part_a = aside.x() * one.part_a + aside.y() * two.part_a;
  const Vector6 part_b = aside.x() * one.part_b + aside.y() * two.part_b;
  add_product(i, part_a, part_b, part_a, part_b,
              1 / (proximal_ * gamma_[i] + one.softness + slip_[i].across));
}

void MlcpSolver::clear_blocks() {
  const std::size_t n = inverse_.size();
  for (std::size_t p = 0; p < n; ++p) blocks_[p].setIdentity();
  for (std::size_t k = n; k < blocks_.size(); ++k) blocks_[k].setZero();
}

void MlcpSolver::factor() {
  clear_blocks();
  for (std::size_t i = 0; i < rows().size(); ++i) {
    const Row& row = rows()[i];
    if (set_[i] == Set::free) {
      add_product(i, row.part_a, row.part_b, row.part_a, row.part_b,
                  1 / (proximal_ * gamma_[i] + row.softness));
    } else if (set_[i] == Set::slides) {
      if (pair_[i] == Pair::first) add_slide(i);
    } else if (row.normal >= 0 && set_[i] != Set::inactive) {
      // Add ±μ times a sliding row's column to its normal's, whose impulse it follows.
      const Row& normal = rows()[row.normal];
      const double sign = set_[i] == Set::high ? 1 : -1;
      add_product(row.normal, row.part_a, row.part_b, normal.part_a, normal.part_b,
                  sign * row.friction / (proximal_ * gamma_[row.normal] + normal.softness));
    }
  }
  add_waiting_products();
  eliminate();
}

void MlcpSolver::eliminate() {
  const int n = static_cast<int>(inverse_.size());
  for (int p = 0; p < n; ++p) {
    inverse_[p] = blocks_[p].inverse();
    const int begin = neighbour_begin_[p];
    const int end = neighbour_begin_[p + 1];
    const int* targets = updates_.data() + update_begin_[p];
    for (int i = begin; i < end; ++i, targets += end - begin) {
      const Matrix6 lower = blocks_[n + 2 * i + 1] * inverse_[p];
      subtract_products(lower, blocks_.data() + n + 2 * begin, targets, end - begin, blocks_.data());
      blocks_[n + 2 * i + 1] = lower;
    }
  }
}

void MlcpSolver::solve_blocks() {
  const int n = static_cast<int>(step_.size());
  ordered_.resize(n);
  for (int p = 0; p < n; ++p) ordered_[p] = step_[order_[p]];
  for (int p = 0; p < n; ++p) {
    for (int i = neighbour_begin_[p]; i < neighbour_begin_[p + 1]; ++i) {
      ordered_[neighbours_[i]].noalias() -= blocks_[n + 2 * i + 1] * ordered_[p];
    }
  }
  for (int p = n - 1; p >= 0; --p) {
    Vector6 sum = ordered_[p];
    for (int i = neighbour_begin_[p]; i < neighbour_begin_[p + 1]; ++i) {
      sum.noalias() -= blocks_[n + 2 * i] * ordered_[neighbours_[i]];
    }
    ordered_[p].noalias() = inverse_[p] * sum;
    step_[order_[p]] = ordered_[p];
  }
}

void MlcpSolver::solve_free() {
  // Sum Gᵀ(εD + S)⁻¹ times the right sides. (1 + Gᵀ(εD + S)⁻¹G)⁻¹ times the sum is the bodies' change of
  // velocity.
  for (Vector6& s : step_) s.setZero();
  const auto right_across = [&](std::size_t i) {
    const Vector2 aside = across(slip_[i].along);
    return -aside.dot(
        Vector2(w_[i] + slip_[i].across * lambda_[i], w_[i + 1] + slip_[i].across * lambda_[i + 1]));
  };
  const auto weight_across = [&](std::size_t i) {
    return 1 / (proximal_ * gamma_[i] + rows()[i].softness + slip_[i].across);
  };
  for (std::size_t i = 0; i < rows().size(); ++i) {
    const Row& row = rows()[i];
    if (set_[i] == Set::free) {
      row.add_impulse(-w_[i] / (proximal_ * gamma_[i] + row.softness), step_);
    } else if (row.normal >= 0 && set_[i] != Set::inactive && pair_[i] != Pair::second) {
      const std::size_t normal = row.normal;
      const double share =
          -row.friction * w_[normal] / (proximal_ * gamma_[normal] + rows()[normal].softness);
      if (set_[i] == Set::slides) {
        const double aside = right_across(i) * weight_across(i);
        const Vector2 factors = share * slip_[i].along + aside * across(slip_[i].along);
        row.add_impulse(factors.x(), step_);
        rows()[i + 1].add_impulse(factors.y(), step_);
      } else {
        row.add_impulse(set_[i] == Set::high ? share : -share, step_);
      }
    }
  }
  solve_blocks();
  for (std::size_t i = 0; i < rows().size(); ++i) {
    const Row& row = rows()[i];
    if (set_[i] == Set::free) {
      lambda_[i] += (-w_[i] - row.velocity(step_)) / (proximal_ * gamma_[i] + row.softness);
    } else if (set_[i] == Set::slides && pair_[i] == Pair::first) {
      const Vector2 aside = across(slip_[i].along);
      const Vector2 velocity(row.velocity(step_), rows()[i + 1].velocity(step_));
      const double change = (right_across(i) - aside.dot(velocity)) * weight_across(i);
      lambda_[i] += change * aside.x();
      lambda_[i + 1] += change * aside.y();
    }
  }
}

}  // namespace substep
