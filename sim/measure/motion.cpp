#include "sim/measure/motion.h"

#include <fmt/format.h>

#include <optional>

#include "sim/direct/mlcp.h"
#include "sim/error.h"
#include "sim/execution/parallel_for.h"
#include "sim/math/floating_point.h"
#include "sim/math/rotation.h"
#include "sim/model/model.h"
#include "sim/simulation.h"

namespace substep {
namespace {

constexpr double agreement = 2e-5;  // of the scene's size

/// Returns fine + (fine − coarse) / (2^order − 1), sample by sample.
Motion extrapolated(const Motion& coarse, const Motion& fine, int order) {
  const double weight = 1 / (std::ldexp(1.0, order) - 1);
  Motion result{fine.interval, {}};
  const std::size_t count = std::min(coarse.samples.size(), fine.samples.size());
  for (std::size_t k = 0; k < count; ++k) {
    State state = fine.samples[k];
    const State& other = coarse.samples[k];
    for (std::size_t i = 1; i < state.q.size(); ++i) {
      state.q[i].linear += weight * (state.q[i].linear - other.q[i].linear);
      Eigen::Vector4d from = other.q[i].angular.coeffs();
      Eigen::Vector4d to = state.q[i].angular.coeffs();
      if (from.dot(to) < 0) from = -from;
      to += weight * (to - from);
      state.q[i].angular.coeffs() = to.normalized();
      state.v[i].linear += weight * (state.v[i].linear - other.v[i].linear);
      state.v[i].angular += weight * (state.v[i].angular - other.v[i].angular);
    }
    result.samples.push_back(std::move(state));
  }
  return result;
}

/// Returns an uncertainty as a length: a turn counts as the way of a point half the scene's size away.
double length_of(const Uncertainty& uncertainty, double size) {
  return std::max(uncertainty.position, uncertainty.turn * size / 2);
}

Uncertainty larger_of(const Uncertainty& one, const Uncertainty& other) {
  return {std::max(one.position, other.position), std::max(one.turn, other.turn)};
}

/// The largest distances of a body between two samples, and the body that is furthest apart.
struct Distance {
  Uncertainty largest;
  int body = world_body;
};

/// Returns the distance of two samples; infinite where they are not finite.
Distance distance(const Scene& scene, const State& a, const State& b, double size) {
  Distance result;
  for (std::size_t i = 1; i < a.q.size(); ++i) {
    if (scene.bodies[i].is_kinematic()) continue;
    const double d = (a.q[i].linear - b.q[i].linear).norm();
    const double turn = rotation_vector(Quaternion(a.q[i].angular.conjugate() * b.q[i].angular)).norm();
    const Uncertainty now{std::isfinite(d) ? d : infinity, std::isfinite(turn) ? turn : infinity};
    if (length_of(now, size) > length_of(result.largest, size)) result.body = static_cast<int>(i);
    result.largest = larger_of(result.largest, now);
  }
  return result;
}

/// The samples for which two motions agree.
struct Agreement {
  std::vector<Uncertainty> distances;  ///< the largest until each sample, the first included
  int divergence_point = world_body;   ///< after the last: the body that is then furthest apart

