// Iterates over active sets and centres: selects the rows at limits, and solves for the others.

#include <algorithm>
#include <cmath>

#include "sim/direct/mlcp.h"

namespace substep {
namespace {

/// The usual ε. Each move of the centre multiplies the multipliers' error by ε/σ, with σ the smallest
/// eigenvalue of Γ, scaled to a unit diagonal, that is not zero; rounding adds about 1e-16/ε². Measured on
/// ten 1 kg rods with 1000 kg at their end: residual 1e-13 in at most 30 rounds; with 1e-8 rounding leaves
/// 1e-4.
constexpr double usual_proximal = 1e-6;
constexpr int most_usual_sets = 60;  // a wall of 225 boxes takes at most 40
/// The centre moves once the residual of the problem about it is below this fraction of the whole problem's,
/// even where rows still change sets.
constexpr double solved_about_centre = 0.1;
/// After this many sets a residual above `promising` times the first one shows that the sets cycle.
constexpr int sets_of_guess = 3;
constexpr double promising = 0.1;
constexpr int most_rounds = 400;
constexpr int most_idle_moves = 12;  // moves of the centre that leave the residual as it is
constexpr int most_sets_about_centre = 12;

/// Softness across the slip, over Γ_xx, where the limit is almost 0: practically infinite.
constexpr double most_across = 1e9;

/// Directions of friction that turn by less count as settled: the rest is of second order, and vanishes with
/// the next move of the centre. Turns weighted by the impulse leave more steps of the card house unsolved.
constexpr double settled_turn = 1e-6;

constexpr double first_proximal = 0.1;
/// Least ε. Points that are 1e-9 m out of their plane need it: impulses that close them grow by residual/ε
/// per move.
constexpr double least_proximal = 1e-9;
/// Least ε while every set moves the centre and the residual falls.
constexpr double least_of_transient = 1e-7;
/// Most sets that each move the centre. Of 142 problems of the wrecking ball they solve 111, in 37 sets at
/// the median.
constexpr int most_transient = 60;
/// Sets in all. A pile of 250 boxes that meet takes at most 800.
constexpr int most_sets = 2000;
/// Smallest and largest factor by which ε changes from set to set.
constexpr double strongest_fall = 0.1;
constexpr double strongest_rise = 4;
/// Ratios of successive residuals between which a residual below `small_residual` no longer falls: only a
/// smaller ε helps.
constexpr double standstill_ratio = 0.9;
constexpr double rise_ratio = 1.02;
constexpr double small_residual = 1e-5;
/// Multiples of the best and of the first residual: sets above both diverge, and start again from the best.
constexpr double lost_of_best = 30;
constexpr double lost_of_first = 3;
/// Fraction of the residual that the problem about a centre may have left when the centre moves.
constexpr double settled_fraction = 0.3;
constexpr int most_sets_in_move = 6;
constexpr int few_sets_in_move = 3;
/// Factors of ε after a move of few sets, and after one that did not settle.
constexpr double factor_after_few = 0.5;
constexpr double factor_after_failure = 8;

/// Ends the moves where the residual is rounding, or below the tolerance and no longer falls.
class Progress {
 public:
  bool ends(double residual, const MlcpReport& report) {
    idle_ = residual < standstill_ratio * least_ ? 0 : idle_ + 1;
    least_ = std::min(least_, residual);
    return residual <= MlcpSolver::accurate ||
           (report.residual <= MlcpSolver::nearly_accurate && residual > report.residual) ||
           (report.residual <= MlcpSolver::tolerance && idle_ > 1);
  }

