#include "sim/measure/stepper.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>

#include "sim/constraints/contact_finder.h"
#include "sim/constraints/formulate.h"
#include "sim/model/model.h"
#include "sim/simulation.h"

namespace substep {
namespace {

class AlgorithmStepper : public Stepper {
 public:
  AlgorithmStepper(const Scene& scene, const Settings& settings) : simulation_(scene, settings) {}

  bool step() override {
    const StepReport& report = simulation_.step();
    row_solves_ += report.row_solves;
    return report.status != StepReport::Status::diverged;
  }
  const State& state() const override { return simulation_.state(); }
  std::optional<std::vector<ContactImpulse>> contact_impulses() const override {
    return simulation_.contact_impulses();
  }
  std::int64_t row_solves() const override { return row_solves_; }

 private:
  Simulation simulation_;
  std::int64_t row_solves_ = 0;
};

class RecordedStepper : public Stepper {
 public:
  explicit RecordedStepper(std::vector<State> states) : states_(std::move(states)) {}

  bool step() override {
    if (frame_ + 1 >= states_.size()) return false;
    ++frame_;
    return true;
  }
  const State& state() const override { return states_[frame_]; }

 private:
  std::vector<State> states_;
  std::size_t frame_ = 0;
};

int steps_of(const Scene& scene, const Settings& settings) {
  return std::max(1, static_cast<int>(std::lround(scene.duration / settings.step)));
}

/// Mean time of a call, µs: the least of three batches, since an interruption only adds.
template <typename Call>
double time_of(const Call& call) {
  constexpr int batches = 3;
  constexpr int calls = 16;
  call();
  double least = infinity;
  for (int batch = 0; batch < batches; ++batch) {
    const double start = cpu_time();
    for (int i = 0; i < calls; ++i) call();
    least = std::min(least, (cpu_time() - start) / calls * 1e6);
  }
  return least;
}

/// Times s1, s2 and s4 by themselves, about as Simulation::step does them. Soft Step's s2 and s4 count once.
StageTimes stages_at(const Scene& scene, const Settings& settings, const std::vector<State>& states) {
  const Model model = build_model(scene);
  ContactFinder finder(scene, model);
  const double hs = sub_step_of(settings);
  const bool is_direct = settings.algorithm == Algorithm::a1;
  const bool is_descendant = !is_of_report(settings.algorithm);
  const Joints joints = settings.algorithm >= Algorithm::a3 ? settings.joints : Joints::rows;
  Problem problem;
  problem.model = &model;
  problem.substeps.duration = hs;
  problem.substeps.count = static_cast<int>(std::lround(settings.step / hs));
  build_blocks(problem, is_descendant ? Joints::plain : joints);
  const std::vector<Coordinates> no_coordinates;
  StageTimes sum;
  for (const State& state : states) {
    if (model.contacts) {
      sum.geometry += time_of(
          [&] { problem.contacts = &finder.find(state, settings.step, problem.substeps.count, is_direct); });
      if (!is_descendant)
        sum.formulation += time_of([&] { build_contacts(problem, is_direct ? no_coordinates : state.q); });
    }
    sum.formulation += time_of([&] { formulate(problem, state.q, hs); });
    std::vector<Coordinates> q = state.q;
    sum.coordinates += time_of([&] {
      if (settings.algorithm != Algorithm::a3) return step_coordinates(hs, state.v, q);
      for (int j = 1; j <= settings.substeps; ++j) {
        step_coordinates(hs, state.v, q);
        if (j < settings.substeps) formulate(problem, q, hs);
      }
    });
  }
  const auto count = static_cast<double>(states.size());
  return {sum.geometry / count, sum.formulation / count, 0, sum.coordinates / count};
}

}  // namespace

std::unique_ptr<Stepper> recorded_stepper(std::vector<State> states) {
  return std::make_unique<RecordedStepper>(std::move(states));
}

std::unique_ptr<Stepper> algorithm_stepper(const Scene& scene, const Settings& settings) {
  return std::make_unique<AlgorithmStepper>(scene, settings);
}

double cpu_time() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

RunTimes time_run(const Scene& scene, const Settings& settings, const MakeStepper& make, int repetitions) {
  const int steps = steps_of(scene, settings);
  std::vector<double> times;
  for (int i = 0; i < repetitions; ++i) {
    const auto stepper = make(scene, settings);
    const double start = cpu_time();
    for (int k = 0; k < steps; ++k) {
      if (!stepper->step()) break;
    }
    times.push_back(cpu_time() - start);
  }
  std::ranges::sort(times);
  return {times[times.size() / 2], times.front(), times.back(), repetitions, {}};
}

RunTimes time_run(const Scene& scene, const Settings& settings, int repetitions) {
  RunTimes times = time_run(scene, settings, algorithm_stepper, repetitions);
  constexpr int stops = 8;
  const int steps = steps_of(scene, settings);
  std::vector<State> states;
  const auto stepper = algorithm_stepper(scene, settings);
  int taken = 0;
  for (; taken < steps; ++taken) {
    if (taken % std::max(1, steps / stops) == 0) states.push_back(stepper->state());
    if (!stepper->step()) break;
  }
  times.stages = stages_at(scene, settings, states);
  const double whole = times.median / std::max(1, taken) * 1e6;
  times.stages.velocities =
      std::max(0.0, whole - times.stages.geometry - times.stages.formulation - times.stages.coordinates);
  return times;
}

}  // namespace substep
