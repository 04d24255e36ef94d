#include "sim/direct/mlcp.h"

#include <cstring>

namespace substep {
namespace {

/// Returns true where two rows are the tangents of one contact.
bool are_pair(const Mlcp::Row& one, const Mlcp::Row& other) {
  return one.normal >= 0 && other.normal == one.normal && other.friction == one.friction &&
         other.softness == one.softness && other.a == one.a && other.b == one.b;
}

/// Returns the largest eigenvalue of a symmetric 2×2 matrix.
double largest_eigenvalue(double first, double second, double between) {
  const double half = 0.5 * (first - second);
  return 0.5 * (first + second) + std::sqrt(half * half + between * between);
}

/// Returns the point of a disc about the origin that is nearest to `point`.
Vector2 onto_disc(const Vector2& point, double radius) {
  const double length = point.norm();
  return length > radius ? Vector2(point * (radius / length)) : point;
}

}  // namespace

void MlcpSolver::prepare() {
  const std::size_t count = rows().size();
  gamma_.resize(count);
  w_.resize(count);
  natural_.resize(count);
  set_.assign(count, Set::inactive);
  slip_.assign(count, Slip{});
  pair_.assign(count, Pair::none);
  y_.assign(problem_->bodies, Vector6::Zero());
  step_.assign(problem_->bodies, Vector6::Zero());
  known_lambda_.clear();
  for (std::size_t i = 0; i < count; ++i) {
    const Row& row = rows()[i];
    gamma_[i] = row.gamma();
    if (i == 0 || pair_[i - 1] == Pair::first || !are_pair(rows()[i - 1], row)) continue;
    // Give the two one scale, which does not depend on the choice of the tangents.
    const Row& first = rows()[i - 1];
    const double between =
        (row.a >= 0 ? row.part_a.dot(first.part_a) : 0) + (row.b >= 0 ? row.part_b.dot(first.part_b) : 0);
    pair_[i - 1] = Pair::first;
    pair_[i] = Pair::second;
    gamma_[i - 1] = gamma_[i] = largest_eigenvalue(gamma_[i - 1], gamma_[i], between);
  }
}

void MlcpSolver::velocities() {
  // Reuse the velocities of equal λ, as each round needs those of the λ that the round before ended with.
  // Bits are compared: −0 is not 0 here.
  if (known_lambda_.size() == lambda_.size() &&
      std::memcmp(known_lambda_.data(), lambda_.data(), lambda_.size() * sizeof(double)) == 0) {
    w_ = known_w_;
    y_ = known_y_;
    return;
  }
  for (Vector6& y : y_) y.setZero();
  for (std::size_t i = 0; i < rows().size(); ++i) rows()[i].add_impulse(lambda_[i], y_);
  for (std::size_t i = 0; i < rows().size(); ++i) {
    const Row& row = rows()[i];
    w_[i] = row.softness * lambda_[i] - row.right + row.velocity(y_);
  }
  known_lambda_ = lambda_;
  known_w_ = w_;
  known_y_ = y_;
}

Vector2 MlcpSolver::target_of_pair(std::size_t i) const {
  const double inverse = 1 / (gamma_[i] + rows()[i].softness);
  return {lambda_[i] - w_[i] * inverse, lambda_[i + 1] - w_[i + 1] * inverse};
}

double MlcpSolver::residual() {
  velocities();
  return natural_residual();
}

void MlcpSolver::set_scale() {
  root_gamma_.resize(rows().size());
  scale_ = 0;
  for (std::size_t i = 0; i < rows().size(); ++i) {
    root_gamma_[i] = std::sqrt(gamma_[i]);
    if (!(gamma_[i] > 0) || pair_[i] == Pair::second) continue;
    const double right = pair_[i] == Pair::first ? Vector2(rows()[i].right, rows()[i + 1].right).norm()
                                                 : std::abs(rows()[i].right);
    scale_ = std::max(scale_, right / root_gamma_[i]);
  }
}

double MlcpSolver::natural_residual() {
  double largest = 0;
  double sum = 0;  // finite if all are
  for (std::size_t i = 0; i < rows().size(); ++i) {
    natural_[i] = 0;
    if (!(gamma_[i] > 0)) continue;
    const Row& row = rows()[i];
    const double root = root_gamma_[i];
    if (pair_[i] == Pair::first) {
      const Vector2 total = onto_disc(target_of_pair(i), limit(row, lambda_[row.normal]));
      const Vector2 natural = Vector2(lambda_[i], lambda_[i + 1]) - total;
      natural_[i] = natural.x();
      natural_[i + 1] = natural.y();
      largest = std::max(largest, natural.norm() * root);
      sum += natural.sum();
      ++i;
      continue;
    }
    const bool is_friction = row.normal >= 0;
    const double high = is_friction ? limit(row, lambda_[row.normal]) : row.high;
    const double low = is_friction ? -high : row.low;
    natural_[i] = lambda_[i] - std::clamp(lambda_[i] - w_[i] / (gamma_[i] + row.softness), low, high);
    largest = std::max(largest, std::abs(natural_[i]) * root);
    sum += natural_[i];
  }
  if (!std::isfinite(sum)) return infinity;
  return scale_ > 0 ? largest / scale_ : 0;
}

void MlcpSolver::add_proximal_term() {
  for (std::size_t i = 0; i < rows().size(); ++i) {
    w_[i] += proximal_ * gamma_[i] * (lambda_[i] - centre_[i]);
  }
}

double MlcpSolver::keep_if_better() {
  const double now = residual();
  if (now < report_.residual) {
    report_.residual = now;
    best_ = lambda_;
  }
  return now;
}

bool MlcpSolver::rest_is_redundant() {
  for (Vector6& y : y_) y.setZero();
  double of_rows = 0;  // |r|², r = what is left of the rows over √Γ_xx
  double moved = 0;    // rᵀ(Γ + S)r, relative to Γ's diagonal
  for (std::size_t i = 0; i < rows().size(); ++i) {
    const double squared = natural_[i] * natural_[i];
    of_rows += squared * gamma_[i];
    moved += squared * rows()[i].softness;
    rows()[i].add_impulse(natural_[i], y_);
  }
  for (const Vector6& y : y_) moved += y.squaredNorm();
  return moved <= rank_tolerance * of_rows;
}

bool MlcpSolver::rest_has_limits() const {
  for (std::size_t i = 0; i < rows().size(); ++i) {
    if (rows()[i].has_limits() && std::abs(natural_[i]) * root_gamma_[i] > 1e-13 * scale_) return true;
  }
  return false;
}

bool MlcpSolver::keep_if_redundant(double now) {
  if (!std::isfinite(now) || rest_has_limits() || !rest_is_redundant()) return false;
  best_ = lambda_;
  report_.residual = now;
  return true;
}

int MlcpSolver::violated() const {
  int count = 0;
  for (std::size_t i = 0; i < rows().size(); ++i) {
    count += std::abs(natural_[i]) * root_gamma_[i] > tolerance * scale_ ? 1 : 0;
  }
  return count;
}

void MlcpSolver::guess() {
  for (std::size_t i = 0; i < lambda_.size(); ++i) lambda_[i] = rows()[i].start;
}

MlcpReport MlcpSolver::solve(const Mlcp& problem, std::vector<double>& lambda) {
  problem_ = &problem;
  report_ = {};
  lambda_.assign(rows().size(), 0.0);
  prepare();
  if (!rows().empty()) {
    set_scale();
    is_limited_ = std::ranges::any_of(rows(), &Row::has_limits);
    try_methods();
  }
  lambda = lambda_;
  return report_;
}

void MlcpSolver::try_methods() {
  const std::vector<double> zero(rows().size(), 0.0);
  const auto is_guessed = [](const Row& row) { return row.start != 0; };
  const bool has_guess = is_limited_ && std::ranges::any_of(rows(), is_guessed);
  double at_guess = 0;
  if (has_guess) {
    guess();
    at_guess = report_.residual = residual();
    if (report_.residual <= accurate && scale_ > 0) return;
    lambda_ = zero;
  }
  analyse();
  best_ = lambda_;
  const double at_rest = report_.residual = residual();
  const auto is_solved = [&] { return report_.residual <= tolerance; };
  // Try the active sets that the guess gives, then those from rest.
  bool is_redundant = false;
  if (has_guess) {
    guess();
    is_redundant = solve_active_sets(Start::impulses);
    lambda_ = zero;
    set_.assign(rows().size(), Set::inactive);
  }
  if (!is_redundant && !is_solved())
    is_redundant = solve_active_sets(is_limited_ ? Start::perhaps_free : Start::impulses);
  const auto is_open = [&] { return is_limited_ && !is_redundant && !is_solved(); };
  const auto solve_from_within = [&] {
    if (!is_open() || !solve_interior()) return;
    is_redundant = solve_active_sets(Start::impulses);
    lambda_ = best_;
  };
  if (!has_guess) solve_from_within();
  if (is_open()) {
    // Start from the guess or from rest, whichever is nearer to a solution: sets that cycled say nothing.
    const bool is_guess_nearer = has_guess && at_guess < at_rest;
    lambda_ = zero;
    if (is_guess_nearer) guess();
    report_.residual = is_guess_nearer ? at_guess : at_rest;
    best_ = lambda_;
    is_redundant = solve_transient();
  }
  if (has_guess) solve_from_within();
  if (is_open()) is_redundant = solve_by_centres();
  lambda_ = best_;
  report_.residual = residual();
  if (!is_solved()) {
    report_.contradicting = violated();
    report_.status = rest_is_redundant() ? MlcpReport::Status::least_squares : MlcpReport::Status::unsolved;
  }
  velocities();
}

}  // namespace substep
