#include "sim/direct/mlcp.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace substep {
namespace {

/// ε of the quick way. The multipliers' error shrinks by ε/σ a round, σ the smallest relative eigenvalue of Γ
/// that is not zero, and by rounding/ε²: 1e-6 is where the two meet. Measured on ten 1 kg rods with 1000 kg
/// at their end: residual 1e-13 in at most 30 rounds; with 1e-8 rounding wins, and 1e-4 is left.
constexpr double usual_pull = 1e-6;
constexpr int most_sets = 60;  // a wall of 225 boxes takes at most 40
constexpr int most_rounds = 400;
constexpr int most_idle = 12;  // moves of the centre that leave the residual as it is
constexpr int most_sets_about_centre = 12;

/// ε of the careful way: from an easy problem to the given one. Of 80 problems of dominoes, cards, a wrecked
/// wall and a water wheel that no start solved the quick way, all are solved; with 1e-6 as the least, 50.
/// Points that are 1e-9 m out of their plane are why: what closes them grows by residual/ε a round.
constexpr double first_pull = 0.1;
constexpr double least_pull = 1e-9;
constexpr double after_success = 0.5;
constexpr double after_failure = 4;
constexpr int first_sweeps = 12;
constexpr int most_careful_rounds = 100;
constexpr int most_steps_of_minimise = 60;
constexpr int most_steps_of_search = 40;

/// Directions of friction that turn less than this are taken as settled: what is left is of second order, and
/// goes with the next move of the centre.
constexpr double settled_turn = 1e-6;
/// Softness across the slip, over Γ_xx, where the limit is next to nothing: as good as infinite.
constexpr double most_across = 1e9;

bool has_limits(const Mlcp::Row& row) {
  return row.normal >= 0 || std::isfinite(row.low) || std::isfinite(row.high);
}

double limit(const Mlcp::Row& row, double value) {
  return row.friction * std::max(value, 0.0);
}

/// Whether the second of two rows is the same contact's other tangent.
bool are_pair(const Mlcp::Row& one, const Mlcp::Row& other) {
  return one.normal >= 0 && other.normal == one.normal && other.friction == one.friction &&
         other.softness == one.softness && other.a == one.a && other.b == one.b;
}

/// The point of a disc about the origin that is nearest to `point`.
Vector2 onto_disc(const Vector2& point, double radius) {
  const double length = point.norm();
  return length > radius ? Vector2(point * (radius / length)) : point;
}

Vector2 across(const Vector2& along) {
  return {-along.y(), along.x()};
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

void MlcpSolver::sweep(const Mlcp& problem, std::vector<double>& lambda, int sweeps) {
  const auto target = [&](std::size_t i) {
    const Mlcp::Row& row = problem.rows[i];
    return lambda[i] + (row.right - row.softness * lambda[i] - velocity(row)) / (gamma_[i] + row.softness);
  };
  for (int s = 0; s < sweeps; ++s) {
    for (std::size_t i = 0; i < problem.rows.size(); ++i) {
      const Mlcp::Row& row = problem.rows[i];
      if (!(gamma_[i] > 0) || pair_[i] == Pair::second) continue;
      if (pair_[i] == Pair::first) {
        const Vector2 total = onto_disc({target(i), target(i + 1)}, limit(row, lambda[row.normal]));
        for (std::size_t k = 0; k < 2; ++k) {
          add_impulse(problem.rows[i + k], total[static_cast<Eigen::Index>(k)] - lambda[i + k]);
          lambda[i + k] = total[static_cast<Eigen::Index>(k)];
        }
        continue;
      }
      const bool rubs = row.normal >= 0;
      const double high = rubs ? limit(row, lambda[row.normal]) : row.high;
      const double low = rubs ? -high : row.low;
      const double total = std::clamp(target(i), low, high);
      add_impulse(row, total - lambda[i]);
      lambda[i] = total;
    }
  }
}

void MlcpSolver::velocities(const Mlcp& problem, const std::vector<double>& lambda) {
  for (Vector6& y : y_) y.setZero();
  for (std::size_t i = 0; i < problem.rows.size(); ++i) add_impulse(problem.rows[i], lambda[i]);
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    w_[i] = row.softness * lambda[i] - row.right + velocity(row);
  }
}

Vector2 MlcpSolver::target_of_pair(const Mlcp& problem, const std::vector<double>& lambda,
                                   std::size_t i) const {
  const double inverse = 1 / (gamma_[i] + problem.rows[i].softness);
  return {lambda[i] - w_[i] * inverse, lambda[i + 1] - w_[i + 1] * inverse};
}

double MlcpSolver::residual(const Mlcp& problem, const std::vector<double>& lambda) {
  velocities(problem, lambda);
  double largest = 0;
  double scale = 0;
  double sum = 0;  // finite if all are
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    natural_[i] = 0;
    if (!(gamma_[i] > 0)) continue;
    const Mlcp::Row& row = problem.rows[i];
    const double root = std::sqrt(gamma_[i]);
    if (pair_[i] == Pair::first) {
      const Vector2 total = onto_disc(target_of_pair(problem, lambda, i), limit(row, lambda[row.normal]));
      const Vector2 natural = Vector2(lambda[i], lambda[i + 1]) - total;
      natural_[i] = natural.x();
      natural_[i + 1] = natural.y();
      largest = std::max(largest, natural.norm() * root);
      scale = std::max(scale, Vector2(row.right, problem.rows[i + 1].right).norm() / root);
      sum += natural.sum();
      ++i;
      continue;
    }
    const bool rubs = row.normal >= 0;
    const double high = rubs ? limit(row, lambda[row.normal]) : row.high;
    const double low = rubs ? -high : row.low;
    natural_[i] = lambda[i] - std::clamp(lambda[i] - w_[i] / (gamma_[i] + row.softness), low, high);
    largest = std::max(largest, std::abs(natural_[i]) * root);
    scale = std::max(scale, std::abs(row.right) / root);
    sum += natural_[i];
  }
  scale_ = scale;
  if (!std::isfinite(sum)) return std::numeric_limits<double>::infinity();
  return scale > 0 ? largest / scale : 0;
}

