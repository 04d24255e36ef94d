#include "sim/math/rotation.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace substep {
namespace {

// π/2 in three parts: the first two have 33 significant bits, so that their products with a quadrant number
// below 2^20 are exact.
constexpr double half_pi_high = 0x1.921fb544p+0;
constexpr double half_pi_middle = 0x1.0b4611a6p-34;
constexpr double half_pi_low = 0x1.3198a2e037073p-69;
constexpr double two_over_pi = 0x1.45f306dc9c883p-1;

/// Taylor coefficients in x² of (sin x / x − 1) / x² and (cos x − 1) / x², the highest first. On [−π/4, π/4]
/// the first term left out is below 1e-19 in the sine and 2.1e-18 in the cosine; for x² ≤ 1/4 the functions
/// skip the first coefficient.
constexpr std::array sine_terms = {
    1.0 / 355687428096000.0, -1.0 / 1307674368000.0, 1.0 / 6227020800.0, -1.0 / 39916800.0,
    1.0 / 362880.0,          -1.0 / 5040.0,          1.0 / 120.0,        -1.0 / 6.0};
constexpr std::array cosine_terms = {
    1.0 / 20922789888000.0, -1.0 / 87178291200.0, 1.0 / 479001600.0, -1.0 / 3628800.0,
    1.0 / 40320.0,          -1.0 / 720.0,         1.0 / 24.0,        -0.5};

/// Coefficients of (arcsin x / x − 1) / x² in x², the highest first.
constexpr std::array arcsine_terms = {6435.0 / 557056.0, 143.0 / 10240.0, 231.0 / 13312.0, 63.0 / 2816.0,
                                      35.0 / 1152.0,     5.0 / 112.0,     3.0 / 40.0,      1.0 / 6.0};

/// Returns the value of a polynomial at s by Horner's rule, from the coefficient at index `First` on.
template <std::size_t First = 0, std::size_t Count>
double polynomial(const std::array<double, Count>& coefficients, double s) {
  double value = coefficients[First];
  for (std::size_t i = First + 1; i < Count; ++i) value = value * s + coefficients[i];
  return value;
}

/// A rotation as a quaternion.
struct FreeTurn {
  double cosine;   ///< of half the angle
  Vector3 vector;  ///< the axis times the sine of half the angle
};

/// Returns the rotation of a free body in a short `duration`: sums Euler's equations and q' = q ω/2 as series
/// in powers of time, until the terms vanish. `shape`: (I₂ − I₃)/I₁ and its cyclic permutations.
FreeTurn free_turn(const Vector3& velocity, const Vector3& shape, double duration) {
  constexpr int most_terms = 24;
  constexpr double least_term = 1e-18;
  std::array<Vector3, most_terms> w;  // of the angular velocity, times the duration
  std::array<FreeTurn, most_terms> q;
  w[0] = duration * velocity;
  q[0] = {1, Vector3::Zero()};
  FreeTurn sum = q[0];
  for (int k = 0; k + 1 < most_terms; ++k) {
    Vector3 products = Vector3::Zero();
    FreeTurn next{0, Vector3::Zero()};
    for (int i = 0; i <= k; ++i) {
      const Vector3& other = w[k - i];
      products += Vector3(w[i].y() * other.z(), w[i].z() * other.x(), w[i].x() * other.y());
      next.cosine -= q[i].vector.dot(other);
      next.vector += q[i].cosine * other + q[i].vector.cross(other);
    }
    w[k + 1] = shape.cwiseProduct(products) / (k + 1);
    q[k + 1] = {next.cosine * (0.5 / (k + 1)), next.vector * (0.5 / (k + 1))};
    sum.cosine += q[k + 1].cosine;
    sum.vector += q[k + 1].vector;
    // Stop only where both vanish: about a principal axis every other term has no vector, or no cosine.
    if (std::max(std::abs(q[k + 1].cosine), q[k + 1].vector.cwiseAbs().maxCoeff()) < least_term) break;
  }
  return sum;
}

/// Returns the rotation vector of a turn of at most 1/4 rad, by the series of the arcsine.
Vector3 small_rotation_vector(const FreeTurn& turn) {
  const double s = turn.vector.squaredNorm();
  return 2 * (1 + s * polynomial(arcsine_terms, s)) * turn.vector;
}

}  // namespace

SineCosine sine_cosine(double angle) {
  const double quadrant = std::floor(angle * two_over_pi + 0.5);
  const double x = ((angle - quadrant * half_pi_high) - quadrant * half_pi_middle) - quadrant * half_pi_low;
  const double s = x * x;
  const double sine = x + x * s * polynomial(sine_terms, s);
  const double cosine = 1 + s * polynomial(cosine_terms, s);
  const double turn = quadrant - 4 * std::floor(quadrant / 4);  // 0, 1, 2 or 3
  if (turn == 1) return {cosine, -sine};
  if (turn == 2) return {-sine, -cosine};
  if (turn == 3) return {-cosine, sine};
  return {sine, cosine};
}

