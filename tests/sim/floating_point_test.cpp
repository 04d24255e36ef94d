// Runs have equal bits in every floating-point mode of the caller, and restore the caller's mode.

#include <fenv.h>
#include <gtest/gtest.h>

#include <cfenv>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#if defined(__x86_64__)
#include <pmmintrin.h>
#endif

#include "sim/log/pose_log.h"
#include "sim/simulation.h"
#include "tests/scene_files.h"

namespace substep {
namespace {

/// Returns the log of a scene with joints, contacts and friction.
std::string log_of(const std::string& name, Algorithm algorithm) {
  const Scene scene = scene_named(name);
  Settings settings = default_settings(algorithm);
  settings.step = scene.step;
  Simulation simulation(scene, settings);
  return to_text(record(simulation, 40, 1));
}

struct Setting {
  std::string name;
  std::function<void()> set;
};

std::vector<Setting> settings() {
  std::vector<Setting> result{{"upwards", [] { std::fesetround(FE_UPWARD); }},
                              {"downwards", [] { std::fesetround(FE_DOWNWARD); }},
                              {"towards zero", [] { std::fesetround(FE_TOWARDZERO); }},
                              {"trapping", [] { feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW); }}};
#if defined(__x86_64__)
  result.push_back({"flushing to zero", [] { _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON); }});
  result.push_back({"subnormals are zeros", [] { _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON); }});
#endif
  return result;
}

TEST(FloatingPoint, KeepsBitsInAnyRoundingMode) {
  for (const char* const scene : {"door", "box_stack", "tumbling_body"}) {
    for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a5}) {
      const std::string expected = log_of(scene, algorithm);
      for (const Setting& setting : settings()) {
        std::fenv_t before{};
        std::fegetenv(&before);
        setting.set();
        const std::string found = log_of(scene, algorithm);
        std::fesetenv(&before);
        EXPECT_TRUE(found == expected) << scene << ' ' << name(algorithm) << ": " << setting.name;
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
