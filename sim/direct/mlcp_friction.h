#pragma once
/// A pair's disc of friction, for the solver of mlcp.h.

#include <algorithm>

#include "sim/direct/mlcp.h"

namespace substep {

/// Directions of friction that turn by less than this are taken as settled: what is left is of second order,
/// and goes with the next move of the centre. To weight the turn by the impulse that it moves leaves more
/// steps of the card house unsolved.
constexpr double settled_turn = 1e-6;

/// Residual at which problems with limits end before another set is factored.
constexpr double accurate = 1e-12;

/// Residual at which problems with limits end as soon as a set is no better.
constexpr double nearly_accurate = 1e-11;

/// What a friction row's impulse can be at most, with `value` as its normal's.
inline double limit(const Mlcp::Row& row, double value) {
  return row.friction * std::max(value, 0.0);
}

/// The point of a disc about the origin that is nearest to `point`.
inline Vector2 onto_disc(const Vector2& point, double radius) {
  const double length = point.norm();
  return length > radius ? Vector2(point * (radius / length)) : point;
}

inline Vector2 across(const Vector2& along) {
  return {-along.y(), along.x()};
}

}  // namespace substep