void MlcpSolver::pull_to_centre(const Mlcp& problem, const std::vector<double>& lambda) {
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    w_[i] += pull_ * gamma_[i] * (lambda[i] - centre_[i]);
  }
}

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

void MlcpSolver::analyse(const Mlcp& problem) {
  pairs_.clear();
  for (const Mlcp::Row& row : problem.rows) {
    if (row.a >= 0 && row.b >= 0) pairs_.emplace_back(std::minmax(row.a, row.b));
  }
  std::ranges::sort(pairs_);
  pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
  const bool known = pairs_ == pattern_ && static_cast<int>(order_.size()) == problem.bodies;
  if (!known) {
    pattern_ = pairs_;
    // Minimum degree, ties to the lowest body: little fill for chains, trees and stacks.
    const int n = problem.bodies;
    std::vector<std::vector<int>> adjacent(n);
    for (const auto& [a, b] : pairs_) {
      adjacent[a].push_back(b);
      adjacent[b].push_back(a);
    }
    order_.clear();
    place_.assign(n, -1);
    std::vector<std::vector<int>> eliminated(n);
    std::vector<std::vector<int>> of_degree(n + 1);  // candidates, lazily kept: an entry may be out of date
    for (int body = n - 1; body >= 0; --body) of_degree[adjacent[body].size()].push_back(body);
    std::size_t degree = 0;
    while (static_cast<int>(order_.size()) < n) {
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
    neighbour_begin_.assign(1, 0);
    neighbours_.clear();
    for (const int body : order_) {
      for (const int other : eliminated[body]) neighbours_.push_back(place_[other]);
      std::sort(neighbours_.begin() + neighbour_begin_.back(), neighbours_.end());
      neighbour_begin_.push_back(static_cast<int>(neighbours_.size()));
    }
    update_begin_.assign(1, 0);
    updates_.clear();
  }
  const int n = problem.bodies;
  // The block of places (p, q): p itself, else the upper one of an edge, and the lower one after it.
  const auto block_of = [&](int p, int q) {
    if (p == q) return p;
    const int early = std::min(p, q);
    const auto begin = neighbours_.begin() + neighbour_begin_[early];
    const auto end = neighbours_.begin() + neighbour_begin_[early + 1];
    const int edge = static_cast<int>(std::lower_bound(begin, end, std::max(p, q)) - neighbours_.begin());
    return n + 2 * edge + (p > q ? 1 : 0);
  };
  if (!known) {
    for (int p = 0; p < n; ++p) {
      for (int i = neighbour_begin_[p]; i < neighbour_begin_[p + 1]; ++i) {
        for (int j = neighbour_begin_[p]; j < neighbour_begin_[p + 1]; ++j) {
          updates_.push_back(block_of(neighbours_[i], neighbours_[j]));
        }
      }
      update_begin_.push_back(static_cast<int>(updates_.size()));
    }
    blocks_.resize(n + 2 * neighbours_.size());
    inverse_.resize(n);
  }
  row_blocks_.resize(2 * problem.rows.size());
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    if (row.a < 0 || row.b < 0) continue;
    row_blocks_[2 * i] = block_of(place_[row.a], place_[row.b]);
    row_blocks_[2 * i + 1] = block_of(place_[row.b], place_[row.a]);
  }
}

