#include "render/video/recorded_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/error.h"
#include "sim/measure/expectations.h"
#include "sim/measure/invariants.h"
#include "sim/measure/metrics.h"
#include "sim/measure/motion.h"
#include "sim/measure/stepper.h"
#include "sim/simulation.h"

namespace substep::render {
namespace {

constexpr double same = 1e-6;  // of a step: tolerance of sums of steps and of frames

/// Returns the clock of a run that keeps multiples of `every` steps, which are `instant` s long together.
FrameClock clock_of(const std::vector<double>& times, double instant, std::int64_t every) {
  FrameClock clock;
  const auto keep = [&](std::int64_t kept) {
    if (clock.steps.empty() || clock.steps.back() < kept * every) clock.steps.push_back(kept * every);
  };
  for (const double time : times) {
    const double exact = time / instant;
    auto before = static_cast<std::int64_t>(std::floor(exact + same));
    const double weight = exact - static_cast<double>(before);
    keep(before);
    const auto at = std::ranges::lower_bound(clock.steps, before * every) - clock.steps.begin();
    clock.positions.push_back({static_cast<std::size_t>(at), weight < same ? 0 : weight});
    if (weight >= same) keep(before + 1);
  }
  return clock;
}

bool is_exact(const FrameClock& clock) {
  return std::ranges::all_of(clock.positions,
                             [](const FrameClock::Position& position) { return position.weight == 0; });
}

std::vector<Coordinates> between(const std::vector<Coordinates>& a, const std::vector<Coordinates>& b,
                                 double weight) {
  std::vector<Coordinates> result;
  result.reserve(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    result.push_back(
        {a[i].linear + weight * (b[i].linear - a[i].linear), a[i].angular.slerp(weight, b[i].angular)});
  }
  return result;
}

std::vector<float> between(const std::vector<float>& a, const std::vector<float>& b, double weight) {
  std::vector<float> result;
  for (std::size_t i = 0; i < a.size(); ++i)
    result.push_back(std::lerp(a[i], b[i], static_cast<float>(weight)));
  return result;
}

std::vector<ContactImpulse> between(const std::vector<ContactImpulse>&, const std::vector<ContactImpulse>& b,
                                    double) {
  return b;
}

double between(double a, double b, double weight) {
  return a + weight * (b - a);
}

template <typename Value>
void spread(const FrameClock& clock, std::vector<Value>& values) {
  std::vector<Value> result;
  for (std::size_t k = 0; k < clock.frames_of(values.size()); ++k) {
    const auto& [before, weight] = clock.positions[k];
    result.push_back(weight == 0 ? values[before] : between(values[before], values[before + 1], weight));
  }
  values = std::move(result);
}

/// Returns a reader of the chosen expectation; an empty one where none is chosen.
PoseReader expected_reader(const Scene& scene, const QuantityChoice& choice) {
  return choice.expected ? reader_of(scene, *choice.expected) : PoseReader();
}

/// Keeps the poses of a step, and the quantities that need all earlier steps or velocities, where known.
void keep_state(const Scene& scene, const QuantityChoice& choice, const State& state,
                const PoseReader& expected, Run& run) {
  run.poses.push_back(state.q);
  if (expected) run.quantities.expected.push_back(expected(state.q));
  if (state.v.empty()) return;
  if (choice.energy) run.quantities.energies.push_back(energy(scene, state));
  if (choice.speeds) {
    std::vector<float>& speeds = run.quantities.speeds.emplace_back();
    for (const Velocity& v : state.v) speeds.push_back(static_cast<float>(v.linear.norm()));
  }
}

/// Adds to the run's times those of a step that began at this CPU time.
void add_times(double begun, Run& run) {
  run.cpu_time += cpu_time() - begun;
  run.simulated += run.panel.settings.step;
}

/// Computes the speeds of a run from the distances between neighbouring frames.
void read_speeds(Run& run, double interval) {
  for (std::size_t k = 0; k < run.poses.size(); ++k) {
    const std::size_t from = k == 0 ? 0 : k - 1;
    const std::size_t to = std::min(from + 1, run.poses.size() - 1);
    std::vector<float>& speeds = run.quantities.speeds.emplace_back();
    for (std::size_t body = 0; body < run.poses[k].size(); ++body) {
      const double distance = (run.poses[to][body].linear - run.poses[from][body].linear).norm();
      speeds.push_back(static_cast<float>(distance / interval));
    }
  }
}

}  // namespace

std::vector<double> frame_times(const ComparisonSettings& settings) {
  const double interval = settings.frame_interval;
  const double last = std::floor((settings.duration - settings.start) / interval + same);
  std::vector<double> times;
  for (int k = 0; k <= last; ++k) times.push_back(settings.start + k * interval);
  return times;
}

std::size_t FrameClock::frames_of(std::size_t kept) const {
  const auto is_shown = [&](const Position& position) {
    return position.before + (position.weight > 0 ? 1 : 0) < kept;
  };
  return static_cast<std::size_t>(std::ranges::partition_point(positions, is_shown) - positions.begin());
}

std::vector<FrameClock> frame_clocks(const std::vector<double>& times, double interval,
                                     const std::vector<double>& steps) {
  std::vector<FrameClock> clocks;
  for (const double step : steps) clocks.push_back(clock_of(times, step, 1));
  if (std::ranges::all_of(clocks, is_exact)) return clocks;
  const double longest = std::ranges::max(steps);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double every = std::round(longest / steps[i]);
    if (std::abs(every * steps[i] - longest) > same * longest) {
      throw Error(
          "steps of {:g} s and {:g} s: frames {:g} s apart lie between them, and the shorter step does not "
          "divide the longer: give a step that does, or one that divides the frames' interval",
          steps[i], longest, interval);
    }
    clocks[i] = clock_of(times, longest, static_cast<std::int64_t>(every));
  }
  return clocks;
}

