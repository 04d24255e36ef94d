// From active set to active set: which rows are at which limit, and the linear system of the others.

#include <algorithm>
#include <cmath>

#include "sim/direct/mlcp_friction.h"

namespace substep {
namespace {

/// The usual ε. The multipliers' error shrinks by ε/σ a round, σ the smallest relative eigenvalue of Γ that
/// is not zero, and by rounding/ε²: 1e-6 is where the two meet. Measured on ten 1 kg rods with 1000 kg at
/// their end: residual 1e-13 in at most 30 rounds; with 1e-8 rounding wins, and 1e-4 is left.
constexpr double usual_proximal = 1e-6;
constexpr int most_sets = 60;  // a wall of 225 boxes takes at most 40
/// With this part of its residual left about a centre, the centre moves on, whatever signs still change.
constexpr double solved_about_centre = 0.1;
/// Sets after which a residual above this part of the first one says that they go round in circles.
constexpr int sets_of_guess = 3;
constexpr double promising = 0.1;
constexpr int most_rounds = 400;
constexpr int most_idle = 12;  // moves of the centre that leave the residual as it is
constexpr int most_sets_about_centre = 12;

/// Softness across the slip, over Γ_xx, where the limit is next to nothing: as good as infinite.
constexpr double most_across = 1e9;

}  // namespace

MlcpSolver::Set MlcpSolver::set_of_pair(std::size_t i, const Vector2& target, double radius,
                                        double diagonal) {
  const double length = target.norm();
  if (!(length > radius)) return Set::free;
  const Vector2 along = target / length;
  if (set_[i] == Set::slides) turned_ = std::max(turned_, (along - slip_[i].along).norm());
  slip_[i].along = along;
  slip_[i].across = diagonal * std::min((length - radius) / std::max(radius, 1e-300), most_across);
  return Set::slides;
}

int MlcpSolver::classify(const Mlcp& problem, const std::vector<double>& lambda) {
  int changed = 0;
  turned_ = 0;
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    const Set before = set_[i];
    const double target = lambda[i] - w_[i] / (gamma_[i] + row.softness);  // not used without Γ_xx
    if (!(gamma_[i] > 0)) {
      set_[i] = Set::off;
    } else if (pair_[i] == Pair::second) {
      set_[i] = set_[i - 1];
    } else if (row.normal >= 0) {
      // A normal comes before its friction, so its new set is known.
      const double high = limit(row, lambda[row.normal]);
      if (set_[row.normal] != Set::free) {
        set_[i] = Set::off;
      } else if (pair_[i] == Pair::first) {
        set_[i] = set_of_pair(i, target_of_pair(problem, lambda, i), high, gamma_[i] + row.softness);
      } else {
        set_[i] = target >= high ? Set::high : target <= -high ? Set::low : Set::free;
      }
    } else {
      set_[i] = target <= row.low ? Set::low : target >= row.high ? Set::high : Set::free;
    }
    changed += set_[i] != before ? 1 : 0;
  }
  return changed;
}

void MlcpSolver::fix_limits(const Mlcp& problem, std::vector<double>& lambda) const {
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    if (set_[i] == Set::off) lambda[i] = 0;
    if (row.normal < 0) {
      if (set_[i] == Set::low) lambda[i] = row.low;
      if (set_[i] == Set::high) lambda[i] = row.high;
      continue;
    }
    const double most = row.friction * lambda[row.normal];
    if (set_[i] == Set::low) lambda[i] = -most;
    if (set_[i] == Set::high) lambda[i] = most;
    if (set_[i] == Set::slides && pair_[i] == Pair::first) {
      const Vector2& along = slip_[i].along;
      const double aside = across(along).dot(Vector2(lambda[i], lambda[i + 1]));
      const Vector2 total = most * along + aside * across(along);
      lambda[i] = total.x();
      lambda[i + 1] = total.y();
    }
  }
}

void MlcpSolver::solve_set(const Mlcp& problem, std::vector<double>& lambda) {
  fix_limits(problem, lambda);
  velocities(problem, lambda);
  add_proximal_term(problem, lambda);
  solve_free(problem, lambda);
  fix_limits(problem, lambda);
}

