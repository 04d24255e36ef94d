// An interior point method, which takes some thirty factorisations at any size.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "sim/direct/mlcp.h"

namespace substep {
namespace {

constexpr int most_steps = 60;
constexpr int most_idle_steps = 6;  ///< steps in a row that leave more than `largest_rest` of the residual
constexpr double largest_rest = 0.8;
constexpr double near_solution = 1e-8;  ///< residual from which a few active sets suffice
/// ε of the steps. With 1e-10 rounding leaves a residual of 1e-4 in piles; with 1e-7 more steps are short.
constexpr double proximal_of_steps = 1e-8;
constexpr double fraction_of_length = 0.99;
/// Step length below which each contact takes a length of its own: only a few contacts limit so short a step.
/// With one length for all a pile of 250 ends with a residual of 6e-3.
constexpr double short_step = 0.2;
constexpr double fraction_of_own_length = 0.9;

/// Returns the largest s <= `most` up to which `x0` + s `d0` >= |`x` + s `d`|.
double length_in_cone(double x0, const Vector2& x, double d0, const Vector2& d, double most) {
  const double a = d0 * d0 - d.squaredNorm();
  const double b = x0 * d0 - x.dot(d);
  const double c = x0 * x0 - x.squaredNorm();
  double length = d0 < 0 ? std::min(most, -x0 / d0) : most;
  const double discriminant = b * b - a * c;
  if (discriminant < 0) return length;
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  for (const double s : {q / a, c / q}) {
    if (s > 0 && s < length) length = s;
  }
  return length;
}

}  // namespace

bool MlcpSolver::list_units() {
  units_.clear();
  unit_of_.assign(rows().size(), -1);
  for (std::size_t i = 0; i < rows().size(); ++i) {
    const Row& row = rows()[i];
    if (!(gamma_[i] > 0) || pair_[i] == Pair::second) continue;
    if (row.normal < 0) {
      Unit unit;
      unit.row = {static_cast<int>(i), -1, -1};
      unit.has_low = std::isfinite(row.low);
      unit.has_high = std::isfinite(row.high);
      if (row.low == row.high) return false;
      unit_of_[i] = static_cast<int>(units_.size());
      units_.push_back(unit);
      continue;
    }
    // The unit of the normal is known, as it comes before its friction.
    if (pair_[i] == Pair::none || unit_of_[row.normal] < 0) return false;
    const Row& normal = rows()[row.normal];
    if (normal.a != row.a || normal.b != row.b || normal.low != 0 || std::isfinite(normal.high)) return false;
    if (!(row.friction > 0)) continue;
    Unit& unit = units_[unit_of_[row.normal]];
    unit.row = {row.normal, static_cast<int>(i), static_cast<int>(i) + 1};
    unit.friction = row.friction * std::sqrt(gamma_[i] / gamma_[row.normal]);
  }
  return true;
}

/// Starts a unit at distance 1, scaled, from its lower or else its upper limit, at most in their middle.
void MlcpSolver::start_unit(Unit& unit) const {
  const Row& row = rows()[unit.row[0]];
  const double one = root_gamma_[unit.row[0]] / scale_;
  unit.above = unit.below = 1;
  if (unit.has_low && unit.has_high) {
    unit.above = std::min(1.0, 0.5 * (row.high - row.low) * one);
    unit.below = (row.high - row.low) * one - unit.above;
  }
  unit.lambda[0] = unit.has_low    ? row.low * one + unit.above
                   : unit.has_high ? row.high * one - unit.below
                                   : 0;
  unit.lower = unit.has_low ? 1 : 0;
  unit.upper = unit.has_high ? 1 : 0;
}

/// Sets the defects: the rows' velocities less those that multipliers and slip stand for.
void MlcpSolver::set_defects() {
  for (Unit& unit : units_) {
    for (int k = 0; k < unit.rows(); ++k)
      unit.defect[k] = w_[unit.row[k]] / (root_gamma_[unit.row[k]] * scale_);
    unit.defect[0] += unit.upper - unit.lower;
    if (unit.rows() > 1) unit.defect.tail<2>() -= unit.slip;
  }
}

/// Linearises the unit's law: Δλ = change_with_fixed_bodies(t) − weight Δw, with softness and ε.
void MlcpSolver::set_weight(Unit& unit) const {
  Matrix3 softness = Matrix3::Zero();
  for (int k = 0; k < unit.rows(); ++k)
    softness(k, k) = rows()[unit.row[k]].softness / gamma_[unit.row[k]] + proximal_of_steps;
  unit.law.setZero();
  unit.weight.setZero();
  if (!unit.is_limited()) {
    unit.weight(0, 0) = 1 / softness(0, 0);
    return;
  }
  unit.law(0, 0) = 1 / (unit.lower / unit.above + unit.upper / unit.below);
  if (unit.rows() > 1) {
    const double most = unit.friction * unit.lambda[0];
    const Vector2 force = unit.lambda.tail<2>();
    unit.inverse = (unit.speed * Matrix2::Identity() - force * unit.slip.transpose() / most).inverse();
    unit.law.bottomRightCorner<2, 2>() =
        unit.inverse * (most * Matrix2::Identity() - force * force.transpose() / most);
    unit.law.bottomLeftCorner<2, 1>() =
        unit.law(0, 0) * unit.friction * unit.inverse * (unit.speed / most * force - unit.slip);
  }
  unit.damping = (Matrix3::Identity() + unit.law * softness).inverse();
  unit.weight = unit.damping * unit.law;
}

/// Returns Δλ of a unit whose bodies keep their velocities, where products of λ and w are to be `t`.
Vector3 MlcpSolver::change_with_fixed_bodies(const Unit& unit, double t) {
  if (!unit.is_limited()) return {-unit.weight(0, 0) * unit.defect[0], 0, 0};
  Vector3 change = Vector3::Zero();
  if (unit.has_low) change[0] += t / unit.above - unit.lower;
  if (unit.has_high) change[0] -= t / unit.below - unit.upper;
  change[0] *= unit.law(0, 0);
  if (unit.rows() > 1) {
    const double most = unit.friction * unit.lambda[0];
    const Vector2 force = unit.lambda.tail<2>();
    const double along =
        t - most * unit.speed - force.dot(unit.slip) - unit.friction * unit.speed * change[0];
    change.tail<2>() = -unit.inverse * (most * unit.slip + unit.speed * force +
                                        unit.friction * change[0] * unit.slip + along / most * force);
  }
  return unit.damping * (change - unit.law * unit.defect);
}

/// Sets the Newton step towards products of λ and w equal to `t`.
void MlcpSolver::set_directions(double t) {
  for (Vector6& s : step_) s.setZero();
  for (Unit& unit : units_) {
    unit.change = change_with_fixed_bodies(unit, t);
    for (int k = 0; k < unit.rows(); ++k) {
      const Row& row = rows()[unit.row[k]];
      const double size = unit.change[k] / root_gamma_[unit.row[k]];
      row.add_impulse(size, step_);
    }
  }
  solve_blocks();
  for (Unit& unit : units_) {
    Vector3 moved = Vector3::Zero();
    for (int k = 0; k < unit.rows(); ++k) {
      moved[k] = rows()[unit.row[k]].velocity(step_) / root_gamma_[unit.row[k]];
    }
    unit.change -= unit.weight * moved;
    if (unit.has_low)
      unit.lower_change = t / unit.above - unit.lower - unit.lower / unit.above * unit.change[0];
    if (unit.has_high)
      unit.upper_change = t / unit.below - unit.upper + unit.upper / unit.below * unit.change[0];
    if (unit.rows() == 1) continue;
    for (int k = 1; k < 3; ++k) {
      const double softness = rows()[unit.row[k]].softness / gamma_[unit.row[k]];
      unit.slip_change[k - 1] = moved[k] + unit.defect[k] + (softness + proximal_of_steps) * unit.change[k];
    }
    const double most = unit.friction * unit.lambda[0];
    const Vector2 force = unit.lambda.tail<2>();
    unit.speed_change =
        (t - most * unit.speed - force.dot(unit.slip) - unit.friction * unit.speed * unit.change[0] -
         unit.slip.dot(unit.change.tail<2>()) - force.dot(unit.slip_change)) /
        most;
  }
}

/// Returns the fraction of its step after which a unit reaches its limits; infinity where it never does.
double MlcpSolver::length_of_step(const Unit& unit) {
  double length = infinity;
  const auto reach = [&](double value, double change) {
    if (change < 0) length = std::min(length, -value / change);
  };
  if (unit.has_low) {
    reach(unit.above, unit.change[0]);
    reach(unit.lower, unit.lower_change);
  }
  if (unit.has_high) {
    reach(unit.below, -unit.change[0]);
    reach(unit.upper, unit.upper_change);
  }
  if (unit.rows() == 1) return length;
  length = length_in_cone(unit.friction * unit.lambda[0], unit.lambda.tail<2>(),
                          unit.friction * unit.change[0], unit.change.tail<2>(), length);
  return length_in_cone(unit.speed, unit.slip, unit.speed_change, unit.slip_change, length);
}

double MlcpSolver::common_length() const {
  double length = infinity;
  for (const Unit& unit : units_) length = std::min(length, length_of_step(unit));
  return length;
}

/// Returns the mean of the products of λ and w after a fraction of the step.
double MlcpSolver::mean_product(double length) const {
  double sum = 0;
  int count = 0;
  for (const Unit& unit : units_) {
    const double change = length * unit.change[0];
    if (unit.has_low) sum += (unit.above + change) * (unit.lower + length * unit.lower_change);
    if (unit.has_high) sum += (unit.below - change) * (unit.upper + length * unit.upper_change);
    count += (unit.has_low ? 1 : 0) + (unit.has_high ? 1 : 0);
    if (unit.rows() == 1) continue;
    sum +=
        unit.friction * (unit.lambda[0] + change) * (unit.speed + length * unit.speed_change) +
        (unit.lambda.tail<2>() + length * unit.change.tail<2>()).dot(unit.slip + length * unit.slip_change);
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

void MlcpSolver::factor_units() {
  clear_blocks();
  using Part = Eigen::Matrix<double, 3, 6>;
  for (Unit& unit : units_) {
    set_weight(unit);
    const Row& first = rows()[unit.row[0]];
    Part a = Part::Zero();
    Part b = Part::Zero();
    for (int k = 0; k < unit.rows(); ++k) {
      const Row& row = rows()[unit.row[k]];
      const double inverse_root = 1 / root_gamma_[unit.row[k]];
      a.row(k) = inverse_root * row.part_a.transpose();
      b.row(k) = inverse_root * row.part_b.transpose();
    }
    const Part weighted_a = unit.weight * a;
    const Part weighted_b = unit.weight * b;
    if (first.a >= 0) blocks_[position_[first.a]].noalias() += a.transpose() * weighted_a;
    if (first.b >= 0) blocks_[position_[first.b]].noalias() += b.transpose() * weighted_b;
    if (first.a < 0 || first.b < 0) continue;
    blocks_[row_blocks_[2 * unit.row[0]]].noalias() += a.transpose() * weighted_b;
    blocks_[row_blocks_[2 * unit.row[0] + 1]].noalias() += b.transpose() * weighted_a;
  }
  eliminate();
}

/// Takes the step: one fraction for all units or, below `short_step`, 0.9 of each unit's way to its limits.
void MlcpSolver::take_step() {
  const double common = std::min(1.0, fraction_of_length * common_length());
  for (Unit& unit : units_) {
    double length = common;
    if (common < short_step) length = std::clamp(fraction_of_own_length * length_of_step(unit), common, 1.0);
    unit.lambda += length * unit.change;
    unit.above += length * unit.change[0];
    unit.below -= length * unit.change[0];
    unit.lower += length * unit.lower_change;
    unit.upper += length * unit.upper_change;
    unit.speed += length * unit.speed_change;
    unit.slip += length * unit.slip_change;
    for (int k = 0; k < unit.rows(); ++k)
      lambda_[unit.row[k]] = unit.lambda[k] * scale_ / root_gamma_[unit.row[k]];
  }
}

bool MlcpSolver::solve_interior() {
  if (!list_units()) return false;
  std::ranges::fill(lambda_, 0.0);
  residual();
  for (Unit& unit : units_) {
    start_unit(unit);
    lambda_[unit.row[0]] = unit.lambda[0] * scale_ / root_gamma_[unit.row[0]];
  }
  velocities();
  double least = infinity;
  for (int step = 0, idle = 0; step < most_steps && idle < most_idle_steps; ++step) {
    set_defects();
    factor_units();
    ++report_.active_sets;
    report_.row_solves += static_cast<std::int64_t>(lambda_.size());
    // Predict: the length of the step to products of zero shows by how much they can shrink (Mehrotra).
    const double mean = mean_product(0);
    set_directions(0);
    const double ratio = std::clamp(mean_product(std::min(1.0, common_length())) / mean, 1e-3, 1.0);
    set_directions(mean * ratio * ratio * ratio);
    take_step();
    const double now = keep_if_better();
    idle = now < largest_rest * least ? 0 : idle + 1;
    least = std::min(least, now);
    if (!std::isfinite(now) || now <= near_solution) break;
  }
  lambda_ = best_;
  return true;
}

}  // namespace substep
