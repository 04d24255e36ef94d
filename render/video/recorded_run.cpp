#include "render/video/recorded_run.h"

#include <fmt/format.h>

#include <algorithm>
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

/// Reads at a kept step what takes velocities.
void read_velocities(const Scene& scene, const ReadingChoice& choice, const State& state, double& start,
                     Readings& readings) {
  if (choice.energy) {
    const double now = energy(scene, state);
    if (readings.energies.empty()) start = now;
    readings.energies.push_back(now - start);
  }
  if (choice.speeds) {
    std::vector<float>& speeds = readings.speeds.emplace_back();
    for (const Velocity& v : state.v) speeds.push_back(static_cast<float>(v.linear.norm()));
  }
}

/// Makes the run's next step, and counts its time.
template <typename Step>
decltype(auto) timed(Run& run, const Step& step) {
  const double start = cpu_time();
  decltype(auto) result = step();
  run.cpu_time += cpu_time() - start;
  run.simulated += run.panel.settings.step;
  return result;
}

}  // namespace

bool take_shots(const FrameClock& clock, int steps_per_shot, Tally& tally, const std::function<bool()>& step,
                const std::function<const State&()>& state, std::vector<std::vector<Coordinates>>& poses,
                std::int64_t& steps, const std::function<void(const State&)>& read) {
  for (const std::int64_t shot : clock.steps) {
    while (steps < shot * steps_per_shot) {
      if (tally.stop) return true;
      ++steps;
      ++tally.done;
      if (!step()) return false;
    }
    poses.push_back(state().q);
    if (read) read(state());
  }
  return true;
}

void simulate_algorithm(const Scene& scene, const FrameClock& clock, const ReadingChoice& choice, Run& run,
                        Tally& tally) {
  Simulation simulation(scene, run.panel.settings);
  double start_energy = 0;
  Metrics metrics;
  Invariants invariants(scene, simulation.state());
  invariants.add(simulation.state(), 0, metrics);
  std::int64_t steps = 0;
  const auto step = [&] {
    const StepReport& report = timed(run, [&]() -> const StepReport& { return simulation.step(); });
    run.row_solves += report.row_solves;
    if (report.status == StepReport::Status::unsolved) ++run.unsolved;
    if (report.status == StepReport::Status::diverged) return false;
    invariants.follow(simulation.state(), run.panel.settings.step, metrics);
    return true;
  };
  const auto read = [&](const State& state) {
    read_velocities(scene, choice, state, start_energy, run.readings);
    invariants.add(state, static_cast<double>(steps) * run.panel.settings.step, metrics);
    if (choice.contacts) run.readings.contacts.push_back(simulation.contact_impulses());
  };
  if (!take_shots(
          clock, 1, tally, step, [&]() -> const State& { return simulation.state(); }, run.poses, steps,
          read)) {
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

void simulate_engine(const Scene& scene, const FrameClock& clock, const ReadingChoice& choice,
                     Stepper& stepper, Run& run, Tally& tally) {
  const bool is_command = engine_of(run.panel).is_command;
  const auto step = [&] { return is_command ? stepper.step() : timed(run, [&] { return stepper.step(); }); };
  double start_energy = 0;
  std::int64_t steps = 0;
  const auto read = [&](const State& state) {
    read_velocities(scene, choice, state, start_energy, run.readings);
  };
  if (!take_shots(
          clock, 1, tally, step, [&]() -> const State& { return stepper.state(); }, run.poses, steps, read)) {
    run.diverged = static_cast<double>(steps) * run.panel.settings.step;
  }
  run.row_solves = stepper.row_solves();
}

void take_frames(const PoseLog& log, const FrameClock& clock, Run& run) {
  for (const std::int64_t shot : clock.steps) {
    const auto frame = static_cast<std::size_t>(shot);
    if (frame >= log.frames.size()) {
      if (!log.end.starts_with("diverged")) {
        throw Error(fmt::format("{}: ends at {:g} s: shorten the film with --duration",
                                run.panel.log.string(),
                                static_cast<double>(log.frames.size() - 1) * log.settings.step));
      }
      run.diverged = static_cast<double>(log.frames.size()) * log.settings.step;
      return;
    }
    if (log.frames[frame].poses.empty()) {
      throw Error(fmt::format("{}: has poses every {} frames only: the film needs frame {}",
                              run.panel.log.string(), log.full_every, frame));
    }
    run.poses.push_back(log.frames[frame].poses);
  }
}

void read_poses(const Scene& scene, const ReadingChoice& choice, Run& run) {
  State state = initial_state(scene);
  state.contacts.clear();
  Readings& readings = run.readings;
  if (choice.expected) readings.expected = expected_values(scene, *choice.expected, run.poses);
  const JointGapMeter joints(scene);
  std::unique_ptr<PenetrationMeter> meter;
  if (choice.depths || choice.deepest) meter = std::make_unique<PenetrationMeter>(scene);
  if (!choice.gap && !meter) return;
  for (const std::vector<Coordinates>& poses : run.poses) {
    state.q = poses;
    if (choice.gap) readings.gaps.push_back(joints.gap(state));
    if (!meter) continue;
    const std::vector<double> depths = meter->depths(state);
    if (choice.deepest) readings.deepest.push_back(std::ranges::max(depths));
    if (choice.depths) readings.depths.emplace_back(depths.begin(), depths.end());
  }
}

void read_speeds(const Run& run, double interval, Readings& readings) {
  for (std::size_t k = 0; k < run.poses.size(); ++k) {
    const std::size_t from = k == 0 ? 0 : k - 1;
    const std::size_t to = std::min(from + 1, run.poses.size() - 1);
    std::vector<float>& speeds = readings.speeds.emplace_back();
    for (std::size_t body = 0; body < run.poses[k].size(); ++body) {
      const double way = (run.poses[to][body].linear - run.poses[from][body].linear).norm();
      speeds.push_back(static_cast<float>(way / interval));
    }
  }
}

}  // namespace substep::render