bool MlcpSolver::solve_active_sets(const Mlcp& problem, Start start, std::vector<double>& lambda,
                                   MlcpReport& report) {
  const auto rows = static_cast<std::int64_t>(problem.rows.size());
  proximal_ = usual_proximal;
  centre_ = lambda;
  const double at_start = report.residual;
  double at_centre = report.residual;
  int sets = 0;
  int sets_about_centre = 0;
  int idle = 0;
  bool is_redundant = false;
  for (int round = 0; round < most_rounds && sets < most_sets; ++round) {
    const double before = report.residual;
    const double whole = keep_if_better(problem, lambda, report);
    const bool is_accurate = whole <= accurate || (report.residual <= nearly_accurate && whole > before);
    add_proximal_term(problem, lambda);
    const bool is_about_centre = is_limited_ && sets_about_centre > 0 &&
                                 natural_residual(problem, lambda) < solved_about_centre * whole;
    bool another_set = true;
    if (round == 0 && start != Start::impulses) {
      for (std::size_t i = 0; i < problem.rows.size(); ++i) set_[i] = gamma_[i] > 0 ? Set::free : Set::off;
    } else {
      const int changed = classify(problem, lambda);
      another_set = round == 0 || (!is_about_centre && (changed > 0 || turned_ > settled_turn));
      // Where much gives way at once, the sweeps' guess is better than this one.
      if (start == Start::perhaps_free && sets == 1 && 8 * changed > rows) break;
      if (is_limited_ && sets >= sets_of_guess && report.residual > promising * at_start) break;
    }
    if (another_set && is_limited_ && is_accurate) break;
    if (another_set) {
      factor(problem);
      ++sets;
      ++sets_about_centre;
      report.row_solves += rows;
    }
    if (!another_set || sets_about_centre > most_sets_about_centre) {
      // λ solves the problem with the proximal term (or its sets go round in a circle): the centre moves on.
      const double now = keep_if_better(problem, lambda, report);
      idle = report.residual < 0.9 * at_centre ? 0 : idle + 1;
      at_centre = report.residual;
      if (!std::isfinite(now)) lambda = best_;
      if (!another_set && keep_if_redundant(problem, lambda, now, report)) {
        is_redundant = true;
        break;
      }
      if (report.residual <= 1e-13 || idle > (report.residual <= tolerance ? 1 : most_idle)) break;
      centre_ = lambda;
      sets_about_centre = 0;
    }
    solve_set(problem, lambda);
  }
  report.active_sets += sets;
  return is_redundant;
}

bool MlcpSolver::solve_by_gradients(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report) {
  const std::size_t count = problem.rows.size();
  proximal_ = usual_proximal;
  for (std::size_t i = 0; i < count; ++i) set_[i] = gamma_[i] > 0 ? Set::free : Set::off;
  factor(problem);
  ++report.active_sets;
  lambda = best_;
  conjugate_.assign(count, 0.0);
  double before = 0;
  for (int idle = 0; idle <= most_idle;) {
    const double least = report.residual;
    const double now = keep_if_better(problem, lambda, report);
    if (!(now > 1e-13) || !std::isfinite(now)) break;
    if (rest_is_redundant(problem)) {
      best_ = lambda;
      report.residual = now;
      return true;
    }
    idle = now < 0.9 * least ? 0 : idle + 1;
    centre_ = lambda;
    solve_free(problem, lambda);
    double product = 0;  // of what is left and its preconditioned direction
    for (std::size_t i = 0; i < count; ++i) product -= w_[i] * (lambda[i] - centre_[i]);
    for (std::size_t i = 0; i < count; ++i) {
      conjugate_[i] = lambda[i] - centre_[i] + (before > 0 ? product / before * conjugate_[i] : 0);
    }
    before = product;
    velocities(problem, conjugate_);
    double curvature = 0;
    for (std::size_t i = 0; i < count; ++i) curvature += conjugate_[i] * (w_[i] + problem.rows[i].right);
    if (!(curvature > 0)) break;
    for (std::size_t i = 0; i < count; ++i) lambda[i] = centre_[i] + product / curvature * conjugate_[i];
    report.row_solves += static_cast<std::int64_t>(count);
  }
  return false;
}

}  // namespace substep
