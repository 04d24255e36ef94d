#include "sim/direct/direct_solver.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <utility>

namespace substep {
namespace {

/// Least pivot over its diagonal. A row with a smaller one is redundant up to rounding and drift; the general
/// solver then solves the problem. The least in our scenes is 1e-4: a chain of rods with 1000 kg at its end.
constexpr double least_pivot = MlcpSolver::rank_tolerance;
/// ε of loops. A round leaves ε/(σ + ε) of a right side along an eigenvector of Γ with eigenvalue σ, and
/// changes impulses of redundant rows by 1/ε of their contradiction: Bricard's linkage loses 0.12 J in 10 s,
/// 0.30 J with 1e-7, and 1.6 J with 1e-9.
constexpr double shift_of_loops = 1e-6;
/// ε after `rounds_until_slow` rounds, for rows that are nearly redundant, as in a flat net.
constexpr double shift_of_slow_loops = 1e-8;
constexpr int rounds_until_slow = 3;
constexpr double accurate = 1e-12;  // residual; ten rods with 1000 kg at their end: 1e-13 without refinement
constexpr int most_refinements = 3;
constexpr int most_idle_rounds = 12;  // that reduce the residual by less than a tenth
constexpr int group_size = 3;

/// Sets of connected bodies, as a union-find.
class Connections {
 public:
  explicit Connections(int bodies) : root_(bodies) { std::iota(root_.begin(), root_.end(), 0); }

  int root_of(int body) {
    while (root_[body] != body) body = root_[body] = root_[root_[body]];
    return body;
  }
  /// Connects two bodies. Returns false if they were connected before.
  bool join(int a, int b) {
    a = root_of(a);
    b = root_of(b);
    root_[a] = b;
    return a != b;
  }

 private:
  std::vector<int> root_;
};

}  // namespace

bool JointSolver::is_known(const Mlcp& problem) const {
  if (problem.rows.size() != rows_) return false;
  return std::ranges::all_of(groups_, [&](const Group& group) {
    for (int k = 0; k < group.rows; ++k) {
      const Mlcp::Row& row = problem.rows[group.row[k]];
      if (row.a != group.a || row.b != group.b) return false;
    }
    return true;
  });
}

bool JointSolver::has_loops(const Mlcp& problem) const {
  const int fixed = problem.bodies;  // index of all fixed bodies
  Connections connections(problem.bodies + 1);
  std::map<std::pair<int, int>, int> rows_of;
  for (const Group& group : groups_) rows_of[std::minmax(group.a, group.b)] += group.rows;
  for (const auto& [bodies, rows] : rows_of) {
    const int a = bodies.first < 0 ? fixed : bodies.first;
    const int b = bodies.second < 0 ? fixed : bodies.second;
    if (rows > 6 || !connections.join(a, b)) return true;
  }
  return false;
}

void JointSolver::analyse(const Mlcp& problem) {
  rows_ = problem.rows.size();
  groups_.clear();
  struct Part {
    int group;
    bool is_a;
  };
  std::vector<std::vector<Part>> parts_of(problem.bodies);
  // Collect the rows of a joint, which need not follow each other.
  std::map<std::pair<int, int>, int> open;  // last group of two bodies
  for (int i = 0; i < std::ssize(problem.rows); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    const int next = static_cast<int>(groups_.size());
    int& group = open.try_emplace({row.a, row.b}, next).first->second;
    if (group < next && groups_[group].rows < group_size) {
      Group& with = groups_[group];
      with.row[with.rows++] = i;
      continue;
    }
    group = next;
    if (row.a >= 0) parts_of[row.a].push_back({next, true});
    if (row.b >= 0) parts_of[row.b].push_back({next, false});
    groups_.push_back({{i, 0, 0}, 1, row.a, row.b});
  }
  has_loops_ = has_loops(problem);

  // List the products: two groups that share a body add to one block beside the diagonal
  std::map<std::pair<int, int>, int> number_of;
  std::vector<std::pair<int, int>> pairs;
  products_.clear();
  for (const std::vector<Part>& parts : parts_of) {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const std::pair<int, int> pair{parts[i].group, parts[j].group};
        const auto [at, is_new] = number_of.try_emplace(pair, static_cast<int>(pairs.size()));
        if (is_new) pairs.push_back(pair);
        products_.push_back({at->second, pair.first, pair.second, parts[i].is_a, parts[j].is_a});
      }
    }
  }
  factor_.analyse(static_cast<int>(groups_.size()), pairs);
  // Turn the products to the way in which the factor stores their blocks
  for (Product& product : products_) {
    if (pairs[product.pair].first == product.row) continue;
    std::swap(product.row, product.column);
    std::swap(product.row_is_a, product.column_is_a);
  }
}