bool keep_steps(const FrameClock& clock, int parts, Tally& tally, std::int64_t& steps,
                const std::function<bool()>& step, const std::function<void()>& keep) {
  for (const std::int64_t kept : clock.steps) {
    while (steps < kept * parts) {
      if (tally.stop) return true;
      ++steps;
      ++tally.done;
      if (!step()) return false;
    }
    keep();
  }
  return true;
}

void simulate_algorithm(const Scene& scene, const FrameClock& clock, const QuantityChoice& choice, Run& run,
                        Tally& tally) {
  Simulation simulation(scene, run.panel.settings);
  const State& state = simulation.state();
  Metrics metrics;
  Invariants invariants(scene, state);
  invariants.add(state, 0, metrics);
  const PoseReader expected = expected_reader(scene, choice);
  std::int64_t steps = 0;
  const auto step = [&] {
    const double begun = cpu_time();
    const StepReport& report = simulation.step();
    add_times(begun, run);
    run.row_solves += report.row_solves;
    if (report.status == StepReport::Status::unsolved) ++run.unsolved;
    if (report.status == StepReport::Status::diverged) return false;
    invariants.follow(state, run.panel.settings.step, metrics);
    if (expected) expected(state.q);
    return true;
  };
  const auto keep = [&] {
    keep_state(scene, choice, state, expected, run);
    invariants.add(state, static_cast<double>(steps) * run.panel.settings.step, metrics);
    if (choice.contacts) run.quantities.contacts.push_back(simulation.contact_impulses());
  };
  if (!keep_steps(clock, 1, tally, steps, step, keep)) {
    run.diverged = static_cast<double>(steps) * run.panel.settings.step;
    return;
  }
  run.violations = violations(scene, run.panel.settings, metrics);
}

std::unique_ptr<Stepper> engine_stepper(const Scene& scene, double duration, Run& run) {
  try {
    Scene filmed = scene;
    filmed.duration = duration;
    return engine_of(run.panel).make(filmed, run.panel.settings);
  } catch (const Error& error) {
    run.refusal = fmt::format("not simulated: {}", error.what());
    run.poses.push_back(initial_state(scene).q);
    return nullptr;
  }
}

