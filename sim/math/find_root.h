#pragma once
/// Roots of functions of one variable, for the contacts of round shapes.

namespace substep {

/// Returns a root on [0, 1] of a continuous function that is positive at 0 and negative at 1.
template <class Function>
double find_root(Function function) {
  double low = 0;
  double high = 1;
  double at_low = function(low);
  double at_high = function(high);
  if (!(at_low > 0)) return 0;
  if (!(at_high < 0)) return 1;
  // The Illinois variant of false position.
  int side = 0;
  for (int i = 0; i < 60 && high - low > 1e-15; ++i) {
    double middle = (low * at_high - high * at_low) / (at_high - at_low);
    if (!(middle > low && middle < high)) middle = (low + high) / 2;
    const double value = function(middle);
    if (value == 0) return middle;
    if (value > 0) {
      low = middle;
      at_low = value;
      if (side == 1) at_high /= 2;
      side = 1;
    } else {
      high = middle;
      at_high = value;
      if (side == -1) at_low /= 2;
      side = -1;
    }
    if (middle == low && middle == high) break;
  }
  return (low + high) / 2;
}

}  // namespace substep
