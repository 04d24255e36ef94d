#pragma once
/// The curvature of a round shape at a point where it touches another, as rolling needs it.

#include <optional>

#include "sim/geometry/shape.h"

namespace substep {

/// An ellipsoid in a shape's frame: its centre, and the squares of its half axes about the frame's axes.
/// Where one of them is 0 it is an ellipse.
struct TouchingEllipsoid {
  Vector3 centre;
  Vector3 squares;
};

/// Returns true where a shape has neither faces nor edges.
bool is_round(const Shape& shape);

/// Returns true where touching_ellipsoid() may return one.
bool is_curved(const Shape& shape);

/// Returns the ellipsoid that `shape` equals around the point where it touches `other`; nothing where it is
/// flat or has an edge or a corner there. `normal` points to the shape. For a cylinder, a cone and the side
/// of a capsule it is the circle about Y through the point, since on a line of contact only rotation about Y
/// moves the point. All is in the shape's frame.
std::optional<TouchingEllipsoid> touching_ellipsoid(const Shape& shape, const Shape& other,
                                                    const Vector3& point, const Vector3& normal);

}  // namespace substep
