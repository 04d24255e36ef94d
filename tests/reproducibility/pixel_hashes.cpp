// Prints a hash of the pixels of three frames of every scene: its start, and after 15 and 30 steps of A5.
// They must be the same for each compiler, level and machine.
//
//     pixel_hashes [--entry MODE] SCENE.gltf …
//
// MODE is as in pose_hashes.

#include <fmt/format.h>

#include <clocale>
#include <cstdio>
#include <exception>

#include "render/renderer.h"
#include "sim/loading/load_scene.h"
#include "sim/scene/scene.h"
#include "sim/simulation.h"
#include "tests/reproducibility/entry.h"

int main(int count, char** arguments) {
  using namespace substep;
  render::pin_renderer();
  std::setlocale(LC_ALL, "");
  const int first = first_after_entry(count, arguments);
  if (first == 0) return 2;
  if (count < first + 1) {
    std::fprintf(stderr, "usage: pixel_hashes [--entry MODE] SCENE.gltf ...\n");
    return 2;
  }
  try {
    render::RenderSettings picture;
    picture.width = 320;
    picture.height = 180;
    for (int i = first; i < count; ++i) {
      const Scene scene = load_scene(arguments[i]);
      Settings settings = default_settings(Algorithm::a5);
      settings.step = scene.step;
      Simulation simulation(scene, settings);
      render::Renderer renderer(scene, picture);
      for (const int frame : {0, 15, 30}) {
        while (simulation.steps() < frame) {
          if (simulation.step().status == StepReport::Status::diverged) break;
        }
        fmt::print("{} frame {} {:016x}\n", scene.name, frame, hash(renderer.draw(simulation.state().q)));
      }
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pixel_hashes: %s\n", error.what());
    return 2;
  }
  return 0;
}
