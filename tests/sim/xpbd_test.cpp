// A3 with 'stable' joints at τ = κ = 1 equals small-step position-based dynamics without compliance
// (small_step_xpbd.cpp).

#include <gtest/gtest.h>

#include <string>

#include "sim/error.h"
#include "sim/measure/claims_measurement.h"
#include "tests/scene_files.h"

namespace substep {
namespace {

Settings a3(int n, int m, double step) {
  Settings settings = default_settings(Algorithm::a3);
  settings.step = step;
  settings.substeps = n;
  settings.iterations = m;
  settings.tau = 1;
  settings.kappa = 1;
  settings.joints = Joints::stable;
  return settings;
}

TEST(SmallStepXpbd, IterationsEqualThoseOfA3) {
  // Measured: 3.1e-12 and 1.0e-12 m, rounding that the motion amplifies. Claim 16 has one iteration.
  EXPECT_LT(claims::distance_from_xpbd(scene_named("rod_chain"), a3(3, 2, 1.0 / 97), 2), 1e-11);
  EXPECT_LT(claims::distance_from_xpbd(scene_named("heavy_chain"), a3(5, 3, 1.0 / 60), 2), 1e-11);
}

TEST(SmallStepXpbd, RefusesScenesOutOfPlane) {
  EXPECT_THROW(claims::distance_from_xpbd(scene_named("bricard"), a3(1, 1, 1.0 / 60), 1), Error);
}

}  // namespace
}  // namespace substep
