#pragma once
/// s2 of one block: the rows of joints, limits and drives.

#include "sim/constraints/formulate.h"

namespace substep {

/// What a block's rows are formulated from: its two bodies' coordinates, with rotations as matrices.
struct Placed {
  const Coordinates& a;
  const Coordinates& b;
  const Matrix3& rotation_a;
  const Matrix3& rotation_b;
};

/// J, β and M⁻¹Jᵀ of the block's rows.
void formulate_block(Problem& problem, Block& x, const Placed& at, double hs);

}  // namespace substep