  /// Returns the last sample until which they agree; 0 also where none does.
  std::size_t samples() const { return distances.empty() ? 0 : distances.size() - 1; }
  Uncertainty largest() const { return distances.empty() ? Uncertainty{} : distances.back(); }
};

Agreement agreement_of(const Scene& scene, const Motion& a, const Motion& b, double size) {
  Agreement result;
  const std::size_t count = std::min(a.samples.size(), b.samples.size());
  for (std::size_t k = 0; k < count; ++k) {
    const Distance now = distance(scene, a.samples[k], b.samples[k], size);
    if (length_of(now.largest, size) > agreement * size) {
      result.divergence_point = now.body;
      break;
    }
    result.distances.push_back(larger_of(result.largest(), now.largest));
  }
  return result;
}

/// Returns the larger uncertainty at each instant of `one`; `other` may end earlier.
std::vector<Uncertainty> larger_of(std::vector<Uncertainty> one, const std::vector<Uncertainty>& other) {
  for (std::size_t k = 0; k < one.size() && !other.empty(); ++k)
    one[k] = larger_of(one[k], other[std::min(k, other.size() - 1)]);
  return one;
}

/// Returns the errors that differences of A1's refinements may hide. Where an acceleration jumps, as at the
/// onset of rolling, steps of `step` err by up to the jump times their square, and the next refinement shares
/// half of that. All refinements share A1's tolerance. The fastest body decides.
std::vector<Uncertainty> unseen(const Scene& scene, const Motion& motion, std::size_t samples, double step) {
  constexpr double part = 4 * MlcpSolver::tolerance;
  const double jumps = 2 * step * step / motion.interval;
  const auto largest = [&](const auto& velocity_of) {
    Uncertainty result;
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
      if (scene.bodies[i].is_kinematic()) continue;
      const Velocity v = velocity_of(i);
      result = larger_of(result, {v.linear.norm(), v.angular.norm()});
    }
    return result;
  };
  std::vector<Uncertainty> result(samples + 1);
  for (std::size_t k = 1; k <= samples; ++k) {
    const Uncertainty speed = largest([&](auto i) { return motion.samples[k].v[i]; });
    result[k].position = result[k - 1].position + part * motion.interval * speed.position;
    result[k].turn = result[k - 1].turn + part * motion.interval * speed.turn;
    // Look for a jump in the next interval, too, which shows one that is late in this interval.
    if (k + 1 == motion.samples.size()) continue;
    const Uncertainty jump = largest([&](auto i) -> Velocity {
      const Velocity& now = motion.samples[k + 1].v[i];
      const Velocity& before = motion.samples[k].v[i];
      const Velocity& earlier = motion.samples[k - 1].v[i];
      return {now.linear - 2 * before.linear + earlier.linear,
              now.angular - 2 * before.angular + earlier.angular};
    });
    result[k].position += jumps * jump.position;
    result[k].turn += jumps * jump.turn;
  }
  return result;
}

std::string name_of(const Scene& scene, int body) {
  return body == world_body ? "" : scene.bodies[body].name;
}

/// Returns the halvings of the scene's step that the finest level has: as many as a few seconds of computing
/// allow, counted in rows and not by the clock, so that every machine takes the same.
int finest_level(const Scene& scene, double duration) {
  Simulation simulation(scene, {.algorithm = Algorithm::a1, .step = scene.step});
  const StepReport& report = simulation.step();
  const bool joints_alone = report.contacts == 0 && !build_model(scene).contacts;
  // A row with limits costs A1 more than one without: we measured 0.3 µs against 0.1 µs. In walls and card
  // houses the many active sets cost most.
  const double rows =
      std::max((report.rows + 3) * (joints_alone ? 1.0 : 3.0), static_cast<double>(report.row_solves));
  constexpr double budget = 8e6;
  int level = 9;
  while (level > 4 && rows * std::ldexp(duration / scene.step, level) > budget) --level;
  return level;
}

/// Returns the smooth part of the motion; see reference_integrator.cpp. `why_not` receives the reason where
/// the motion is incomplete, except for contacts.
ReferenceMotion smooth_reference(const Scene& scene, double duration, std::string& why_not) {
  constexpr int order = 12;
  constexpr int usually_finest = 64;
  constexpr int finest = 1 << 14;                       // also where no rows are solved, or each run diverges
  constexpr std::int64_t most_row_solves = 60'000'000;  // of one run where springs are stiffer than that
  ReferenceMotion reference;
  if (build_model(scene).contacts) return reference;
  const double size = size_of(scene);
  const auto samples = static_cast<std::size_t>(std::lround(duration / scene.step));
  Motion coarse;
  double least = infinity;
  for (int divisions = 2; divisions <= finest; divisions *= 2) {
    std::unique_ptr<Stepper> stepper;
    try {
      stepper = reference_stepper(scene, scene.step / divisions, order);
    } catch (const Error& error) {
      why_not = error.what();
      return reference;
    }
    Motion fine{scene.step, {stepper->state()}};
    continue_motion(*stepper, divisions, samples, fine);
    const Agreement agreed = agreement_of(scene, coarse, fine, size);
    coarse = std::move(fine);
    if (divisions == 2) continue;
    const double horizon = static_cast<double>(agreed.samples()) * scene.step;
    const double whole = length_of(agreed.largest(), size);
    // Halve the steps until the difference is rounding, which smaller steps do not reduce.
    if (horizon > reference.horizon || (horizon == reference.horizon && whole < least)) {
      least = whole;
      reference = {.motion = coarse,
                   .method = fmt::format("own of order {} at h/{}", order, divisions),
                   .horizon = horizon,
                   .divergence_point = name_of(scene, agreed.divergence_point),
                   .uncertainties = agreed.distances};
    } else if (reference.horizon > 0) {
      // The movement by this refinement is also the error of the one before.
      reference.uncertainties = larger_of(reference.uncertainties, agreed.distances);
      break;
    }
    if (agreed.samples() == samples && whole < 1e-11 * size) break;
    const bool is_costly = 2 * stepper->row_solves() > most_row_solves;
    if (divisions >= usually_finest && (reference.horizon > 0 || is_costly)) break;  // stiff
  }
  if (reference.horizon > duration - scene.step / 2) return reference;
  why_not = reference.horizon > 0 ? fmt::format("its refinements agree until {:g} s only", reference.horizon)
                                  : "its refinements do not agree";
  return reference;
}

/// A run of A1 at a part of the scene's step.
struct Refinement {
  int divisions;
  std::unique_ptr<Stepper> stepper;
  Motion motion;
};

/// Romberg's table of levels of which each has half the step of the one before: the last row and the row
/// before it, and the column in which the two agree longest.
struct RombergTable {
  std::vector<Motion> before;
  std::vector<Motion> row;
  std::size_t column = 0;
  Agreement agreed;

