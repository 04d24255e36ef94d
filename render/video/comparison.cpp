#include "render/video/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stop_token>

#include "render/video/recorded_run.h"
#include "sim/error.h"
#include "sim/execution/parallel_for.h"
#include "sim/log/pose_table.h"
#include "sim/measure/expectations.h"
#include "sim/measure/invariants.h"

namespace substep::render {
namespace {

void check(const ComparisonSettings& settings) {
  if (!(settings.duration >= 0 && settings.duration <= 3600))
    throw Error("duration {} s: a video can have from 0 to 3600", settings.duration);
  if (!(settings.start >= 0 && settings.start <= settings.duration))
    throw Error("start {} s: must be from 0 to the duration, {} s", settings.start, settings.duration);
  if (!((settings.duration - settings.start) / settings.frame_interval <= 200000))
    throw Error("the film has more than 200000 frames: shorten it with --duration, or show it less slowly");
  if (!(settings.reference_substeps >= 2 && settings.reference_substeps <= 10000))
    throw Error("reference sub-steps {}: must be from 2 to 10000", settings.reference_substeps);
  if (settings.panels.empty()) throw Error("a film needs at least one panel");
  constexpr std::size_t most = 64;
  if (settings.panels.size() > most) throw Error("a film has at most {} panels", most);
  for (const PanelChoice& panel : settings.panels) {
    if (panel.kind == PanelChoice::Kind::reference && !settings.has_reference)
      throw Error("a panel shows the reference, and there is none");
  }
}

/// Makes a run for each panel. Finished runs have the settings of their log, which `logs` receives.
std::vector<Run> runs_of(const Scene& scene, const ComparisonSettings& settings, std::vector<PoseLog>& logs) {
  std::vector<Run> runs;
  logs.resize(settings.panels.size());
  for (const PanelChoice& panel : settings.panels) {
    Run& run = runs.emplace_back();
    run.panel = panel;
    if (panel.kind == PanelChoice::Kind::log) {
      PoseLog& log = logs[runs.size() - 1] = read_run(panel.log, scene, settings.step);
      run.panel.settings = log.settings;
      run.panel.author = log.author;
    }
    if (panel.kind == PanelChoice::Kind::reference) run.panel.settings.step = settings.step;
    check(run.panel.settings);
    run.panel.shade = static_cast<int>(std::count_if(runs.begin(), runs.end() - 1, [&](const Run& earlier) {
      return hue_of(earlier.panel) == hue_of(run.panel);
    }));
  }
  return runs;
}

/// Returns errors where they are known for half of the film, else the first quantity that the scene has.
Strip usual_strip(const Scene& scene, bool knows_errors) {
  if (knows_errors) return Strip::error;
  if (expectation_of_poses(scene) != nullptr) return Strip::expected;
  return JointGapMeter(scene).is_empty() ? Strip::depth : Strip::gap;
}

using Job = std::function<void()>;

/// The data that a comparison needs while it is simulated.
struct ComparisonContext {
  const Scene& scene;
  const ComparisonSettings& settings;
  const std::function<void(double)>& progress;
  QuantityChoice quantities{};  ///< while the runs are simulated
  std::vector<PoseLog> logs{};
  std::vector<FrameClock> clocks{};  ///< the reference's, then the runs'
  Tally tally{};
  std::int64_t total = 0;     ///< steps of all runs
  ReferenceAttempt fine{};    ///< the reference's run with `substeps` steps in a step
  ReferenceAttempt coarse{};  ///< the reference's run with `substeps` / 2 steps in a step
  bool is_smooth = false;     ///< the reference integrator makes both runs, else A1
  int substeps = 0;           ///< of the reference; 0: not known yet

