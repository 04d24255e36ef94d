#pragma once
/// Round shapes: construction, one common type for contacts, and curvature for rolling.

#include <array>
#include <optional>

#include "sim/geometry/shape.h"

namespace substep {

/// Returns a cylinder between y = ±height/2; a cone frustum where the radii differ, a cone where one is 0.
/// Throws Error unless the height is positive and finite and the radii are finite, not negative and not both
/// 0.
Cylinder make_cylinder(double height, double radius_bottom, double radius_top);

/// Returns the hull of balls around (0, ∓height/2, 0). Throws Error unless the measures are finite and not
/// negative and a radius is positive.
TaperedCapsule make_tapered_capsule(double height, double radius_bottom, double radius_top);

/// The convex hull of two balls or of two discs on one axis: a sphere, capsule, tapered capsule, cylinder or
/// cone, placed in some frame. Its ends are 0, at the foot of `axis`, and 1.
struct RevolvedSolid {
  RevolvedSolid(const Pose& pose, double half_length, double radius_bottom, double radius_top,
                bool has_ball_ends);

  Vector3 middle;
  Vector3 axis;    ///< unit
  Vector3 across;  ///< unit, across the axis, fixed in the shape
  double half;     ///< from the middle to an end
  std::array<double, 2> radius;
  bool is_ball_ended;
  /// The straight side's outward normals are cosine u + sine axis, for every unit vector u across the axis. A
  /// solid with a ball that contains the other has no side.
  double sine = 0;
  double cosine = 1;
  bool has_side = true;

  /// Returns false where a measure is not finite or negative, or the solid has no volume.
  bool is_valid() const;
  /// Returns the radius of a ball about the middle that contains the solid.
  double reach() const;
  Vector3 end(int i) const { return i == 0 ? Vector3(middle - half * axis) : Vector3(middle + half * axis); }
  /// Returns the component of the direction perpendicular to the axis.
  Vector3 outward(const Vector3& direction) const { return direction - axis.dot(direction) * axis; }
  /// Returns the farthest point of an end along a unit direction.
  Vector3 support(const Vector3& direction, int i) const;
  /// Returns the farthest point of the solid along a unit direction.
  Vector3 support(const Vector3& direction) const;
  /// Returns the largest component of the solid's points along a unit direction.
  double height(const Vector3& direction) const;
  /// Returns the unit direction from the closest point of the solid to a point outside it or, for a point
  /// inside, out through the side or an end's ball. Returns nothing at the centre of an end's ball, and where
  /// the foot of a point inside on the side's line lies beyond the side.
  std::optional<Vector3> direction_to(const Vector3& point) const;
};

/// Returns the revolved solid of a round shape; nothing for others.
std::optional<RevolvedSolid> as_revolved(const Shape& shape, const Pose& pose);

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
/// moves the point. All vectors are in the shape's frame.
std::optional<TouchingEllipsoid> touching_ellipsoid(const Shape& shape, const Shape& other,
                                                    const Vector3& point, const Vector3& normal);

}  // namespace substep