bool JointSolver::factor(const Mlcp& problem, double shift) {
  factor_.clear();
  for (const Product& product : products_) {
    Matrix3& block = factor_.block(product.pair);
    const Group& rows = groups_[product.row];
    const Group& columns = groups_[product.column];
    for (int c = 0; c < columns.rows; ++c) {
      const Mlcp::Row& column = problem.rows[columns.row[c]];
      const Vector6& part = product.column_is_a ? column.part_a : column.part_b;
      for (int r = 0; r < rows.rows; ++r) {
        const Mlcp::Row& row = problem.rows[rows.row[r]];
        block(r, c) += (product.row_is_a ? row.part_a : row.part_b).dot(part);
      }
    }
  }
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    const Group& group = groups_[i];
    Matrix3& diagonal = factor_.diagonal(static_cast<int>(i));
    diagonal.setIdentity();
    for (int r = 0; r < group.rows; ++r) {
      const Mlcp::Row& row = problem.rows[group.row[r]];
      for (int c = 0; c < r; ++c) {
        const Mlcp::Row& column = problem.rows[group.row[c]];
        if (group.a >= 0) diagonal(r, c) += row.part_a.dot(column.part_a);
        if (group.b >= 0) diagonal(r, c) += row.part_b.dot(column.part_b);
      }
      diagonal(r, r) = (1 + shift) * gamma_[group.row[r]] + row.softness;
    }
  }
  return factor_.factor(shift > 0 ? 0 : least_pivot);
}

void JointSolver::set_impulses(const Mlcp& problem, const std::vector<Vector3>& combination,
                               std::vector<Vector6>& impulses) const {
  impulses.assign(problem.bodies, Vector6::Zero());
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    // Sum a group's rows first, so that a body's sum in memory is updated once for the three.
    const Group& group = groups_[i];
    Vector6 sum_a = Vector6::Zero();
    Vector6 sum_b = Vector6::Zero();
    for (int k = 0; k < group.rows; ++k) {
      sum_a += combination[i][k] * problem.rows[group.row[k]].part_a;
      sum_b += combination[i][k] * problem.rows[group.row[k]].part_b;
    }
    if (group.a >= 0) impulses[group.a] += sum_a;
    if (group.b >= 0) impulses[group.b] += sum_b;
  }
}

double JointSolver::residual(const Mlcp& problem) {
  set_impulses(problem, multipliers_, y_);
  // Compare squares over Γ_xx, to avoid square roots.
  double largest = 0;
  double sum = 0;  // finite if all residuals are
  squared_scale_ = 0;
  for_each_row([&](std::size_t group, int k, int i) {
    const Mlcp::Row& row = problem.rows[i];
    double missing = row.right - row.softness * multipliers_[group][k];
    if (row.a >= 0) missing -= row.part_a.dot(y_[row.a]);
    if (row.b >= 0) missing -= row.part_b.dot(y_[row.b]);
    left_[group][k] = missing;
    const double squared = squared_residual(row, i, missing);
    largest = std::max(largest, squared);
    squared_scale_ = std::max(squared_scale_, row.right * row.right * inverse_gamma_[i]);
    sum += squared;
  });
  if (!std::isfinite(sum)) return infinity;
  return squared_scale_ > 0 ? std::sqrt(largest / squared_scale_) : 0;
}

double JointSolver::squared_residual(const Mlcp::Row& row, int i, double missing) const {
  const double share = row.softness > 0 ? 1 / (1 + row.softness * inverse_gamma_[i]) : 1;
  return missing * missing * share * share * inverse_gamma_[i];
}

