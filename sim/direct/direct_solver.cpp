#include "sim/direct/direct_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

namespace substep {
namespace {

/// With a pivot smaller than this part of its diagonal, the row says what others have said, up to rounding
/// and drift: the general solver leaves out what contradicts. The least of the scenes' joints is 1e-4, of a
/// chain of rods with 1000 kg at its end.
constexpr double singular = MlcpSolver::rank_tolerance;
/// A solution λ with λᵀ(Γ + S)λ below this part of λᵀDλ, D Γ's diagonal, is for the most part a redundant
/// direction's: the pivots did not tell. The general solver judges, with its smaller bound. Only where bodies
/// are joined in loops: in a tree the rows of different joints are independent, and the part is small for
/// another reason, that impulses change little from link to link: (π/N)² in a chain of N.
constexpr double suspicious = 100 * MlcpSolver::rank_tolerance;
constexpr double accurate = 1e-12;  // ten rods with 1000 kg at their end: 1e-13 without refinement
constexpr int most_refinements = 3;
constexpr std::ptrdiff_t most_blocks_of_group = 10;  // beyond, the general solver has less work
constexpr int group_size = 3;

bool has_limits(const Mlcp::Row& row) {
  return row.normal >= 0 || row.low > -std::numeric_limits<double>::infinity() ||
         row.high < std::numeric_limits<double>::infinity();
}

/// Inverts a symmetric positive matrix by its factors. False where a pivot is rounding.
bool invert(const Matrix3& matrix, const Vector3& whole, Matrix3& inverse) {
  const double d0 = matrix(0, 0);
  if (!(d0 > singular * whole[0])) return false;
  const double i0 = 1 / d0;
  const double l10 = matrix(1, 0) * i0;
  const double l20 = matrix(2, 0) * i0;
  const double d1 = matrix(1, 1) - l10 * matrix(1, 0);
  if (!(d1 > singular * whole[1])) return false;
  const double i1 = 1 / d1;
  const double a21 = matrix(2, 1) - l20 * matrix(1, 0);
  const double l21 = a21 * i1;
  const double d2 = matrix(2, 2) - l20 * matrix(2, 0) - l21 * a21;
  if (!(d2 > singular * whole[2])) return false;
  const double i2 = 1 / d2;
  // L⁻¹ has −l10, −l21 and m20 below its diagonal; the inverse is L⁻ᵀ D⁻¹ L⁻¹.
  const double m20 = l10 * l21 - l20;
  inverse(0, 0) = i0 + l10 * l10 * i1 + m20 * m20 * i2;
  inverse(0, 1) = inverse(1, 0) = -l10 * i1 - m20 * l21 * i2;
  inverse(0, 2) = inverse(2, 0) = m20 * i2;
  inverse(1, 1) = i1 + l21 * l21 * i2;
  inverse(1, 2) = inverse(2, 1) = -l21 * i2;
  inverse(2, 2) = i2;
  return true;
}

}  // namespace

bool EnvelopeSolver::is_known(const Mlcp& problem) const {
  if (problem.rows.size() != rows_) return false;
  return std::ranges::all_of(groups_, [&](const Group& group) {
    for (int k = 0; k < group.rows; ++k) {
      const Mlcp::Row& row = problem.rows[group.first + k];
      if (row.a != group.a || row.b != group.b) return false;
    }
    return true;
  });
}

void EnvelopeSolver::order_groups(const Mlcp& problem) {
  std::vector<Group> groups;
  std::vector<std::vector<int>> groups_of(problem.bodies);
  for (int i = 0; i < std::ssize(problem.rows); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    if (!groups.empty() && groups.back().rows < group_size && groups.back().a == row.a &&
        groups.back().b == row.b) {
      ++groups.back().rows;
      continue;
    }
    for (const int body : {row.a, row.b}) {
      if (body >= 0) groups_of[body].push_back(static_cast<int>(groups.size()));
    }
    groups.push_back({i, 1, row.a, row.b});
  }
  const auto degree = [&](int group) {
    std::size_t count = 0;
    for (const int body : {groups[group].a, groups[group].b}) {
      if (body >= 0) count += groups_of[body].size();
    }
    return count;
  };
  std::vector<int> starts(groups.size());
  for (std::size_t i = 0; i < starts.size(); ++i) starts[i] = static_cast<int>(i);
  std::ranges::stable_sort(starts, {}, degree);
  std::vector<bool> placed(groups.size(), false);
  std::vector<bool> passed(problem.bodies, false);
  std::vector<int> order;
  for (const int start : starts) {
    if (placed[start]) continue;
    placed[start] = true;
    std::size_t next = order.size();
    order.push_back(start);
    for (; next < order.size(); ++next) {
      const std::size_t begin = order.size();
      for (const int body : {groups[order[next]].a, groups[order[next]].b}) {
        if (body < 0 || passed[body]) continue;
        passed[body] = true;
        for (const int group : groups_of[body]) {
          if (placed[group]) continue;
          placed[group] = true;
          order.push_back(group);
        }
      }
      std::stable_sort(order.begin() + static_cast<std::ptrdiff_t>(begin), order.end(),
                       [&](int one, int other) { return degree(one) < degree(other); });
    }
  }
  groups_.clear();
  for (std::size_t i = order.size(); i > 0; --i) groups_.push_back(groups[order[i - 1]]);
}

bool EnvelopeSolver::has_loops(const Mlcp& problem) const {
  std::vector<int> root(problem.bodies + 1);  // the last is what does not move
  std::iota(root.begin(), root.end(), 0);
  const auto root_of = [&](int body) {
    int at = body < 0 ? problem.bodies : body;
    while (root[at] != at) at = root[at] = root[root[at]];
    return at;
  };
  std::map<std::pair<int, int>, int> rows_of;
  for (const Group& group : groups_) rows_of[std::minmax(group.a, group.b)] += group.rows;
  for (const auto& [bodies, rows] : rows_of) {
    const int a = root_of(bodies.first);
    const int b = root_of(bodies.second);
    if (a == b || rows > 6) return true;
    root[a] = b;
  }
  return false;
}

void EnvelopeSolver::analyse(const Mlcp& problem) {
  rows_ = problem.rows.size();
  order_groups(problem);
  has_loops_ = has_loops(problem);

  struct Part {
    int place;
    bool is_a;
  };
  std::vector<std::vector<Part>> parts_of(problem.bodies);  // in ascending places
  first_.resize(groups_.size());
  for (std::size_t place = 0; place < groups_.size(); ++place) {
    const Group& group = groups_[place];
    if (group.a >= 0) parts_of[group.a].push_back({static_cast<int>(place), true});
    if (group.b >= 0) parts_of[group.b].push_back({static_cast<int>(place), false});
    first_[place] = static_cast<int>(place);
  }
  for (const std::vector<Part>& parts : parts_of) {
    for (const Part& part : parts) first_[part.place] = std::min(first_[part.place], parts.front().place);
  }
  shift_.clear();
  std::ptrdiff_t blocks = 0;
  for (std::size_t place = 0; place < groups_.size(); ++place) {
    shift_.push_back(blocks - first_[place]);
    blocks += static_cast<std::ptrdiff_t>(place) - first_[place];
  }
  products_.clear();
  small_ = blocks <= most_blocks_of_group * std::ssize(groups_);
  if (!small_) return;
  for (const std::vector<Part>& parts : parts_of) {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const int place = parts[i].place;
        products_.push_back({shift_[place] + parts[j].place, groups_[place], groups_[parts[j].place],
                             parts[i].is_a, parts[j].is_a});
      }
    }
  }
  lower_.resize(static_cast<std::size_t>(blocks));
  inverse_diagonal_.resize(groups_.size());
}

