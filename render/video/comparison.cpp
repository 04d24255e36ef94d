#include "render/video/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "sim/error.h"
#include "sim/execution/parallel_for.h"
#include "sim/simulation.h"

namespace substep {
namespace {

/// Which step each video frame shows.
struct Clock {
  std::vector<std::int64_t> steps;
  bool is_nearest = false;
};

Clock clock_of(double step, double duration) {
  const auto frames = static_cast<std::int64_t>(std::floor(duration * video_frame_rate + 1e-6)) + 1;
  Clock clock;
  for (std::int64_t k = 0; k < frames; ++k) {
    const double exact = static_cast<double>(k) / (video_frame_rate * step);
    clock.steps.push_back(std::llround(exact));
    if (std::abs(exact - static_cast<double>(clock.steps.back())) > 1e-6) clock.is_nearest = true;
  }
  return clock;
}

/// `steps_per_shot` steps of the run are one step of the clock.
void simulate(const Scene& scene, const Clock& clock, int steps_per_shot, Run& run,
              std::atomic<std::int64_t>& done, const std::stop_token& stop) {
  Simulation simulation(scene, run.settings);
  std::int64_t steps = 0;
  for (const std::int64_t shot : clock.steps) {
    while (steps < shot * steps_per_shot) {
      if (stop.stop_requested()) return;
      const StepReport& report = simulation.step();
      ++steps;
      ++done;
      run.row_solves += report.row_solves;
      if (report.status == StepReport::Status::unsolved) ++run.unsolved;
      if (report.status == StepReport::Status::diverged) {
        run.diverged = static_cast<double>(steps) * run.settings.step;
        return;
      }
    }
    run.poses.push_back(simulation.state().q);
  }
}

/// Mean over the body's mass of the squared distance between where a point is and where it should be.
///
/// A turn by θ about the unit axis u moves a point by 2 sin(θ/2) times its distance from the axis, and the
/// mean square of that distance is uᵀI u / m; sin(θ/2) u is the vector part of the quaternion between the
/// two.
double squared_distance(const Body& body, const Coordinates& is, const Coordinates& should_be) {
  double sum = (is.linear - should_be.linear).squaredNorm();
  const Quaternion between = should_be.angular.conjugate() * is.angular;
  for (int axis = 0; axis < 3; ++axis) {
    // A body of infinite inertia does not turn.
    if (body.inverse_inertia[axis] == 0) continue;
    const double squared_radius = body.inverse_mass / body.inverse_inertia[axis];
    sum += 4 * squared_radius * between.vec()[axis] * between.vec()[axis];
  }
  return sum;
}

void measure(const Scene& scene, const Run& reference, Run& run) {
  const std::size_t frames = std::min(run.poses.size(), reference.poses.size());
  double sum_over_frames = 0;
  for (std::size_t k = 0; k < frames; ++k) {
    double sum = 0;
    int count = 0;
    for (std::size_t body = 1; body < scene.bodies.size(); ++body) {
      if (scene.bodies[body].inverse_mass == 0) continue;
      sum += squared_distance(scene.bodies[body], run.poses[k][body], reference.poses[k][body]);
      ++count;
    }
    const double mean = count == 0 ? 0 : sum / count;
    run.errors.push_back(std::sqrt(mean));
    sum_over_frames += mean;
  }
  if (frames > 0) run.rms_error = std::sqrt(sum_over_frames / static_cast<double>(frames));
}

std::vector<Run> runs_of(const ComparisonSettings& settings) {
  std::vector<Run> runs;
  for (const Algorithm algorithm :
       {Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5, Algorithm::a1}) {
    Run& run = runs.emplace_back();
    run.settings = settings.settings;
    run.settings.algorithm = algorithm;
    if (algorithm == Algorithm::a2) run.settings.iterations *= run.settings.substeps;
  }
  runs.back().is_reference = true;
  runs.back().settings.step /= settings.reference_substeps;
  return runs;
}

}  // namespace

Comparison simulate_comparison(const Scene& scene, const ComparisonSettings& settings,
                               const std::function<void(double)>& progress) {
  if (!(settings.duration >= 0 && settings.duration <= 3600)) {
    throw Error(fmt::format("duration {} s: a video can have from 0 to 3600", settings.duration));
  }
  if (!(settings.reference_substeps >= 1 && settings.reference_substeps <= 10000)) {
    throw Error(fmt::format("reference sub-steps {}: must be from 1 to 10000", settings.reference_substeps));
  }
  Comparison comparison;
  comparison.runs = runs_of(settings);
  for (const Run& run : comparison.runs) check(run.settings);
  const Clock clock = clock_of(settings.settings.step, settings.duration);
  for (const std::int64_t step : clock.steps) {
    comparison.times.push_back(static_cast<double>(step) * settings.settings.step);
  }
  comparison.is_nearest = clock.is_nearest;

  // The longest first, so that no thread is left alone with it.
  constexpr std::array<std::size_t, 6> order{5, 0, 2, 3, 4, 1};
  const std::int64_t total = clock.steps.back() * (5 + settings.reference_substeps);
  std::atomic<std::int64_t> done{0};
  parallel_for(
      settings.threads, order.size(),
      [&](std::size_t i, const std::stop_token& stop) {
        Run& run = comparison.runs[order[i]];
        simulate(scene, clock, run.is_reference ? settings.reference_substeps : 1, run, done, stop);
      },
      [&] {
        if (progress) progress(total > 0 ? static_cast<double>(done) / static_cast<double>(total) : 1);
      });
  for (Run& run : comparison.runs) measure(scene, comparison.reference(), run);
  return comparison;
}

}  // namespace substep
