#pragma once
/// What the search for contacts takes as touching, kept, hard; and the materials of a pair.

#include <algorithm>

#include "sim/scene/scene.h"

namespace substep {

/// Of the smaller shape: a point that has moved by less on both bodies, and slips by less in a step, is the
/// same. A fast rolling body's is not: what it rolls over in a step would count as displacement, by up to a
/// sixth of its angle squared.
inline constexpr double same_place = 0.02;

/// Of the smaller shape: what is no farther apart touches.
inline constexpr double touching = 2e-4;

/// Of the smaller shape, and of what gravity moves it by in a step: what touched before and is no farther
/// apart goes on touching, for a pile that settles trembles by so much.
inline constexpr double touched_before = 0.05;
inline constexpr double falls_of_touched = 4;

/// Of the smaller shape, what an impact must take of a body's way in the step to be given at once, bouncing
/// or not.
inline constexpr double hard = 0.01;

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

/// What the two materials make of a coefficient each.
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
