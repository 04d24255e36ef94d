// The problem with friction's limits fixed, a convex one: descent to its minimum.

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/direct/mlcp_friction.h"

namespace substep {
namespace {

constexpr int most_steps_of_minimise = 60;
constexpr int most_steps_of_search = 40;

}  // namespace

int MlcpSolver::clamp_unlimited(const Mlcp& problem, std::vector<double>& lambda) {
  int changed = 0;
  turned_ = 0;
  for (int body = 0; body < problem.bodies; ++body) step_[place_[body]] = -y_[body];
  const auto take = [&](std::size_t i) {
    const Mlcp::Row& row = problem.rows[i];
    if (row.a >= 0) step_[place_[row.a]] += lambda[i] * row.part_a;
    if (row.b >= 0) step_[place_[row.b]] += lambda[i] * row.part_b;
  };
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    const Set before = set_[i];
    if (!(gamma_[i] > 0)) {
      set_[i] = Set::off;
      lambda[i] = 0;
      continue;
    }
    unclamped_[i] =
        (row.right + proximal_ * gamma_[i] * centre_[i] - velocity(row)) / with_proximal(problem, i);
    if (pair_[i] == Pair::first) continue;
    if (pair_[i] == Pair::second) {
      const Vector2 target(unclamped_[i - 1], unclamped_[i]);
      const Vector2 total = onto_disc(target, high_[i]);
      set_[i] = set_[i - 1] = set_of_pair(i - 1, target, high_[i], with_proximal(problem, i));
      lambda[i - 1] = total.x();
      lambda[i] = total.y();
      take(i - 1);
      changed += set_[i] != before ? 1 : 0;
    } else {
      set_[i] = unclamped_[i] <= low_[i] ? Set::low : unclamped_[i] >= high_[i] ? Set::high : Set::free;
      lambda[i] = std::clamp(unclamped_[i], low_[i], high_[i]);
    }
    take(i);
    changed += set_[i] != before ? 1 : 0;
  }
  return changed;
}

double MlcpSolver::share_of_step(const Mlcp& problem) const {
  double along = 0;  // step · y
  double squared = 0;
  for (int body = 0; body < problem.bodies; ++body) {
    along += step_[place_[body]].dot(y_[body]);
    squared += step_[place_[body]].squaredNorm();
  }
  // The derivative along the step rises; without pairs it is piecewise linear. Newton's method between two
  // bounds.
  double low = 0;
  double high = std::numeric_limits<double>::infinity();
  double share = 1;
  for (int search = 0; search < most_steps_of_search; ++search) {
    double derivative = along + share * squared;
    double second = squared;
    for (std::size_t i = 0; i < problem.rows.size(); ++i) {
      if (!(gamma_[i] > 0) || pair_[i] == Pair::first) continue;
      const double softness = with_proximal(problem, i);
      const double value = unclamped_[i] - share * slope_[i] / softness;
      if (pair_[i] == Pair::second) {
        const Vector2 slope(slope_[i - 1], slope_[i]);
        const Vector2 both(unclamped_[i - 1] - share * slope.x() / softness, value);
        const double length = both.norm();
        derivative -= onto_disc(both, high_[i]).dot(slope);
        const double aside = length > high_[i] ? across(both).dot(slope) / length : 0;
        second += (length > high_[i] ? aside * aside * high_[i] / length : slope.squaredNorm()) / softness;
        continue;
      }
      derivative -= std::clamp(value, low_[i], high_[i]) * slope_[i];
      if (value > low_[i] && value < high_[i]) second += slope_[i] * slope_[i] / softness;
    }
    if (!(second > 0)) break;  // the step is zero
    (derivative > 0 ? high : low) = share;
    double next = share - derivative / second;
    if (!(next > low && next < high)) next = std::isfinite(high) ? (low + high) / 2 : 2 * share;
    const bool found = std::abs(next - share) <= 1e-12 * share;
    share = next;
    if (found) break;
  }
  return share;
}

void MlcpSolver::minimise(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report) {
  const std::size_t count = problem.rows.size();
  low_.resize(count);
  high_.resize(count);
  unclamped_.resize(count);
  slope_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Mlcp::Row& row = problem.rows[i];
    const bool is_friction = row.normal >= 0;
    high_[i] = is_friction ? limit(row, lambda[row.normal]) : row.high;
    low_[i] = is_friction ? -high_[i] : row.low;
  }
  velocities(problem, lambda);
  for (int k = 0; k < most_steps_of_minimise; ++k) {
    const int changed = clamp_unlimited(problem, lambda);
    if (k > 0 && changed == 0 && turned_ <= settled_turn) return;
    factor(problem, Friction::fixed);
    ++report.active_sets;
    report.row_solves += static_cast<std::int64_t>(count);
    solve_blocks();
    for (std::size_t i = 0; i < count; ++i) {
      const Mlcp::Row& row = problem.rows[i];
      slope_[i] = 0;
      if (row.a >= 0) slope_[i] += row.part_a.dot(step_[place_[row.a]]);
      if (row.b >= 0) slope_[i] += row.part_b.dot(step_[place_[row.b]]);
    }
    const double share = share_of_step(problem);
    for (int body = 0; body < problem.bodies; ++body) y_[body] += share * step_[place_[body]];
  }
}

}  // namespace substep
