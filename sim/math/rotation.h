#pragma once
/// Rotations: R_q of the report (II.5.1), its inverse, and the gyroscopic term of free and jointed bodies.
///
/// Sine and cosine are our own: libm's differ in the last bit between versions and machines, but pose logs
/// must have the same bits everywhere.

#include "sim/math/vector.h"

namespace substep {

struct SineCosine {
  double sine;
  double cosine;
};

/// Returns sine and cosine, exact to 1 unit in the last place for |angle| <= 1e5 rad. For larger angles the
/// reduction to one quadrant loses digits. Returns no finite numbers for an angle that is not finite.
SineCosine sine_cosine(double angle);

/// Returns the angle in [−π, π], rad, of the vector (cosine, sine), which has any length; 0 for (0, 0).
double angle_of(double sine, double cosine);

/// Returns R_q(a), the unit quaternion of the rotation vector `a` (rad).
Quaternion rotation_quaternion(const Vector3& a);

/// Returns the rotation vector (rad) of a unit quaternion, of length at most π.
Vector3 rotation_vector(const Quaternion& q);

/// Returns the rotation by the smallest angle that turns one direction to another, of any lengths but 0. For
/// opposite directions the axis is any normal to them. Eigen's setFromTwoVectors takes seconds to compile.
Quaternion shortest_rotation(const Vector3& from, const Vector3& to);

/// Returns p ∘ q, scaled to unit length, since rounding changes the length in each product.
inline Quaternion compose(const Quaternion& p, const Quaternion& q) {
  Quaternion product = p * q;
  product.coeffs() *= 1 / std::sqrt(product.squaredNorm());
  return product;
}

/// Returns the change of a body's local angular velocity (rad/s) over `duration` such that the body stepped
/// with the changed velocity w keeps its angular momentum: R(duration · w) I w = I ω̆. `inertia`: the
/// principal moments, I. The change takes energy, so that light bodies that joints turn fast do not diverge.
/// Iterates Newton's method to rounding.
Vector3 implicit_gyroscopic_change(const Vector3& local_angular_velocity, const Vector3& inertia,
                                   double duration);

/// Returns the mean angular velocity (body frame, rad/s) of a free body over `duration`, from its velocity at
/// the start: the body turns exactly by R_q(duration · mean). `inertia`: its principal moments. Euler's
/// equations are solved by power series, to rounding for turns of up to 1000 rad.
Vector3 mean_of_free_rotation(const Vector3& local_angular_velocity, const Vector3& inertia, double duration);

/// Returns the angular velocity (body frame, rad/s) of a body after it has turned by the rotation vector
/// `turn` (rad) with constant angular momentum `momentum` (body frame before the turn, kg m²/s).
Vector3 velocity_after_turn(const Vector3& momentum, const Vector3& inertia, const Vector3& turn);

}  // namespace substep
