#pragma once
/// What the kernels of a sweep share (contact_solve.cpp).

#include "sim/constraints/lanes.h"

namespace substep {

/// What a kernel works on: a batch, its rows, and how they are solved.
struct Visit {
  const ContactBatch& x;
  const ContactDirections* directions;
  NormalRow* normals;
  FrictionRows* frictions;
  const RestitutionRow* restitutions;  ///< null: none bounces
  const Coupling* coupling;
  const RowSolve& how;
};

/// What is known of a visit where its kernel is compiled.
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
