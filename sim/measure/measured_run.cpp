#include "sim/measure/measured_run.h"

#include <algorithm>
#include <cmath>

#include "sim/math/rotation.h"
#include "sim/measure/joint_gap.h"
#include "sim/measure/motion.h"

namespace substep {
namespace {

std::vector<Vector3> centres_of(const State& state) {
  std::vector<Vector3> centres;
  for (const Coordinates& q : state.q) centres.push_back(q.linear);
  return centres;
}

double distance(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
  double largest = 0;
  for (std::size_t i = 1; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

}  // namespace

MeasuredRun measured_run(Simulation& simulation, double duration) {
  MeasuredRun run;
  const Scene& scene = simulation.scene();
  const JointGapMeter joints(scene);
  const double start = energy(scene, simulation.state());
  const auto steps = static_cast<int>(std::lround(duration / simulation.settings().step));
  for (int i = 0; i < steps && !run.diverged; ++i) {
    const StepReport& report = simulation.step();
    run.diverged = report.status == StepReport::Status::diverged;
    run.row_solves += report.row_solves;
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

double energy(const Scene& scene, const State& state) {
  double sum = 0;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    if (body.inverse_mass == 0) continue;
    const Vector3 local = state.q[i].angular.conjugate() * state.v[i].angular;
    sum += 0.5 / body.inverse_mass * state.v[i].linear.squaredNorm();
    sum -= body.gravity_factor / body.inverse_mass * scene.gravity.dot(state.q[i].linear);
    for (int axis = 0; axis < 3; ++axis) {
      if (body.inverse_inertia[axis] > 0) sum += 0.5 * local[axis] * local[axis] / body.inverse_inertia[axis];
    }
  }
  return sum;
}

Momentum momentum(const Scene& scene, const State& state, double time) {
  double mass = 0;
  Vector3 centre = Vector3::Zero();
  Momentum sum;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    if (body.inverse_mass == 0) continue;
    const double m = 1 / body.inverse_mass;
    mass += m;
    centre += m * state.q[i].linear;
    sum.linear += m * (state.v[i].linear - time * body.gravity_factor * scene.gravity);
  }
  if (mass > 0) centre /= mass;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    if (body.inverse_mass == 0) continue;
    Vector3 spin = state.q[i].angular.conjugate() * state.v[i].angular;
    for (int axis = 0; axis < 3; ++axis) {
      spin[axis] = body.inverse_inertia[axis] > 0 ? spin[axis] / body.inverse_inertia[axis] : 0;
    }
    const Vector3 arm = state.q[i].linear - centre;
    sum.angular += state.q[i].angular * spin + arm.cross(state.v[i].linear) / body.inverse_mass;
  }
  return sum;
}

double position_difference(const State& a, const State& b) {
  return distance(centres_of(a), centres_of(b));
}

double orientation_difference(const State& a, const State& b) {
  double largest = 0;
  for (std::size_t i = 1; i < a.q.size(); ++i) {
    const Quaternion turn = a.q[i].angular.conjugate() * b.q[i].angular;
    largest = std::max(largest, rotation_vector(turn).norm());
  }
  return largest;
}

double position_difference(const MeasuredRun& a, const MeasuredRun& b) {
  return a.diverged || b.diverged ? infinite : position_difference(a.state, b.state);
}

double orientation_difference(const MeasuredRun& a, const MeasuredRun& b) {
  return a.diverged || b.diverged ? infinite : orientation_difference(a.state, b.state);
}

Reference reference_run(const Scene& scene, double duration, int divisions) {
  Settings settings;
  settings.algorithm = Algorithm::a1;
  std::vector<Vector3> centres[3];
  for (int k = 0; k < 3; ++k) {
    settings.step = scene.step / (divisions << k) * 2;
    centres[k] = centres_of(measured_run(scene, settings, duration).state);
  }
  const auto extrapolated = [](const std::vector<Vector3>& coarse, const std::vector<Vector3>& fine) {
    std::vector<Vector3> result;
    for (std::size_t i = 0; i < fine.size(); ++i) result.push_back(2 * fine[i] - coarse[i]);
    return result;
  };
  Reference reference;
  reference.centres = extrapolated(centres[1], centres[2]);
  reference.uncertainty = distance(reference.centres, extrapolated(centres[0], centres[1]));
  return reference;
}

double error_of(const MeasuredRun& run, const Reference& reference) {
  return run.diverged ? infinite : distance(centres_of(run.state), reference.centres);
}

}  // namespace substep
