#pragma once
/// Finds how far two convex solids are apart, by the distance algorithm of Gilbert, Johnson and Keerthi
/// (1988), and when two moving shapes first meet, by conservative advancement (Mirtich 1996).

#include <optional>
#include <span>

#include "sim/geometry/contact.h"
#include "sim/geometry/round_shapes.h"

namespace substep {

/// A convex solid in the world, given by its support function: a core and all points within `radius` of it.
/// Planes and meshes are not convex solids; a triangle is one.
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
  std::optional<RevolvedSolid> revolved_;   ///< of a ball or capsule the axis, of other round shapes all
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

/// Returns the normal along which a and b are farthest apart, to `tolerance` m; gap ≤ 0 if their cores meet.
Separation separation(const ConvexSolid& a, const ConvexSolid& b, double tolerance);

/// A body that moves with a constant spin, and with a velocity that changes in sub-steps: after the time s it
/// has moved by s v + ½ s (s + substep) a.
struct RigidMotion {
  Vector3 position = Vector3::Zero();  ///< of the centre of mass at the start, world, m
  Quaternion orientation = Quaternion::Identity();
  Vector3 velocity = Vector3::Zero();      ///< v, m/s
  Vector3 acceleration = Vector3::Zero();  ///< a, m/s²
  double substep = 0;                      ///< s
  Vector3 spin = Vector3::Zero();          ///< world, rad/s

  /// Returns the displacement of the centre of mass after `time`.
  Vector3 displacement(double time) const {
    return time * velocity + 0.5 * time * (time + substep) * acceleration;
  }
  /// Returns the body's pose after `time`.
  Pose at(double time) const;
  /// Returns the velocity at the start of a point of the body.
  Vector3 velocity_at(const Vector3& point) const { return velocity + spin.cross(point - position); }
};

/// A shape that is fixed in a moving body.
struct MovingShape {
  const Shape* shape;
  Pose placement;  ///< shape's frame → body frame
  double reach;    ///< of the farthest point from the body's centre of mass, m; 0 for planes
  RigidMotion motion;
};

/// The first meeting of two shapes.
struct Impact {
  double time;     ///< s
  Vector3 normal;  ///< unit, from b to a: the direction along which they were apart
};

/// Returns the first time in [0, duration] at which a and b are no farther apart than `tolerance` metres;
/// nothing where they stay apart. Two planes or meshes never meet; a one-sided mesh meets nothing that starts
/// behind it. `held`: contacts with a mesh b, whose triangles of their directions or their least distance are
/// left out.
std::optional<Impact> time_of_impact(const MovingShape& a, const MovingShape& b, double duration,
                                     double tolerance, std::span<const ContactPoint> held = {});

/// Returns the box around a shape that moves for `duration`; for a plane the box at its start.
Bounds swept_bounds(const MovingShape& a, double duration);

}  // namespace substep