  RombergTable(const Scene& scene, const std::vector<Refinement>& coarse_to_fine) {
    for (const Refinement& run : coarse_to_fine) {
      before = std::move(row);
      row = {run.motion};
      for (std::size_t k = 0; k < before.size(); ++k)
        row.push_back(extrapolated(before[k], row[k], static_cast<int>(k) + 1));
    }
    const double size = size_of(scene);
    agreed = agreement_of(scene, before[0], row[0], size);
    for (std::size_t k = 1; k < before.size(); ++k) {
      Agreement candidate = agreement_of(scene, before[k], row[k], size);
      if (candidate.samples() > agreed.samples() ||
          (candidate.samples() == agreed.samples() &&
           length_of(candidate.largest(), size) < length_of(agreed.largest(), size))) {
        agreed = std::move(candidate);
        column = k;
      }
    }
  }
};

ReferenceMotion reference_by_a1(const Scene& scene, double duration, int threads) {
  constexpr int levels = 5;
  constexpr std::size_t first_samples = 4;
  const int finest = finest_level(scene, duration);
  std::vector<Refinement> runs;
  for (int level = finest - levels + 1; level <= finest; ++level) {
    auto stepper = algorithm_stepper(scene, {.algorithm = Algorithm::a1, .step = scene.step / (1 << level)});
    Motion motion{scene.step, {stepper->state()}};
    runs.push_back({1 << level, std::move(stepper), std::move(motion)});
  }
  const auto last = static_cast<std::size_t>(std::lround(duration / scene.step));
  // Continue all levels together until the refinements agree in no column.
  std::optional<RombergTable> table;
  std::size_t until = 0;
  do {
    const std::size_t before = until;
    until = std::min(last, std::max(first_samples, 2 * until));
    // Begin with the finest level, which takes half of the work.
    parallel_for(threads, runs.size(), [&](std::size_t i, const std::stop_token&) {
      Refinement& run = runs[runs.size() - 1 - i];
      const bool has_diverged = run.motion.samples.size() <= before;
      if (!has_diverged) continue_motion(*run.stepper, run.divisions, until, run.motion);
    });
    table.emplace(scene, runs);
  } while (until < last && table->agreed.samples() == until);
  const std::size_t column = table->column;
  const Agreement& agreed = table->agreed;
  ReferenceMotion reference;
  reference.method = fmt::format("A1 at h/{}", 1 << finest);
  if (column > 0) reference.method = fmt::format("A1 of order {} at h/{}", column + 1, 1 << finest);
  const double step = scene.step / (1 << finest);
  reference.motion = std::move(table->row[column]);
  reference.uncertainties =
      larger_of(agreed.distances, unseen(scene, reference.motion, agreed.samples(), step));
  reference.horizon = static_cast<double>(agreed.samples()) * scene.step;
  reference.divergence_point = name_of(scene, agreed.divergence_point);
  return reference;
}

/// Returns half the diagonal of the box with the body's moments. A box of half-sizes a, b, c has m/3 (b² +
/// c²), …, in sum 2m/3 (a² + b² + c²).
double half_diagonal(const Body& body) {
  double moments = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (body.inverse_inertia[axis] > 0) moments += 1 / body.inverse_inertia[axis];
  }
  return std::sqrt(1.5 * moments * body.inverse_mass);
}

}  // namespace

