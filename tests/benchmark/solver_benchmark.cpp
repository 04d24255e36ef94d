// solver_benchmark: CPU times of our algorithms and other engines, in one run, as tables in Markdown.
//
//   solver_benchmark                                     everything: some minutes
//   solver_benchmark --benchmark_filter='chain 10/'      one scene
//
// Options are Google Benchmark's. Figures are medians over repetitions, whose order is shuffled so
// that a machine that slows down slows everyone.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/study/engines/engines.h"
#include "tests/benchmark/measurement.h"

namespace substep::benchmark {
namespace {

void register_ours(const BenchmarkScene& scene, const std::string& name, Settings settings) {
  settings.step = scene.step;
  register_steps(scene, name, algorithm_stepper, settings);
}

/// Registers the engine that sweeps call `engine`, where it was built in, with its defaults but for the
/// iterations.
void register_engine(const BenchmarkScene& scene, const std::string& engine, const std::string& name,
                     int iterations) {
  const auto found = std::ranges::find(engines(), engine, &Engine::name);
  if (found == engines().end()) return;
  register_steps(scene, name, found->make, {.step = scene.step, .iterations = iterations});
}

void register_a1(const BenchmarkScene& scene) {
  register_ours(scene, "A1", {.algorithm = Algorithm::a1, .substeps = 1});
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
  register_ours(scene, "A2 m=10", {.algorithm = Algorithm::a2, .substeps = 1, .iterations = 10});
  register_ours(scene, "A3 n=4 m=1", {.algorithm = Algorithm::a3});
  register_ours(scene, "A4 n=4 m=1", {.algorithm = Algorithm::a4});
  register_ours(scene, "A5 n=4 m=1", {.algorithm = Algorithm::a5});
  register_ours(scene, "A5 n=4 m=1 stable", {.algorithm = Algorithm::a5, .joints = Joints::stable});
  register_direct_engine(scene);
  register_iterative_engines(scene);
}

/// Registers A5 with the default settings: ten sub-steps of one sweep.
void register_a5(const BenchmarkScene& scene) {
  register_ours(scene, "A5 n=10", default_settings(Algorithm::a5));
}

void register_contacts(const BenchmarkScene& scene) {
  register_ours(scene, "A2 m=10", default_settings(Algorithm::a2));
  register_a5(scene);
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
  for (const BenchmarkScene& scene : {wall_of(10), pile_of(100)}) register_a5(scene);
  register_a1(stack_of(10));
  register_contacts(stack_of(10));
  register_direct_engine(stack_of(10));
  for (const double top : {100.0, 1000.0}) register_a1(stack_of(10, top));
  for (const int base : {10, 20, 30}) register_contacts(pyramid_of(base));
  register_contacts(pile_of(250));
  register_a5(pile_of(2000));
  register_engine(pile_of(2000), "bullet-si", "Bullet SI 10", 10);
  for (const BenchmarkScene& scene :
       {pyramid_of(10), pyramid_of(20), pyramid_of(30), pile_of(250), pile_of(2000)}) {
    Settings settings = default_settings(Algorithm::a5);
    settings.step = scene.step;
    register_stages(scene, "A5 n=10", settings);
  }
}

/// Returns the ratios that this run measured both sides of, as a table in Markdown. Its last column names
/// those that failed their check.
std::string ratios(const Results& results) {
  std::string text = "| of | ratio | measured | fails its check |\n|---|---|---:|---|\n";
  const auto add = [&](const std::string& about, const std::string& what, const std::string& one,
                       const std::string& other, const std::string& figure) {
    const double ratio = results.median(one, figure) / results.median(other, figure);
    if (!std::isfinite(ratio)) return;
    std::string failed;
    for (const std::string& name : {one, other}) {
      if (results.failed(name)) failed += (failed.empty() ? "" : ", ") + name;
    }
    text += fmt::format("| {} | {} | {:.3g} | {} |\n", about, what, ratio, failed);
  };
  for (const std::string scene : {"pendulum", "chain 10", "heavy chain"}) {
    add("joints", "A1 on " + scene + " / dWorldStep", scene + "/A1", scene + "/dWorldStep", "us_per_step");
  }
  for (const std::string scene : {"pendulum", "chain 10", "heavy chain"}) {
    add("joints", "A5 n=4 on " + scene + " / QuickStep 20", scene + "/A5 n=4 m=1", scene + "/QuickStep 20",
        "us_per_step");
  }
  add("A1 by size", "A1 a link, chain of 10000 / of 100", "chain 10000/A1", "chain 100/A1",
      "ns_per_body_step");
  for (const std::string scene : {"pyramid 55", "pyramid 210", "pyramid 465", "pile 250", "pile 2000"}) {
    add(scene.substr(0, scene.find(' ')) + "s", "A5 n=10 on " + scene + " / Bullet 10", scene + "/A5 n=10",
        scene + "/Bullet SI 10", "us_per_step");
  }
  add("piles", "A5 n=10 a body-step, pile of 2000 / of 250", "pile 2000/A5 n=10", "pile 250/A5 n=10",
      "ns_per_body_step");
  add("A1 by size", "A1 a row, pyramid of 210 / of 15", "pyramid 210/cost of A1", "pyramid 15/cost of A1",
      "ns_per_row");
  add("A1 by size", "A1 a row, pyramid of 465 / of 55", "pyramid 465/cost of A1", "pyramid 55/cost of A1",
      "ns_per_row");
  for (const std::string scene : {"pyramid 55", "pyramid 210", "pyramid 465", "wall 100"}) {
    add("heaps", "A1 on " + scene + " / A5 n=10", scene + "/cost of A1", scene + "/A5 n=10", "us_per_step");
  }
  return text;
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
