#pragma once
/// The stability of one constraint row over τ and κ: the closed form, and runs of A3, A4 and A5.
///
/// One scalar equality row, with u = Jv and β for its state: u' = (1 − κ) u + τ β, β' = β − u'. Both
/// eigenvalues are within the unit circle if and only if 0 < κ < 2 and 0 < τ < 4 − 2κ.

#include <vector>

#include "sim/model/settings.h"

namespace substep {

struct StabilityPoint {
  Algorithm algorithm;
  double tau;
  double kappa;
  bool stable;  ///< a row that was off by 1 mm came closer
};

/// Returns τ on the border, above which a row is unstable.
constexpr double stability_border(double kappa) {
  return 4 - 2 * kappa;
}

/// A3, A4 and A5 on a grid over 0 < κ < 2, 0 < τ < 4 that stays 0.1 off the border: for each point one weight
/// without gravity, whose rows are the scalar row.
std::vector<StabilityPoint> measure_stability_map();

/// Counts the points on the wrong side of the closed form.
struct StabilityMatch {
  int points = 0;
  int wrong = 0;
};
StabilityMatch match_closed_form(const std::vector<StabilityPoint>& points);

}  // namespace substep