  /// Runs the jobs on threads, in their order. Throws the first failure in that order.
  void run_jobs(const std::vector<Job>& jobs) {
    parallel_for(
        settings.threads, jobs.size(),
        [&](std::size_t i, const std::stop_token& stop) {
          const std::stop_callback end_all(stop, [&] { tally.stop = true; });
          jobs[i]();
        },
        [&] {
          if (progress)
            progress(total > 0 ? std::min(1.0, static_cast<double>(tally.done) / static_cast<double>(total))
                               : 1);
        });
  }
};

/// Simulates one run of the reference with `parts` steps in a step of the comparison.
ReferenceAttempt attempt(ComparisonContext& work, int parts, const ReferenceAttempt* like = nullptr) {
  return simulate_reference(work.scene, work.clocks[0], work.settings.step, parts, work.is_smooth,
                            work.settings.cache, work.tally, like);
}

/// Runs A1 at an eighth and a fourth of the sub-steps, and takes these runs for the reference where they
/// agree in every frame, as they do where nothing moves.
void settle_reference(ComparisonContext& work) {
  const int eighth = work.settings.reference_substeps / 8;
  if (work.is_smooth || eighth < 1 || work.settings.reference_substeps % 8 != 0) return;
  work.coarse = attempt(work, eighth);
  if (!work.coarse.is_whole(work.clocks[0])) return;
  work.fine = attempt(work, 2 * eighth, &work.coarse);
  if (!work.fine.is_whole(work.clocks[0])) return;
  for (std::size_t k = 0; k < work.fine.poses.size(); ++k) {
    if (!is_settled(work.scene, work.fine.poses[k], work.coarse.poses[k])) return;
  }
  work.substeps = 2 * eighth;
}

/// Simulates the two runs of the reference, with all sub-steps and with half of them.
void simulate_reference_runs(ComparisonContext& work) {
  work.substeps = work.settings.reference_substeps;
  const auto simulate_both = [&] {
    // Begin with the longer one.
    work.run_jobs({[&work] { work.fine = attempt(work, work.substeps); },
                   [&work] { work.coarse = attempt(work, work.substeps / 2); }});
  };
  simulate_both();
  if (!work.is_smooth || !(std::isfinite(work.fine.ended) || std::isfinite(work.coarse.ended))) return;
  // Use A1 where the integrator ends, which is where constraints depend on one another.
  work.is_smooth = false;
  simulate_both();
}

/// Simulates the reference and all runs, as far as they go.
void simulate_all(ComparisonContext& work, std::vector<Run>& runs) {
  const ComparisonSettings& settings = work.settings;
  std::vector<Job> jobs;
  if (settings.has_reference) {
    // Count the full runs. A fourth of their steps is enough where the first two runs agree.
    work.total +=
        work.clocks[0].steps.back() * (settings.reference_substeps + settings.reference_substeps / 2);
    jobs.emplace_back([&work] { settle_reference(work); });
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    Run& run = runs[i];
    const FrameClock& own = work.clocks[i + 1];
    if (run.is_reference()) continue;
    if (run.panel.kind == PanelChoice::Kind::log) {
      take_frames(work.scene, work.logs[i], own, work.quantities, run);
      continue;
    }
    if (run.panel.kind == PanelChoice::Kind::engine) {
      std::shared_ptr<Stepper> stepper = engine_stepper(work.scene, settings.duration, run);
      if (!stepper) continue;
      jobs.emplace_back([&work, &own, &run, stepper] {
        simulate_engine(work.scene, own, work.quantities, *stepper, run, work.tally);
      });
    } else {
      jobs.emplace_back(
          [&work, &own, &run] { simulate_algorithm(work.scene, own, work.quantities, run, work.tally); });
    }
    work.total += own.steps.back();
  }
  if (!jobs.empty()) work.run_jobs(jobs);
  if (settings.has_reference && work.substeps == 0) simulate_reference_runs(work);
}

/// Turns the two runs of the reference into the comparison's reference, at kept steps.
ReferenceRun made_reference(ComparisonContext& work) {
  const double step = work.settings.step;
  const double rate = std::round(work.substeps / step * 1e6) / 1e6;
  std::vector<double> times;
  for (const std::int64_t kept : work.clocks[0].steps) times.push_back(static_cast<double>(kept) * step);
  ReferenceRun reference =
      reference_of(work.scene, work.coarse, std::move(work.fine), times,
                   fmt::format("{}, h=1/{:g}", work.is_smooth ? "own, order 8" : "A1 itself", rate));
  reference.is_a1 = !work.is_smooth;
  return reference;
}

}  // namespace

void QuantityChoice::add(Strip strip, const Scene& scene) {
  gap = gap || strip == Strip::gap;
  energy = energy || strip == Strip::energy;
  deepest = deepest || strip == Strip::depth;
  if (strip != Strip::expected) return;
  expected = expectation_of_poses(scene);
  if (expected == nullptr) throw Error("--strip expected: the scene expects nothing that follows from poses");
}

Comparison simulate_comparison(const Scene& scene, const ComparisonSettings& settings,
                               const std::function<void(double)>& progress) {
  check(settings);
  Comparison comparison;
  ComparisonContext work{scene, settings, progress, settings.quantities};
  // Read the expected quantity at every step: it can become the strip's, which is chosen after the runs.
  if (!work.quantities.expected) work.quantities.expected = expectation_of_poses(scene);
  comparison.runs = runs_of(scene, settings, work.logs);
  comparison.times = frame_times(settings);
  std::vector<double> steps{settings.step};
  for (const Run& run : comparison.runs) steps.push_back(run.panel.settings.step);
  work.clocks = frame_clocks(comparison.times, settings.frame_interval, steps);
  work.is_smooth = settings.has_reference && has_smooth_reference(scene, settings.step);
  simulate_all(work, comparison.runs);

  // Measure at kept steps, then interpolate at frames.
  const FrameClock& clock = work.clocks.front();
  if (settings.has_reference) comparison.reference = made_reference(work);
  QuantityChoice quantities = settings.quantities;
  if (comparison.reference) {
    comparison.strip = usual_strip(scene, 2 * comparison.reference->known >= clock.steps.size());
    quantities.add(*comparison.strip, scene);
  }
  comparison.expected = quantities.expected;
  std::vector<Job> jobs;
  for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
    Run& run = comparison.runs[i];
    if (run.is_reference() || !run.refusal.empty()) continue;
    jobs.emplace_back([&, own = &work.clocks[i + 1], to = &run] {
      if (comparison.reference) measure_from(scene, *comparison.reference, *to);
      if (!quantities.expected) to->quantities.expected.clear();
      read_poses(scene, quantities, *to);
      spread(*own, settings.frame_interval, quantities, *to);
    });
  }
  work.run_jobs(jobs);
  if (!comparison.reference) return comparison;
  spread(clock, *comparison.reference);
  for (Run& run : comparison.runs) {
    if (run.is_reference()) run.poses = comparison.reference->poses;
  }
  return comparison;
}

}  // namespace substep::render
