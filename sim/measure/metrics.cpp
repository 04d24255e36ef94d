#include "sim/measure/metrics.h"

#include <algorithm>
#include <cmath>

#include "sim/constraints/contact_finder.h"
#include "sim/constraints/formulate.h"
#include "sim/math/floating_point.h"
#include "sim/measure/invariants.h"
#include "sim/measure/measured_run.h"
#include "sim/measure/motion.h"
#include "sim/measure/violations.h"
#include "sim/model/model.h"
#include "sim/simulation.h"

namespace substep {
namespace {

constexpr double bounded_error = 0.1;  // of the scene's size
constexpr double still = 0.01;         // of the smallest body: a reference that moves by less stands

/// √(Σ m |Δv|² + Δω · I Δω) / √Σ m, m/s.
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
  Settings result;
  result.algorithm = Algorithm::a1;
  result.step = sub_step_of(settings);
  return result;
}

/// Solves single (sub-)steps of a run's states again, as the run's algorithm does and as A1 does.
class Judge {
 public:
  Judge(const Scene& scene, const Settings& settings)
      : scene_(scene), judged_(scene, single(settings)), exact_(scene, substep::exact(settings)) {}

  double distance(const State& state) {
    for (Simulation* const simulation : {&judged_, &exact_}) {
      simulation->set_state(state);
      if (simulation->step().status == StepReport::Status::diverged) return infinite;
    }
    return velocity_distance(scene_, judged_.state(), exact_.state());
  }

 private:
  /// Returns the settings of one sub-step as a step of its own.
  static Settings single(Settings settings) {
    settings.step = substep::exact(settings).step;
    settings.substeps = 1;
    return settings;
  }

  const Scene& scene_;
  Simulation judged_;
  Simulation exact_;
};

/// Collects numbers and returns their largest and their RMS.
class SpreadOf {
 public:
  void add(double value) {
    squares_ += value * value;
    result_.largest = std::max(result_.largest, value);
    ++count_;
  }
  Spread result() const {
    Spread spread = result_;
    if (count_ > 0) spread.rms = std::sqrt(squares_ / count_);
    return spread;
  }

