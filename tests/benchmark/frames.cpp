#include <chrono>

#include "render/renderer.h"
#include "sim/loading/load_scene.h"
#include "tests/benchmark/measurement.h"
#include "tests/folders.h"

namespace substep::benchmark {

void register_frames(const std::string& name, int width, int height) {
  const auto run = [=](::benchmark::State& state) {
    const Scene scene = load_scene(std::string(test::source_folder) + "/scenes/" + name + ".gltf");
    render::RenderSettings settings;
    settings.width = width;
    settings.height = height;
    render::Renderer renderer(scene, settings);
    const substep::State start = initial_state(scene);
    renderer.draw(start.q);  // the first frame builds what later ones use
    // The rasteriser has threads of its own: the wall clock is what a user waits for.
    const auto begin = std::chrono::steady_clock::now();
    for (auto unused : state) {
      (void)unused;
      ::benchmark::DoNotOptimize(renderer.draw(start.q));
    }
    const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - begin;
    state.counters["ms_per_frame"] = taken.count() / static_cast<double>(state.iterations());
  };
  ::benchmark::RegisterBenchmark(
      ("frame " + name + "/" + std::to_string(width) + "x" + std::to_string(height)).c_str(), run)
      ->UseRealTime();
}

}  // namespace substep::benchmark