void MlcpSolver::add_product(const Mlcp& problem, std::size_t row_index, const Vector6& column_a,
                             const Vector6& column_b, const Vector6& row_a, const Vector6& row_b,
                             double factor) {
  const Mlcp::Row& row = problem.rows[row_index];
  if (row.a >= 0) blocks_[place_[row.a]].noalias() += (factor * column_a) * row_a.transpose();
  if (row.b >= 0) blocks_[place_[row.b]].noalias() += (factor * column_b) * row_b.transpose();
  if (row.a >= 0 && row.b >= 0) {
    blocks_[row_blocks_[2 * row_index]].noalias() += (factor * column_a) * row_b.transpose();
    blocks_[row_blocks_[2 * row_index + 1]].noalias() += (factor * column_b) * row_a.transpose();
  }
}

void MlcpSolver::add_slide(const Mlcp& problem, std::size_t i, Friction friction) {
  const Mlcp::Row& one = problem.rows[i];
  const Mlcp::Row& two = problem.rows[i + 1];
  const Vector2& along = slip_[i].along;
  if (friction == Friction::follows) {
    const Mlcp::Row& normal = problem.rows[one.normal];
    add_product(problem, one.normal, along.x() * one.part_a + along.y() * two.part_a,
                along.x() * one.part_b + along.y() * two.part_b, normal.part_a, normal.part_b,
                one.friction / (pull_ * gamma_[one.normal] + normal.softness));
  }
  const Vector2 aside = across(along);
  const Vector6 part_a = aside.x() * one.part_a + aside.y() * two.part_a;
  const Vector6 part_b = aside.x() * one.part_b + aside.y() * two.part_b;
  add_product(problem, i, part_a, part_b, part_a, part_b,
              1 / (pull_ * gamma_[i] + one.softness + slip_[i].across));
}

