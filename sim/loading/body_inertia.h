#pragma once
/// Principal axes of bodies that get them from their shapes.

#include "sim/geometry/mass_properties.h"

namespace substep {

/// Density of bodies without mass and density, that of water, kg/m³.
inline constexpr double default_density = 1000;

/// Returns principal_inertia() without rounding: equal moments where they differ by rounding alone, so that
/// symmetric bodies have no gyroscopic term, and products of inertia of that size as 0, so that axes stay
/// those of the shape.
PrincipalInertia symmetric_principal_inertia(Matrix3 inertia);

}  // namespace substep
