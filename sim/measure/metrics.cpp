#include "sim/measure/metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "sim/constraints/formulate.h"
#include "sim/loading/scene_settings.h"
#include "sim/math/floating_point.h"
#include "sim/measure/invariants.h"
#include "sim/model/model.h"
#include "sim/simulation.h"

namespace substep {
namespace {

using Severity = Violation::Severity;

constexpr double bounded_error = 0.1;  // of the scene's size
constexpr double still = 0.01;  // of the smallest body's size: a reference that moves less stands still
/// Limit of joint gaps, overlaps and displacements of standing bodies, as a fraction of the smallest body's
/// size.
constexpr double bounded_violation = 0.1;
/// Joint gap that causes a warning, as a fraction of the scene's size.
constexpr double warned_gap = 0.01;
/// Limit of the energy that undriven scenes gain and unbraked joints lose, as a fraction of energy_scale().
constexpr double bounded_energy = 0.1;
/// Limit of the energy drift of free bodies, as a fraction of energy_scale().
constexpr double free_energy = 0.01;
/// Limit of the momentum drift of bodies that touch nothing fixed, as a fraction of the momentum that they
/// have with the energy energy_scale() plus the run's growth of energy.
constexpr double free_momentum = 0.01;
/// Limit of the angle by which summed rotation turns a body's momentum in A4 and A5, rad.
constexpr double warned_turn = 0.1;

/// Returns √(Σ m |Δv|² + Δω · I Δω) / √Σ m, m/s.
double velocity_distance(const Scene& scene, const State& a, const State& b) {
  double sum = 0;
  double mass = 0;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    if (body.inverse_mass == 0) continue;
    sum += (a.v[i].linear - b.v[i].linear).squaredNorm() / body.inverse_mass;
    mass += 1 / body.inverse_mass;
    const Vector3 spin = a.q[i].angular.conjugate() * (a.v[i].angular - b.v[i].angular);
    for (int axis = 0; axis < 3; ++axis) {
      if (body.inverse_inertia[axis] > 0) sum += spin[axis] * spin[axis] / body.inverse_inertia[axis];
    }
  }
  return mass > 0 ? std::sqrt(sum / mass) : 0;
}

/// Returns the settings of A1 at h/n.
Settings exact(const Settings& settings) {
  return {.algorithm = Algorithm::a1, .step = sub_step_of(settings)};
}

/// A run's metrics, and its motion at the samples.
struct Measurement {
  Metrics metrics;
  Motion motion;
};

/// Returns the samples of `motion` at the instants of one with a larger interval.
Motion thinned(const Motion& motion, double interval) {
  const auto every = static_cast<std::size_t>(std::lround(interval / motion.interval));
  Motion result{interval, {}};
  for (std::size_t k = 0; k < motion.samples.size(); k += every) result.samples.push_back(motion.samples[k]);
  return result;
}

/// Returns the difference of two runs, whose steps may differ, until the reference's horizon.
MotionDifference difference_to_horizon(const Scene& scene, const Motion& a, const Motion& b,
                                       const ReferenceMotion& reference) {
  const double interval = std::max(a.interval, b.interval);
  const double horizon = interval * std::floor(reference.horizon / interval + 1e-6);
  return difference(scene, thinned(a, interval), thinned(b, interval), horizon);
}

Motion motion_of(const Scene& scene, const Settings& settings, double interval, double horizon) {
  const Sampling sampling(settings.step, interval);
  const auto stepper = algorithm_stepper(scene, settings);
  Motion motion{interval, {stepper->state()}};
  continue_motion(*stepper, sampling.steps_between, std::lround(horizon / interval), motion);
  return motion;
}

ErrorParts parts_of(const Scene& scene, const Settings& settings, const Motion& motion,
                    const ReferenceMotion& reference) {
  const auto distance = [&](const Motion& a, const Motion& b) {
    return difference_to_horizon(scene, a, b, reference).position.rms;
  };
  if (settings.algorithm == Algorithm::a1) return {distance(motion, reference.motion), {}, {}};
  const Motion direct = motion_of(scene, exact(settings), motion.interval, reference.horizon);
  const double stepping = distance(direct, reference.motion);
  if (settings.algorithm <= Algorithm::a3 || !is_of_report(settings.algorithm))
    return {stepping, distance(motion, direct), {}};
  Settings conceptual = settings;
  conceptual.algorithm = Algorithm::a3;
  const Motion a3 = motion_of(scene, conceptual, motion.interval, reference.horizon);
  return {stepping, distance(a3, direct), distance(motion, a3)};
}

void judge_bounds(const Scene& scene, const ReferenceMotion& reference, Metrics& metrics) {
  const double size = size_of(scene);
  // Ignore the error where there is no reference.
  const bool is_near = reference.horizon == 0 || metrics.error.position.rms <= bounded_error * size;
  const double most = bounded_violation * smallest_body_of(scene);
  metrics.energy_scale = energy_scale(scene);
  const bool is_bounded = std::ranges::all_of(violations(scene, metrics), [](const Violation& violation) {
    return violation.severity == Violation::Severity::warning;
  });
  metrics.bounded =
      !metrics.diverged && is_near && is_bounded && (!stands(scene, reference) || metrics.moved <= most);
}

/// Runs the scene for its duration, and compares it with the reference. `at_sample`, where there is one,
/// receives the time and the state of each sample.
Measurement measured(const Scene& scene, Stepper& stepper, double step, const ReferenceMotion& reference,
                     const std::function<void(double, const State&)>& at_sample) {
  const Sampling sampling(step, reference.motion.interval);
  const double interval = reference.motion.interval * sampling.samples_between;
  Metrics metrics;
  Motion motion{interval, {stepper.state()}};
  Invariants invariants(scene, stepper.state());
  invariants.add(stepper.state(), 0, metrics);
  ExpectationMeter expectations(scene, stepper.state());
  const auto samples = static_cast<int>(std::lround(scene.duration / interval));
  for (int k = 1; k <= samples; ++k) {
    for (int i = 1; i <= sampling.steps_between; ++i) {
      const double time = (k - 1) * interval + i * step;
      if (!stepper.step()) {
        metrics.diverged = time;
        break;
      }
      invariants.follow(stepper.state(), step, metrics);
      const auto contacts = expectations.needs_contacts() ? stepper.contact_impulses() : std::nullopt;
      expectations.add(stepper.state(), time, contacts ? &*contacts : nullptr);
    }
    if (metrics.diverged) break;
    motion.samples.push_back(stepper.state());
    invariants.add(stepper.state(), k * interval, metrics);
    if (at_sample) at_sample(k * interval, stepper.state());
  }
  metrics.expected = expectations.figures(metrics.diverged.has_value());
  metrics.row_solves = stepper.row_solves();
  metrics.error = difference_to_horizon(scene, motion, reference.motion, reference);
  judge_bounds(scene, reference, metrics);
  return {std::move(metrics), std::move(motion)};
}

/// Returns an upper bound on the energy of correcting the initial violations, J: the weight of all bodies,
/// raised by the violations of all moving bodies in a row.
double energy_of_violations(const Scene& scene, double violation) {
  double weight = 0;
  int moving = 0;
  for (const Body& body : scene.bodies) {
    if (body.inverse_mass == 0) continue;
    weight += scene.gravity.norm() / body.inverse_mass;
    ++moving;
  }
  return weight * moving * violation;
}

/// Returns the largest momentum of all bodies together with an energy, N·s.
double momentum_scale(const Scene& scene, double energy) {
  double mass = 0;
  for (const Body& body : scene.bodies) {
    if (body.inverse_mass > 0) mass += 1 / body.inverse_mass;
  }
  return std::sqrt(2 * mass * energy);
}

}  // namespace

