// peers_benchmark: errors against CPU time of A5 with 1 to 32 sub-steps, A1 and Bullet's sequential impulses,
// in one run, and the cheapest run within an error.
//
//   peers_benchmark                      all scenes: some minutes
//   peers_benchmark --figure peers.svg   writes the figure, too
//   peers_benchmark 'pyramid 55'         scenes whose names begin with these words

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "render/report/plot.h"
#include "sim/log/file_output.h"
#include "sim/measure/invariants.h"
#include "sim/study/engines/engines.h"
#include "tests/benchmark/benchmark_scenes.h"

namespace substep::benchmark {
namespace {

constexpr double seconds = 10;

/// A series of the figure: an engine with its settings, from the cheapest to the dearest.
struct Entrant {
  std::string name;
  report::SeriesStyle style;
  MakeStepper make;
  std::vector<Settings> settings;
  std::vector<std::string> labels;
};

std::vector<Entrant> entrants() {
  Entrant a1{
      "A1", report::style_of(Algorithm::a1), algorithm_stepper, {default_settings(Algorithm::a1)}, {"A1"}};
  Entrant a5{"A5", report::style_of(Algorithm::a5), algorithm_stepper, {}, {}};
  for (const int n : {1, 2, 4, 8, 10, 16, 32}) {
    a5.settings.push_back(default_settings(Algorithm::a5));
    a5.settings.back().substeps = n;
    a5.labels.push_back(fmt::format("A5 n={}", n));
  }
  std::vector<Entrant> all{std::move(a1), std::move(a5)};
  const auto found = std::ranges::find(engines(), "bullet-si", &Engine::name);
  if (found == engines().end()) return all;
  Entrant bullet{found->label, {8, 4, false, true, true}, found->make, {}, {}};
  for (const int iterations : {4, 10, 20, 50}) {
    bullet.settings.emplace_back().iterations = iterations;
    bullet.labels.push_back(fmt::format("Bullet {}", iterations));
  }
  all.push_back(std::move(bullet));
  return all;
}

struct Point {
  std::string label;
  double cost = infinity;   ///< ms of CPU time a simulated second
  double error = infinity;  ///< m
};

/// Runs ten seconds. The error is the largest displacement of any body; of a pile, which has to settle first,
/// the deepest overlap in the last second.
Point measure(const BenchmarkScene& scene, const MakeStepper& make, Settings settings, std::string label) {
  settings.step = scene.step;
  const std::unique_ptr<Stepper> engine = make(scene.scene, settings);
  const State start = engine->state();
  const auto steps = static_cast<int>(std::lround(seconds / scene.step));
  const auto last_second = static_cast<int>(std::lround((seconds - 1) / scene.step));
  const bool is_pile = scene.judge == BenchmarkScene::Judge::contained;
  PenetrationMeter meter(scene.scene);
  Point point{std::move(label)};
  double time = 0;
  double largest = 0;
  for (int i = 1; i <= steps; ++i) {
    const double before = cpu_time();
    if (!engine->step()) return point;
    time += cpu_time() - before;
    if (!is_pile) largest = std::max(largest, moved(scene.scene, start, engine->state()));
    if (is_pile && i > last_second && i % 10 == 0) largest = std::max(largest, meter.depth(engine->state()));
  }
  point.cost = 1e3 * time / seconds;
  point.error = largest;
  return point;
}

/// The points of one scene, by entrant.
struct SceneResult {
  BenchmarkScene scene;
  std::vector<std::vector<Point>> points;
};

/// Runs the scene with each entrant, and prints a row for each run.
SceneResult run(const BenchmarkScene& scene, const std::vector<Entrant>& all) {
  SceneResult result{scene, {}};
  for (const Entrant& entrant : all) {
    std::vector<Point>& points = result.points.emplace_back();
    // A1 takes seconds for a step of a pile that falls.
    const bool is_pile = scene.judge == BenchmarkScene::Judge::contained;
    if (is_pile && entrant.settings.front().algorithm == Algorithm::a1 && entrant.name == "A1") continue;
    for (std::size_t i = 0; i < entrant.settings.size(); ++i) {
      points.push_back(measure(scene, entrant.make, entrant.settings[i], entrant.labels[i]));
      const auto& [label, cost, error] = points.back();
      fmt::print("| {} | {} | {:.3g} | {:.2g} |\n", scene.name, label, cost, error);
    }
  }
  return result;
}

constexpr std::array errors{0.5, 0.05, 0.01, 0.001};

/// Returns the cheapest run that stays within an error, or "none".
std::string cheapest(const SceneResult& result, double error) {
  const Point* best = nullptr;
  for (const std::vector<Point>& points : result.points) {
    for (const Point& point : points) {
      if (point.error <= error && (!best || point.cost < best->cost)) best = &point;
    }
  }
  return best ? best->label : "none";
}

std::string table(const std::vector<SceneResult>& results) {
  std::string text = "| scene | within 0.5 m | 0.05 m | 0.01 m | 0.001 m |\n|---|---|---|---|---|\n";
  for (const SceneResult& result : results) {
    text += fmt::format("| {} |", result.scene.name);
    for (const double error : errors) text += fmt::format(" {} |", cheapest(result, error));
    text += "\n";
  }
  return text;
}

/// Range of drawn errors, m: smaller ones are rounding, larger ones falls.
constexpr std::array drawn_errors{1e-5, 10.0};

report::Sheet figure(const std::vector<SceneResult>& results, const std::vector<Entrant>& all) {
  report::Sheet sheet;
  sheet.title = "What stands and what lies in piles: error against cost";
  sheet.caption = {
      "Largest displacement of any body in 10 s, of piles the deepest overlap in the last second, against "
      "CPU time. Errors beyond 10 µm and 10 m are drawn there. h = 1/60 s; A5 with 1, 2, 4, 8, 10, 16 and 32 "
      "sub-steps, Bullet with 4, 10, 20 and 50 iterations."};
  for (const SceneResult& result : results) {
    report::Panel panel;
    panel.title = result.scene.name;
    panel.x = {"ms a simulated second", true, {}, {}};
    panel.y = {"error, m", true, drawn_errors, {}};
    for (std::size_t i = 0; i < all.size(); ++i) {
      report::Series series{all[i].name, all[i].style};
      for (const Point& point : result.points[i])
        series.points.push_back({point.cost, std::clamp(point.error, drawn_errors[0], drawn_errors[1])});
      panel.series.push_back(std::move(series));
    }
    sheet.panels.push_back(std::move(panel));
  }
  return sheet;
}

std::vector<BenchmarkScene> scenes() {
  return {stack_of(10),   stack_of(10, 100), stack_of(10, 1000), pyramid_of(10), pyramid_of(20),
          pyramid_of(30), wall_of(10),       pile_of(250),       pile_of(2000)};
}

int main_of(const std::vector<std::string>& arguments) {
  std::string figure_file;
  std::vector<std::string> chosen;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == "--figure" && i + 1 < arguments.size()) {
      figure_file = arguments[++i];
    } else {
      chosen.push_back(arguments[i]);
    }
  }
  const std::vector<Entrant> all = entrants();
  std::vector<BenchmarkScene> run_scenes = scenes();
  std::erase_if(run_scenes, [&](const BenchmarkScene& scene) { return !scene.is_chosen_by(chosen); });
  if (run_scenes.empty()) {
    fmt::print(stderr, "no scene's name begins with these words\n");
    return 2;
  }
  fmt::print("| scene | run | ms a simulated second | m |\n|---|---|---:|---:|\n");
  std::vector<SceneResult> results;
  for (const BenchmarkScene& scene : run_scenes) results.push_back(run(scene, all));
  fmt::print("\n{}", table(results));
  if (!figure_file.empty())
    write_file(figure_file, report::draw(figure(results, all), report::PictureFormat::svg));
  return 0;
}

}  // namespace
}  // namespace substep::benchmark

int main(int argc, char** argv) {
  return substep::benchmark::main_of({argv + 1, argv + argc});
}
