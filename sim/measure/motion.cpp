#include "sim/measure/motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "sim/direct/mlcp.h"
#include "sim/error.h"
#include "sim/execution/parallel_for.h"
#include "sim/math/floating_point.h"
#include "sim/math/rotation.h"
#include "sim/measure/reference_integrator.h"
#include "sim/model/model.h"
#include "sim/simulation.h"

namespace substep {
namespace {

constexpr double agreement = 2e-5;  // of the scene's size

/// A run of A1 at a part of the scene's step, which continues where it stopped.
class RunOfA1 {
 public:
  RunOfA1(const Scene& scene, int divisions)
      : divisions_(divisions), simulation_(scene, settings_of(scene, divisions)) {
    motion_ = {scene.step, {simulation_.state()}};
  }
  const Motion& motion() const { return motion_; }

  /// Simulates until the motion has the sample, or diverges.
  void continue_to(std::size_t sample) {
    while (!has_diverged_ && motion_.samples.size() <= sample) {
      for (int i = 0; i < divisions_ && !has_diverged_; ++i)
        has_diverged_ = simulation_.step().status == StepReport::Status::diverged;
      if (!has_diverged_) motion_.samples.push_back(simulation_.state());
    }
  }

 private:
  static Settings settings_of(const Scene& scene, int divisions) {
    Settings settings;
    settings.algorithm = Algorithm::a1;
    settings.step = scene.step / divisions;
    return settings;
  }

  int divisions_;
  Simulation simulation_;
  Motion motion_;
  bool has_diverged_ = false;
};

/// fine + (fine − coarse) / (2^order − 1), sample by sample.
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

/// The time for which two motions agree, and their largest distance until then.
struct Agreement {
  std::size_t samples = 0;
  double distance = 0;                ///< m
  double turn = 0;                    ///< rad
  int divergence_point = world_body;  ///< of the samples' end: the body that is then furthest apart

