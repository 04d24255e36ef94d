#pragma once
/// Computes how stiff the impulses of taut joints make bodies in the transverse direction.

#include <vector>

#include "sim/constraints/formulate.h"

namespace substep {

/// Returns the largest frequency of a body's turning in the geometric stiffness of its joints, rad/s, or
/// `least` where none is larger, with the forces λ/duration of rows that were formulated one by one in the
/// bodies' frames. `stiffness` is room for K by body, in the bodies' frames. A joint that pulls
/// with F on a point at the arm r from the centre of mass gives K = (r·F) 1 − (r Fᵀ + F rᵀ)/2, for the torque
/// r × F changes by −K θ as the body turns by θ. Only joints that lock a point count. No mode of the jointed
/// bodies is faster: the stiffness is a sum over bodies, and what joints lock takes freedom from it.
double transverse_frequency(const Problem& problem, double duration, double least,
                            std::vector<Matrix3>& stiffness);

}  // namespace substep
