// A1, A2 and A3 are of first order on every joint scene, once steps are small enough for their iterations.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "sim/loading/load_scene.h"
#include "sim/measure/metrics.h"
#include "tests/folders.h"

namespace substep {
namespace {

struct Case {
  const char* scene;
  double duration;  ///< s
  int iterations;   ///< of A2 and A3
  int divisions;    ///< of the scene's step into h of A1 and A2 or into h/n of A3, and twice as many
};

void PrintTo(const Case& x, std::ostream* out) {
  *out << x.scene;
}

class Order : public testing::TestWithParam<Case> {};

TEST_P(Order, IsOneInA1ToA3) {
  const Case& x = GetParam();
  Scene scene = load_scene(std::string(test::source_folder) + "/scenes/" + x.scene + ".gltf");
  scene.duration = x.duration;
  const ReferenceMotion reference = reference_motion(scene, x.duration);
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a2, Algorithm::a3}) {
    const auto error_at = [&](int divisions) {
      Settings settings;
      settings.algorithm = algorithm;
      settings.step = algorithm == Algorithm::a3 ? scene.step : scene.step / divisions;
      settings.substeps = divisions;
      settings.iterations = x.iterations;
      const MotionDifference error = measure(scene, settings, reference, false).error;
      EXPECT_GT(error.position.rms + error.orientation.rms, 100 * reference.uncertainty);
      return error.position.rms > 0 ? error.position.rms : error.orientation.rms;
    };
    const double order = std::log2(error_at(x.divisions) / error_at(2 * x.divisions));
    RecordProperty(std::string(name(algorithm)), std::to_string(order));
    EXPECT_NEAR(order, 1, 0.05) << name(algorithm);  // measured 0.987 to 1.027
  }
}

// A heavy chain's end pulls a thousand times the weight of a link: it takes 64
// iterations until the step is all that is left.
INSTANTIATE_TEST_SUITE_P(JointScenes, Order,
                         testing::Values(Case{"pendulum", 1, 1, 64}, Case{"rod_chain", 1, 1, 128},
                                         Case{"heavy_chain", 0.25, 64, 512}, Case{"heavy_top", 1, 1, 64},
                                         Case{"joint_kinds", 0.25, 16, 64}, Case{"squeezer", 0.5, 4, 128}));

}  // namespace
}  // namespace substep
