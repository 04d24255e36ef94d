// The reference that errors are measured from: two runs of different steps.

#include "render/video/recorded_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "sim/error.h"
#include "sim/loading/json_value.h"
#include "sim/measure/motion.h"
#include "sim/measure/reference_cache.h"
#include "sim/measure/stepper.h"
#include "sim/simulation.h"

namespace substep::render {
namespace {

/// Returns the mean of squared_distance() over the dynamic bodies.
double mean_squared_distance(const Scene& scene, const std::vector<Coordinates>& is,
                             const std::vector<Coordinates>& should_be) {
  double sum = 0;
  int count = 0;
  for (std::size_t body = 1; body < scene.bodies.size(); ++body) {
    if (scene.bodies[body].inverse_mass == 0) continue;
    sum += squared_distance(scene.bodies[body], is[body], should_be[body]);
    ++count;
  }
  return count == 0 ? 0 : sum / count;
}

Json to_json(const ReferenceAttempt& attempt) {
  return {attempt.poses, attempt.ended, attempt.unsolved, attempt.unsolved_steps};
}

ReferenceAttempt attempt_in(const Json& json) {
  return {json.at(0), json.at(1), json.at(2), json.at(3)};
}

}  // namespace

bool is_settled(const Scene& scene, const std::vector<Coordinates>& one,
                const std::vector<Coordinates>& other) {
  const double most = 1e-9 * size_of(scene);
  return mean_squared_distance(scene, one, other) <= most * most;
}

ReferenceAttempt simulate_reference(const Scene& scene, const FrameClock& clock, double step, int divisions,
                                    bool is_smooth, const ReferenceCache& cache, Tally& tally,
                                    const ReferenceAttempt* like) {
  const std::string key = fmt::format("film {:016x} {} {} {} {}", scene.hash, step, divisions, is_smooth,
                                      fmt::join(clock.steps, " "));
  if (const auto kept = cache.find(key)) return attempt_in(*kept);
  ReferenceAttempt attempt;
  std::int64_t steps = 0;
  bool continues = true;
  if (is_smooth) {
    const std::unique_ptr<Stepper> stepper = reference_stepper(scene, step / divisions, 8);
    continues = keep_steps(
        clock, divisions, tally, steps, [&] { return stepper->step(); },
        [&] { attempt.poses.push_back(stepper->state().q); });
  } else {
    Settings settings;
    settings.algorithm = Algorithm::a1;
    settings.step = step / divisions;
    Simulation simulation(scene, settings);
    const auto advance = [&] {
      const std::size_t frames = attempt.poses.size();
      if (like && frames > 0 && !is_settled(scene, attempt.poses.back(), like->poses[frames - 1]))
        return false;
      const StepReport& report = simulation.step();
      if (report.status == StepReport::Status::unsolved && ++attempt.unsolved_steps == 1) {
        attempt.unsolved = static_cast<double>(steps) * settings.step;
      }
      return report.status != StepReport::Status::diverged;
    };
    continues = keep_steps(clock, divisions, tally, steps, advance,
                           [&] { attempt.poses.push_back(simulation.state().q); });
  }
  if (!continues) attempt.ended = static_cast<double>(steps) * step / divisions;
  if (!tally.stop && !(like && !continues)) cache.keep(key, to_json(attempt));
  return attempt;
}

bool has_smooth_reference(const Scene& scene, double step) {
  try {
    reference_stepper(scene, step, 8);
    return true;
  } catch (const Error&) {
    return false;
  }
}

ReferenceRun reference_of(const Scene& scene, const ReferenceAttempt& coarse, ReferenceAttempt fine,
                          const std::vector<double>& times, const std::string& method) {
  ReferenceRun reference;
  reference.method = method;
  reference.poses = std::move(fine.poses);
  const std::size_t both = std::min(reference.poses.size(), coarse.poses.size());
  const double most = 0.01 * size_of(scene);
  while (reference.known < both) {
    const std::size_t k = reference.known;
    const double difference = std::sqrt(mean_squared_distance(scene, coarse.poses[k], reference.poses[k]));
    // Count a NaN as diverged.
    if (!(difference <= most)) break;
    if (times[k] + 1e-9 >= fine.unsolved) break;
    reference.uncertainty.push_back(difference);
    ++reference.known;
  }
  if (reference.known == times.size()) return reference;
  // Drop the start, at which all runs are equal.
  if (reference.known == 1) {
    reference.known = 0;
    reference.uncertainty.clear();
  }
  const std::size_t first =
      reference.known == 0 ? std::min<std::size_t>(1, times.size() - 1) : reference.known;
  if (first < both && times[first] + 1e-9 >= fine.unsolved) {
    reference.fate = fine.unsolved_steps == 1 ? fmt::format("a step not solved, at {:.2f} s", fine.unsolved)
                                              : fmt::format("{} steps not solved, the first at {:.2f} s",
                                                            fine.unsolved_steps, fine.unsolved);
  } else if (first < both) {
    reference.fate = fmt::format("its refinements diverge at {:.2f} s", times[first]);
  } else {
    reference.fate = fmt::format("fails at {:.2f} s", std::min(fine.ended, coarse.ended));
  }
  return reference;
}

/// A turn by θ about the unit axis u moves a point by 2 sin(θ/2) times its distance from the axis, and the
/// mean square of that distance is uᵀI u / m; sin(θ/2) u is the vector part of the quaternion between the two
/// poses.
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

std::optional<Divergence> divergence_of(const Scene& scene, const Comparison& comparison, const Run& run) {
  if (!comparison.reference || run.is_reference()) return std::nullopt;
  const double most = 0.02 * size_of(scene);
  const std::size_t frames = std::min(run.poses.size(), comparison.reference->known);
  for (std::size_t k = 0; k < frames; ++k) {
    Divergence farthest{k};
    for (std::size_t body = 1; body < scene.bodies.size(); ++body) {
      if (scene.bodies[body].inverse_mass == 0) continue;
      const double distance = std::sqrt(
          squared_distance(scene.bodies[body], run.poses[k][body], comparison.reference->poses[k][body]));
      if (distance > farthest.distance) farthest = {k, static_cast<int>(body), distance};
    }
    if (farthest.distance > most) return farthest;
  }
  return std::nullopt;
}

void measure_from(const Scene& scene, const ReferenceRun& reference, Run& run) {
  const std::size_t kept = std::min(run.poses.size(), reference.known);
  for (std::size_t k = 0; k < kept; ++k) {
    run.errors.push_back(std::sqrt(mean_squared_distance(scene, run.poses[k], reference.poses[k])));
  }
}

}  // namespace substep::render
