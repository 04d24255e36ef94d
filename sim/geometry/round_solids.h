#pragma once
/// Cylinders, cones and tapered capsules from their measures, along +Y about the origin.

#include "sim/geometry/shape.h"

namespace substep {

/// A cylinder between y = ±height/2; a cone frustum where the radii differ, a cone where one is 0. Throws
/// Error unless the height is positive and finite and the radii are finite, not negative and not both 0.
Cylinder make_cylinder(double height, double radius_bottom, double radius_top);

/// The hull of balls around (0, ∓height/2, 0). Throws Error unless the measures are finite and not negative
/// and a radius is positive.
TaperedCapsule make_tapered_capsule(double height, double radius_bottom, double radius_top);

}  // namespace substep
