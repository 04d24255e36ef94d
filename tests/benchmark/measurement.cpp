#include "tests/benchmark/measurement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <memory>
#include <optional>

#include "sim/measure/stepper.h"
#include "sim/simulation.h"

namespace substep::benchmark {
namespace {

std::string remark(const BenchmarkScene& scene, const Verdict& verdict) {
  std::string text = verdict.passed ? "" : std::string(failed_check) + ": ";
  switch (scene.judge) {
    case BenchmarkScene::Judge::trajectory:
      return text + fmt::format("{:.2g} m from the reference after 1 s", verdict.error);
    case BenchmarkScene::Judge::standing:
      return text + fmt::format("moved {:.2g} m in {:.0f} s", verdict.error, scene.steps * scene.step);
    case BenchmarkScene::Judge::contained:
      return text + fmt::format("{:.2g} m deep after {:.0f} s", verdict.error, scene.steps * scene.step);
    case BenchmarkScene::Judge::none:
      break;
  }
  return text;
}

}  // namespace

double cpu_time() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void register_steps(const BenchmarkScene& scene, const std::string& engine, const MakeStepper& make,
                    const Settings& settings) {
  // Judge the engine once, before the first timing.
  const auto verdict = std::make_shared<std::optional<Verdict>>();
  const auto run = [scene, make, settings, verdict](::benchmark::State& state) {
    if (!*verdict) *verdict = judge(scene, *make(scene.scene, settings));
    double time = 0;
    for (auto unused : state) {
      (void)unused;
      const std::unique_ptr<Stepper> one = make(scene.scene, settings);
      one->step();  // the first step makes room
      const double start = cpu_time();
      for (int i = 1; i < scene.steps; ++i) one->step();
      const double taken = cpu_time() - start;
      state.SetIterationTime(taken);
      time += taken;
    }
    const double step = time / (static_cast<double>(state.iterations()) * (scene.steps - 1));
    state.counters["us_per_step"] = 1e6 * step;
    state.counters["ns_per_body_step"] = 1e9 * step / static_cast<double>(scene.scene.bodies.size() - 1);
    state.counters["error_m"] = (*verdict)->error;
    state.SetLabel(remark(scene, **verdict));
  };
  ::benchmark::RegisterBenchmark((scene.name + "/" + engine).c_str(), run)->UseManualTime();
}

void register_cost_of_a1(const BenchmarkScene& scene) {
  const auto run = [scene](::benchmark::State& state) {
    const Settings settings{.algorithm = Algorithm::a1, .step = scene.step};
    double time = 0;
    double rows = 0;
    double sets = 0;
    double residual = 0;
    for (auto unused : state) {
      (void)unused;
      Simulation simulation(scene.scene, settings);
      simulation.step();  // the first step makes room
      const double start = cpu_time();
      for (int i = 1; i < scene.steps; ++i) {
        const StepReport& report = simulation.step();
        rows += report.rows;
        sets += report.active_sets;
        residual = std::max(residual, report.residual);
      }
      const double taken = cpu_time() - start;
      state.SetIterationTime(taken);
      time += taken;
    }
    const double steps = static_cast<double>(state.iterations()) * (scene.steps - 1);
    state.counters["us_per_step"] = 1e6 * time / steps;
    state.counters["ns_per_row"] = 1e9 * time / rows;
    state.counters["rows"] = rows / steps;
    state.counters["sets"] = sets / steps;
    state.counters["residual"] = residual;
  };
  ::benchmark::RegisterBenchmark((scene.name + "/cost of A1").c_str(), run)->UseManualTime();
}

void register_stages(const BenchmarkScene& scene, const std::string& engine, const Settings& settings) {
  const auto run = [=](::benchmark::State& state) {
    Scene timed = scene.scene;
    timed.duration = scene.steps * scene.step;
    RunTimes times;
    for (auto unused : state) {
      (void)unused;
      times = time_run(timed, settings, 1);
      state.SetIterationTime(times.median);
    }
    const StageTimes& stages = times.stages;
    const double whole = stages.geometry + stages.formulation + stages.velocities + stages.coordinates;
    state.counters["us_geometry"] = stages.geometry;
    state.counters["us_formulation"] = stages.formulation;
    state.counters["us_velocities"] = stages.velocities;
    state.counters["us_coordinates"] = stages.coordinates;
    state.counters["part_of_rows"] = (stages.geometry + stages.formulation) / whole;
  };
  ::benchmark::RegisterBenchmark((scene.name + "/stages of " + engine).c_str(), run)->UseManualTime();
}

void Results::ReportRuns(const std::vector<Run>& runs) {
  for (const Run& run : runs) {
    if (run.run_type != Run::RT_Iteration || run.error_occurred) continue;
    const std::string& name = run.run_name.function_name;
    auto line = std::ranges::find(lines_, name, &Line::name);
    if (line == lines_.end())
      line = lines_.insert(lines_.end(), {run.family_index, name, run.report_label, {}});
    for (const auto& [figure, counter] : run.counters) line->figures[figure].push_back(counter.value);
  }
}

void Results::Finalize() {
  std::ranges::sort(lines_, {}, &Line::place);
}

const Results::Line* Results::line(const std::string& name) const {
  const auto found = std::ranges::find(lines_, name, &Line::name);
  return found == lines_.end() ? nullptr : &*found;
}

double Results::median(const std::string& name, const std::string& figure) const {
  const Line* one = line(name);
  if (!one || !one->figures.contains(figure)) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> values = one->figures.at(figure);
  std::ranges::sort(values);
  return values[values.size() / 2];
}

bool Results::failed(const std::string& name) const {
  const Line* one = line(name);
  return one && one->remark.starts_with(failed_check);
}

namespace {

/// Returns a table of lines in Markdown by columns (figure, heading); `remark` heads a last column of
/// remarks. Figures that are not there are blank.
std::string table(const Results& results, const std::vector<const Results::Line*>& lines,
                  const std::string& first, const std::vector<std::pair<std::string, std::string>>& columns,
                  const std::string& remark = "") {
  if (lines.empty()) return "";
  std::string text = fmt::format("| {} |", first);
  std::string rule = "|---|";
  for (const auto& [figure, heading] : columns) {
    text += fmt::format(" {} |", heading);
    rule += "---:|";
  }
  if (!remark.empty()) {
    text += fmt::format(" {} |", remark);
    rule += "---|";
  }
  text += fmt::format("\n{}\n", rule);
  for (const Results::Line* line : lines) {
    text += fmt::format("| {} |", line->name);
    for (const auto& [figure, heading] : columns) {
      const bool is_there = line->figures.contains(figure);
      text += fmt::format(" {} |", is_there ? fmt::format("{:.4g}", results.median(line->name, figure)) : "");
    }
    if (!remark.empty()) text += fmt::format(" {} |", line->remark);
    text += "\n";
  }
  return text;
}

std::vector<const Results::Line*> lines_with(const Results& results, const std::string& figure) {
  std::vector<const Results::Line*> lines;
  for (const Results::Line& line : results.lines()) {
    if (line.figures.contains(figure)) lines.push_back(&line);
  }
  return lines;
}

}  // namespace

std::string table(const Results& results) {
  std::vector<const Results::Line*> lines;
  for (const Results::Line& line : results.lines()) {
    const auto is_of = [&](const char* figure) { return line.figures.contains(figure); };
    if (!is_of("rows") && !is_of("part_of_rows")) lines.push_back(&line);
  }
  return table(results, lines, "scene/engine",
               {{"us_per_step", "µs a step"}, {"ns_per_body_step", "ns a body-step"}}, "check");
}

std::string stages(const Results& results) {
  return table(results, lines_with(results, "part_of_rows"), "scene",
               {{"us_geometry", "µs s1, geometry"},
                {"us_formulation", "s2, rows"},
                {"us_velocities", "s3, velocities"},
                {"us_coordinates", "s4, coordinates"},
                {"part_of_rows", "s1 and s2"}});
}

std::string cost_of_a1(const Results& results) {
  return table(results, lines_with(results, "rows"), "scene",
               {{"rows", "rows"},
                {"sets", "sets a step"},
                {"us_per_step", "µs a step"},
                {"ns_per_row", "ns a row"},
                {"residual", "residual"}});
}

std::string exponents_of_a1(const Results& results) {
  std::map<std::string, std::pair<const Results::Line*, const Results::Line*>> kinds;  // smallest and largest
  for (const Results::Line* line : lines_with(results, "rows")) {
    auto& [first, last] = kinds[line->name.substr(0, line->name.find(' '))];
    if (!first) first = line;
    last = line;
  }
  std::string text;
  for (const auto& [kind, ends] : kinds) {
    const auto growth = [&, from = ends.first, to = ends.second](const char* figure) {
      return std::log(results.median(to->name, figure) / results.median(from->name, figure));
    };
    if (ends.first == ends.second) continue;
    text += fmt::format("{}{}: {:.2f}", text.empty() ? "Exponent of A1's time in the rows: " : ", ", kind,
                        growth("us_per_step") / growth("rows"));
  }
  return text + "\n";
}

}  // namespace substep::benchmark
