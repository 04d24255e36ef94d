// Prints a hash of the state of every scene with every algorithm after two seconds, or after BODY_STEPS moves
// of one body by one step, whichever comes first: what must be the same for each compiler, level and machine.
//
//     pose_hashes [--entry MODE] BODY_STEPS SCENE.gltf …
//
// MODE is how the processor is set when the library is entered: upward, downward, toward-zero, flush-to-zero.

#include <fmt/format.h>

#include <cfenv>
#include <clocale>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string_view>

#if defined(__x86_64__)
#include <pmmintrin.h>
#endif

#include "sim/loading/load_scene.h"
#include "sim/scene/scene.h"
#include "sim/simulation.h"

namespace {

bool enter(std::string_view mode) {
  if (mode == "upward") return std::fesetround(FE_UPWARD) == 0;
  if (mode == "downward") return std::fesetround(FE_DOWNWARD) == 0;
  if (mode == "toward-zero") return std::fesetround(FE_TOWARDZERO) == 0;
#if defined(__x86_64__)
  if (mode == "flush-to-zero") {
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    return true;
  }
#endif
  return false;
}

}  // namespace

int main(int count, char** arguments) {
  using namespace substep;
  std::setlocale(LC_ALL, "");
  int first = 1;
  if (count > 2 && std::string_view(arguments[1]) == "--entry") {
    if (!enter(arguments[2])) {
      std::fprintf(stderr, "pose_hashes: --entry %s is not known here\n", arguments[2]);
      return 2;
    }
    first = 3;
  }
  if (count < first + 2) {
    std::fprintf(stderr, "usage: pose_hashes [--entry MODE] BODY_STEPS SCENE.gltf ...\n");
    return 2;
  }
  try {
    const std::size_t most_body_steps = std::strtoull(arguments[first], nullptr, 10);
    for (int i = first + 1; i < count; ++i) {
      const Scene scene = load_scene(arguments[i]);
      for (const Algorithm algorithm :
           {Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
        for (const Joints joints : {Joints::rows, Joints::plain, Joints::stable}) {
          Settings settings;
          settings.algorithm = algorithm;
          settings.joints = joints;
          settings.step = scene.step;
          settings.iterations = 3;
          settings.tau = 0.7;
          settings.kappa = 0.9;
          settings.contact_tau = 1.1;
          settings.contact_kappa = 0.8;
          Simulation simulation(scene, settings);
          // Counted so that this program's own rounding does not add a step.
          const std::int64_t steps = std::llround(2 / settings.step);
          while (simulation.steps() < steps && simulation.steps() * scene.bodies.size() < most_body_steps) {
            if (simulation.step().status == StepReport::Status::diverged) break;
          }
          fmt::print("{} {} {} {} {:016x}\n", scene.name, name(algorithm), name(joints), simulation.steps(),
                     hash(simulation.state()));
        }
      }
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pose_hashes: %s\n", error.what());
    return 2;
  }
  return 0;
}
