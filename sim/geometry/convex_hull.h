#pragma once
/// Convex polytopes from points (qhull) and from the primitive solids.

#include <span>
#include <string>

#include "sim/geometry/shape.h"

namespace substep {

/// Returns the convex hull of `points`. Coplanar facets are merged into one polygon, vertices are exactly the
/// given ones, and the result depends on the order of the points alone. Throws Error that begins with `what`
/// ("crate.gltf: /meshes/2") when a coordinate is not finite or the hull is thinner than 1e-6 of its size.
Polytope convex_hull(std::span<const Vector3> points, const std::string& what);

/// Returns a box with full extents `size`, centred at the origin.
Polytope box(const Vector3& size);

/// Returns a cylinder along +Y between y = ±height/2 with a bottom and a top radius, as a prism of `sides`
/// sides, at least 3, whose vertices lie on the circles. A radius of 0 makes a cone.
Polytope cylinder(double height, double radius_bottom, double radius_top, int sides = 32);

/// Returns an ellipsoid about the origin, with the hull of points on it: `rings` from pole to pole along Y,
/// twice as many round it. `rings` is even, so that the half axes' ends are among the points.
Polytope ellipsoid(const Vector3& half_axes, int rings = 12);

/// Returns the polytope scaled along its own axes; factors must be positive.
Polytope scaled(const Polytope& polytope, const Vector3& factors);

}  // namespace substep