void MlcpSolver::factor(const Mlcp& problem, Friction friction) {
  const int n = problem.bodies;
  for (int p = 0; p < n; ++p) blocks_[p].setIdentity();
  for (std::size_t k = n; k < blocks_.size(); ++k) blocks_[k].setZero();
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    if (set_[i] == Set::free) {
      add_product(problem, i, row.part_a, row.part_b, row.part_a, row.part_b,
                  1 / (pull_ * gamma_[i] + row.softness));
    } else if (set_[i] == Set::slides) {
      if (pair_[i] == Pair::first) add_slide(problem, i, friction);
    } else if (friction == Friction::follows && row.normal >= 0 && set_[i] != Set::off) {
      // A sliding row's impulse follows its normal's: it adds ±μ of its column to the normal's.
      const Mlcp::Row& normal = problem.rows[row.normal];
      const double sign = set_[i] == Set::high ? 1 : -1;
      add_product(problem, row.normal, row.part_a, row.part_b, normal.part_a, normal.part_b,
                  sign * row.friction / (pull_ * gamma_[row.normal] + normal.softness));
    }
  }
  for (int p = 0; p < n; ++p) {
    inverse_[p] = blocks_[p].inverse();
    const int begin = neighbour_begin_[p];
    const int end = neighbour_begin_[p + 1];
    int update = update_begin_[p];
    for (int i = begin; i < end; ++i) {
      const Matrix6 lower = blocks_[n + 2 * i + 1] * inverse_[p];
      for (int j = begin; j < end; ++j) {
        blocks_[updates_[update++]].noalias() -= lower * blocks_[n + 2 * j];
      }
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
    return 1 / (pull_ * gamma_[i] + problem.rows[i].softness + slip_[i].across);
  };
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Mlcp::Row& row = problem.rows[i];
    if (set_[i] == Set::free) {
      add_column(row, -w_[i] / (pull_ * gamma_[i] + row.softness));
    } else if (row.normal >= 0 && set_[i] != Set::off && pair_[i] != Pair::second) {
      const std::size_t normal = row.normal;
      const double share =
          -row.friction * w_[normal] / (pull_ * gamma_[normal] + problem.rows[normal].softness);
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
      lambda[i] += (-w_[i] - stepped(row)) / (pull_ * gamma_[i] + row.softness);
    } else if (set_[i] == Set::slides && pair_[i] == Pair::first) {
      const Vector2 aside = across(slip_[i].along);
      const Vector2 velocity(stepped(row), stepped(problem.rows[i + 1]));
      const double change = (lacks_across(i) - aside.dot(velocity)) * weight_across(i);
      lambda[i] += change * aside.x();
      lambda[i + 1] += change * aside.y();
    }
  }
}

void MlcpSolver::solve_set(const Mlcp& problem, std::vector<double>& lambda) {
  fix_limits(problem, lambda);
  velocities(problem, lambda);
  pull_to_centre(problem, lambda);
  solve_free(problem, lambda);
  fix_limits(problem, lambda);
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
    if (has_limits(problem.rows[i]) && std::abs(natural_[i]) * std::sqrt(gamma_[i]) > 1e-13 * scale_)
      return true;
  }
  return false;
}

int MlcpSolver::violated(const Mlcp& problem) const {
  int count = 0;
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    count += std::abs(natural_[i]) * std::sqrt(gamma_[i]) > tolerance * scale_ ? 1 : 0;
  }
  return count;
}

