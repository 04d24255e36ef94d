// One scalar equality row under τ and κ: u' = (1−κ)u + τβ, β' = β − u'. Stable if and only if both
// eigenvalues are within the unit circle, which is where 0 < κ < 2 and 0 < τ < 4 − 2κ.

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "sim/measure/stability_map.h"

namespace substep {
namespace {

/// Returns true where the recurrence of (u, β) contracts.
bool contracts(double tau, double kappa) {
  Eigen::Matrix2d step;
  step << 1 - kappa, tau,  //
      -(1 - kappa), 1 - tau;
  return step.eigenvalues().cwiseAbs().maxCoeff() < 1;
}

TEST(Stabilization, HasTheBorderOfTheClosedForm) {
  for (double kappa = 0.05; kappa < 2; kappa += 0.05) {
    EXPECT_TRUE(contracts(0.999 * stability_border(kappa), kappa)) << kappa;
    EXPECT_FALSE(contracts(1.001 * stability_border(kappa), kappa)) << kappa;
  }
}

}  // namespace
}  // namespace substep