bool stands(const Scene& scene, const ReferenceMotion& reference) {
  if (std::ranges::any_of(scene.bodies, [](const Body& body) {
        return body.linear_velocity != Vector3::Zero() || body.angular_velocity != Vector3::Zero();
      })) {
    return false;
  }
  const auto last = static_cast<std::size_t>(std::lround(reference.horizon / reference.motion.interval));
  if (last == 0) return false;
  const double most = still * smallest_body_of(scene);
  const std::vector<State>& samples = reference.motion.samples;
  return std::ranges::all_of(
      samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(last) + 1,
      [&](const State& state) { return moved(scene, samples.front(), state) <= most; });
}

Metrics measure(const Scene& scene, Stepper& stepper, double step, const ReferenceMotion& reference) {
  const DefaultFloatingPoint environment;
  return measured(scene, stepper, step, reference, {}).metrics;
}

Metrics measure(const Scene& scene, const Settings& settings, const ReferenceMotion& reference, bool parts) {
  const DefaultFloatingPoint environment;
  const auto stepper = algorithm_stepper(scene, settings);
  if (!parts) return measured(scene, *stepper, settings.step, reference, {}).metrics;
  Settings one_substep = settings;
  one_substep.step = sub_step_of(settings);
  one_substep.substeps = 1;
  Simulation judged(scene, one_substep);
  Simulation direct(scene, exact(settings));
  SpreadMeter residual;
  const double interval = std::max(settings.step, reference.motion.interval);
  const int every = 1 + static_cast<int>(reference.horizon / interval / 60);
  int sample = 0;
  // Solve a (sub-)step of the sample's state again, as the run's algorithm does and as A1 does.
  const auto add_residual = [&](double time, const State& state) {
    if (time > reference.horizon || ++sample % every != 0) return;
    bool diverged = false;
    for (Simulation* const simulation : {&judged, &direct}) {
      simulation->set_state(state);
      diverged = diverged || simulation->step().status == StepReport::Status::diverged;
    }
    residual.add(diverged ? infinity : velocity_distance(scene, judged.state(), direct.state()));
  };
  auto [metrics, motion] = measured(scene, *stepper, settings.step, reference, add_residual);
  metrics.residual = residual.result();
  metrics.parts = parts_of(scene, settings, motion, reference);
  return metrics;
}

