#include "sim/direct/mlcp.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "sim/direct/mlcp_friction.h"

namespace substep {
namespace {

bool has_limits(const Mlcp::Row& row) {
  return row.normal >= 0 || std::isfinite(row.low) || std::isfinite(row.high);
}

/// Whether the second of two rows is the same contact's other tangent.
bool are_pair(const Mlcp::Row& one, const Mlcp::Row& other) {
  return one.normal >= 0 && other.normal == one.normal && other.friction == one.friction &&
         other.softness == one.softness && other.a == one.a && other.b == one.b;
}

/// Of a symmetric 2×2 matrix.
double largest_eigenvalue(double first, double second, double between) {
  const double half = 0.5 * (first - second);
  return 0.5 * (first + second) + std::sqrt(half * half + between * between);
}

}  // namespace

void MlcpSolver::prepare(const Mlcp& problem) {
  const std::size_t count = problem.rows.size();
  gamma_.resize(count);
  w_.resize(count);
  natural_.resize(count);
  set_.assign(count, Set::off);
  slip_.assign(count, Slip{});
  pair_.assign(count, Pair::none);
  y_.assign(problem.bodies, Vector6::Zero());
  step_.assign(problem.bodies, Vector6::Zero());
  known_lambda_.clear();
  for (std::size_t i = 0; i < count; ++i) {
    const Mlcp::Row& row = problem.rows[i];
    gamma_[i] = (row.a >= 0 ? row.part_a.squaredNorm() : 0) + (row.b >= 0 ? row.part_b.squaredNorm() : 0);
    if (i == 0 || pair_[i - 1] == Pair::first || !are_pair(problem.rows[i - 1], row)) continue;
    // The two have one scale, which does not depend on the tangents' choice.
    const Mlcp::Row& first = problem.rows[i - 1];
    const double between =
        (row.a >= 0 ? row.part_a.dot(first.part_a) : 0) + (row.b >= 0 ? row.part_b.dot(first.part_b) : 0);
    pair_[i - 1] = Pair::first;
    pair_[i] = Pair::second;
    gamma_[i - 1] = gamma_[i] = largest_eigenvalue(gamma_[i - 1], gamma_[i], between);
  }
}

double MlcpSolver::velocity(const Mlcp::Row& row) const {
  double velocity = 0;
  if (row.a >= 0) velocity += row.part_a.dot(y_[row.a]);
  if (row.b >= 0) velocity += row.part_b.dot(y_[row.b]);
  return velocity;
}

void MlcpSolver::add_impulse(const Mlcp::Row& row, double change) {
  if (row.a >= 0) y_[row.a] += change * row.part_a;
  if (row.b >= 0) y_[row.b] += change * row.part_b;
}

void MlcpSolver::velocities(const Mlcp& problem, const std::vector<double>& lambda) {
  // Each round asks for those of the λ that the round before ended with. Bits are compared: −0 is not 0 here.
  if (known_lambda_.size() == lambda.size() &&
      std::memcmp(known_lambda_.data(), lambda.data(), lambda.size() * sizeof(double)) == 0) {
    w_ = known_w_;
    y_ = known_y_;
    return;
  }
  for (Vector6& y : y_) y.setZero();
  for (std::size_t i = 0; i < problem.rows.size(); ++i) add_impulse(problem.rows[i], lambda[i]);
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    w_[i] = row.softness * lambda[i] - row.right + velocity(row);
  }
  known_lambda_ = lambda;
  known_w_ = w_;
  known_y_ = y_;
}

Vector2 MlcpSolver::target_of_pair(const Mlcp& problem, const std::vector<double>& lambda,
                                   std::size_t i) const {
  const double inverse = 1 / (gamma_[i] + problem.rows[i].softness);
  return {lambda[i] - w_[i] * inverse, lambda[i + 1] - w_[i + 1] * inverse};
}

double MlcpSolver::residual(const Mlcp& problem, const std::vector<double>& lambda) {
  velocities(problem, lambda);
  return natural_residual(problem, lambda);
}

void MlcpSolver::set_scale(const Mlcp& problem) {
  root_gamma_.resize(problem.rows.size());
  scale_ = 0;
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    root_gamma_[i] = std::sqrt(gamma_[i]);
    if (!(gamma_[i] > 0) || pair_[i] == Pair::second) continue;
    const double right = pair_[i] == Pair::first
                             ? Vector2(problem.rows[i].right, problem.rows[i + 1].right).norm()
                             : std::abs(problem.rows[i].right);
    scale_ = std::max(scale_, right / root_gamma_[i]);
  }
}

double MlcpSolver::natural_residual(const Mlcp& problem, const std::vector<double>& lambda) {
  double largest = 0;
  double sum = 0;  // finite if all are
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    natural_[i] = 0;
    if (!(gamma_[i] > 0)) continue;
    const Mlcp::Row& row = problem.rows[i];
    const double root = root_gamma_[i];
    if (pair_[i] == Pair::first) {
      const Vector2 total = onto_disc(target_of_pair(problem, lambda, i), limit(row, lambda[row.normal]));
      const Vector2 natural = Vector2(lambda[i], lambda[i + 1]) - total;
      natural_[i] = natural.x();
      natural_[i + 1] = natural.y();
      largest = std::max(largest, natural.norm() * root);
      sum += natural.sum();
      ++i;
      continue;
    }
    const bool is_friction = row.normal >= 0;
    const double high = is_friction ? limit(row, lambda[row.normal]) : row.high;
    const double low = is_friction ? -high : row.low;
    natural_[i] = lambda[i] - std::clamp(lambda[i] - w_[i] / (gamma_[i] + row.softness), low, high);
    largest = std::max(largest, std::abs(natural_[i]) * root);
    sum += natural_[i];
  }
  if (!std::isfinite(sum)) return std::numeric_limits<double>::infinity();
  return scale_ > 0 ? largest / scale_ : 0;
}

