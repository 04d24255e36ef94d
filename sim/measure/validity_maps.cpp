#include "sim/measure/validity_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "sim/direct/frozen_problem.h"
#include "sim/error.h"
#include "sim/loading/file_bytes.h"
#include "sim/simulation.h"

namespace substep {
namespace {

double kinetic_and_spring_energy(const State& state, double stiffness) {
  const double y = state.q[1].linear.y();
  return 0.5 * state.v[1].linear.squaredNorm() + 0.5 * stiffness * y * y;
}

constexpr double stability_offset = 0.001;  // m

bool is_stable(const Scene& scene, Algorithm algorithm, const Stabilization& by) {
  Simulation simulation(scene, {.algorithm = algorithm, .substeps = 8, .tau = by.tau, .kappa = by.kappa});
  // Apply the row 1600 times: at 0.1 from the border in τ the amplitude changes by far more than a half.
  for (int i = 0; i < 200; ++i) {
    if (simulation.step().status == StepReport::Status::diverged) return false;
  }
  return std::abs(simulation.state().q[1].linear.y()) < stability_offset;
}

constexpr std::array mass_ratios{1.0, 10.0, 100.0, 1000.0, 10000.0};

/// Returns the scene with its heaviest body of `ratio` times the lightest's mass.
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

Scene weight_on_a_joint(double height, const std::array<bool, 3>& axes, std::optional<double> stiffness) {
  Scene scene;
  scene.name = "one weight";
  scene.gravity.setZero();
  scene.bodies.resize(2);
  scene.bodies[0].name = "world";
  Body& weight = scene.bodies[1];
  weight.name = "weight";
  weight.inverse_mass = 1;
  weight.inverse_inertia = Vector3::Constant(10);
  weight.pose.position = {0, height, 0};
  Joint& joint = scene.joints.emplace_back();
  joint.name = "joint";
  joint.body_b = 1;
  joint.limits.push_back({.axes = axes, .min = 0, .max = 0, .stiffness = stiffness});
  return scene;
}

std::vector<StabilityPoint> stability_map() {
  // Three rows, each the scalar row.
  const Scene scene = weight_on_a_joint(stability_offset, {true, true, true});
  std::vector<StabilityPoint> points;
  for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    for (int k = 0; k < 10; ++k) {
      for (int t = 0; t < 20; ++t) {
        const double kappa = 0.1 + 0.2 * k;
        const double tau = 0.1 + 0.2 * t;
        points.push_back({algorithm, tau, kappa, is_stable(scene, algorithm, {tau, kappa})});
      }
    }
  }
  return points;
}

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

StabilityLimit stability_limit(const Scene& scene, const Settings& settings, const ReferenceMotion& reference,
                               int most) {
  StabilityLimit limit;
  limit.most = most;
  std::map<int, bool> known;
  const auto is_bounded = [&](int divisions) {
    const auto found = known.find(divisions);
    if (found != known.end()) return found->second;
    ++limit.runs;
    return known[divisions] = measure(scene, divided(settings, divisions), reference, false).bounded;
  };
  // A lucky coarse run does not count: two finer ones must be bounded too.
  int high = 1;
  while (high <= most && !(is_bounded(high) && is_bounded(2 * high) && is_bounded(4 * high))) high *= 2;
  if (high > most) return limit;
  int low = high / 2;
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (is_bounded(middle) ? high : low) = middle;
  }
  limit.divisions = high;
  return limit;
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

std::vector<StiffnessPoint> stiffness_map(const Settings& settings) {
  std::vector<StiffnessPoint> points;
  for (const int rate : {30, 60, 120, 240, 480}) {
    for (int exponent = 0; exponent <= 8; ++exponent) {
      const double stiffness = std::pow(10, exponent);
      const Scene scene = weight_on_a_joint(0.1, {false, true, false}, stiffness);
      Settings one = settings;
      one.step = 1.0 / rate;
      Simulation simulation(scene, one);
      const double start = kinetic_and_spring_energy(simulation.state(), stiffness);
      double end = 0;
      for (int k = 0; k < rate && std::isfinite(end); ++k) {
        const bool diverged = simulation.step().status == StepReport::Status::diverged;
        end = diverged ? infinity : kinetic_and_spring_energy(simulation.state(), stiffness);
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
  if (last < 2 || scene.joints.empty() || !joins_the_last_two(scene.joints.back()))
    throw Error("scene {}: its last joint is not between its last two bodies", scene.name);
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

FrozenProblem load_frozen_problem(const std::filesystem::path& file) {
  constexpr std::uintmax_t largest = std::uintmax_t{1} << 28;  // bytes: 1000 contacts, dense, are 1.7e8
  return parse_frozen_problem(read_bytes(file, file.string(), largest), file.string());
}

std::vector<SweepError> sweep_errors(const FrozenProblem& problem, double tolerance) {
  constexpr int most = 4096;
  std::vector<SweepError> errors;
  std::vector<double> lambda;
  int done = 0;
  for (int sweeps = 1; sweeps <= most; sweeps *= 2) {
    sweep_rows(problem, lambda, sweeps - done);
    done = sweeps;
    errors.push_back({sweeps, cone_error(problem, lambda).natural_map});
    if (!(errors.back().error > tolerance) || !std::isfinite(errors.back().error)) break;
  }
  return errors;
}

}  // namespace substep