bool EnvelopeSolver::factor(const Mlcp& problem) {
  std::ranges::fill(lower_, Matrix3::Zero());
  for (const Product& product : products_) {
    Matrix3& block = lower_[product.block];
    for (int c = 0; c < product.column.rows; ++c) {
      const Mlcp::Row& column = problem.rows[product.column.first + c];
      const Vector6& part = product.column_is_a ? column.part_a : column.part_b;
      for (int r = 0; r < product.row.rows; ++r) {
        const Mlcp::Row& row = problem.rows[product.row.first + r];
        block(r, c) += (product.row_is_a ? row.part_a : row.part_b).dot(part);
      }
    }
  }
  const int count = static_cast<int>(groups_.size());
  for (int i = 0; i < count; ++i) {
    const Group& group = groups_[i];
    Matrix3 diagonal = Matrix3::Identity();
    for (int r = 0; r < group.rows; ++r) {
      const Mlcp::Row& row = problem.rows[group.first + r];
      for (int c = 0; c < r; ++c) {
        const Mlcp::Row& column = problem.rows[group.first + c];
        if (group.a >= 0) diagonal(r, c) += row.part_a.dot(column.part_a);
        if (group.b >= 0) diagonal(r, c) += row.part_b.dot(column.part_b);
      }
      diagonal(r, r) = gamma_[group.first + r] + row.softness;
    }
    const Vector3 whole = diagonal.diagonal();
    Matrix3* const row = lower_.data() + shift_[i];
    for (int j = first_[i] + 1; j < i; ++j) {
      const Matrix3* const other = lower_.data() + shift_[j];
      for (int k = std::max(first_[i], first_[j]); k < j; ++k) {
        row[j].noalias() -= row[k] * other[k].transpose();
      }
    }
    for (int j = first_[i]; j < i; ++j) {
      const Matrix3 scaled = row[j] * inverse_diagonal_[j];
      diagonal.noalias() -= scaled * row[j].transpose();
      row[j] = scaled;
    }
    if (!invert(diagonal, whole, inverse_diagonal_[i])) return false;
  }
  return true;
}