bool JointSolver::rest_is_redundant(const Mlcp& problem) {
  // Use the round's step in place of the residual. In exact arithmetic the residual over D is ε times the
  // step; rounding changes the residual by 1e-3 of itself.
  double of_rows = 0;  // |r|², r = the rows' residuals over √Γ_xx
  double moved = 0;    // rᵀ(Γ + S)r, relative to Γ's diagonal
  for_each_row([&](std::size_t group, int k, int i) {
    const double squared = step_[group][k] * step_[group][k];
    of_rows += squared * gamma_[i];
    moved += squared * problem.rows[i].softness;
  });
  set_impulses(problem, step_, step_y_);
  for (const Vector6& y : step_y_) moved += y.squaredNorm();
  return moved <= MlcpSolver::rank_tolerance * of_rows;
}

int JointSolver::violated(const Mlcp& problem) const {
  int count = 0;
  for_each_row([&](std::size_t group, int k, int i) {
    const double squared = squared_residual(problem.rows[i], i, left_[group][k]);
    count += std::sqrt(squared) > MlcpSolver::tolerance * std::sqrt(squared_scale_) ? 1 : 0;
  });
  return count;
}

bool JointSolver::solve_tree(const Mlcp& problem, MlcpReport& report) {
  if (!factor(problem, 0)) return false;
  for (int round = 0; round <= most_refinements; ++round) {
    factor_.solve(left_);
    for (std::size_t i = 0; i < groups_.size(); ++i) multipliers_[i] += left_[i];
    report.row_solves += static_cast<std::int64_t>(rows_);
    report.residual = residual(problem);
    if (report.residual <= accurate) break;
  }
  return report.residual <= MlcpSolver::tolerance;
}

bool JointSolver::solve_loops(const Mlcp& problem, MlcpReport& report) {
  if (!factor(problem, shift_of_loops)) return false;
  report.residual = infinity;
  bool is_slow = false;
  for (int round = 1, idle = 0; idle <= most_idle_rounds; ++round) {
    step_ = left_;
    factor_.solve(step_);
    for (std::size_t i = 0; i < groups_.size(); ++i) multipliers_[i] += step_[i];
    report.row_solves += static_cast<std::int64_t>(rows_);
    const double before = report.residual;
    const double now = residual(problem);
    // Keep the best iterate
    idle = now < 0.9 * before ? 0 : idle + 1;
    if (now < before) {
      report.residual = now;
      best_ = multipliers_;
    }
    if (now <= accurate || (report.residual <= MlcpSolver::tolerance && idle > 0)) break;
    if (rest_is_redundant(problem)) {
      // Stop: further rounds would only change redundant rows' impulses.
      report.residual = now;
      if (now <= MlcpSolver::tolerance) return true;
      report.status = MlcpReport::Status::least_squares;
      report.contradicting = violated(problem);
      return true;
    }
    // Factor again with a smaller ε where convergence is slow
    if (is_slow || round < rounds_until_slow || now < 0.5 * before) continue;
    is_slow = true;
    ++report.active_sets;
    if (!factor(problem, shift_of_slow_loops)) return false;
  }
  if (!(report.residual <= MlcpSolver::tolerance)) return false;
  multipliers_ = best_;
  residual(problem);
  return true;
}

bool JointSolver::solve(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report) {
  const std::size_t count = problem.rows.size();
  y_.assign(problem.bodies, Vector6::Zero());
  lambda.assign(count, 0.0);
  if (count == 0) return true;
  if (std::any_of(problem.rows.rbegin(), problem.rows.rend(), std::mem_fn(&Mlcp::Row::has_limits)))
    return false;  // the search is from the end, where contacts are
  if (!is_known(problem)) analyse(problem);
  gamma_.resize(count);
  inverse_gamma_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    gamma_[i] = problem.rows[i].gamma();
    if (!(gamma_[i] > 0)) return false;
    inverse_gamma_[i] = 1 / gamma_[i];
  }
  for (std::vector<Vector3>* values : {&multipliers_, &left_, &step_})
    values->assign(groups_.size(), Vector3::Zero());
  for_each_row([&](std::size_t group, int k, int i) { left_[group][k] = problem.rows[i].right; });
  report.active_sets = 1;
  if (!(has_loops_ ? solve_loops(problem, report) : solve_tree(problem, report))) return false;
  for_each_row([&](std::size_t group, int k, int i) { lambda[i] = multipliers_[group][k]; });
  return true;
}

