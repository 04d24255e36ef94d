#pragma once
/// All round shapes as one type, for contacts: the convex hull of two balls or of two discs on one axis.

#include <array>
#include <optional>

#include "sim/geometry/shape.h"

namespace substep {

/// A sphere, capsule, tapered capsule, cylinder or cone, placed in some frame. Its ends are 0, at the foot of
/// `axis`, and 1.
struct RevolvedSolid {
  RevolvedSolid(const Sphere& sphere, const Pose& pose);
  RevolvedSolid(const Capsule& capsule, const Pose& pose);
  RevolvedSolid(const TaperedCapsule& capsule, const Pose& pose);
  RevolvedSolid(const Cylinder& cylinder, const Pose& pose);

  Vector3 middle;
  Vector3 axis;    ///< unit
  Vector3 across;  ///< unit, across the axis, fixed in the shape
  double half;     ///< from the middle to an end
  std::array<double, 2> radius;
  bool is_ball_ended;
  /// The straight side's outward normals are cosine u + sine axis, with u all around. A solid with a ball
  /// that holds the other has no side.
  double sine = 0;
  double cosine = 1;
  bool has_side = true;

  /// Returns the radius of a ball about the middle that holds the solid.
  double reach() const;
  Vector3 end(int i) const { return i == 0 ? Vector3(middle - half * axis) : Vector3(middle + half * axis); }
  /// Returns the component of the direction perpendicular to the axis.
  Vector3 outward(const Vector3& direction) const { return direction - axis.dot(direction) * axis; }
  /// Returns the farthest point of an end along a unit direction.
  Vector3 support(const Vector3& direction, int i) const;
  /// Returns the farthest point of the solid along a unit direction.
  Vector3 support(const Vector3& direction) const;
  /// Returns the solid's extent along a unit direction.
  double height(const Vector3& direction) const;
  /// Returns the unit direction from the closest point of the solid to a point outside it or, for a point
  /// inside, the shortest way out through the side or an end's ball. Returns nothing for a point inside that
  /// is nearest to a disc.
  std::optional<Vector3> direction_to(const Vector3& point) const;

 private:
  RevolvedSolid(const Pose& pose, double half_length, double radius_bottom, double radius_top, bool balls);
};

}  // namespace substep
