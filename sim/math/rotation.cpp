#include "sim/math/rotation.h"

#include <cmath>

namespace substep {
namespace {

// π/2 in three parts: the first two have 33 significant bits, so that their products with a quadrant number
// below 2^20 are exact.
constexpr double half_pi_high = 0x1.921fb544p+0;
constexpr double half_pi_middle = 0x1.0b4611a6p-34;
constexpr double half_pi_low = 0x1.3198a2e037073p-69;
constexpr double two_over_pi = 0x1.45f306dc9c883p-1;

// Taylor polynomials on [−π/4, π/4]; the first term left out is below 1e-19.
double sine_polynomial(double x) {
  const double s = x * x;
  double p = 1.0 / 355687428096000.0;
  p = p * s - 1.0 / 1307674368000.0;
  p = p * s + 1.0 / 6227020800.0;
  p = p * s - 1.0 / 39916800.0;
  p = p * s + 1.0 / 362880.0;
  p = p * s - 1.0 / 5040.0;
  p = p * s + 1.0 / 120.0;
  p = p * s - 1.0 / 6.0;
  return x + x * s * p;
}

double cosine_polynomial(double x) {
  const double s = x * x;
  double p = 1.0 / 20922789888000.0;
  p = p * s - 1.0 / 87178291200.0;
  p = p * s + 1.0 / 479001600.0;
  p = p * s - 1.0 / 3628800.0;
  p = p * s + 1.0 / 40320.0;
  p = p * s - 1.0 / 720.0;
  p = p * s + 1.0 / 24.0;
  p = p * s - 0.5;
  return 1 + s * p;
}

// sin(√s)/√s and cos(√s) for 0 <= s <= 0.25.
double sinc_of_square(double s) {
  double p = -1.0 / 1307674368000.0;
  p = p * s + 1.0 / 6227020800.0;
  p = p * s - 1.0 / 39916800.0;
  p = p * s + 1.0 / 362880.0;
  p = p * s - 1.0 / 5040.0;
  p = p * s + 1.0 / 120.0;
  p = p * s - 1.0 / 6.0;
  return p * s + 1;
}

double cosine_of_square(double s) {
  double p = -1.0 / 87178291200.0;
  p = p * s + 1.0 / 479001600.0;
  p = p * s - 1.0 / 3628800.0;
  p = p * s + 1.0 / 40320.0;
  p = p * s - 1.0 / 720.0;
  p = p * s + 1.0 / 24.0;
  p = p * s - 0.5;
  return p * s + 1;
}

}  // namespace

SineCosine sine_cosine(double angle) {
  const double quadrant = std::floor(angle * two_over_pi + 0.5);
  const double x = ((angle - quadrant * half_pi_high) - quadrant * half_pi_middle) - quadrant * half_pi_low;
  const double sine = sine_polynomial(x);
  const double cosine = cosine_polynomial(x);
  const double turn = quadrant - 4 * std::floor(quadrant / 4);  // 0, 1, 2 or 3
  if (turn == 1) return {cosine, -sine};
  if (turn == 2) return {-sine, -cosine};
  if (turn == 3) return {-cosine, sine};
  return {sine, cosine};
}

Quaternion rotation_quaternion(const Vector3& a) {
  const double half_squared = 0.25 * a.squaredNorm();
  if (half_squared <= 0.25) {
    const Vector3 vector = a * (0.5 * sinc_of_square(half_squared));
    return {cosine_of_square(half_squared), vector.x(), vector.y(), vector.z()};
  }
  const double half = std::sqrt(half_squared);
  const auto [sine, cosine] = sine_cosine(half);
  const Vector3 vector = a * (0.5 * (sine / half));
  return {cosine, vector.x(), vector.y(), vector.z()};
}

double angle_of(double sine, double cosine) {
  // By Newton's method on sine and cosine from an estimate: atan2 of libm would differ between machines.
  const double length = std::sqrt(sine * sine + cosine * cosine);
  if (length == 0) return 0;
  const double s = std::abs(sine) / length;
  const double c = std::abs(cosine) / length;
  double angle = s <= c ? s / (c + 0.28 * s * s / c) : half_pi_high - c / (s + 0.28 * c * c / s);
  for (int i = 0; i < 3; ++i) {
    const auto [s_now, c_now] = sine_cosine(angle);
    angle += s * c_now - c * s_now;  // sin(exact − angle): leaves the cube of the error
  }
  if (cosine < 0) angle = 2 * half_pi_high - angle + (2 * half_pi_middle + 2 * half_pi_low);
  return sine < 0 ? -angle : angle;
}

Vector3 rotation_vector(const Quaternion& q) {
  const double sign = q.w() < 0 ? -1 : 1;
  const double sine = q.vec().norm();
  if (sine == 0) return Vector3::Zero();
  return q.vec() * (sign * 2 * angle_of(sine, sign * q.w()) / sine);
}

Vector3 gyroscopic_change(const Vector3& local_angular_velocity, const Vector3& inertia, double duration) {
  const Vector3 momentum = inertia.cwiseProduct(local_angular_velocity);
  Vector3 w = local_angular_velocity;
  // About a principal axis, or at rest, there is nothing to change.
  if (momentum.cross(w) == Vector3::Zero()) return Vector3::Zero();
  // Newton on f(w) = I w − R(−h w) I ω̆, whose last term turns the old momentum into the stepped body's frame.
  // Four steps reach rounding for turns of up to half a radian a step; more turn takes a few more.
  for (int i = 0; i < 12; ++i) {
    const Vector3 turned = rotation_quaternion(-duration * w) * momentum;
    const Vector3 f = inertia.cwiseProduct(w) - turned;
    // d(R(−h w) L) = −h [R(−h w) L]× … to first order in h w: enough for quadratic-like convergence, since f
    // is exact.
    Matrix3 derivative = inertia.asDiagonal();
    derivative(0, 1) += duration * turned.z();
    derivative(0, 2) -= duration * turned.y();
    derivative(1, 0) -= duration * turned.z();
    derivative(1, 2) += duration * turned.x();
    derivative(2, 0) += duration * turned.y();
    derivative(2, 1) -= duration * turned.x();
    const Vector3 correction = derivative.inverse() * f;
    w -= correction;
    if (correction.squaredNorm() <= 1e-32 * w.squaredNorm()) break;
  }
  return w - local_angular_velocity;
}

}  // namespace substep