void EnvelopeSolver::add_solution(std::vector<double>& lambda) {
  const int count = static_cast<int>(groups_.size());
  for (int i = 0; i < count; ++i) {
    for (int j = first_[i]; j < i; ++j) right_[i].noalias() -= lower_[shift_[i] + j] * right_[j];
  }
  for (int i = 0; i < count; ++i) right_[i] = (inverse_diagonal_[i] * right_[i]).eval();
  for (int i = count - 1; i >= 0; --i) {
    for (int j = first_[i]; j < i; ++j) right_[j].noalias() -= lower_[shift_[i] + j].transpose() * right_[i];
    for (int k = 0; k < groups_[i].rows; ++k) lambda[groups_[i].first + k] += right_[i][k];
  }
}

double EnvelopeSolver::residual(const Mlcp& problem, const std::vector<double>& lambda) {
  std::ranges::fill(y_, Vector6::Zero());
  for (const Group& group : groups_) {
    // A group's rows are summed first: a body's sum in memory is then touched once for the three.
    Vector6 sum_a = Vector6::Zero();
    Vector6 sum_b = Vector6::Zero();
    for (int i = group.first; i < group.first + group.rows; ++i) {
      sum_a += lambda[i] * problem.rows[i].part_a;
      sum_b += lambda[i] * problem.rows[i].part_b;
    }
    if (group.a >= 0) y_[group.a] += sum_a;
    if (group.b >= 0) y_[group.b] += sum_b;
  }
  // Both are compared squared, over Γ_xx, which spares their roots.
  double largest = 0;
  double scale = 0;
  double sum = 0;  // finite if all are
  for (std::size_t place = 0; place < groups_.size(); ++place) {
    const Group& group = groups_[place];
    for (int k = 0; k < group.rows; ++k) {
      const int i = group.first + k;
      const Mlcp::Row& row = problem.rows[i];
      double missing = row.right - row.softness * lambda[i];
      if (row.a >= 0) missing -= row.part_a.dot(y_[row.a]);
      if (row.b >= 0) missing -= row.part_b.dot(y_[row.b]);
      right_[place][k] = missing;
      const double inverse = inverse_gamma_[i];
      const double share = row.softness > 0 ? 1 / (1 + row.softness * inverse) : 1;
      const double squared = missing * missing * share * share * inverse;
      largest = std::max(largest, squared);
      scale = std::max(scale, row.right * row.right * inverse);
      sum += squared;
    }
  }
  if (!std::isfinite(sum)) return std::numeric_limits<double>::infinity();
  return scale > 0 ? std::sqrt(largest / scale) : 0;
}

bool EnvelopeSolver::is_mostly_redundant(const Mlcp& problem, const std::vector<double>& lambda) const {
  double of_rows = 0;
  double moved = 0;
  for (std::size_t i = 0; i < lambda.size(); ++i) {
    const double squared = lambda[i] * lambda[i];
    of_rows += squared * gamma_[i];
    moved += squared * problem.rows[i].softness;
  }
  for (const Vector6& y : y_) moved += y.squaredNorm();
  return moved < suspicious * of_rows;
}

bool EnvelopeSolver::solve(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report) {
  const std::size_t count = problem.rows.size();
  y_.assign(problem.bodies, Vector6::Zero());
  if (count == 0) {
    lambda.clear();
    return true;
  }
  if (std::any_of(problem.rows.rbegin(), problem.rows.rend(), has_limits)) return false;  // contacts are last
  if (!is_known(problem)) analyse(problem);
  if (!small_) return false;
  gamma_.resize(count);
  inverse_gamma_.resize(count);
  right_.resize(groups_.size());
  for (std::size_t i = 0; i < count; ++i) {
    const Mlcp::Row& row = problem.rows[i];
    gamma_[i] = (row.a >= 0 ? row.part_a.squaredNorm() : 0) + (row.b >= 0 ? row.part_b.squaredNorm() : 0);
    if (!(gamma_[i] > 0)) return false;
    inverse_gamma_[i] = 1 / gamma_[i];
  }
  if (!factor(problem)) return false;
  lambda.assign(count, 0.0);
  for (std::size_t place = 0; place < groups_.size(); ++place) {
    right_[place].setZero();  // where a group has fewer rows
    for (int k = 0; k < groups_[place].rows; ++k) {
      right_[place][k] = problem.rows[groups_[place].first + k].right;
    }
  }
  report.active_sets = 1;
  for (int round = 0; round <= most_refinements; ++round) {
    add_solution(lambda);
    report.row_solves += static_cast<std::int64_t>(count);
    report.residual = residual(problem, lambda);
    if (report.residual <= accurate) break;
  }
  return report.residual <= MlcpSolver::tolerance && !(has_loops_ && is_mostly_redundant(problem, lambda));
}

}  // namespace substep
