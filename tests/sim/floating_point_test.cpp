// Runs have equal bits in every floating-point mode of the caller, and restore the caller's mode.

#include <fenv.h>
#include <gtest/gtest.h>

#include <cfenv>
#include <string>

#include "sim/log/pose_log.h"
#include "sim/simulation.h"
#include "tests/reproducibility/entry.h"
#include "tests/scene_files.h"

namespace substep {
namespace {

/// Returns the log of 40 steps of a scene.
std::string log_of(const std::string& name, Algorithm algorithm) {
  const Scene scene = scene_named(name);
  Settings settings = default_settings(algorithm);
  settings.step = scene.step;
  Simulation simulation(scene, settings);
  return to_text(record(simulation, 40, 1));
}

TEST(FloatingPoint, KeepsBitsInAnyRoundingMode) {
  for (const char* const scene : {"door", "box_stack", "tumbling_body"}) {
    for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a5}) {
      const std::string expected = log_of(scene, algorithm);
      for (const char* const mode : {"upward", "downward", "toward-zero", "flush-to-zero", "trapping"}) {
        std::fenv_t before{};
        std::fegetenv(&before);
        EXPECT_TRUE(set_floating_point_mode(mode));
        const std::string found = log_of(scene, algorithm);
        std::fesetenv(&before);
        EXPECT_TRUE(found == expected) << scene << ' ' << name(algorithm) << ": " << mode;
      }
    }
  }
}

TEST(FloatingPoint, RestoresCallersMode) {
  std::fenv_t before{};
  std::fegetenv(&before);
  std::fesetround(FE_UPWARD);
  log_of("pendulum", Algorithm::a5);
  EXPECT_EQ(std::fegetround(), FE_UPWARD);
  std::fesetenv(&before);
  feenableexcept(FE_DIVBYZERO);
  log_of("pendulum", Algorithm::a5);
  EXPECT_EQ(fegetexcept(), FE_DIVBYZERO);
  std::fesetenv(&before);
#if defined(__x86_64__)
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  log_of("pendulum", Algorithm::a5);
  EXPECT_EQ(_MM_GET_FLUSH_ZERO_MODE(), static_cast<unsigned>(_MM_FLUSH_ZERO_ON));
  std::fesetenv(&before);
#endif
}

}  // namespace
}  // namespace substep
