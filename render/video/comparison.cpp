#include "render/video/comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <stop_token>

#include "render/video/frame_clock.h"
#include "sim/error.h"
#include "sim/execution/parallel_for.h"
#include "sim/log/pose_table.h"
#include "sim/measure/expectations.h"
#include "sim/measure/invariants.h"
#include "sim/measure/joint_gap.h"
#include "sim/measure/measured_run.h"
#include "sim/measure/metrics.h"
#include "sim/measure/motion.h"
#include "sim/measure/reference_integrator.h"
#include "sim/measure/stage_times.h"
#include "sim/simulation.h"
#include "sim/study/engines/engines.h"

namespace substep::render {
namespace {

/// Work that goes on beside other work.
struct Tally {
  std::atomic<std::int64_t> done{0};
  std::atomic<bool> stop{false};
};

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

/// Reads at all kept steps what follows from the poses alone.
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

/// Speeds of a run of which the poses alone are known: by the way since the frame before.
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

/// Makes the clock's steps and keeps their poses. Returns false where `step` says that there is no more.
bool take_shots(const FrameClock& clock, int steps_per_shot, Tally& tally, const std::function<bool()>& step,
                const std::function<const State&()>& state, std::vector<std::vector<Coordinates>>& poses,
                std::int64_t& steps, const std::function<void(const State&)>& read = {}) {
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

/// Makes the run's next step, and counts its time.
template <typename Step>
decltype(auto) timed(Run& run, const Step& step) {
  const double start = cpu_time();
  decltype(auto) result = step();
  run.cpu_time += cpu_time() - start;
  run.simulated += run.panel.settings.step;
  return result;
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

/// Returns the stepper of a panel's engine, which is run as far as the film goes where it is a command.
/// Nothing where it cannot do the scene, which the run then says.
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

/// One of the two runs that are the reference.
struct ReferenceAttempt {
  std::vector<std::vector<Coordinates>> poses;
  std::optional<double> ended;     ///< when it could not go on, s
  std::optional<double> unsolved;  ///< when a step was not solved first, s
  int unsolved_steps = 0;
};

nlohmann::json to_json(const ReferenceAttempt& attempt) {
  nlohmann::json poses = nlohmann::json::array();
  for (const std::vector<Coordinates>& frame : attempt.poses) poses.push_back(substep::to_json(frame));
  return {{"poses", std::move(poses)},
          {"ended", attempt.ended.value_or(-1)},
          {"unsolved", attempt.unsolved.value_or(-1)},
          {"unsolved steps", attempt.unsolved_steps}};
}

ReferenceAttempt attempt_in(const nlohmann::json& json) {
  ReferenceAttempt attempt;
  for (const nlohmann::json& frame : json.at("poses")) attempt.poses.push_back(coordinates_in(frame));
  const auto time = [&](const char* name) {
    const auto seconds = json.at(name).get<double>();
    return seconds < 0 ? std::nullopt : std::optional(seconds);
  };
  attempt.ended = time("ended");
  attempt.unsolved = time("unsolved");
  json.at("unsolved steps").get_to(attempt.unsolved_steps);
  return attempt;
}

/// Mean of squared_distance over the bodies that move.
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

/// Whether two refinements agree so well that smaller steps would show nothing new.
bool is_settled(const Scene& scene, const std::vector<Coordinates>& one,
                const std::vector<Coordinates>& other) {
  constexpr double settled = 1e-9;  // of the scene's size
  const double most = settled * size_of(scene);
  return mean_squared_distance(scene, one, other) <= most * most;
}

/// Simulates a run of the reference. A1 stops where a frame is not `like` the other run's.
void simulate_reference(const Scene& scene, const FrameClock& clock, double step, int divisions,
                        bool is_smooth, ReferenceAttempt& attempt, Tally& tally,
                        const ReferenceAttempt* like = nullptr) {
  std::int64_t steps = 0;
  bool goes_on = true;
  if (is_smooth) {
    const std::unique_ptr<Stepper> stepper = reference_stepper(scene, step / divisions, 8);
    goes_on = take_shots(
        clock, divisions, tally, [&] { return stepper->step(); },
        [&]() -> const State& { return stepper->state(); }, attempt.poses, steps);
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
    goes_on = take_shots(
        clock, divisions, tally, advance, [&]() -> const State& { return simulation.state(); }, attempt.poses,
        steps);
  }
  if (!goes_on) attempt.ended = static_cast<double>(steps) * step / divisions;
}

bool has_smooth_reference(const Scene& scene, double step) {
  try {
    reference_stepper(scene, step, 8);
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// What the two runs say together: until when the finer is a reference.
ReferenceRun reference_of(const Scene& scene, const ReferenceAttempt& coarse, ReferenceAttempt fine,
                          const std::vector<double>& times, const std::string& method) {
  ReferenceRun reference;
  reference.method = method;
  reference.poses = std::move(fine.poses);
  const std::size_t both = std::min(reference.poses.size(), coarse.poses.size());
  const double most = parted * size_of(scene);
  while (reference.known < both) {
    const std::size_t k = reference.known;
    const double apart = std::sqrt(mean_squared_distance(scene, coarse.poses[k], reference.poses[k]));
    // Written so that a NaN has parted.
    if (!(apart <= most)) break;
    if (fine.unsolved && times[k] + 1e-9 >= *fine.unsolved) break;
    reference.uncertainty.push_back(apart);
    ++reference.known;
  }
  if (reference.known == times.size()) return reference;
  // That all begin alike is no measurement.
  if (reference.known == 1) {
    reference.known = 0;
    reference.uncertainty.clear();
  }
  const std::size_t first =
      reference.known == 0 ? std::min<std::size_t>(1, times.size() - 1) : reference.known;
  if (first < both && fine.unsolved && times[first] + 1e-9 >= *fine.unsolved) {
    reference.fate =
        fmt::format("{} steps not solved, the first at {:.2f} s", fine.unsolved_steps, *fine.unsolved);
  } else if (first < both) {
    reference.fate = fmt::format("its refinements diverge at {:.2f} s", times[first]);
  } else {
    reference.fate = fmt::format("fails at {:.2f} s", fine.ended.value_or(coarse.ended.value_or(0)));
  }
  return reference;
}

std::string step_words(double step) {
  return fmt::format("h=1/{:g}", std::round(1 / step * 1e6) / 1e6);
}

double root_mean_square(const std::vector<double>& values) {
  double squares = 0;
  for (const double value : values) squares += value * value;
  return values.empty() ? 0 : std::sqrt(squares / static_cast<double>(values.size()));
}

void check(const ComparisonSettings& settings) {
  if (!(settings.duration >= 0 && settings.duration <= 3600)) {
    throw Error(fmt::format("duration {} s: a video can have from 0 to 3600", settings.duration));
  }
  if (!(settings.start >= 0 && settings.start <= settings.duration)) {
    throw Error(
        fmt::format("start {} s: must be from 0 to the duration, {} s", settings.start, settings.duration));
  }
  if ((settings.duration - settings.start) / settings.frame_interval > 200000) {
    throw Error("the film has more than 200000 frames: shorten it with --duration, or show it less slowly");
  }
  if (!(settings.reference_substeps >= 2 && settings.reference_substeps <= 10000)) {
    throw Error(fmt::format("reference sub-steps {}: must be from 2 to 10000", settings.reference_substeps));
  }
  if (settings.panels.empty()) throw Error("a film needs at least one panel");
  constexpr std::size_t most = 64;
  if (settings.panels.size() > most) throw Error(fmt::format("a film has at most {} panels", most));
  for (const PanelChoice& panel : settings.panels) {
    if (panel.kind == PanelChoice::Kind::reference && !settings.has_reference) {
      throw Error("a panel shows the reference, and there is none");
    }
  }
}

/// The panels' runs, before they are made, and the logs of those that are finished, by panel. A log has its
/// own settings.
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

using Job = std::function<void()>;

/// Runs the jobs on threads, in their order. Throws the first failure in that order.
void run_jobs(const std::vector<Job>& jobs, int threads, Tally& tally, std::int64_t total,
              const std::function<void(double)>& progress) {
  parallel_for(
      threads, jobs.size(),
      [&](std::size_t i, const std::stop_token& stop) {
        const std::stop_callback end_all(stop, [&] { tally.stop = true; });
        jobs[i]();
      },
      [&] {
        if (!progress) return;
        progress(total > 0 ? std::min(1.0, static_cast<double>(tally.done) / static_cast<double>(total)) : 1);
      });
}

}  // namespace

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

std::optional<Departure> departure_of(const Scene& scene, const Comparison& comparison, const Run& run) {
  if (!comparison.reference || run.is_reference()) return std::nullopt;
  const double most = away * size_of(scene);
  const std::size_t frames = std::min(run.poses.size(), comparison.reference->known);
  for (std::size_t k = 0; k < frames; ++k) {
    Departure farthest{k};
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
  run.rms_error = root_mean_square(run.errors);
}

namespace {

/// Chooses what strips show: errors where they are known for half of the film, else what tells most to its
/// end.
void choose_strip(const Scene& scene, std::size_t kept, Comparison& comparison, ReadingChoice& readings) {
  if (!comparison.reference) return;
  comparison.strip = Strip::error;
  if (2 * comparison.reference->known >= kept) return;
  if (const Expectation* const expectation = expectation_of_poses(scene)) {
    comparison.strip = Strip::expected;
    readings.expected = expectation;
  } else if (!JointGapMeter(scene).is_empty()) {
    comparison.strip = Strip::gap;
    readings.gap = true;
  } else {
    comparison.strip = Strip::depth;
    readings.deepest = true;
  }
}

/// Turns what was kept at steps into what is shown at frames.
void spread(const FrameClock& clock, double interval, const ReadingChoice& choice, Run& run) {
  if (!run.refusal.empty()) return;
  spread(clock, run.poses);
  spread(clock, run.errors);
  for (auto* const series :
       {&run.readings.gaps, &run.readings.energies, &run.readings.deepest, &run.readings.expected})
    spread(clock, *series);
  spread(clock, run.readings.depths);
  spread(clock, run.readings.speeds);
  spread(clock, run.readings.contacts);
  if (choice.speeds && run.readings.speeds.empty()) read_speeds(run, interval, run.readings);
  run.rms_error = root_mean_square(run.errors);
}

std::vector<double> steps_of(const ComparisonSettings& settings, const std::vector<Run>& runs) {
  std::vector<double> steps{settings.step};
  for (const Run& run : runs) steps.push_back(run.panel.settings.step);
  return steps;
}

/// The data that a comparison needs while it is simulated.
struct Work {
  const Scene& scene;
  const ComparisonSettings& settings;
  std::vector<PoseLog> logs{};
  std::vector<FrameClock> clocks{};  ///< the reference's, then the runs'
  Tally tally{};
  ReferenceAttempt fine{};
  ReferenceAttempt coarse{};
  bool is_smooth = false;
  int substeps = 0;  ///< of the reference; 0: not known yet
};

/// Simulates one run of the reference, or takes it from the cache. One that is cut where it is not `like`
/// another is not kept.
void simulate_attempt(Work& work, int parts, ReferenceAttempt& attempt,
                      const ReferenceAttempt* like = nullptr) {
  const FrameClock& clock = work.clocks[0];
  const std::string key = fmt::format("film {:016x} {} {} {} {}", work.scene.hash, work.settings.step, parts,
                                      work.is_smooth, fmt::join(clock.steps, " "));
  if (const auto kept = work.settings.cache.find(key)) {
    attempt = attempt_in(*kept);
    return;
  }
  attempt = {};
  simulate_reference(work.scene, clock, work.settings.step, parts, work.is_smooth, attempt, work.tally, like);
  if (!work.tally.stop && !(like && attempt.ended)) work.settings.cache.keep(key, to_json(attempt));
}

/// Takes an eighth and a fourth of the sub-steps for the reference where these two agree in every frame, as
/// they do where nothing moves.
void settle_reference(Work& work) {
  const int eighth = work.settings.reference_substeps / 8;
  if (work.is_smooth || eighth < 1 || work.settings.reference_substeps % 8 != 0) return;
  const auto is_whole = [&](const ReferenceAttempt& attempt) {
    return !attempt.ended && !attempt.unsolved && attempt.poses.size() == work.clocks[0].steps.size();
  };
  simulate_attempt(work, eighth, work.coarse);
  if (!is_whole(work.coarse)) return;
  simulate_attempt(work, 2 * eighth, work.fine, &work.coarse);
  if (!is_whole(work.fine)) return;
  for (std::size_t k = 0; k < work.fine.poses.size(); ++k) {
    if (!is_settled(work.scene, work.fine.poses[k], work.coarse.poses[k])) return;
  }
  work.substeps = 2 * eighth;
}

/// Simulates the reference and all runs, as far as they go.
void simulate_all(Work& work, std::vector<Run>& runs, const std::function<void(double)>& progress) {
  const auto& [scene, settings, logs, clocks, t, f, c, smooth, substeps] = work;
  std::vector<Job> jobs;
  std::int64_t total = 0;
  if (settings.has_reference) {
    // A fourth of these steps is enough where the first two runs agree.
    total += clocks[0].steps.back() * (settings.reference_substeps + settings.reference_substeps / 2);
    jobs.emplace_back([&work] { settle_reference(work); });
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    Run& run = runs[i];
    const FrameClock& own = clocks[i + 1];
    if (run.is_reference()) continue;
    if (run.panel.kind == PanelChoice::Kind::log) {
      take_frames(logs[i], own, run);
      continue;
    }
    if (run.panel.kind == PanelChoice::Kind::engine) {
      std::shared_ptr<Stepper> stepper = engine_stepper(scene, settings.duration, run);
      if (!stepper) continue;
      jobs.emplace_back([&work, &own, &run, stepper] {
        simulate_engine(work.scene, own, work.settings.readings, *stepper, run, work.tally);
      });
    } else {
      jobs.emplace_back([&work, &own, &run] {
        simulate_algorithm(work.scene, own, work.settings.readings, run, work.tally);
      });
    }
    total += own.steps.back();
  }
  if (!jobs.empty()) run_jobs(jobs, settings.threads, work.tally, total, progress);
  if (!settings.has_reference || substeps > 0) return;
  work.substeps = settings.reference_substeps;
  // The longer one begins first.
  const std::vector<Job> runs_of_reference{
      [&work] { simulate_attempt(work, work.substeps, work.fine); },
      [&work] { simulate_attempt(work, work.substeps / 2, work.coarse); }};
  run_jobs(runs_of_reference, settings.threads, work.tally, total, progress);
}

}  // namespace

Comparison simulate_comparison(const Scene& scene, const ComparisonSettings& settings,
                               const std::function<void(double)>& progress) {
  check(settings);
  Comparison comparison;
  Work work{scene, settings};
  comparison.runs = runs_of(scene, settings, work.logs);
  const FrameTimes frames{settings.start, settings.duration, settings.frame_interval};
  comparison.times = frames.times();
  work.clocks = frame_clocks(frames, steps_of(settings, comparison.runs));
  work.is_smooth = settings.has_reference && has_smooth_reference(scene, settings.step);
  simulate_all(work, comparison.runs, progress);

  const FrameClock& clock = work.clocks.front();
  if (settings.has_reference) {
    const std::string method = fmt::format("{}, {}", work.is_smooth ? "own, order 8" : "A1 itself",
                                           step_words(settings.step / work.substeps));
    std::vector<double> times;
    for (const std::int64_t step : clock.steps) times.push_back(static_cast<double>(step) * settings.step);
    comparison.reference = reference_of(scene, work.coarse, std::move(work.fine), times, method);
    comparison.reference->is_a1 = !work.is_smooth;
  }
  ReadingChoice readings = settings.readings;
  choose_strip(scene, clock.steps.size(), comparison, readings);
  comparison.expected = readings.expected;
  std::vector<Job> jobs;
  for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
    Run& run = comparison.runs[i];
    if (run.is_reference() || !run.refusal.empty()) continue;
    jobs.emplace_back([&, own = &work.clocks[i + 1], to = &run] {
      if (comparison.reference) measure_from(scene, *comparison.reference, *to);
      read_poses(scene, readings, *to);
      spread(*own, settings.frame_interval, readings, *to);
    });
  }
  run_jobs(jobs, settings.threads, work.tally, 0, {});
  if (comparison.reference) {
    ReferenceRun& reference = *comparison.reference;
    reference.known = clock.frames_of(reference.known);
    spread(clock, reference.poses);
    spread(clock, reference.uncertainty);
    for (Run& run : comparison.runs) {
      if (run.is_reference()) run.poses = reference.poses;
    }
  }
  return comparison;
}

}  // namespace substep::render
