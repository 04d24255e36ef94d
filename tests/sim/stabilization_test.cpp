// One scalar equality row under τ and κ: u' = (1−κ)u + τβ, β' = β − u'. Stable if and only if both
// eigenvalues are within the unit circle, which is where 0 < κ < 2 and 0 < τ < 4 − 2κ.

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "sim/measure/stability_map.h"

namespace substep {
namespace {

/// Whether the recurrence of (u, β) contracts.
bool contracts(double tau, double kappa) {
  Eigen::Matrix2d step;
  step << 1 - kappa, tau,  //
      -(1 - kappa), 1 - tau;
  return step.eigenvalues().cwiseAbs().maxCoeff() < 1;
}

TEST(Stabilization, IsStableWhereTheEigenvaluesSay) {
  const std::vector<StabilityPoint> points = measure_stability_map();
  int stable = 0;
  for (const StabilityPoint& point : points) {
    EXPECT_EQ(point.stable, contracts(point.tau, point.kappa))
        << name(point.algorithm) << " τ " << point.tau << " κ " << point.kappa;
    stable += point.stable;
  }
  EXPECT_EQ(points.size(), 600U);  // A3, A4 and A5 on 10 × 20 points, 0.1 to 1.9 and 0.1 to 3.9
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(points[i].kappa, 0.1 + 0.2 * static_cast<double>(i / 20 % 10), 1e-12);
    EXPECT_NEAR(points[i].tau, 0.1 + 0.2 * static_cast<double>(i % 20), 1e-12);
  }
  EXPECT_GT(stable, 200);
  EXPECT_LT(stable, 400);
}

TEST(Stabilization, HasTheBorderOfTheClosedForm) {
  for (double kappa = 0.05; kappa < 2; kappa += 0.05) {
    EXPECT_TRUE(contracts(0.999 * stability_border(kappa), kappa)) << kappa;
    EXPECT_FALSE(contracts(1.001 * stability_border(kappa), kappa)) << kappa;
  }
}

}  // namespace
}  // namespace substep
