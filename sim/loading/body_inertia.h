#pragma once
/// Where a body's principal axes lie, for bodies that get them from their shapes.

#include "sim/geometry/mass_properties.h"

namespace substep {

/// Of what a file gives neither mass nor density: that of water, kg/m³.
inline constexpr double default_density = 1000;

/// As principal_inertia, but moments that differ by rounding alone are made equal, as those of a symmetric
/// body, which has no gyroscopic term; and products of inertia of that size are made 0, which leaves the axes
/// where the shape has them.
PrincipalInertia symmetric_principal_inertia(Matrix3 inertia);

}  // namespace substep
