// solver_benchmark: CPU times of our algorithms beside ODE and Bullet, of the stages of A5's steps, and of A1
// by the size of its problem, as tables in Markdown.
//
//   solver_benchmark              everything: some minutes
//   solver_benchmark 'chain 10'   scenes whose names begin with these words

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "sim/simulation.h"
#include "sim/study/engines/engines.h"
#include "tests/benchmark/benchmark_scenes.h"

namespace substep::benchmark {
namespace {

constexpr int repetitions = 3;
constexpr std::array other_names{"dWorldStep", "QuickStep 20", "Bullet SI 10"};

struct Entrant {
  std::string name;
  MakeStepper make;
  Settings settings;
  std::vector<double> times = {};  ///< of a step, µs

  double median() {
    std::ranges::sort(times);
    return times[times.size() / 2];
  }
};

/// Adds the engine that sweeps call `engine`, where it was built in, with default settings and these
/// iterations.
void add_engine(std::vector<Entrant>& entrants, const std::string& engine, const std::string& name,
                int iterations) {
  const auto found = std::ranges::find(engines(), engine, &Engine::name);
  if (found != engines().end()) entrants.push_back({name, found->make, {.iterations = iterations}});
}

std::vector<Entrant> on_joints() {
  const std::pair<const char*, Settings> ours[] = {
      {"A1", {.algorithm = Algorithm::a1}},
      {"A2 m=10", {.algorithm = Algorithm::a2, .iterations = 10}},
      {"A3 n=4 m=1", {.algorithm = Algorithm::a3}},
      {"A4 n=4 m=1", {.algorithm = Algorithm::a4}},
      {"A5 n=4 m=1", {.algorithm = Algorithm::a5}},
      {"A5 n=4 m=1 stable", {.algorithm = Algorithm::a5, .joints = Joints::stable}}};
  std::vector<Entrant> entrants;
  for (const auto& [name, settings] : ours) entrants.push_back({name, algorithm_stepper, settings});
  add_engine(entrants, "ode-step", other_names[0], 1);
  add_engine(entrants, "ode-quickstep", other_names[1], 20);
  add_engine(entrants, "bullet-si", other_names[2], 10);
  return entrants;
}

/// Returns A2 and A5 with the default settings, ten sweeps each, and engines with iterations.
std::vector<Entrant> on_contacts() {
  std::vector<Entrant> entrants{{"A2 m=10", algorithm_stepper, default_settings(Algorithm::a2)},
                                {"A5 n=10", algorithm_stepper, default_settings(Algorithm::a5)}};
  add_engine(entrants, "ode-quickstep", other_names[1], 20);
  add_engine(entrants, "bullet-si", other_names[2], 10);
  return entrants;
}

/// Returns the scene with the duration of its steps.
Scene timed(const BenchmarkScene& scene) {
  Scene result = scene.scene;
  result.duration = scene.steps * scene.step;
  return result;
}

std::string remark(const BenchmarkScene& scene, const Verdict& verdict) {
  const std::string begin = verdict.passed ? "" : "fails its check: ";
  const double duration = scene.steps * scene.step;
  if (scene.judge == BenchmarkScene::Judge::trajectory)
    return begin + fmt::format("{:.2g} m from the reference after 1 s", verdict.error);
  if (scene.judge == BenchmarkScene::Judge::standing)
    return begin + fmt::format("moved {:.2g} m in {:.0f} s", verdict.error, duration);
  return begin + fmt::format("{:.2g} m deep after {:.0f} s", verdict.error, duration);
}

/// Times the entrants in turns, so that a machine that slows down slows all of them, and prints a row for
/// each: its time, and the ratios to the times of other engines.
void compare(const BenchmarkScene& scene, std::vector<Entrant> entrants) {
  for (int i = 0; i < repetitions; ++i) {
    for (Entrant& entrant : entrants) {
      entrant.settings.step = scene.step;
      const RunTimes times = time_run(timed(scene), entrant.settings, entrant.make, 1);
      entrant.times.push_back(1e6 * times.median / scene.steps);
    }
  }
  const State target = target_of(scene);
  for (Entrant& entrant : entrants) {
    std::string row = fmt::format("| {} | {} | {:.4g} |", scene.name, entrant.name, entrant.median());
    for (const char* const name : other_names) {
      const auto other = std::ranges::find(entrants, name, &Entrant::name);
      row += other == entrants.end() ? " – |" : fmt::format(" {:.3g} |", entrant.median() / other->median());
    }
    const Verdict verdict = judge(scene, target, *entrant.make(scene.scene, entrant.settings));
    fmt::print("{} {} |\n", row, remark(scene, verdict));
  }
}

void print_stages(const BenchmarkScene& scene) {
  Settings settings = default_settings(Algorithm::a5);
  settings.step = scene.step;
  const StageTimes stages = time_run(timed(scene), settings, 1).stages;
  fmt::print("| {} | {:.4g} | {:.4g} | {:.4g} | {:.4g} |\n", scene.name, stages.geometry, stages.formulation,
             stages.velocities, stages.coordinates);
}

void print_cost_of_a1(const BenchmarkScene& scene) {
  Simulation simulation(scene.scene, {.algorithm = Algorithm::a1, .step = scene.step});
  simulation.step();  // the first step allocates memory
  double rows = 0;
  double sets = 0;
  double residual = 0;
  const double start = cpu_time();
  for (int i = 1; i < scene.steps; ++i) {
    const StepReport& report = simulation.step();
    rows += report.rows;
    sets += report.active_sets;
    residual = std::max(residual, report.residual);
  }
  const double time = cpu_time() - start;
  const int steps = scene.steps - 1;
  fmt::print("| {} | {:.4g} | {:.2g} | {:.4g} | {:.3g} | {:.2g} |\n", scene.name, rows / steps, sets / steps,
             1e6 * time / steps, 1e9 * time / rows, residual);
}

void run(const std::vector<std::string>& words) {
  const auto is_chosen = [&](const BenchmarkScene& scene) { return scene.is_chosen_by(words); };
  fmt::print("| scene | engine | µs a step | / {} | check |\n|---|---|---:|---:|---:|---:|---|\n",
             fmt::join(other_names, " | / "));
  for (const BenchmarkScene& scene : {pendulum(), chain_of(10), heavy_chain()}) {
    if (is_chosen(scene)) compare(scene, on_joints());
  }
  for (const BenchmarkScene& scene : {stack_of(10), pyramid_of(10), pyramid_of(20), pyramid_of(30),
                                      wall_of(10), pile_of(250), pile_of(2000)}) {
    if (is_chosen(scene)) compare(scene, on_contacts());
  }
  fmt::print(
      "\n| A5 n=10 | µs s1, geometry | s2, rows | s3, velocities | s4, coordinates |\n"
      "|---|---:|---:|---:|---:|\n");
  for (const BenchmarkScene& scene :
       {pyramid_of(10), pyramid_of(20), pyramid_of(30), pile_of(250), pile_of(2000)}) {
    if (is_chosen(scene)) print_stages(scene);
  }
  fmt::print(
      "\n| A1 | rows | sets a step | µs a step | ns a row | residual |\n|---|---:|---:|---:|---:|---:|\n");
  std::vector<BenchmarkScene> sizes;
  for (const int rods : {10, 100, 1000, 10000}) sizes.push_back(chain_of(rods));
  for (const int side : {8, 16, 32, 48}) sizes.push_back(net_of(side));
  for (const int boxes : {10, 20, 40, 80, 160}) sizes.push_back(stack_of(boxes));
  for (const int base : {5, 10, 15, 20, 30}) sizes.push_back(pyramid_of(base));
  for (const int side : {5, 10, 15}) sizes.push_back(wall_of(side));
  for (const int boxes : {25, 50, 100}) sizes.push_back(pile_of(boxes));
  for (const BenchmarkScene& scene : sizes) {
    if (is_chosen(scene)) print_cost_of_a1(scene);
  }
}

}  // namespace
}  // namespace substep::benchmark

int main(int argc, char** argv) {
  substep::benchmark::run({argv + 1, argv + argc});
}
