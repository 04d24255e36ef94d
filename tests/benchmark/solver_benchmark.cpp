// solver_benchmark: CPU times of our algorithms and other engines, in one run, as tables in Markdown.
//
//   solver_benchmark                                     everything: some minutes
//   solver_benchmark --benchmark_filter='chain 10/'      one scene
//
// Options are Google Benchmark's. Figures are medians over repetitions, whose order is shuffled so
// that a machine that slows down slows everyone.

#include <fmt/format.h>

#include <algorithm>

#include "sim/study/engines/engines.h"
#include "tests/benchmark/measurement.h"
#include "tests/benchmark/ratios.h"

namespace substep::benchmark {
namespace {

Settings settings_of(Algorithm algorithm, double step, int substeps, int iterations) {
  Settings settings;
  settings.algorithm = algorithm;
  settings.step = step;
  settings.substeps = substeps;
  settings.iterations = iterations;
  return settings;
}

void register_ours(const BenchmarkScene& scene, const std::string& name, const Settings& settings) {
  register_steps(scene, name, algorithm_stepper, settings);
}

/// Registers the engine that sweeps call `engine`, where it was built in, with its defaults but for the
/// iterations.
void register_engine(const BenchmarkScene& scene, const std::string& engine, const std::string& name,
                     int iterations) {
  const auto found = std::ranges::find(engines(), engine, &Engine::name);
  if (found == engines().end()) return;
  Settings settings;
  settings.step = scene.step;
  settings.iterations = iterations;
  register_steps(scene, name, found->make, settings);
}

void register_a1(const BenchmarkScene& scene) {
  register_ours(scene, "A1", settings_of(Algorithm::a1, scene.step, 1, 1));
}

void register_direct_engine(const BenchmarkScene& scene) {
  register_engine(scene, "ode-step", "dWorldStep", 1);
}

void register_iterative_engines(const BenchmarkScene& scene) {
  register_engine(scene, "ode-quickstep", "QuickStep 20", 20);
  register_engine(scene, "bullet-si", "Bullet SI 10", 10);
}

void register_joints(const BenchmarkScene& scene) {
  register_a1(scene);
  register_ours(scene, "A2 m=10", settings_of(Algorithm::a2, scene.step, 1, 10));
  register_ours(scene, "A3 n=4 m=1", settings_of(Algorithm::a3, scene.step, 4, 1));
  register_ours(scene, "A4 n=4 m=1", settings_of(Algorithm::a4, scene.step, 4, 1));
  register_ours(scene, "A5 n=4 m=1", settings_of(Algorithm::a5, scene.step, 4, 1));
  Settings stable = settings_of(Algorithm::a5, scene.step, 4, 1);
  stable.joints = Joints::stable;
  register_ours(scene, "A5 n=4 m=1 stable", stable);
  register_direct_engine(scene);
  register_iterative_engines(scene);
}

/// Registers the default settings: ten sub-steps of one sweep.
void register_default(const BenchmarkScene& scene, Algorithm algorithm, const std::string& name) {
  Settings settings = default_settings(algorithm);
  settings.step = scene.step;
  register_ours(scene, name, settings);
}

void register_contacts(const BenchmarkScene& scene) {
  register_default(scene, Algorithm::a2, "A2 m=10");
  register_default(scene, Algorithm::a5, "A5 n=10");
  register_iterative_engines(scene);
}

void register_all() {
  for (const BenchmarkScene& scene : {pendulum(), chain_of(10), heavy_chain()}) register_joints(scene);
  for (const int rods : {100, 10000}) register_a1(chain_of(rods));
  for (const int rods : {10, 100, 1000, 10000}) register_cost_of_a1(chain_of(rods));
  for (const int side : {8, 16, 32, 48}) register_cost_of_a1(net_of(side));
  for (const int boxes : {10, 20, 40, 80, 160}) register_cost_of_a1(stack_of(boxes));
  for (const int base : {5, 10, 15, 20, 30}) register_cost_of_a1(pyramid_of(base));
  for (const int side : {5, 10, 15}) register_cost_of_a1(wall_of(side));
  for (const int boxes : {25, 50, 100}) register_cost_of_a1(pile_of(boxes));
  for (const BenchmarkScene& scene : {wall_of(10), pile_of(100)})
    register_default(scene, Algorithm::a5, "A5 n=10");
  register_a1(stack_of(10));
  register_contacts(stack_of(10));
  register_direct_engine(stack_of(10));
  for (const double top : {100.0, 1000.0}) register_a1(stack_of(10, top));
  for (const int base : {10, 20, 30}) register_contacts(pyramid_of(base));
  register_contacts(pile_of(250));
  register_default(pile_of(2000), Algorithm::a5, "A5 n=10");
  register_engine(pile_of(2000), "bullet-si", "Bullet SI 10", 10);
  for (const BenchmarkScene& scene :
       {pyramid_of(10), pyramid_of(20), pyramid_of(30), pile_of(250), pile_of(2000)}) {
    Settings settings = default_settings(Algorithm::a5);
    settings.step = scene.step;
    register_stages(scene, "A5 n=10", settings);
  }
}

}  // namespace
}  // namespace substep::benchmark

int main(int argc, char** argv) {
  using namespace substep::benchmark;
  // Put our options first, so that the user's override them.
  std::vector<char*> arguments = {argv[0]};
  std::string defaults[] = {"--benchmark_repetitions=7", "--benchmark_enable_random_interleaving=true",
                            "--benchmark_min_time=0.05"};
  for (std::string& one : defaults) arguments.push_back(one.data());
  arguments.insert(arguments.end(), argv + 1, argv + argc);
  int count = static_cast<int>(arguments.size());
  arguments.push_back(nullptr);
  ::benchmark::Initialize(&count, arguments.data());
  if (::benchmark::ReportUnrecognizedArguments(count, arguments.data())) return 2;
  register_all();
  Results results;
  ::benchmark::RunSpecifiedBenchmarks(&results);
  fmt::print("{}\n{}\n{}\n{}\n{}", table(results), stages(results), cost_of_a1(results),
             exponents_of_a1(results), ratios(results));
}
