// Prints a hash of the state of every scene with every algorithm after two seconds, or after BODY_STEPS moves of one
// body by one step, whichever comes first: what must be the same for each compiler, level and machine.
//
//     pose_hashes BODY_STEPS SCENE.gltf …

#include <fmt/format.h>

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "sim/loading/load_scene.h"
#include "sim/scene/scene.h"
#include "sim/simulation.h"

int main(int count, char** arguments) {
  using namespace substep;
  if (count < 3) {
    std::fprintf(stderr, "usage: pose_hashes BODY_STEPS SCENE.gltf ...\n");
    return 2;
  }
  try {
    const std::size_t most_body_steps = std::strtoull(arguments[1], nullptr, 10);
    for (int i = 2; i < count; ++i) {
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
          Simulation simulation(scene, settings);
          while (static_cast<double>(simulation.steps()) * settings.step < 2 &&
                 simulation.steps() * scene.bodies.size() < most_body_steps) {
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
