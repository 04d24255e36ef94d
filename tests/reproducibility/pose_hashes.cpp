// Prints a hash of the state after two seconds of every scene with every algorithm: what must be the same for
// each compiler, level and machine.
//
//     pose_hashes SCENE.gltf …

#include <fmt/format.h>

#include <cstdio>
#include <exception>

#include "sim/loading/load_scene.h"
#include "sim/scene/scene.h"
#include "sim/simulation.h"

int main(int count, char** arguments) {
  using namespace substep;
  try {
    for (int i = 1; i < count; ++i) {
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
          while (static_cast<double>(simulation.steps()) * settings.step < 2) {
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