 private:
  double squares_ = 0;
  int count_ = 0;
  Spread result_;
};

/// Steps for `duration`; `at_sample` sees the time and the state of each sample.
template <typename AtSample>
Motion sampled(const Scene& scene, Stepper& stepper, double step, double interval, double duration,
               Metrics* metrics, const AtSample& at_sample) {
  const Sampling sampling(step, interval);
  Motion motion{interval * sampling.samples_between(), {stepper.state()}};
  std::optional<Invariants> invariants;
  std::optional<ExpectationMeter> expectations;
  if (metrics) {
    invariants.emplace(scene, stepper.state());
    invariants->add(stepper.state(), 0, *metrics);
    expectations.emplace(scene, stepper.state());
  }
  const auto samples = static_cast<int>(std::lround(duration / motion.interval));
  for (int k = 1; k <= samples; ++k) {
    for (int i = 1; i <= sampling.steps_between(); ++i) {
      if (!stepper.step()) {
        if (!metrics) return motion;
        metrics->diverged = (k - 1) * motion.interval + i * step;
        metrics->expected = expectations->figures(true);
        return motion;
      }
      if (invariants) invariants->follow(stepper.state(), step, *metrics);
      if (expectations) {
        const auto contacts = expectations->needs_contacts() ? stepper.contact_impulses() : std::nullopt;
        expectations->add(stepper.state(), (k - 1) * motion.interval + i * step,
                          contacts ? &*contacts : nullptr);
      }
    }
    motion.samples.push_back(stepper.state());
    if (invariants) invariants->add(stepper.state(), k * motion.interval, *metrics);
    at_sample(k * motion.interval, stepper.state());
  }
  if (expectations) metrics->expected = expectations->figures(false);
  return motion;
}

/// Returns `reference` at the instants of `motion`.
Motion thinned(const Motion& reference, const Motion& motion) {
  const auto every = static_cast<std::size_t>(std::lround(motion.interval / reference.interval));
  if (every == 1) return reference;
  Motion result{motion.interval, {}};
  for (std::size_t k = 0; k < reference.samples.size(); k += every)
    result.samples.push_back(reference.samples[k]);
  return result;
}

double whole_horizon(const Motion& motion, const ReferenceMotion& reference) {
  return motion.interval * std::floor(reference.horizon / motion.interval + 1e-6);
}

Motion motion_of(const Scene& scene, const Settings& settings, const ReferenceMotion& reference) {
  const auto stepper = algorithm_stepper(scene, settings);
  return sampled(scene, *stepper, settings.step, reference.motion.interval, reference.horizon, nullptr,
                 [](double, const State&) {});
}

/// Returns the difference of two runs, whose steps may differ.
MotionDifference apart(const Scene& scene, const Motion& a, const Motion& b,
                       const ReferenceMotion& reference) {
  const Motion& coarse = a.interval > b.interval ? a : b;
  return difference(scene, thinned(a, coarse), thinned(b, coarse), whole_horizon(coarse, reference));
}

ErrorParts parts_of(const Scene& scene, const Settings& settings, const Motion& motion,
                    const ReferenceMotion& reference) {
  ErrorParts parts;
  const auto from_reference = [&](const Motion& run) {
    return difference(scene, run, thinned(reference.motion, run), whole_horizon(run, reference)).position.rms;
  };
  if (settings.algorithm == Algorithm::a1) {
    parts.stepping = from_reference(motion);
    return parts;
  }
  const Motion direct = motion_of(scene, exact(settings), reference);
  parts.stepping = from_reference(direct);
  if (settings.algorithm <= Algorithm::a3 || !is_of_report(settings.algorithm)) {
    parts.solver = apart(scene, motion, direct, reference).position.rms;
    return parts;
  }
  Settings conceptual = settings;
  conceptual.algorithm = Algorithm::a3;
  const Motion a3 = motion_of(scene, conceptual, reference);
  parts.solver = apart(scene, a3, direct, reference).position.rms;
  parts.model = apart(scene, motion, a3, reference).position.rms;
  return parts;
}

void judge_bounds(const Scene& scene, const ReferenceMotion& reference, Metrics& metrics) {
  const double size = size_of(scene);
  // Without a reference there is no error to judge by.
  const bool is_near = reference.horizon == 0 || metrics.error.position.rms <= bounded_error * size;
  const double most = bounded_violation * smallest_body_of(scene);
  metrics.energy_scale = energy_scale(scene);
  const bool is_bounded = std::ranges::all_of(violations(scene, metrics), [](const Violation& violation) {
    return violation.severity == Violation::Severity::warning;
  });
  metrics.bounded =
      !metrics.diverged && is_near && is_bounded && (!stands(scene, reference) || metrics.moved <= most);
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

struct PenetrationMeter::Implementation {
  explicit Implementation(const Scene& s) : model(build_model(s)), finder(s, model) {}
  Model model;
  ContactFinder finder;
};

PenetrationMeter::PenetrationMeter(const Scene& scene)
    : implementation_(std::make_unique<Implementation>(scene)) {}
PenetrationMeter::~PenetrationMeter() = default;

double PenetrationMeter::depth(const State& state) {
  return std::ranges::max(depths(state));
}

std::vector<double> PenetrationMeter::depths(const State& state) {
  std::vector<double> deepest(state.q.size(), 0);
  if (!implementation_->model.contacts) return deepest;
  for (const Contact& contact : implementation_->finder.find(state, 0, 1)) {
    const Coordinates& a = state.q[contact.a];
    const Coordinates& b = state.q[contact.b];
    const Vector3 apart = a.linear + a.angular * contact.arm_a - (b.linear + b.angular * contact.arm_b);
    const double depth = -apart.dot(b.angular * contact.normal_b);
    for (const int body : {contact.a, contact.b}) deepest[body] = std::max(deepest[body], depth);
  }
  return deepest;
}

Metrics measure(const Scene& scene, Stepper& stepper, double step, const ReferenceMotion& reference) {
  const DefaultFloatingPoint environment;
  Metrics metrics;
  const Motion motion = sampled(scene, stepper, step, reference.motion.interval, scene.duration, &metrics,
                                [](double, const State&) {});
  metrics.row_solves = stepper.row_solves();
  metrics.error =
      difference(scene, motion, thinned(reference.motion, motion), whole_horizon(motion, reference));
  judge_bounds(scene, reference, metrics);
  return metrics;
}

Metrics measure(const Scene& scene, const Settings& settings, const ReferenceMotion& reference, bool parts) {
  const DefaultFloatingPoint environment;
  Metrics metrics;
  const auto stepper = algorithm_stepper(scene, settings);
  Judge judge(scene, settings);
  SpreadOf residual;
  const double interval = std::max(settings.step, reference.motion.interval);
  const int every = 1 + static_cast<int>(reference.horizon / interval / 60);
  int sample = 0;
  const Motion motion = sampled(scene, *stepper, settings.step, reference.motion.interval, scene.duration,
                                &metrics, [&](double time, const State& state) {
                                  if (!parts || time > reference.horizon || ++sample % every != 0) return;
                                  residual.add(judge.distance(state));
                                });
  metrics.residual = residual.result();
  metrics.row_solves = stepper->row_solves();
  metrics.error =
      difference(scene, motion, thinned(reference.motion, motion), whole_horizon(motion, reference));
  if (parts) metrics.parts = parts_of(scene, settings, motion, reference);
  judge_bounds(scene, reference, metrics);
  return metrics;
}

}  // namespace substep