  /// A turn counts as the way of a point half the scene's size away.
  double whole(double size) const { return std::max(distance, turn * size / 2); }
};

/// Largest distances of a body between two samples.
Agreement distance(const Scene& scene, const State& a, const State& b, double size) {
  Agreement result;
  for (std::size_t i = 1; i < a.q.size(); ++i) {
    if (scene.bodies[i].inverse_mass == 0) continue;
    const double d = (a.q[i].linear - b.q[i].linear).norm();
    const double turn = rotation_vector(Quaternion(a.q[i].angular.conjugate() * b.q[i].angular)).norm();
    if (!(std::max(d, turn * size / 2) <= result.whole(size))) result.divergence_point = static_cast<int>(i);
    result.distance = std::isfinite(d) ? std::max(result.distance, d) : infinite;
    result.turn = std::isfinite(turn) ? std::max(result.turn, turn) : infinite;
  }
  return result;
}

Agreement agreement_of(const Scene& scene, const Motion& a, const Motion& b, double size) {
  Agreement result;
  const std::size_t count = std::min(a.samples.size(), b.samples.size());
  for (std::size_t k = 0; k < count; ++k) {
    const Agreement now = distance(scene, a.samples[k], b.samples[k], size);
    if (!(now.whole(size) <= agreement * size)) {
      result.divergence_point = now.divergence_point;
      break;
    }
    result = {k, std::max(result.distance, now.distance), std::max(result.turn, now.turn)};
  }
  return result;
}

/// Largest distances of two motions until each of `samples`, the first included; infinite where one has
/// ended.
std::vector<Uncertainty> differences(const Scene& scene, const Motion& a, const Motion& b,
                                     std::size_t samples) {
  std::vector<Uncertainty> result(samples + 1);
  const double size = size_of(scene);
  for (std::size_t k = 1; k <= samples; ++k) {
    const bool both = k < std::min(a.samples.size(), b.samples.size());
    const Agreement now = both ? distance(scene, a.samples[k], b.samples[k], size)
                               : Agreement{.distance = infinite, .turn = infinite};
    result[k] = {std::max(result[k - 1].position, now.distance), std::max(result[k - 1].turn, now.turn)};
  }
  return result;
}

/// At each instant of `one`; `other` may end earlier.
std::vector<Uncertainty> larger_of(std::vector<Uncertainty> one, const std::vector<Uncertainty>& other) {
  for (std::size_t k = 0; k < one.size(); ++k) {
    const Uncertainty& more = other[std::min(k, other.size() - 1)];
    one[k] = {std::max(one[k].position, more.position), std::max(one[k].turn, more.turn)};
  }
  return one;
}

/// Returns the errors that differences of A1's refinements may hide. Where an acceleration jumps, as at the
/// onset of rolling, steps of `step` err by up to the jump times their square, and the next refinement shares
/// half of that. All refinements share A1's tolerance. The fastest body decides.
std::vector<Uncertainty> unseen(const Scene& scene, const Motion& motion, std::size_t samples, double step) {
  constexpr double part = 4 * MlcpSolver::tolerance;
  const double jumps = 2 * step * step / motion.interval;
  const auto largest = [&](const auto& value) {
    double result = 0;
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
      if (scene.bodies[i].inverse_mass > 0) result = std::max(result, value(i).norm());
    }
    return result;
  };
  std::vector<Uncertainty> result(samples + 1);
  const auto velocities = [&](std::size_t k) -> const std::vector<Velocity>& { return motion.samples[k].v; };
  const std::size_t last = motion.samples.size() - 1;
  for (std::size_t k = 1; k <= samples; ++k) {
    result[k] = result[k - 1];
    result[k].position += part * motion.interval * largest([&](auto i) { return velocities(k)[i].linear; });
    result[k].turn += part * motion.interval * largest([&](auto i) { return velocities(k)[i].angular; });
    // A jump late in an interval is seen in the next one.
    if (const std::size_t j = k + 1; j <= last) {
      const auto& now = velocities(j);
      const auto& before = velocities(j - 1);
      const auto& earlier = velocities(j - 2);
      result[k].position += jumps * largest([&](auto i) {
                              return Vector3(now[i].linear - 2 * before[i].linear + earlier[i].linear);
                            });
      result[k].turn += jumps * largest([&](auto i) {
                          return Vector3(now[i].angular - 2 * before[i].angular + earlier[i].angular);
                        });
    }
  }
  return result;
}

/// Takes over what is known of the motion's uncertainty, until its horizon.
void set_uncertainties(std::vector<Uncertainty> uncertainties, ReferenceMotion& reference) {
  reference.uncertainty = uncertainties.back().position;
  reference.turn_uncertainty = uncertainties.back().turn;
  reference.uncertainties = std::move(uncertainties);
}

std::string name_of(const Scene& scene, int body) {
  return body == world_body ? "" : scene.bodies[body].name;
}

/// Halvings of the scene's step that the finest level has: as many as a few seconds of computing allow,
/// counted in rows and not by the clock, so that every machine takes the same.
int finest_level(const Scene& scene, double duration) {
  Settings settings;
  settings.algorithm = Algorithm::a1;
  settings.step = scene.step;
  Simulation simulation(scene, settings);
  const StepReport& report = simulation.step();
  const bool joints_alone = report.contacts == 0 && !build_model(scene).contacts;
  // A row with limits costs A1 more than one without; measured, 0.3 µs against 0.1 µs. Where many active sets
  // are tried, as in walls and card houses, it is these that cost.
  const double rows =
      std::max((report.rows + 3) * (joints_alone ? 1.0 : 3.0), static_cast<double>(report.row_solves));
  constexpr double budget = 8e6;
  int level = 9;
  while (level > 4 && rows * std::ldexp(duration / scene.step, level) > budget) --level;
  return level;
}

/// The instants of the scene's steps, until it cannot go on.
Motion run_of_stepper(const Scene& scene, Stepper& stepper, int divisions, std::size_t samples) {
  Motion motion{scene.step, {stepper.state()}};
  bool goes_on = true;
  while (goes_on && motion.samples.size() <= samples) {
    for (int i = 0; goes_on && i < divisions; ++i) goes_on = stepper.step();
    if (goes_on) motion.samples.push_back(stepper.state());
  }
  return motion;
}

/// Returns the smooth part of the motion; see reference_integrator.h. `why_not` receives the reason where the
/// motion is incomplete, except for contacts.
ReferenceMotion smooth_reference(const Scene& scene, double duration, std::string& why_not) {
  constexpr int order = 12;
  constexpr int usually_finest = 64;
  constexpr std::int64_t most_row_solves = 60'000'000;  // of one run where springs are stiffer than that
  ReferenceMotion reference;
  if (build_model(scene).contacts) return reference;
  const double size = size_of(scene);
  const auto samples = static_cast<std::size_t>(std::lround(duration / scene.step));
  Motion coarse;
  double least = infinite;
  std::int64_t row_solves = 0;
  for (int divisions = 2; divisions <= usually_finest || 2 * row_solves <= most_row_solves; divisions *= 2) {
    std::unique_ptr<Stepper> stepper;
    try {
      stepper = reference_stepper(scene, scene.step / divisions, order);
    } catch (const Error& error) {
      why_not = error.what();
      return reference;
    }
    Motion fine = run_of_stepper(scene, *stepper, divisions, samples);
    row_solves = stepper->row_solves();
    const Agreement agreed = agreement_of(scene, coarse, fine, size);
    std::vector<Uncertainty> moved = differences(scene, coarse, fine, agreed.samples);
    coarse = std::move(fine);
    if (divisions == 2) continue;
    const double horizon = static_cast<double>(agreed.samples) * scene.step;
    const double whole = agreed.whole(size);
    // Until it is rounding: smaller steps then bring no less.
    if (horizon > reference.horizon || (horizon == reference.horizon && whole < least)) {
      least = whole;
      reference = {.motion = coarse,
                   .method = fmt::format("own of order {} at h/{}", order, divisions),
                   .horizon = horizon,
                   .divergence_point = name_of(scene, agreed.divergence_point)};
      set_uncertainties(std::move(moved), reference);
    } else if (reference.horizon > 0) {
      // The movement by this refinement is also the error of the one before.
      set_uncertainties(larger_of(reference.uncertainties, moved), reference);
      break;
    }
    if (agreed.samples == samples && whole < 1e-11 * size) break;
    if (reference.horizon > 0 && divisions >= usually_finest) break;  // stiff, and agreed
  }
  if (reference.horizon > duration - scene.step / 2) return reference;
  why_not = reference.horizon > 0 ? fmt::format("its refinements agree until {:g} s only", reference.horizon)
                                  : "its refinements do not agree";
  return reference;
}

/// Romberg's table of levels of which each has half the step of the one before: the last row and the row
/// before it, and the column in which the two agree longest.
struct RombergTable {
  std::vector<Motion> before;
  std::vector<Motion> row;
  std::size_t column = 0;
  Agreement agreed;

