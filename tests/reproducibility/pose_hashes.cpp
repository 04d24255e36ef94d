// Prints a hash of the state of every scene with each of A1 to A5 after two seconds, or after BODY_STEPS
// moves of one body by one step, whichever comes first. Hashes are the same for each compiler, level and
// machine.
//
//     pose_hashes [--entry MODE] BODY_STEPS SCENE.gltf …
//
// MODE is one of set_floating_point_mode(), in which the library is entered.

#include <fmt/format.h>

#include <clocale>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <vector>

#include "sim/loading/load_scene.h"
#include "sim/scene/scene.h"
#include "sim/simulation.h"
#include "tests/reproducibility/entry.h"

namespace {

using namespace substep;

/// Returns the joint treatments that can give different states.
std::vector<Joints> treatments(const Scene& scene, Algorithm algorithm) {
  if (scene.joints.empty() || algorithm == Algorithm::a1 || algorithm == Algorithm::a2) return {Joints::rows};
  return {Joints::rows, Joints::plain, Joints::stable};
}

}  // namespace

int main(int count, char** arguments) {
  std::setlocale(LC_ALL, "");
  const int first = first_after_entry(count, arguments);
  if (first == 0) return 2;
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
        for (const Joints joints : treatments(scene, algorithm)) {
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
          // Round the number of steps once, so that this program's own rounding adds none.
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