bool is_driven(const Scene& scene) {
  const auto is_motor = [](const JointDrive& drive) {
    return drive.acceleration || drive.velocity_target != 0;
  };
  const auto moves_by_itself = [](const Body& body) {
    return body.inverse_mass == 0 &&
           (body.linear_velocity != Vector3::Zero() || body.angular_velocity != Vector3::Zero());
  };
  return std::ranges::any_of(
             scene.joints, [&](const Joint& joint) { return std::ranges::any_of(joint.drives, is_motor); }) ||
         std::ranges::any_of(scene.bodies, moves_by_itself);
}

std::vector<Violation> violations(const Scene& scene, const Metrics& metrics) {
  std::vector<Violation> result;
  const auto check = [&result](const char* what, double value, const char* unit, double most,
                               Severity severity) {
    if (value <= most) return;
    result.push_back({fmt::format("{} {:.3g} {}, above {:.3g} {}", what, value, unit, most, unit), severity});
  };
  const double most = bounded_violation * smallest_body_of(scene);
  const double size = size_of(scene);
  const State start = initial_state(scene);
  const double gap = JointGapMeter(scene).gap(start);
  const double depth = PenetrationMeter(scene).depth(start);

  // Report the largest gap once, with its worst severity.
  if (metrics.joint_gap > gap + size) {
    check("joint gap", metrics.joint_gap, "m", gap + size, Severity::torn);
  } else if (metrics.joint_gap > gap + most) {
    check("joint gap", metrics.joint_gap, "m", gap + most, Severity::unbounded);
  } else {
    check("joint gap", metrics.joint_gap, "m", gap + warned_gap * size, Severity::warning);
  }
  check("penetration", metrics.penetration, "m", depth + most, Severity::unbounded);
  for (const std::string& passage : metrics.passages) result.push_back({passage, Severity::warning});

  const double scale = energy_scale(scene);
  const Model model = build_model(scene);
  if (!is_driven(scene)) {
    check(
        "energy growth", metrics.energy_growth, "J",
        bounded_energy * scale + energy_of_violations(scene, gap + depth) + energy_of_springs(model, start.q),
        Severity::unbounded);
    if (is_rigid(model)) {
      const bool is_free = model.locks.empty() && model.limits.empty();
      check(is_free ? "energy drift" : "energy loss",
            is_free ? std::max(metrics.energy_growth, -metrics.energy_change) : -metrics.energy_change, "J",
            (is_free ? free_energy : bounded_energy) * scale, Severity::warning);
    }
  }
  const double momentum = momentum_scale(scene, scale + metrics.energy_growth);
  check("momentum drift", metrics.momentum.value_or(0), "N·s", free_momentum * momentum, Severity::warning);
  check("angular momentum drift", metrics.angular_momentum.value_or(0), "N·m·s",
        free_momentum * momentum * size / 2, Severity::warning);
  return result;
}

std::vector<Violation> violations(const Scene& scene, const Settings& settings, const Metrics& metrics) {
  std::vector<Violation> result = violations(scene, metrics);
  if (const std::string doubt = doubt_about_substeps(scene, settings); !doubt.empty())
    result.push_back({doubt, Severity::warning});
  const bool is_summed = settings.algorithm == Algorithm::a4 || settings.algorithm == Algorithm::a5;
  if (is_summed && metrics.summed_turn > warned_turn) {
    result.push_back(
        {fmt::format("summed rotation turns a body's momentum by up to {:.2g} rad, above {:g} rad",
                     metrics.summed_turn, warned_turn),
         Severity::warning});
  }
  return result;
}

}  // namespace substep
