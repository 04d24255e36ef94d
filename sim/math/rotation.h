#pragma once
/// Rotations: R_q of the report (II.5.1), and what stepping orientations and gyroscopic terms need of it.
///
/// Sine and cosine are our own, since libm's differ in the last bit between versions and machines, and a pose
/// log must not.

#include "sim/math/vector.h"

namespace substep {

struct SineCosine {
  double sine;
  double cosine;
};

/// Within 1 unit in the last place of the exact value for |angle| <= 1e5; beyond, the argument's reduction
/// loses digits as the angle grows. Not finite for what is not finite.
SineCosine sine_cosine(double angle);

/// The angle in [−π, π] of a point (cosine, sine) of the unit circle; 0 for (0, 0).
double angle_of(double sine, double cosine);

/// R_q(a): the unit quaternion of the rotation vector `a` (rad).
Quaternion rotation_quaternion(const Vector3& a);

/// The rotation vector of a unit quaternion, of length at most π.
Vector3 rotation_vector(const Quaternion& q);

/// p ∘ q, scaled back to unit length: a product of unit quaternions leaves it by a rounding each time.
inline Quaternion compose(const Quaternion& p, const Quaternion& q) {
  Quaternion product = p * q;
  product.coeffs() *= 1 / std::sqrt(product.squaredNorm());
  return product;
}

/// Returns the change of a body's local angular velocity (rad/s) over `duration` such that the body stepped
/// with the changed velocity w has the angular momentum it had: R(duration · w) I w = I ω̆, `inertia` being
/// I's principal moments. Takes energy, and so holds light bodies that joints turn fast. By Newton's method
/// to rounding.
Vector3 implicit_gyroscopic_change(const Vector3& local_angular_velocity, const Vector3& inertia,
                                   double duration);

/// Returns the mean angular velocity (body frame, rad/s) of a free body over `duration`, from its velocity at
/// the start: the body turns by R_q(duration · mean), exactly. `inertia`: its principal moments. Euler's
/// equations are solved by power series, to rounding for turns of up to 1000 rad.
Vector3 mean_of_free_rotation(const Vector3& local_angular_velocity, const Vector3& inertia, double duration);

/// Returns the angular velocity (body frame, rad/s) of a body that has turned by the rotation vector `turn`
/// (rad) with the angular momentum `momentum` (in the frame before the turn), which stays.
Vector3 velocity_after_turn(const Vector3& momentum, const Vector3& inertia, const Vector3& turn);

}  // namespace substep
