// From centre to centre: the proximal point method where active sets about one centre cycle.

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/direct/mlcp_friction.h"

namespace substep {
namespace {

constexpr double first_proximal = 0.1;
/// Least ε. Points that are 1e-9 m out of their plane need it: what closes them grows by residual/ε a move.
constexpr double least_proximal = 1e-9;
/// Least ε while every set moves the centre and the residual falls.
constexpr double least_of_transient = 1e-7;
/// Sets that each move the centre. Of 142 problems of the wrecking ball they solve 111, in 37 sets at the
/// median.
constexpr int most_transient = 60;
/// Sets in all. A pile of 250 boxes that meet takes at most 800.
constexpr int most_sets = 2000;
constexpr double least_fall = 0.1;  ///< of ε from set to set
constexpr double most_rise = 4;
/// A residual below `small` that changes by a ratio between these stands still: only a smaller ε helps.
constexpr double stands = 0.9;
constexpr double rises = 1.02;
constexpr double small = 1e-5;
/// A residual above both so much of the best and of the first one has left the way to the solution.
constexpr double lost_of_best = 30;
constexpr double lost_of_first = 3;
/// Part of the residual that may be left of the problem about a centre when it moves.
constexpr double settled = 0.3;
constexpr int most_sets_about_centre = 6;
constexpr int few_sets_about_centre = 3;
constexpr double after_few = 0.5;
constexpr double after_failure = 8;

/// When to end: where the residual is rounding, or below the tolerance and no longer falls.
class Progress {
 public:
  bool ends(double residual, const MlcpReport& report) {
    idle_ = residual < stands * least_ ? 0 : idle_ + 1;
    least_ = std::min(least_, residual);
    return residual <= accurate || (report.residual <= nearly_accurate && residual > report.residual) ||
           (report.residual <= MlcpSolver::tolerance && idle_ > 1);
  }

 private:
  double least_ = std::numeric_limits<double>::infinity();
  int idle_ = 0;
};

}  // namespace

void MlcpSolver::take_set(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report) {
  velocities(problem, lambda);
  add_proximal_term(problem, lambda);
  classify(problem, lambda);
  factor(problem);
  ++report.active_sets;
  report.row_solves += static_cast<std::int64_t>(problem.rows.size());
  solve_set(problem, lambda);
}

bool MlcpSolver::solve_transient(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report) {
  const double first = report.residual;
  double before = first;
  double of_best = first_proximal;  // ε
  proximal_ = first_proximal;
  Progress progress;
  for (int set = 0; set < most_transient; ++set) {
    centre_ = lambda;
    take_set(problem, lambda, report);
    const double now = keep_if_better(problem, lambda, report);
    if (progress.ends(now, report)) return false;
    if (now <= report.residual) of_best = proximal_;
    if (now > lost_of_best * report.residual && now > lost_of_first * first) {
      lambda = best_;
      before = report.residual;
      of_best = std::min(most_rise * of_best, 1.0);
      proximal_ = of_best;
      continue;
    }
    const double ratio = now / before;
    before = now;
    if (ratio > stands && ratio < rises && now < small) {
      if (keep_if_redundant(problem, lambda, now, report)) return true;
      proximal_ = std::max(least_proximal, least_fall * proximal_);
    } else {
      const double least = std::min(proximal_, least_of_transient);
      proximal_ = std::clamp(std::clamp(ratio, least_fall, most_rise) * proximal_, least, 1.0);
    }
  }
  return false;
}

bool MlcpSolver::solve_by_centres(const Mlcp& problem, std::vector<double>& lambda, MlcpReport& report) {
  proximal_ = first_proximal;
  Progress progress;
  for (int sets = 0; sets < most_sets;) {
    centre_ = lambda;
    double whole = std::numeric_limits<double>::infinity();
    double left = whole;  // of the problem about the centre
    int about_centre = 0;
    while (about_centre < most_sets_about_centre && !(left < settled * whole)) {
      take_set(problem, lambda, report);
      ++about_centre;
      whole = keep_if_better(problem, lambda, report);
      add_proximal_term(problem, lambda);
      left = natural_residual(problem, lambda);
    }
    sets += about_centre;
    if (progress.ends(whole, report)) return false;
    if (!(left < settled * whole)) {
      lambda = centre_;  // keeps what impulses that close a contact have grown to
      proximal_ = std::min(after_failure * proximal_, 1.0);
      continue;
    }
    residual(problem, lambda);
    if (keep_if_redundant(problem, lambda, whole, report)) return true;
    if (about_centre <= few_sets_about_centre) proximal_ = std::max(after_few * proximal_, least_proximal);
  }
  return false;
}

}  // namespace substep
