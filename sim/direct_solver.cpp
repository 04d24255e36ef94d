#include "sim/direct_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace substep {
namespace {

/// A pivot smaller than this part of its diagonal is rounding: the row says what others have said.
constexpr double singular = 1e-10;
constexpr double accurate = 1e-12;  // ten rods with 1000 kg at their end: 1e-13 without refinement
constexpr int most_refinements = 3;
constexpr std::ptrdiff_t most_entries_of_row = 32;  // beyond, the general solver has less work

bool has_limits(const Mlcp::Row& row) {
  return row.normal >= 0 || std::isfinite(row.low) || std::isfinite(row.high);
}

}  // namespace

bool EnvelopeSolver::is_known(const Mlcp& problem) const {
  return std::ranges::equal(problem.rows, pattern_, [](const Mlcp::Row& row, const Bodies& bodies) {
    return row.a == bodies.a && row.b == bodies.b;
  });
}

void EnvelopeSolver::order_rows(const Mlcp& problem) {
  std::vector<std::vector<int>> rows_of(problem.bodies);
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    for (const int body : {problem.rows[i].a, problem.rows[i].b}) {
      if (body >= 0) rows_of[body].push_back(static_cast<int>(i));
    }
  }
  const auto degree = [&](int row) {
    std::size_t count = 0;
    for (const int body : {problem.rows[row].a, problem.rows[row].b}) {
      if (body >= 0) count += rows_of[body].size();
    }
    return count;
  };
  std::vector<int> starts(problem.rows.size());
  for (std::size_t i = 0; i < starts.size(); ++i) starts[i] = static_cast<int>(i);
  std::ranges::stable_sort(starts, {}, degree);
  std::vector<bool> placed(problem.rows.size(), false);
  std::vector<bool> passed(problem.bodies, false);
  order_.clear();
  for (const int start : starts) {
    if (placed[start]) continue;
    placed[start] = true;
    std::size_t next = order_.size();
    order_.push_back(start);
    for (; next < order_.size(); ++next) {
      const std::size_t begin = order_.size();
      for (const int body : {problem.rows[order_[next]].a, problem.rows[order_[next]].b}) {
        if (body < 0 || passed[body]) continue;
        passed[body] = true;
        for (const int row : rows_of[body]) {
          if (placed[row]) continue;
          placed[row] = true;
          order_.push_back(row);
        }
      }
      std::stable_sort(order_.begin() + static_cast<std::ptrdiff_t>(begin), order_.end(),
                       [&](int one, int other) { return degree(one) < degree(other); });
    }
  }
  std::ranges::reverse(order_);
}

void EnvelopeSolver::analyse(const Mlcp& problem) {
  pattern_.clear();
  for (const Mlcp::Row& row : problem.rows) pattern_.push_back({row.a, row.b});
  order_rows(problem);

  struct Part {
    int place;
    bool is_a;
  };
  std::vector<std::vector<Part>> parts_of(problem.bodies);  // in ascending places
  for (std::size_t place = 0; place < order_.size(); ++place) {
    const Mlcp::Row& row = problem.rows[order_[place]];
    if (row.a >= 0) parts_of[row.a].push_back({static_cast<int>(place), true});
    if (row.b >= 0) parts_of[row.b].push_back({static_cast<int>(place), false});
  }
  first_.resize(order_.size());
  for (std::size_t place = 0; place < order_.size(); ++place) first_[place] = static_cast<int>(place);
  for (const std::vector<Part>& parts : parts_of) {
    for (const Part& part : parts) first_[part.place] = std::min(first_[part.place], parts.front().place);
  }
  shift_.clear();
  std::ptrdiff_t entries = 0;
  for (std::size_t place = 0; place < order_.size(); ++place) {
    shift_.push_back(entries - first_[place]);
    entries += static_cast<std::ptrdiff_t>(place) - first_[place];
  }
  products_.clear();
  small_ = entries <= most_entries_of_row * std::ssize(order_);
  if (!small_) return;
  for (const std::vector<Part>& parts : parts_of) {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const int place = parts[i].place;
        products_.push_back({shift_[place] + parts[j].place, order_[place], order_[parts[j].place],
                             parts[i].is_a, parts[j].is_a});
      }
    }
  }
  lower_.resize(static_cast<std::size_t>(entries));
  inverse_diagonal_.resize(order_.size());
}

