#pragma once
/// Thresholds of the search for contacts, and the materials of a pair.

#include <algorithm>

#include "sim/scene/scene.h"

namespace substep {

/// Motion of a point on both bodies, and slip in a step, below which it is the same point, relative to the
/// smaller shape. A fast rolling body's is not: what it rolls over in a step would count as displacement, by
/// up to a sixth of its angle squared.
inline constexpr double same_place = 0.02;

/// Gap at which shapes touch, relative to the smaller.
inline constexpr double touching = 2e-4;

/// Gaps at which shapes that touched before still touch, relative to the smaller shape, and to the fall in a
/// step: a pile that settles trembles by so much.
inline constexpr double touched_before = 0.05;
inline constexpr double falls_of_touched = 4;

/// Way that an impact must take from a body in the step to be given at once, bouncing or not, relative to the
/// smaller shape.
inline constexpr double hard = 0.01;

/// Extra distance at which points are found so that a patch can be kept, relative to the smaller shape.
inline constexpr double spare_margin = 2e-3;

/// Part of its way in the step that an impact must take from a body to turn it aside, relative to the smaller
/// shape.
inline constexpr double aside = 0.25;

/// Combines a coefficient of two materials.
inline double combine(Combine how, double a, double b) {
  switch (how) {
    case Combine::average:
    case Combine::unstated:
      return 0.5 * (a + b);
    case Combine::minimum:
      return std::min(a, b);
    case Combine::maximum:
      return std::max(a, b);
    case Combine::multiply:
      break;
  }
  return a * b;
}

/// Coefficients of a pair, combined from two materials.
struct PairMaterial {
  PairMaterial(const ContactMaterial& one, const ContactMaterial& other)
      : dynamic_friction(combine(std::min(one.friction_combine, other.friction_combine), one.dynamic_friction,
                                 other.dynamic_friction)),
        static_friction(combine(std::min(one.friction_combine, other.friction_combine), one.static_friction,
                                other.static_friction)),
        restitution(combine(std::min(one.restitution_combine, other.restitution_combine), one.restitution,
                            other.restitution)) {}
  double dynamic_friction;
  double static_friction;
  double restitution;
};

}  // namespace substep