 private:
  double least_ = infinity;
  int idle_ = 0;
};

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

int MlcpSolver::classify() {
  int changed = 0;
  turned_ = 0;
  for (std::size_t i = 0; i < rows().size(); ++i) {
    const Row& row = rows()[i];
    const Set before = set_[i];
    const double target = lambda_[i] - w_[i] / (gamma_[i] + row.softness);  // not used without Γ_xx
    if (!(gamma_[i] > 0)) {
      set_[i] = Set::inactive;
    } else if (pair_[i] == Pair::second) {
      set_[i] = set_[i - 1];
    } else if (row.normal >= 0) {
      // The new set of the normal is known, as it comes before its friction.
      const double high = limit(row, lambda_[row.normal]);
      if (set_[row.normal] != Set::free) {
        set_[i] = Set::inactive;
      } else if (pair_[i] == Pair::first) {
        set_[i] = set_of_pair(i, target_of_pair(i), high, gamma_[i] + row.softness);
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

void MlcpSolver::fix_limits() {
  for (std::size_t i = 0; i < rows().size(); ++i) {
    const Row& row = rows()[i];
    if (set_[i] == Set::inactive) lambda_[i] = 0;
    if (row.normal < 0) {
      if (set_[i] == Set::low) lambda_[i] = row.low;
      if (set_[i] == Set::high) lambda_[i] = row.high;
      continue;
    }
    const double most = row.friction * lambda_[row.normal];
    if (set_[i] == Set::low) lambda_[i] = -most;
    if (set_[i] == Set::high) lambda_[i] = most;
    if (set_[i] == Set::slides && pair_[i] == Pair::first) {
      const Vector2& along = slip_[i].along;
      const double aside = across(along).dot(Vector2(lambda_[i], lambda_[i + 1]));
      const Vector2 total = most * along + aside * across(along);
      lambda_[i] = total.x();
      lambda_[i + 1] = total.y();
    }
  }
}

void MlcpSolver::solve_set() {
  fix_limits();
  velocities();
  add_proximal_term();
  solve_free();
  fix_limits();
}

bool MlcpSolver::solve_active_sets(Start start) {
  const auto row_count = static_cast<std::int64_t>(rows().size());
  proximal_ = usual_proximal;
  centre_ = lambda_;
  const double at_start = report_.residual;
  double at_centre = report_.residual;
  int sets = 0;
  int sets_about_centre = 0;
  int idle = 0;
  bool is_redundant = false;
  for (int round = 0; round < most_rounds && sets < most_usual_sets; ++round) {
    const double before = report_.residual;
    const double whole = keep_if_better();
    const bool is_accurate = whole <= accurate || (report_.residual <= nearly_accurate && whole > before);
    add_proximal_term();
    const bool is_about_centre =
        is_limited_ && sets_about_centre > 0 && natural_residual() < solved_about_centre * whole;
    bool another_set = true;
    if (round == 0 && start != Start::impulses) {
      for (std::size_t i = 0; i < rows().size(); ++i) set_[i] = gamma_[i] > 0 ? Set::free : Set::inactive;
    } else {
      const int changed = classify();
      another_set = round == 0 || (!is_about_centre && (changed > 0 || turned_ > settled_turn));
      // End where many rows reach their limits at once: this first set is a bad guess then.
      if (start == Start::perhaps_free && sets == 1 && 8 * changed > row_count) break;
      if (is_limited_ && sets >= sets_of_guess && report_.residual > promising * at_start) break;
    }
    if (another_set && is_limited_ && is_accurate) break;
    if (another_set) {
      factor();
      ++sets;
      ++sets_about_centre;
      report_.row_solves += row_count;
    }
    if (!another_set || sets_about_centre > most_sets_about_centre) {
      // Move the centre: λ solves the problem with the proximal term, or its sets cycle.
      const double now = keep_if_better();
      idle = report_.residual < 0.9 * at_centre ? 0 : idle + 1;
      at_centre = report_.residual;
      if (!std::isfinite(now)) lambda_ = best_;
      if (!another_set && keep_if_redundant(now)) {
        is_redundant = true;
        break;
      }
      if (report_.residual <= 1e-13 || idle > (report_.residual <= tolerance ? 1 : most_idle_moves)) break;
      centre_ = lambda_;
      sets_about_centre = 0;
    }
    solve_set();
  }
  report_.active_sets += sets;
  return is_redundant;
}

void MlcpSolver::take_set() {
  velocities();
  add_proximal_term();
  classify();
  factor();
  ++report_.active_sets;
  report_.row_solves += static_cast<std::int64_t>(rows().size());
  solve_set();
}

bool MlcpSolver::solve_transient() {
  const double first = report_.residual;
  double before = first;
  double of_best = first_proximal;  // ε with which the best λ was found
  proximal_ = first_proximal;
  Progress progress;
  for (int set = 0; set < most_transient; ++set) {
    centre_ = lambda_;
    take_set();
    const double now = keep_if_better();
    if (progress.ends(now, report_)) return false;
    if (now <= report_.residual) of_best = proximal_;
    if (now > lost_of_best * report_.residual && now > lost_of_first * first) {
      lambda_ = best_;
      before = report_.residual;
      of_best = std::min(strongest_rise * of_best, 1.0);
      proximal_ = of_best;
      continue;
    }
    const double ratio = now / before;
    before = now;
    if (ratio > standstill_ratio && ratio < rise_ratio && now < small_residual) {
      if (keep_if_redundant(now)) return true;
      proximal_ = std::max(least_proximal, strongest_fall * proximal_);
    } else {
      const double least = std::min(proximal_, least_of_transient);
      proximal_ = std::clamp(std::clamp(ratio, strongest_fall, strongest_rise) * proximal_, least, 1.0);
    }
  }
  return false;
}

bool MlcpSolver::solve_by_centres() {
  proximal_ = first_proximal;
  Progress progress;
  for (int sets = 0; sets < most_sets;) {
    centre_ = lambda_;
    double whole = infinity;
    double left = whole;  // residual of the problem about the centre
    int about_centre = 0;
    while (about_centre < most_sets_in_move && !(left < settled_fraction * whole)) {
      take_set();
      ++about_centre;
      whole = keep_if_better();
      add_proximal_term();
      left = natural_residual();
    }
    sets += about_centre;
    if (progress.ends(whole, report_)) return false;
    if (!(left < settled_fraction * whole)) {
      lambda_ = centre_;  // keeps impulses that have grown to close a contact
      proximal_ = std::min(factor_after_failure * proximal_, 1.0);
      continue;
    }
    residual();
    if (keep_if_redundant(whole)) return true;
    if (about_centre <= few_sets_in_move) proximal_ = std::max(factor_after_few * proximal_, least_proximal);
  }
  return false;
}

}  // namespace substep