bool MlcpSolver::solve_quickly(const Mlcp& problem, Start start, std::vector<double>& lambda,
                               MlcpReport& report) {
  const auto rows = static_cast<std::int64_t>(problem.rows.size());
  pull_ = usual_pull;
  centre_ = lambda;
  int sets = 0;
  int sets_about_centre = 0;
  int idle = 0;
  bool is_redundant = false;
  for (int round = 0; round < most_rounds && sets < most_sets; ++round) {
    velocities(problem, lambda);
    pull_to_centre(problem, lambda);
    bool another_set = true;
    if (round == 0 && start != Start::impulses) {
      for (std::size_t i = 0; i < problem.rows.size(); ++i) set_[i] = gamma_[i] > 0 ? Set::free : Set::off;
    } else {
      const int changed = classify(problem, lambda);
      another_set = changed > 0 || turned_ > settled_turn || round == 0;
      // Where much gives way at once, the sweeps' guess is better than this one.
      if (start == Start::perhaps_free && sets == 1 && 8 * changed > rows) break;
    }
    if (another_set) {
      factor(problem, Friction::follows);
      ++sets;
      ++sets_about_centre;
      report.row_solves += rows;
    }
    if (!another_set || sets_about_centre > most_sets_about_centre) {
      // λ solves the problem that is pulled to the centre (or its sets go round in a circle): the centre
      // moves on.
      const double before = report.residual;
      const double now = keep_if_better(problem, lambda, report);
      idle = now < 0.9 * before ? 0 : idle + 1;
      if (!std::isfinite(now)) lambda = best_;
      if (!another_set && std::isfinite(now) && !rest_has_limits(problem) && rest_is_redundant(problem)) {
        // Further moves would only drive the redundant rows' impulses apart.
        best_ = lambda;
        report.residual = now;
        is_redundant = true;
        break;
      }
      if (report.residual <= 1e-13 || idle > (report.residual <= tolerance ? 1 : most_idle)) break;
      centre_ = lambda;
      sets_about_centre = 0;
    }
    solve_set(problem, lambda);
  }
  report.pivots += sets;
  return is_redundant;
}

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
    unclamped_[i] = (row.right + pull_ * gamma_[i] * centre_[i] - velocity(row)) / pulled(problem, i);
    if (pair_[i] == Pair::first) continue;
    if (pair_[i] == Pair::second) {
      const Vector2 target(unclamped_[i - 1], unclamped_[i]);
      const Vector2 total = onto_disc(target, high_[i]);
      set_[i] = set_[i - 1] = set_of_pair(i - 1, target, high_[i], pulled(problem, i));
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
      const double softness = pulled(problem, i);
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
    const bool rubs = row.normal >= 0;
    high_[i] = rubs ? limit(row, lambda[row.normal]) : row.high;
    low_[i] = rubs ? -high_[i] : row.low;
  }
  velocities(problem, lambda);
  for (int k = 0; k < most_steps_of_minimise; ++k) {
    const int changed = clamp_unlimited(problem, lambda);
    if (k > 0 && changed == 0 && turned_ <= settled_turn) return;
    factor(problem, Friction::fixed);
    ++report.pivots;
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

bool MlcpSolver::solve_about_centre(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report) {
  for (int k = 0; k < most_sets_about_centre; ++k) {
    velocities(problem, lambda);
    pull_to_centre(problem, lambda);
    const bool settled = classify(problem, lambda) == 0 && turned_ <= settled_turn && k > 0;
    if (!settled) {
      factor(problem, Friction::follows);
      ++report.pivots;
      report.row_solves += static_cast<std::int64_t>(problem.rows.size());
    }
    solve_set(problem, lambda);
    if (settled) return true;
  }
  return false;
}

void MlcpSolver::solve_carefully(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report) {
  pull_ = first_pull;
  int idle = 0;
  for (int round = 0; round < most_careful_rounds; ++round) {
    centre_ = lambda;
    bool settled = solve_about_centre(problem, lambda, report);
    if (!settled) {
      lambda = centre_;
      minimise(problem, lambda, report);
      minimum_ = lambda;
      settled = solve_about_centre(problem, lambda, report);
      if (!settled) lambda = minimum_;
    }
    const double before = report.residual;
    const double now = keep_if_better(problem, lambda, report);
    if (!std::isfinite(now)) break;
    const bool better = now < 0.9 * before;
    idle = better ? 0 : idle + 1;
    if (now <= 1e-13 || (report.residual <= tolerance && idle > 1)) break;
    const bool easy = settled || better;
    pull_ = easy ? std::max(least_pull, after_success * pull_) : std::min(first_pull, after_failure * pull_);
  }
}

MlcpReport MlcpSolver::solve(const Mlcp& problem, std::vector<double>& lambda) {
  MlcpReport report;
  lambda.assign(problem.rows.size(), 0.0);
  prepare(problem);
  if (problem.rows.empty()) return report;
  const bool limited = std::ranges::any_of(problem.rows, has_limits);
  analyse(problem);
  best_ = lambda;
  report.residual = residual(problem, lambda);
  const auto is_solved = [&] { return report.residual <= tolerance; };
  bool is_redundant = solve_quickly(problem, limited ? Start::perhaps_free : Start::impulses, lambda, report);
  if (limited && !is_redundant && !is_solved()) {
    lambda.assign(problem.rows.size(), 0.0);
    velocities(problem, lambda);
    sweep(problem, lambda, first_sweeps);
    report.row_solves += static_cast<std::int64_t>(problem.rows.size()) * first_sweeps;
    keep_if_better(problem, lambda, report);
    swept_ = lambda;
    if (!is_solved()) is_redundant = solve_quickly(problem, Start::impulses, lambda, report);
    lambda = swept_;
    if (!is_redundant && !is_solved()) solve_carefully(problem, lambda, report);
  }
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
