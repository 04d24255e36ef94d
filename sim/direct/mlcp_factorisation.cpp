// The linear system of an active set, in the bodies' space: its blocks of six, factored and solved.

#include <Eigen/LU>
#include <algorithm>

#include "sim/direct/block_products.h"
#include "sim/direct/mlcp_friction.h"

namespace substep {

/// Minimum degree, ties to the lowest body: little fill for chains, trees and stacks. Returns each body's
/// neighbours when it is eliminated.
std::vector<std::vector<int>> MlcpSolver::order_bodies(int bodies) {
  std::vector<std::vector<int>> adjacent(bodies);
  for (const auto& [a, b] : pairs_) {
    adjacent[a].push_back(b);
    adjacent[b].push_back(a);
  }
  order_.clear();
  place_.assign(bodies, -1);
  std::vector<std::vector<int>> eliminated(bodies);
  std::vector<std::vector<int>> of_degree(bodies +
                                          1);  // candidates, lazily kept: an entry may be out of date
  for (int body = bodies - 1; body >= 0; --body) of_degree[adjacent[body].size()].push_back(body);
  std::size_t degree = 0;
  while (static_cast<int>(order_.size()) < bodies) {
    while (of_degree[degree].empty()) ++degree;
    const int body = of_degree[degree].back();
    of_degree[degree].pop_back();
    if (place_[body] >= 0 || adjacent[body].size() != degree) continue;
    place_[body] = static_cast<int>(order_.size());
    order_.push_back(body);
    eliminated[body] = adjacent[body];
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
  return eliminated;
}

void MlcpSolver::list_neighbours(const std::vector<std::vector<int>>& eliminated) {
  neighbour_begin_.assign(1, 0);
  neighbours_.clear();
  for (const int body : order_) {
    for (const int other : eliminated[body]) neighbours_.push_back(place_[other]);
    std::sort(neighbours_.begin() + neighbour_begin_.back(), neighbours_.end());
    neighbour_begin_.push_back(static_cast<int>(neighbours_.size()));
  }
}

/// The block of places (p, q): p itself, else the upper one of an edge, and the lower one after it.
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

void MlcpSolver::analyse(const Mlcp& problem) {
  pairs_.clear();
  for (const Mlcp::Row& row : problem.rows) {
    const std::pair<int, int> pair = std::minmax(row.a, row.b);
    // The rows of a manifold follow each other.
    if (pair.first >= 0 && (pairs_.empty() || pairs_.back() != pair)) pairs_.push_back(pair);
  }
  std::ranges::sort(pairs_);
  pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
  const bool known = pairs_ == pattern_ && static_cast<int>(order_.size()) == problem.bodies;
  if (!known) {
    pattern_ = pairs_;
    list_neighbours(order_bodies(problem.bodies));
    list_updates();
    blocks_.resize(problem.bodies + 2 * neighbours_.size());
    inverse_.resize(problem.bodies);
  }
  row_blocks_.resize(2 * problem.rows.size());
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    if (row.a < 0 || row.b < 0) continue;
    if (i > 0 && problem.rows[i - 1].a == row.a && problem.rows[i - 1].b == row.b) {
      row_blocks_[2 * i] = row_blocks_[2 * i - 2];
      row_blocks_[2 * i + 1] = row_blocks_[2 * i - 1];
      continue;
    }
    row_blocks_[2 * i] = block_of(place_[row.a], place_[row.b]);
    row_blocks_[2 * i + 1] = block_of(place_[row.b], place_[row.a]);
  }
}

void MlcpSolver::add_product(const Mlcp& problem, std::size_t row_index, const Vector6& column_a,
                             const Vector6& column_b, const Vector6& row_a, const Vector6& row_b,
                             double factor) {
  const Mlcp::Row& row = problem.rows[row_index];
  const bool is_of_others = row.a != products_.a || row.b != products_.b;
  if (products_.count == most_products || is_of_others) add_waiting_products();
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
  if (a >= 0) add_products(columns_a.data(), rows_a.data(), count, blocks_[place_[a]]);
  if (b >= 0) add_products(columns_b.data(), rows_b.data(), count, blocks_[place_[b]]);
  if (a >= 0 && b >= 0) {
    add_products(columns_a.data(), rows_b.data(), count, blocks_[row_blocks_[2 * row]]);
    add_products(columns_b.data(), rows_a.data(), count, blocks_[row_blocks_[2 * row + 1]]);
  }
  products_.count = 0;
}

void MlcpSolver::add_slide(const Mlcp& problem, std::size_t i) {
  const Mlcp::Row& one = problem.rows[i];
  const Mlcp::Row& two = problem.rows[i + 1];
  const Vector2& along = slip_[i].along;
  const Mlcp::Row& normal = problem.rows[one.normal];
  add_product(problem, one.normal, along.x() * one.part_a + along.y() * two.part_a,
              along.x() * one.part_b + along.y() * two.part_b, normal.part_a, normal.part_b,
              one.friction / (proximal_ * gamma_[one.normal] + normal.softness));
  const Vector2 aside = across(along);
  const Vector6 part_a = aside.x() * one.part_a + aside.y() * two.part_a;
  const Vector6 part_b = aside.x() * one.part_b + aside.y() * two.part_b;
  add_product(problem, i, part_a, part_b, part_a, part_b,
              1 / (proximal_ * gamma_[i] + one.softness + slip_[i].across));
}

void MlcpSolver::clear_blocks() {
  const std::size_t n = inverse_.size();
  for (std::size_t p = 0; p < n; ++p) blocks_[p].setIdentity();
  for (std::size_t k = n; k < blocks_.size(); ++k) blocks_[k].setZero();
}

void MlcpSolver::factor(const Mlcp& problem) {
  clear_blocks();
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    if (set_[i] == Set::free) {
      add_product(problem, i, row.part_a, row.part_b, row.part_a, row.part_b,
                  1 / (proximal_ * gamma_[i] + row.softness));
    } else if (set_[i] == Set::slides) {
      if (pair_[i] == Pair::first) add_slide(problem, i);
    } else if (row.normal >= 0 && set_[i] != Set::off) {
      // A sliding row's impulse follows its normal's: it adds ±μ of its column to the normal's.
      const Mlcp::Row& normal = problem.rows[row.normal];
      const double sign = set_[i] == Set::high ? 1 : -1;
      add_product(problem, row.normal, row.part_a, row.part_b, normal.part_a, normal.part_b,
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
  for (int p = 0; p < n; ++p) {
    for (int i = neighbour_begin_[p]; i < neighbour_begin_[p + 1]; ++i) {
      step_[neighbours_[i]].noalias() -= blocks_[n + 2 * i + 1] * step_[p];
    }
  }
  for (int p = n - 1; p >= 0; --p) {
    Vector6 sum = step_[p];
    for (int i = neighbour_begin_[p]; i < neighbour_begin_[p + 1]; ++i) {
      sum.noalias() -= blocks_[n + 2 * i] * step_[neighbours_[i]];
    }
    step_[p].noalias() = inverse_[p] * sum;
  }
}

void MlcpSolver::solve_free(const Mlcp& problem, std::vector<double>& lambda) {
  // Σ columns · (right side)/D, then (1 + Gᵀ D G)⁻¹ of it: the bodies' change of velocity.
  for (Vector6& s : step_) s.setZero();
  const auto add_column = [&](const Mlcp::Row& row, double factor) {
    if (row.a >= 0) step_[place_[row.a]] += factor * row.part_a;
    if (row.b >= 0) step_[place_[row.b]] += factor * row.part_b;
  };
  const auto stepped = [&](const Mlcp::Row& row) {
    double velocity = 0;
    if (row.a >= 0) velocity += row.part_a.dot(step_[place_[row.a]]);
    if (row.b >= 0) velocity += row.part_b.dot(step_[place_[row.b]]);
    return velocity;
  };
  // What a sliding pair lacks across its slip, and the weight that it has there.
  const auto lacks_across = [&](std::size_t i) {
    const Vector2 aside = across(slip_[i].along);
    return -aside.dot(
        Vector2(w_[i] + slip_[i].across * lambda[i], w_[i + 1] + slip_[i].across * lambda[i + 1]));
  };
  const auto weight_across = [&](std::size_t i) {
    return 1 / (proximal_ * gamma_[i] + problem.rows[i].softness + slip_[i].across);
  };
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    if (set_[i] == Set::free) {
      add_column(row, -w_[i] / (proximal_ * gamma_[i] + row.softness));
    } else if (row.normal >= 0 && set_[i] != Set::off && pair_[i] != Pair::second) {
      const std::size_t normal = row.normal;
      const double share =
          -row.friction * w_[normal] / (proximal_ * gamma_[normal] + problem.rows[normal].softness);
      if (set_[i] == Set::slides) {
        const double aside = lacks_across(i) * weight_across(i);
        const Vector2 factors = share * slip_[i].along + aside * across(slip_[i].along);
        add_column(row, factors.x());
        add_column(problem.rows[i + 1], factors.y());
      } else {
        add_column(row, set_[i] == Set::high ? share : -share);
      }
    }
  }
  solve_blocks();
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    if (set_[i] == Set::free) {
      lambda[i] += (-w_[i] - stepped(row)) / (proximal_ * gamma_[i] + row.softness);
    } else if (set_[i] == Set::slides && pair_[i] == Pair::first) {
      const Vector2 aside = across(slip_[i].along);
      const Vector2 velocity(stepped(row), stepped(problem.rows[i + 1]));
      const double change = (lacks_across(i) - aside.dot(velocity)) * weight_across(i);
      lambda[i] += change * aside.x();
      lambda[i + 1] += change * aside.y();
    }
  }
}

}  // namespace substep