void continue_motion(Stepper& stepper, int steps, std::size_t samples, Motion& motion) {
  while (motion.samples.size() <= samples) {
    for (int i = 0; i < steps; ++i) {
      if (!stepper.step()) return;
    }
    motion.samples.push_back(stepper.state());
  }
}

Sampling::Sampling(double step, double interval) {
  const double steps = interval / step;
  const double samples = step / interval;
  const auto is_whole = [](double x) { return x >= 0.5 && std::abs(x - std::round(x)) < 1e-6 * x; };
  if (is_whole(steps)) {
    steps_between = static_cast<int>(std::lround(steps));
  } else if (is_whole(samples)) {
    samples_between = static_cast<int>(std::lround(samples));
  } else {
    throw Error(
        "step {:g} s: must be a whole part or multiple of {:g} s, the interval at which motions are "
        "compared",
        step, interval);
  }
}

double smallest_body_of(const Scene& scene) {
  double smallest = infinity;
  for (const Body& body : scene.bodies) {
    if (body.inverse_mass == 0) continue;
    const double diagonal = 2 * half_diagonal(body);
    if (diagonal > 0) smallest = std::min(smallest, diagonal);
  }
  return std::isfinite(smallest) ? smallest : size_of(scene);
}

double size_of(const Scene& scene) {
  Vector3 centre = Vector3::Zero();
  int count = 0;
  for (const Body& body : scene.bodies) {
    if (body.inverse_mass == 0) continue;
    centre += body.pose.position;
    ++count;
  }
  if (count == 0) return 1;
  centre /= count;
  double radius = 0;
  for (const Body& body : scene.bodies) {
    if (body.inverse_mass == 0) continue;
    radius = std::max(radius, (body.pose.position - centre).norm() + half_diagonal(body));
  }
  return radius > 0 ? 2 * radius : 1;
}

MotionDifference difference(const Scene& scene, const Motion& a, const Motion& b, double horizon) {
  constexpr MotionDifference unknown{{infinity, infinity}, {infinity, infinity}};
  SpreadMeter positions;
  SpreadMeter turns;
  const auto last = static_cast<std::size_t>(std::lround(horizon / b.interval));
  for (std::size_t k = 1; k <= last; ++k) {
    if (k >= a.samples.size() || k >= b.samples.size()) return unknown;
    const State& one = a.samples[k];
    const State& other = b.samples[k];
    for (std::size_t i = 1; i < one.q.size(); ++i) {
      const Body& body = scene.bodies[i];
      if (body.is_kinematic()) continue;
      if (body.inverse_mass > 0) positions.add((one.q[i].linear - other.q[i].linear).norm());
      turns.add(rotation_vector(Quaternion(one.q[i].angular.conjugate() * other.q[i].angular)).norm());
    }
  }
  if (turns.is_empty()) return unknown;
  return {positions.result(), turns.result()};
}

ReferenceMotion reference_motion(const Scene& scene, double duration, int threads) {
  const DefaultFloatingPoint environment;
  std::string why_not;
  ReferenceMotion smooth = smooth_reference(scene, duration, why_not);
  if (smooth.horizon > duration - scene.step / 2) return smooth;
  ReferenceMotion direct = reference_by_a1(scene, duration, threads);
  if (smooth.horizon > direct.horizon) return smooth;
  if (!why_not.empty()) direct.method += fmt::format(" (not the own integrator: {})", why_not);
  return direct;
}

void check_durations(const Scene& scene, double horizon) {
  const std::string file = scene.file.string();
  if (!(scene.duration >= scene.step && scene.duration <= 3600)) {
    throw Error("{}: duration {:g} s: from the scene's step, {:g} s, to 3600 s", file, scene.duration,
                scene.step);
  }
  if (!(horizon >= scene.step))
    throw Error("{}: horizon {:g} s: must be at least a step, {:g} s", file, horizon, scene.step);
}

}  // namespace substep