  RombergTable(const Scene& scene, const std::vector<std::unique_ptr<RunOfA1>>& coarse_to_fine) {
    for (const auto& run : coarse_to_fine) {
      before = std::move(row);
      row = {run->motion()};
      for (std::size_t k = 0; k < before.size(); ++k)
        row.push_back(extrapolated(before[k], row[k], static_cast<int>(k) + 1));
    }
    const double size = size_of(scene);
    agreed = agreement_of(scene, before[0], row[0], size);
    for (std::size_t k = 1; k < before.size(); ++k) {
      const Agreement candidate = agreement_of(scene, before[k], row[k], size);
      if (candidate.samples > agreed.samples ||
          (candidate.samples == agreed.samples && candidate.whole(size) < agreed.whole(size))) {
        agreed = candidate;
        column = k;
      }
    }
  }
};

ReferenceMotion reference_by_a1(const Scene& scene, double duration, int threads) {
  constexpr int levels = 5;
  constexpr std::size_t first_samples = 4;
  const int finest = finest_level(scene, duration);
  std::vector<std::unique_ptr<RunOfA1>> runs;
  for (int level = finest - levels + 1; level <= finest; ++level)
    runs.push_back(std::make_unique<RunOfA1>(scene, 1 << level));
  const auto last = static_cast<std::size_t>(std::lround(duration / scene.step));
  // Continue all levels together until the refinements agree in no column: later samples tell nothing.
  std::optional<RombergTable> table;
  std::size_t until = 0;
  do {
    until = std::min(last, std::max(first_samples, 2 * until));
    // The finest level takes half of the work, and begins first.
    parallel_for(threads, runs.size(), [&](std::size_t i, const std::stop_token&) {
      runs[runs.size() - 1 - i]->continue_to(until);
    });
    table.emplace(scene, runs);
  } while (until < last && table->agreed.samples == until);
  const std::size_t column = table->column;
  const Agreement& agreed = table->agreed;
  ReferenceMotion reference;
  reference.method = fmt::format("A1 at h/{}", 1 << finest);
  if (column > 0) reference.method = fmt::format("A1 of order {} at h/{}", column + 1, 1 << finest);
  const double step = scene.step / (1 << finest);
  reference.motion = std::move(table->row[column]);
  set_uncertainties(larger_of(differences(scene, table->before[column], reference.motion, agreed.samples),
                              unseen(scene, reference.motion, agreed.samples, step)),
                    reference);
  reference.horizon = static_cast<double>(agreed.samples) * scene.step;
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

Sampling::Sampling(double step, double interval) {
  const double steps = interval / step;
  const double samples = step / interval;
  const auto is_whole = [](double x) { return x >= 0.5 && std::abs(x - std::round(x)) < 1e-6 * x; };
  if (is_whole(steps)) {
    steps_ = static_cast<int>(std::lround(steps));
  } else if (is_whole(samples)) {
    samples_ = static_cast<int>(std::lround(samples));
  } else {
    throw Error(fmt::format(
        "step {:g} s: must be a whole part or multiple of {:g} s, the interval at which motions are "
        "compared",
        step, interval));
  }
}

double smallest_body_of(const Scene& scene) {
  double smallest = infinite;
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

MotionDifference difference(const Scene& scene, const Motion& a, const Motion& b, double horizon, int every) {
  MotionDifference result;
  double squares = 0;
  double turns = 0;
  int count = 0;
  const auto last = static_cast<std::size_t>(std::lround(horizon / b.interval));
  for (std::size_t k = every; k <= last; k += every) {
    if (k >= a.samples.size() || k >= b.samples.size()) {
      return {{infinite, infinite}, {infinite, infinite}};
    }
    const State& one = a.samples[k];
    const State& other = b.samples[k];
    for (std::size_t i = 1; i < one.q.size(); ++i) {
      if (scene.bodies[i].inverse_mass == 0) continue;
      const double d = (one.q[i].linear - other.q[i].linear).norm();
      const double turn =
          rotation_vector(Quaternion(one.q[i].angular.conjugate() * other.q[i].angular)).norm();
      squares += d * d;
      turns += turn * turn;
      result.position.largest = std::max(result.position.largest, d);
      result.orientation.largest = std::max(result.orientation.largest, turn);
      ++count;
    }
  }
  if (count == 0) return {{infinite, infinite}, {infinite, infinite}};
  result.position.rms = std::sqrt(squares / count);
  result.orientation.rms = std::sqrt(turns / count);
  return result;
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

}  // namespace substep