void simulate_engine(const Scene& scene, const FrameClock& clock, const QuantityChoice& choice,
                     Stepper& stepper, Run& run, Tally& tally) {
  const bool is_command = engine_of(run.panel).is_command;
  const PoseReader expected = expected_reader(scene, choice);
  const auto step = [&] {
    const double begun = cpu_time();
    const bool continues = stepper.step();
    if (!is_command) add_times(begun, run);
    if (continues && expected) expected(stepper.state().q);
    return continues;
  };
  std::int64_t steps = 0;
  if (!keep_steps(clock, 1, tally, steps, step,
                  [&] { keep_state(scene, choice, stepper.state(), expected, run); })) {
    run.diverged = static_cast<double>(steps) * run.panel.settings.step;
  }
  run.row_solves = stepper.row_solves();
}

void take_frames(const Scene& scene, const PoseLog& log, const FrameClock& clock,
                 const QuantityChoice& choice, Run& run) {
  const PoseReader expected = expected_reader(scene, choice);
  std::size_t next = 0;
  for (const std::int64_t kept : clock.steps) {
    const auto frame = static_cast<std::size_t>(kept);
    if (frame >= log.frames.size()) {
      if (!log.end.starts_with("diverged")) {
        throw Error("{}: ends at {:g} s: shorten the film with --duration", run.panel.log.string(),
                    static_cast<double>(log.frames.size() - 1) * log.settings.step);
      }
      run.diverged = static_cast<double>(log.frames.size()) * log.settings.step;
      return;
    }
    if (log.frames[frame].poses.empty()) {
      throw Error("{}: has poses every {} frames only: the film needs frame {}", run.panel.log.string(),
                  log.full_every, frame);
    }
    for (; expected && next < frame; ++next) {
      if (!log.frames[next].poses.empty()) expected(log.frames[next].poses);
    }
    State state;
    state.q = log.frames[frame].poses;
    state.v = log.frames[frame].velocities;
    keep_state(scene, choice, state, expected, run);
  }
}

void read_poses(const Scene& scene, const QuantityChoice& choice, Run& run) {
  State state = initial_state(scene);
  state.contacts.clear();
  FrameQuantities& quantities = run.quantities;
  const double start = energy(scene, state);
  for (double& value : quantities.energies) value -= start;
  const JointGapMeter joints(scene);
  std::unique_ptr<PenetrationMeter> meter;
  if (choice.depths || choice.deepest) meter = std::make_unique<PenetrationMeter>(scene);
  if (!choice.gap && !meter) return;
  for (const std::vector<Coordinates>& poses : run.poses) {
    state.q = poses;
    if (choice.gap) quantities.gaps.push_back(joints.gap(state));
    if (!meter) continue;
    const std::vector<double> depths = meter->depths(state);
    if (choice.deepest) quantities.deepest.push_back(std::ranges::max(depths));
    if (choice.depths) quantities.depths.emplace_back(depths.begin(), depths.end());
  }
}

void spread(const FrameClock& clock, double interval, const QuantityChoice& choice, Run& run) {
  FrameQuantities& quantities = run.quantities;
  spread(clock, run.poses);
  for (auto* const series :
       {&run.errors, &quantities.gaps, &quantities.energies, &quantities.deepest, &quantities.expected})
    spread(clock, *series);
  spread(clock, quantities.depths);
  spread(clock, quantities.speeds);
  spread(clock, quantities.contacts);
  if (choice.speeds && quantities.speeds.empty()) read_speeds(run, interval);
  double squares = 0;
  for (const double error : run.errors) squares += error * error;
  run.rms_error = run.errors.empty() ? 0 : std::sqrt(squares / static_cast<double>(run.errors.size()));
}

void spread(const FrameClock& clock, ReferenceRun& reference) {
  reference.known = clock.frames_of(reference.known);
  spread(clock, reference.poses);
  spread(clock, reference.uncertainty);
}

}  // namespace substep::render
