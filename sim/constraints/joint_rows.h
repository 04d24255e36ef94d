#pragma once
/// s2 of one block: the rows of joints, limits and drives.

#include "sim/constraints/formulate.h"

namespace substep {

/// Coordinates of a block's two bodies, with rotations as matrices too.
struct Placed {
  const Coordinates& a;
  const Coordinates& b;
  const Matrix3& rotation_a;
  const Matrix3& rotation_b;
};

/// Computes J, β and M⁻¹Jᵀ of the block's rows.
void formulate_block(Problem& problem, Block& x, const Placed& at, double hs);

}  // namespace substep