void MlcpSolver::add_proximal_term(const Mlcp& problem, const std::vector<double>& lambda) {
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    w_[i] += proximal_ * gamma_[i] * (lambda[i] - centre_[i]);
  }
}

double MlcpSolver::keep_if_better(const Mlcp& problem, const std::vector<double>& lambda,
                                  MlcpReport& report) {
  const double now = residual(problem, lambda);
  if (now < report.residual) {
    report.residual = now;
    best_ = lambda;
  }
  return now;
}

bool MlcpSolver::rest_is_redundant(const Mlcp& problem) {
  for (Vector6& y : y_) y.setZero();
  double of_rows = 0;  // |r|², r = what is left of the rows over √Γ_xx
  double moved = 0;    // rᵀ(Γ + S)r, relative to Γ's diagonal
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const double squared = natural_[i] * natural_[i];
    of_rows += squared * gamma_[i];
    moved += squared * problem.rows[i].softness;
    add_impulse(problem.rows[i], natural_[i]);
  }
  for (const Vector6& y : y_) moved += y.squaredNorm();
  return moved <= rank_tolerance * of_rows;
}

bool MlcpSolver::rest_has_limits(const Mlcp& problem) const {
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    if (has_limits(problem.rows[i]) && std::abs(natural_[i]) * root_gamma_[i] > 1e-13 * scale_) return true;
  }
  return false;
}

bool MlcpSolver::keep_if_redundant(const Mlcp& problem, const std::vector<double>& lambda, double now,
                                   MlcpReport& report) {
  if (!std::isfinite(now) || rest_has_limits(problem) || !rest_is_redundant(problem)) return false;
  best_ = lambda;
  report.residual = now;
  return true;
}

int MlcpSolver::violated(const Mlcp& problem) const {
  int count = 0;
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    count += std::abs(natural_[i]) * root_gamma_[i] > tolerance * scale_ ? 1 : 0;
  }
  return count;
}

MlcpReport MlcpSolver::solve(const Mlcp& problem, std::vector<double>& lambda) {
  MlcpReport report;
  lambda.assign(problem.rows.size(), 0.0);
  prepare(problem);
  if (problem.rows.empty()) return report;
  set_scale(problem);
  is_limited_ = std::ranges::any_of(problem.rows, has_limits);
  const auto is_guessed = [](const Mlcp::Row& row) { return row.start != 0; };
  const bool has_guess = is_limited_ && std::ranges::any_of(problem.rows, is_guessed);
  const auto guess = [&] {
    for (std::size_t i = 0; i < lambda.size(); ++i) lambda[i] = problem.rows[i].start;
  };
  double at_guess = 0;
  if (has_guess) {
    guess();
    at_guess = report.residual = residual(problem, lambda);
    if (report.residual <= accurate && scale_ > 0) return report;
    lambda.assign(problem.rows.size(), 0.0);
  }
  analyse(problem);
  best_ = lambda;
  const double at_rest = report.residual = residual(problem, lambda);
  const auto is_solved = [&] { return report.residual <= tolerance; };
  bool is_redundant = false;
  if (has_guess) {
    guess();
    is_redundant = solve_active_sets(problem, Start::impulses, lambda, report);
    lambda.assign(problem.rows.size(), 0.0);
    set_.assign(problem.rows.size(), Set::off);
  }
  if (!is_redundant && !is_solved()) {
    const Start start = is_limited_ ? Start::perhaps_free : Start::impulses;
    is_redundant = solve_active_sets(problem, start, lambda, report);
  }
  if (!is_limited_ && !is_redundant && !is_solved())
    is_redundant = solve_by_gradients(problem, lambda, report);
  const auto is_open = [&] { return is_limited_ && !is_redundant && !is_solved(); };
  const auto solve_from_within = [&] {
    if (!is_open() || !solve_interior(problem, lambda, report)) return;
    is_redundant = solve_active_sets(problem, Start::impulses, lambda, report);
    lambda = best_;
  };
  if (!has_guess) solve_from_within();
  if (is_open()) {
    // Sets that cycled say nothing: start from the guess or from rest, whichever is nearer to a solution.
    lambda.assign(problem.rows.size(), 0.0);
    report.residual = at_rest;
    if (has_guess && at_guess < at_rest) {
      guess();
      report.residual = at_guess;
    }
    best_ = lambda;
    is_redundant = solve_transient(problem, lambda, report);
  }
  if (has_guess) solve_from_within();
  if (is_open()) is_redundant = solve_by_centres(problem, lambda, report);
  lambda = best_;
  report.residual = residual(problem, lambda);
  if (!is_solved()) {
    report.contradicting = violated(problem);
    report.status =
        rest_is_redundant(problem) ? MlcpReport::Status::least_squares : MlcpReport::Status::unsolved;
  }
  velocities(problem, lambda);
  return report;
}

}  // namespace substep
