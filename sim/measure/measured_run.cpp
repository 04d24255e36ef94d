#include "sim/measure/measured_run.h"

#include <algorithm>
#include <cmath>

#include "sim/measure/invariants.h"
#include "sim/measure/motion.h"

namespace substep {

MeasuredRun measured_run(Simulation& simulation, double duration) {
  MeasuredRun run;
  const Scene& scene = simulation.scene();
  const JointGapMeter joints(scene);
  const double start = energy(scene, simulation.state());
  const auto steps = static_cast<int>(std::lround(duration / simulation.settings().step));
  for (int i = 0; i < steps && !run.diverged; ++i) {
    const StepReport& report = simulation.step();
    run.diverged = report.status == StepReport::Status::diverged;
    run.largest_residual = std::max(run.largest_residual, report.residual);
    run.largest_gap = std::max(run.largest_gap, joints.gap(simulation.state()));
    run.energy_growth = std::max(run.energy_growth, energy(scene, simulation.state()) - start);
  }
  run.state = simulation.state();
  run.energy_change = energy(scene, run.state) - start;
  return run;
}

MeasuredRun measured_run(const Scene& scene, const Settings& settings, double duration) {
  Simulation simulation(scene, settings);
  return measured_run(simulation, duration);
}

double position_difference(const State& a, const State& b) {
  double largest = 0;
  for (std::size_t i = 1; i < a.q.size(); ++i)
    largest = std::max(largest, (a.q[i].linear - b.q[i].linear).norm());
  return largest;
}

double position_difference(const MeasuredRun& a, const MeasuredRun& b) {
  return a.diverged || b.diverged ? infinity : position_difference(a.state, b.state);
}

State reference_run(const Scene& scene, double duration, int divisions) {
  const auto end_at = [&](double step) {
    return measured_run(scene, {.algorithm = Algorithm::a1, .step = step}, duration).state;
  };
  const State coarse = end_at(scene.step / divisions);
  State fine = end_at(scene.step / (2 * divisions));
  for (std::size_t i = 0; i < fine.q.size(); ++i)
    fine.q[i].linear = 2 * fine.q[i].linear - coarse.q[i].linear;
  return fine;
}

double error_of(const MeasuredRun& run, const State& reference) {
  return run.diverged ? infinity : position_difference(run.state, reference);
}

}  // namespace substep
