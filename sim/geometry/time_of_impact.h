#pragma once
/// Finds when two moving shapes first meet, by conservative advancement (Mirtich 1996) along the directions
/// in which they are apart.

#include <optional>

#include "sim/geometry/contact.h"
#include "sim/geometry/shape.h"

namespace substep {

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
/// behind it.
std::optional<Impact> time_of_impact(const MovingShape& a, const MovingShape& b, double duration,
                                     double tolerance);

/// Returns the box around a shape that moves for `duration`; for a plane the box at its start.
Bounds swept_bounds(const MovingShape& a, double duration);

}  // namespace substep
