#pragma once
/// Computes expectations of scenes in closed form. No function calls libm beyond sqrt, so that every machine
/// writes the same bytes.

#include <vector>

namespace substep::scenes {

/// Returns the period in s of a physical pendulum that is released at rest, `amplitude` rad from the
/// vertical. `moment` about the axis in kg·m², `lever` from the axis to the centre of mass in m, `mass` in
/// kg, `gravity` across the axis in m/s².
double pendulum_period(double moment, double mass, double gravity, double lever, double amplitude);

/// Returns a block's positions on a table, m from its start, at the ends of its slips before `duration`, s.
/// The table is at `throw_length` cos(`rate` t), m and rad/s. Friction accelerates a block by ≤ μ `gravity`.
std::vector<double> slips_on_shaken_table(double throw_length, double rate, double friction, double gravity,
                                          double duration);

}  // namespace substep::scenes
