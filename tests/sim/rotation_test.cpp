#include "sim/math/rotation.h"

#include <gtest/gtest.h>

#include <cmath>

namespace substep {
namespace {

TEST(SineCosine, EqualsLibraryToTheLastDigit) {
  double largest = 0;
  for (int i = -20000; i <= 20000; ++i) {
    const double angle = i * 0.00731 + i * i * 1e-7;
    const auto [sine, cosine] = sine_cosine(angle);
    largest = std::max({largest, std::abs(sine - std::sin(angle)), std::abs(cosine - std::cos(angle))});
  }
  EXPECT_LT(largest, 2.3e-16);  // measured 1.1e-16: half a unit in the last place below 1
}

TEST(SineCosine, ReducesLargeArguments) {
  for (const double angle : {1e3, 12345.678, 99999.9, -1e5}) {
    const auto [sine, cosine] = sine_cosine(angle);
    EXPECT_NEAR(sine, std::sin(angle), 2.3e-16) << angle;
    EXPECT_NEAR(cosine, std::cos(angle), 2.3e-16) << angle;
  }
  EXPECT_TRUE(std::isnan(sine_cosine(INFINITY).sine));
}

TEST(RotationQuaternion, IsExponentialOfHalfVector) {
  for (const double angle : {0.0, 1e-9, 0.1, 0.9999, 1.0001, 3.0, 7.0, 200.0}) {
    const Vector3 axis = Vector3(1, -2, 3).normalized();
    const Quaternion q = rotation_quaternion(angle * axis);
    EXPECT_NEAR(q.norm(), 1, 4e-16) << angle;
    const Quaternion expected(Eigen::AngleAxisd(angle, axis));
    EXPECT_LT((q.coeffs() - expected.coeffs()).norm(), angle > 100 ? 1e-14 : 5e-16) << angle;
  }
}

TEST(RotationVector, UndoesTheQuaternion) {
  for (const double angle : {1e-12, 1e-3, 0.5, 1.5, 3.0, 3.14159}) {
    const Vector3 vector = angle * Vector3(-2, 0.5, 1).normalized();
    EXPECT_LT((rotation_vector(rotation_quaternion(vector)) - vector).norm(), 1e-15 + 4e-16 * angle) << angle;
  }
  EXPECT_EQ(rotation_vector(Quaternion::Identity()), Vector3::Zero());
}

// V.1 and V.2: the composition of two rotations is the rotation of the sum, to first order.
TEST(SmallRotations, AddWithAnErrorOfSecondOrder) {
  const Vector3 u = Vector3(1, 2, -1).normalized();
  const Vector3 v = Vector3(-2, 1, 3).normalized();
  double last = 0;
  for (int k = 1; k <= 5; ++k) {
    const double angle = std::ldexp(1.0, -k - 2);
    const Quaternion product = rotation_quaternion(angle * u) * rotation_quaternion(angle * v);
    const Quaternion sum = rotation_quaternion(angle * (u + v));
    const double error = rotation_vector(product.conjugate() * sum).norm();
    if (k > 1) {
      EXPECT_NEAR(std::log2(last / error), 2, 0.02) << angle;  // measured 1.995 and nearer
    }
    last = error;
  }
}

TEST(GyroscopicChange, KeepsMomentum) {
  const Vector3 inertia(0.043333, 0.033333, 0.016667);
  for (const double duration : {1e-4, 1.0 / 240, 1.0 / 60, 1.0 / 20}) {
    const Vector3 before(0.5, 5, -3);
    const Vector3 after = before + gyroscopic_change(before, inertia, duration);
    const Vector3 momentum = rotation_quaternion(duration * after) * inertia.cwiseProduct(after);
    const double relative = (momentum - inertia.cwiseProduct(before)).norm() / momentum.norm();
    EXPECT_LT(relative, 1e-15) << duration;  // measured 4e-16
  }
}

TEST(GyroscopicChange, IsZeroForEqualMoments) {
  EXPECT_LT(gyroscopic_change({1, 2, 3}, Vector3::Constant(0.4), 0.01).norm(), 1e-15);
}

TEST(GyroscopicChange, TurnsTopAboutItsAxis) {
  // Free, it precesses in its own frame about the axis of the third moment at (I3 / I1 − 1) w3, and the spin
  // about that axis stays. Whichever axis it is.
  constexpr double duration = 1e-5;
  for (int axis = 0; axis < 3; ++axis) {
    const int next = (axis + 1) % 3;
    const int last = (axis + 2) % 3;
    Vector3 inertia = Vector3::Constant(0.5);
    inertia[axis] = 0.8;
    Vector3 velocity;
    velocity[axis] = 3;
    velocity[next] = 2;
    velocity[last] = 0;
    const Vector3 change = gyroscopic_change(velocity, inertia, duration);
    const double precession = (0.8 / 0.5 - 1) * 3;
    EXPECT_NEAR(change[last] / duration, precession * 2, 1e-3) << axis;
    EXPECT_NEAR(change[axis] / duration, 0, 1e-3) << axis;
    EXPECT_NEAR(change[next] / duration, 0, 1e-3) << axis;
  }
}

}  // namespace
}  // namespace substep
