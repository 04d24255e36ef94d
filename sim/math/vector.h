#pragma once
/// The scalar, vector and quaternion types of the library.
///
/// Units are SI throughout: metres, kilograms, seconds, radians. Frames are right-handed, +Y is up.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>

namespace substep {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;

/// Unit quaternion of a rotation. Not aligned, so that its layout is the same whatever vector width the
/// including program is compiled for.
using Quaternion = Eigen::Quaternion<double, Eigen::DontAlign>;

/// Returns a unit vector across `direction`, which need not have unit length, from the axis that is farthest
/// from it.
inline Vector3 perpendicular(const Vector3& direction) {
  Eigen::Index least = 0;
  direction.cwiseAbs().minCoeff(&least);
  return direction.cross(Vector3::Unit(least)).normalized();
}

/// A rigid placement: point_outer = orientation * point_inner + position.
struct Pose {
  Vector3 position = Vector3::Zero();
  Quaternion orientation = Quaternion::Identity();

  Vector3 operator*(const Vector3& point) const { return orientation * point + position; }
  Pose operator*(const Pose& inner) const {
    return {orientation * inner.position + position, orientation * inner.orientation};
  }
  Pose inverse() const {
    const Quaternion back = orientation.conjugate();
    return {-(back * position), back};
  }
};

}  // namespace substep
