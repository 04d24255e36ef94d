#pragma once
/// Types that the kernels of a sweep share (contact_solve.cpp).

#include "sim/constraints/lanes.h"

namespace substep {

/// A kernel's data: a batch, its rows, and the factors of its solution.
struct Visit {
  const ContactBatch& x;
  const ContactDirections* directions;
  NormalRow* normals;
  FrictionRows* frictions;
  const RestitutionRow* restitutions;  ///< null: none bounces
  const Coupling* coupling;
  const RowSolve& how;
};

/// Properties of a visit that are known where its kernel is compiled.
struct Kind {
  bool by_one;  ///< κ, τ and ω are 1, and multiply nothing
  bool any;     ///< the largest change may be asked for
};
inline constexpr Kind plain{true, false};
inline constexpr Kind any_kind{false, true};

template <Kind kind>
[[gnu::always_inline]] inline Lanes times(double factor, const Lanes& x) {
  if constexpr (kind.by_one) return x;
  return all(factor) * x;
}

}  // namespace substep