int DirectSolver::list_islands(const Mlcp& problem) {
  const std::vector<Mlcp::Row>& rows = problem.rows;
  const int fixed = problem.bodies;
  Connections connections(problem.bodies + 1);
  const auto body_of = [&](const Mlcp::Row& row) { return row.a >= 0 ? row.a : row.b >= 0 ? row.b : fixed; };
  // True where a row is of the same bodies as the one before it, as in a manifold.
  const auto repeats_bodies = [&](std::size_t i) {
    const Mlcp::Row& row = rows[i];
    return i > 0 && row.a >= 0 && row.a == rows[i - 1].a && row.b == rows[i - 1].b &&
           (row.normal < 0 || rows[row.normal].a == row.a);
  };
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Mlcp::Row& row = rows[i];
    if (repeats_bodies(i)) continue;
    if (row.a >= 0 && row.b >= 0) connections.join(row.a, row.b);
    if (row.normal >= 0) connections.join(body_of(row), body_of(rows[row.normal]));
  }
  const int first = connections.root_of(body_of(rows[0]));
  bool is_one = true;
  for (std::size_t i = 0; i < rows.size() && is_one; ++i)
    is_one = repeats_bodies(i) || connections.root_of(body_of(rows[i])) == first;
  if (is_one) return 1;

  for (Island& island : islands_) {
    island.rows.clear();
    island.bodies.clear();
  }
  std::size_t count = 0;
  island_of_.assign(problem.bodies + 1, -1);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    int& island = island_of_[connections.root_of(body_of(rows[i]))];
    if (island < 0) {
      island = static_cast<int>(count++);
      if (islands_.size() < count) islands_.emplace_back();
    }
    islands_[island].rows.push_back(static_cast<int>(i));
  }
  index_.resize(problem.bodies);
  for (int body = 0; body < problem.bodies; ++body) {
    const int island = island_of_[connections.root_of(body)];
    if (island < 0) continue;
    index_[body] = static_cast<int>(islands_[island].bodies.size());
    islands_[island].bodies.push_back(body);
  }
  return static_cast<int>(count);
}

void DirectSolver::copy_rows(const Mlcp& problem, Island& island) {
  island.problem.bodies = static_cast<int>(island.bodies.size());
  island.problem.rows.clear();
  for (const int row : island.rows) {
    row_index_[row] = static_cast<int>(island.problem.rows.size());
    Mlcp::Row copy = problem.rows[row];
    if (copy.a >= 0) copy.a = index_[copy.a];
    if (copy.b >= 0) copy.b = index_[copy.b];
    if (copy.normal >= 0) copy.normal = row_index_[copy.normal];  // a normal comes before its friction
    island.problem.rows.push_back(copy);
  }
}

MlcpReport DirectSolver::solve(const Mlcp& problem, std::vector<double>& lambda) {
  MlcpReport report;
  if (joints_.solve(problem, lambda, report)) {
    impulses_ = joints_.impulses();
    return report;
  }
  const int islands = list_islands(problem);
  if (islands == 1) {
    report = general_.solve(problem, lambda);
    impulses_ = general_.impulses();
    return report;
  }
  report = {};
  lambda.resize(problem.rows.size());
  row_index_.resize(problem.rows.size());
  impulses_.assign(problem.bodies, Vector6::Zero());
  for (int k = 0; k < islands; ++k) {
    Island& island = islands_[k];
    copy_rows(problem, island);
    MlcpReport one;
    const bool is_of_joints = island.joints.solve(island.problem, island.lambda, one);
    if (!is_of_joints) one = island.general.solve(island.problem, island.lambda);
    const std::vector<Vector6>& impulses =
        is_of_joints ? island.joints.impulses() : island.general.impulses();
    for (std::size_t i = 0; i < island.rows.size(); ++i) lambda[island.rows[i]] = island.lambda[i];
    for (std::size_t i = 0; i < island.bodies.size(); ++i) impulses_[island.bodies[i]] = impulses[i];
    report.status = std::max(report.status, one.status);
    report.residual = std::max(report.residual, one.residual);
    report.contradicting += one.contradicting;
    report.active_sets = std::max(report.active_sets, one.active_sets);
    report.row_solves += one.row_solves;
  }
  return report;
}

}  // namespace substep