bool EnvelopeSolver::factor(const Mlcp& problem) {
  std::ranges::fill(lower_, 0.0);
  for (const Product& product : products_) {
    const Mlcp::Row& row = problem.rows[product.row];
    const Mlcp::Row& column = problem.rows[product.column];
    lower_[product.entry] +=
        (product.row_is_a ? row.part_a : row.part_b).dot(product.column_is_a ? column.part_a : column.part_b);
  }
  double* const l = lower_.data();
  const int count = static_cast<int>(order_.size());
  for (int i = 0; i < count; ++i) {
    const std::ptrdiff_t row = shift_[i];
    const double whole = gamma_[order_[i]] + problem.rows[order_[i]].softness;
    for (int j = first_[i] + 1; j < i; ++j) {
      const std::ptrdiff_t other = shift_[j];
      for (int k = std::max(first_[i], first_[j]); k < j; ++k) l[row + j] -= l[row + k] * l[other + k];
    }
    double diagonal = whole;
    for (int j = first_[i]; j < i; ++j) {
      const double scaled = l[row + j] * inverse_diagonal_[j];
      diagonal -= l[row + j] * scaled;
      l[row + j] = scaled;
    }
    if (!(diagonal > singular * whole)) return false;
    inverse_diagonal_[i] = 1 / diagonal;
  }
  return true;
}

void EnvelopeSolver::add_solution(std::vector<double>& lambda) {
  const double* const l = lower_.data();
  const int count = static_cast<int>(order_.size());
  for (int i = 0; i < count; ++i) {
    for (int j = first_[i]; j < i; ++j) right_[i] -= l[shift_[i] + j] * right_[j];
  }
  for (int i = 0; i < count; ++i) right_[i] *= inverse_diagonal_[i];
  for (int i = count - 1; i >= 0; --i) {
    for (int j = first_[i]; j < i; ++j) right_[j] -= l[shift_[i] + j] * right_[i];
    lambda[order_[i]] += right_[i];
  }
}

double EnvelopeSolver::residual(const Mlcp& problem, const std::vector<double>& lambda) {
  std::ranges::fill(y_, Vector6::Zero());
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    if (row.a >= 0) y_[row.a] += lambda[i] * row.part_a;
    if (row.b >= 0) y_[row.b] += lambda[i] * row.part_b;
  }
  // Both are compared squared, over Γ_xx, which spares their roots.
  double largest = 0;
  double scale = 0;
  double sum = 0;  // finite if all are
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const Mlcp::Row& row = problem.rows[order_[i]];
    double missing = row.right - row.softness * lambda[order_[i]];
    if (row.a >= 0) missing -= row.part_a.dot(y_[row.a]);
    if (row.b >= 0) missing -= row.part_b.dot(y_[row.b]);
    right_[i] = missing;
    const double gamma = gamma_[order_[i]];
    const double share = gamma / (gamma + row.softness);
    const double inverse = 1 / gamma;
    const double squared = missing * missing * share * share * inverse;
    largest = std::max(largest, squared);
    scale = std::max(scale, row.right * row.right * inverse);
    sum += squared;
  }
  if (!std::isfinite(sum)) return std::numeric_limits<double>::infinity();
  return scale > 0 ? std::sqrt(largest / scale) : 0;
}

bool EnvelopeSolver::solve(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report) {
  if (problem.rows.empty() || std::ranges::any_of(problem.rows, has_limits)) return false;
  if (!is_known(problem)) analyse(problem);
  if (!small_) return false;
  const std::size_t count = problem.rows.size();
  gamma_.resize(count);
  right_.resize(count);
  y_.resize(problem.bodies);
  for (std::size_t i = 0; i < count; ++i) {
    const Mlcp::Row& row = problem.rows[i];
    gamma_[i] = (row.a >= 0 ? row.part_a.squaredNorm() : 0) + (row.b >= 0 ? row.part_b.squaredNorm() : 0);
    if (!(gamma_[i] > 0)) return false;
  }
  if (!factor(problem)) return false;
  lambda.assign(count, 0.0);
  for (std::size_t i = 0; i < count; ++i) right_[i] = problem.rows[order_[i]].right;
  report.pivots = 1;
  for (int round = 0; round <= most_refinements; ++round) {
    add_solution(lambda);
    report.row_solves += static_cast<std::int64_t>(count);
    report.residual = residual(problem, lambda);
    if (report.residual <= accurate) return true;
  }
  return report.residual <= MlcpSolver::tolerance;
}

}  // namespace substep