Quaternion rotation_quaternion(const Vector3& a) {
  const double half_squared = 0.25 * a.squaredNorm();
  if (half_squared <= 0.25) {
    const double sinc = polynomial<1>(sine_terms, half_squared) * half_squared + 1;
    const Vector3 vector = a * (0.5 * sinc);
    return {polynomial<1>(cosine_terms, half_squared) * half_squared + 1, vector.x(), vector.y(), vector.z()};
  }
  const double half = std::sqrt(half_squared);
  const auto [sine, cosine] = sine_cosine(half);
  const Vector3 vector = a * (0.5 * (sine / half));
  return {cosine, vector.x(), vector.y(), vector.z()};
}

double angle_of(double sine, double cosine) {
  // Improve an estimate by Newton's method on sine and cosine: libm's atan2 differs between machines.
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

Quaternion shortest_rotation(const Vector3& from, const Vector3& to) {
  const Vector3 a = from.normalized();
  const Vector3 b = to.normalized();
  const double cosine = b.dot(a);
  constexpr double opposite = -1 + 1e-12;
  Quaternion q;
  if (cosine < opposite) {
    const Vector3 aside = std::abs(a.z()) < 0.5 ? Vector3::UnitZ() : Vector3::UnitX();
    q.w() = 0;
    q.vec() = (aside - a.dot(aside) * a).normalized();
    return q;
  }
  const double s = std::sqrt((1 + cosine) * 2);
  q.w() = s * 0.5;
  q.vec() = a.cross(b) * (1 / s);
  return q;
}

Vector3 implicit_gyroscopic_change(const Vector3& local_angular_velocity, const Vector3& inertia,
                                   double duration) {
  const Vector3 momentum = inertia.cwiseProduct(local_angular_velocity);
  Vector3 w = local_angular_velocity;
  // Return at once at rest and about a principal axis, where the velocity stays.
  if (momentum.cross(w) == Vector3::Zero()) return Vector3::Zero();
  // Solve f(w) = I w − R(−h w) I ω̆ = 0 by Newton's method; the last term is the old momentum in the stepped
  // body's frame. Four steps reach rounding for turns of up to half a radian; larger turns take a few more.
  for (int i = 0; i < 12; ++i) {
    const Vector3 turned = rotation_quaternion(-duration * w) * momentum;
    const Vector3 f = inertia.cwiseProduct(w) - turned;
    // Approximate ∂f/∂w by I − h [R(−h w) L]×, to first order in h w. The root is exact, since f is.
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

Vector3 mean_of_free_rotation(const Vector3& local_angular_velocity, const Vector3& inertia,
                              double duration) {
  const Vector3 momentum = inertia.cwiseProduct(local_angular_velocity);
  // Return at once at rest and about a principal axis, where the velocity stays.
  if (momentum.cross(local_angular_velocity) == Vector3::Zero()) return local_angular_velocity;
  constexpr double longest_turn = 0.25;  // rad, of a series
  constexpr double most_parts = 4096;
  const Vector3 shape =
      Vector3(inertia.y() - inertia.z(), inertia.z() - inertia.x(), inertia.x() - inertia.y())
          .cwiseQuotient(inertia);
  const double parts =
      std::clamp(std::ceil(duration * local_angular_velocity.norm() / longest_turn), 1.0, most_parts);
  Vector3 sum = Vector3::Zero();
  Quaternion whole = Quaternion::Identity();
  for (int i = 0; i < parts; ++i) {
    const Vector3 velocity = (whole.conjugate() * momentum).cwiseQuotient(inertia);
    const FreeTurn part = free_turn(velocity, shape, duration / parts);
    sum += small_rotation_vector(part);
    if (parts > 1) whole = compose(whole, {part.cosine, part.vector.x(), part.vector.y(), part.vector.z()});
  }
  if (parts == 1) return sum / duration;
  // Choose the rotation vector with as many full turns as the body made.
  const Vector3 shortest = rotation_vector(whole);
  const double angle = shortest.norm();
  if (angle == 0) return sum / duration;
  constexpr double full_turn = 4 * half_pi_high;
  const double turns = std::floor((sum.dot(shortest) / angle - angle) / full_turn + 0.5);
  return shortest * ((angle + turns * full_turn) / (angle * duration));
}

Vector3 velocity_after_turn(const Vector3& momentum, const Vector3& inertia, const Vector3& turn) {
  return (rotation_quaternion(-turn) * momentum).cwiseQuotient(inertia);
}

}  // namespace substep
