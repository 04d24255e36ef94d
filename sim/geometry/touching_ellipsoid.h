#pragma once
/// What a round shape is near a point in which it touches another: so much of it as rolling needs.

#include <optional>

#include "sim/geometry/shape.h"

namespace substep {

/// An ellipsoid in a shape's frame: its centre, and the squares of its half axes about the frame's axes.
/// Where one of them is 0 it is an ellipse.
struct TouchingEllipsoid {
  Vector3 centre;
  Vector3 squares;
};

/// Whether a shape has neither faces nor edges.
bool is_round(const Shape& shape);

/// Whether touching_ellipsoid() may have an answer.
bool is_curved(const Shape& shape);

/// The ellipsoid that `shape` is in a point of its surface, where it touches `other`; nothing where it is
/// flat, or has an edge or a corner there. `normal` points to the shape. Of a cylinder or a cone, and between
/// a capsule's ends, it is the circle about Y through the point: the solid may touch along a line, on which
/// only the turn about Y moves the point. All in the shape's frame.
std::optional<TouchingEllipsoid> touching_ellipsoid(const Shape& shape, const Shape& other,
                                                    const Vector3& point, const Vector3& normal);

}  // namespace substep
