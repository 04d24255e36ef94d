#pragma once
/// How far two convex solids are apart: the distance algorithm of Gilbert, Johnson and Keerthi (1988).

#include <optional>

#include "sim/geometry/revolved_solid.h"
#include "sim/geometry/shape.h"

namespace substep {

/// A convex solid in the world, given by its farthest points along directions: a core and all points within
/// `radius` of it. Planes and meshes are not convex solids; a triangle is one.
class ConvexSolid {
 public:
  /// `shape` must not be a plane or a mesh; it and the solid live equally long.
  ConvexSolid(const Shape& shape, const Pose& pose);
  /// A triangle with these corners, in the frame of `pose`.
  ConvexSolid(const Vector3& a, const Vector3& b, const Vector3& c, const Pose& pose);

  /// Returns the core's point farthest along a direction, which need not have unit length.
  Vector3 support(const Vector3& direction) const;
  /// Returns a point of the core.
  Vector3 middle() const { return middle_; }
  double radius() const { return radius_; }

 private:
  const Polytope* polytope_ = nullptr;
  std::optional<RevolvedSolid> revolved_;   ///< a ball or capsule shrunk to its axis, or whole
  Matrix3 rotation_ = Matrix3::Identity();  ///< of a polytope
  Vector3 position_ = Vector3::Zero();
  Matrix3 corners_ = Matrix3::Zero();  ///< of a triangle, columns, world
  Vector3 middle_ = Vector3::Zero();
  double radius_ = 0;
};

/// A direction along which two solids are apart.
struct Separation {
  Vector3 normal;  ///< unit, from b to a
  double gap;  ///< m: between the two solids' extents along the normal, so at most their distance; ≤ 0: none
};

/// Returns the normal along which a and b are farthest apart, to `tolerance` metres; a gap of 0 where their
/// cores meet.
Separation separation(const ConvexSolid& a, const ConvexSolid& b, double tolerance);

}  // namespace substep
