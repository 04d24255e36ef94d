#include "sim/measure/validity_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "sim/error.h"
#include "sim/measure/ablation.h"
#include "sim/measure/joint_gap.h"
#include "sim/measure/measured_run.h"
#include "sim/measure/stability_limit.h"
#include "sim/measure/weight_scene.h"
#include "sim/simulation.h"

namespace substep {
namespace {

double kinetic_and_spring_energy(const State& state, double stiffness) {
  const double y = state.q[1].linear.y();
  return 0.5 * state.v[1].linear.squaredNorm() + 0.5 * stiffness * y * y;
}

Scene weight_on_a_spring(double stiffness) {
  JointLimit spring;
  spring.axes = {false, true, false};
  spring.min = spring.max = 0;
  spring.stiffness = stiffness;
  return weight_on_a_joint(0.1, spring);
}

constexpr std::array mass_ratios{1.0, 10.0, 100.0, 1000.0, 10000.0};

/// The scene with its heaviest body of `ratio` times the lightest's mass.
Scene with_mass_ratio(Scene scene, double ratio) {
  std::size_t heaviest = 0;
  double lightest = 0;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    if (body.inverse_mass == 0) continue;
    if (heaviest == 0 || body.inverse_mass < scene.bodies[heaviest].inverse_mass) heaviest = i;
    lightest = std::max(lightest, body.inverse_mass);
  }
  Body& body = scene.bodies[heaviest];
  const double factor = lightest / ratio / body.inverse_mass;
  body.inverse_mass *= factor;
  body.inverse_inertia *= factor;
  return scene;
}

}  // namespace

std::vector<MassRatioPoint> mass_ratio_map(const Scene& scene, const Settings& settings, double horizon,
                                           int most) {
  std::vector<MassRatioPoint> points;
  for (const double ratio : mass_ratios) {
    Scene scaled = with_mass_ratio(scene, ratio);
    scaled.duration = horizon;
    const ReferenceMotion reference = reference_motion(scaled, horizon);
    const double size = size_of(scaled);
    for (int n = 1; n <= most; n *= 2) {
      const Metrics metrics = measure(scaled, divided(settings, n), reference, false);
      points.push_back({ratio, n, metrics.error.position.rms / size, metrics.bounded});
    }
  }
  return points;
}

std::vector<NeededSubsteps> needed_substeps(const Scene& scene, const Settings& settings, double horizon,
                                            int most) {
  std::vector<NeededSubsteps> points;
  for (const double ratio : mass_ratios) {
    const Scene scaled = with_mass_ratio(scene, ratio);
    const ReferenceMotion reference = reference_motion(scaled, horizon);
    points.push_back({ratio, stability_limit(scaled, settings, reference, most).divisions});
  }
  return points;
}

std::vector<AvbdPoint> avbd_map(const Scene& stack, const Settings& settings) {
  std::vector<AvbdPoint> points;
  for (int decade = -3; decade <= 6; ++decade) {
    Scene scene = stack;
    scene.bodies.resize(4);  // the world's, and three boxes
    std::erase_if(scene.colliders, [](const Collider& collider) { return collider.body >= 4; });
    const double mass = std::pow(10, decade);
    for (Body& body : scene.bodies) {
      if (body.inverse_mass == 0) continue;
      body.inverse_inertia /= mass * body.inverse_mass;
      body.inverse_mass = 1 / mass;
    }
    for (int exponent = 0; exponent <= 10; ++exponent) {
      Settings one = settings;
      one.beta = std::pow(10, exponent);
      Simulation simulation(scene, one);
      AvbdPoint point{mass, one.beta, 0, false};
      for (int step = 0; step < std::lround(5 / one.step) && !point.falls; ++step) {
        point.falls = simulation.step().status == StepReport::Status::diverged;
        for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
          const Coordinates& q = simulation.state().q[i];
          point.moved = std::max(point.moved, (q.linear - scene.bodies[i].pose.position).norm());
          point.falls = point.falls || q.angular.angularDistance(scene.bodies[i].pose.orientation) > 0.5;
        }
        point.falls = point.falls || point.moved > 1;
      }
      points.push_back(point);
    }
  }
  return points;
}

std::vector<StiffnessPoint> stiffness_map(const Settings& settings) {
  std::vector<StiffnessPoint> points;
  for (const int rate : {30, 60, 120, 240, 480}) {
    for (int exponent = 0; exponent <= 8; ++exponent) {
      double stiffness = 1;
      for (int i = 0; i < exponent; ++i) stiffness *= 10;
      const Scene scene = weight_on_a_spring(stiffness);
      Settings one = settings;
      one.step = 1.0 / rate;
      Simulation simulation(scene, one);
      const double start = kinetic_and_spring_energy(simulation.state(), stiffness);
      double end = 0;
      for (int k = 0; k < rate && std::isfinite(end); ++k) {
        const bool diverged = simulation.step().status == StepReport::Status::diverged;
        end = diverged ? std::numeric_limits<double>::infinity()
                       : kinetic_and_spring_energy(simulation.state(), stiffness);
      }
      points.push_back({one.step, stiffness, end / start});
    }
  }
  return points;
}

Scene lengthened_chain(const Scene& scene, int links) {
  Scene chain = scene;
  const auto last = static_cast<int>(scene.bodies.size()) - 1;
  const auto joins_the_last_two = [&](const Joint& joint) {
    return std::min(joint.body_a, joint.body_b) == last - 1 && std::max(joint.body_a, joint.body_b) == last;
  };
  if (last < 2 || scene.joints.empty() || !joins_the_last_two(scene.joints.back())) {
    throw Error(fmt::format("scene {}: its last joint is not between its last two bodies", scene.name));
  }
  const Vector3 pitch = scene.bodies[last].pose.position - scene.bodies[last - 1].pose.position;
  for (int i = last + 1; i <= links; ++i) {
    Body body = chain.bodies.back();
    body.name = fmt::format("link {}", i);
    body.pose.position += pitch;
    chain.bodies.push_back(body);
    Joint joint = chain.joints.back();
    joint.body_a += 1;
    joint.body_b += 1;
    chain.joints.push_back(joint);
  }
  return chain;
}

std::vector<double> ablation_costs(const Scene& scene, int substeps, double horizon) {
  Settings settings;
  settings.algorithm = Algorithm::a3;
  settings.step = scene.step;
  settings.substeps = substeps;
  const MeasuredRun exact = measured_run(scene, settings, horizon);
  std::vector<double> costs;
  for (const Approximation approximation : approximations) {
    Simulation simulation(scene, settings, ablation_procedure(approximation));
    costs.push_back(position_difference(measured_run(simulation, horizon), exact));
  }
  return costs;
}

std::vector<HistoryPoint> history(const Scene& scene, const Settings& settings) {
  const Sampling sampling(settings.step, scene.step);
  Simulation simulation(scene, settings);
  PenetrationMeter meter(scene);
  const JointGapMeter joints(scene);
  const double start = energy(scene, simulation.state());
  std::vector<HistoryPoint> points;
  const auto steps = static_cast<int>(std::lround(scene.duration / settings.step));
  for (int k = 1; k <= steps; ++k) {
    if (simulation.step().status == StepReport::Status::diverged) break;
    if (k % sampling.steps_between() != 0) continue;
    const State& state = simulation.state();
    points.push_back(
        {k * settings.step, joints.gap(state), meter.depth(state), energy(scene, state) - start});
  }
  return points;
}

}  // namespace substep
