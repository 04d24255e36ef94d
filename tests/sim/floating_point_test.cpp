// Runs have equal bits in every floating-point mode of the caller, and restore the caller's mode.

#include <fenv.h>
#include <gtest/gtest.h>

#include <array>
#include <cfenv>
#include <string>

#include "sim/log/pose_log.h"
#include "sim/simulation.h"
#include "tests/reproducibility/entry.h"
#include "tests/scene_files.h"

namespace substep {
namespace {

/// Returns how the processor rounds, which exceptions trap, and on x86-64 also whether tiny numbers become 0.
std::array<unsigned, 3> processor_mode() {
  std::array<unsigned, 3> mode{static_cast<unsigned>(std::fegetround()),
                               static_cast<unsigned>(fegetexcept())};
#if defined(__x86_64__)
  mode[2] = _MM_GET_FLUSH_ZERO_MODE() | _MM_GET_DENORMALS_ZERO_MODE();
#endif
  return mode;
}

/// Returns the log of 40 steps of a scene.
std::string log_of(const std::string& name, Algorithm algorithm) {
  const Scene scene = scene_named(name);
  Settings settings = default_settings(algorithm);
  settings.step = scene.step;
  Simulation simulation(scene, settings);
  return to_text(record(simulation, 40, 1));
}

TEST(FloatingPoint, KeepsBitsAndModeInAnyMode) {
  for (const char* const scene : {"door", "box_stack", "tumbling_body"}) {
    for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a5}) {
      const std::string expected = log_of(scene, algorithm);
      for (const char* const mode : {"upward", "downward", "toward-zero", "flush-to-zero", "trapping"}) {
        std::fenv_t before{};
        std::fegetenv(&before);
        EXPECT_TRUE(set_floating_point_mode(mode));
        const std::array entered = processor_mode();
        const std::string found = log_of(scene, algorithm);
        const std::array left = processor_mode();
        std::fesetenv(&before);
        EXPECT_NE(entered, processor_mode()) << mode;
        EXPECT_EQ(left, entered) << scene << ' ' << name(algorithm) << ": " << mode;
        EXPECT_TRUE(found == expected) << scene << ' ' << name(algorithm) << ": " << mode;
      }
    }
  }
}

}  // namespace
}  // namespace substep
