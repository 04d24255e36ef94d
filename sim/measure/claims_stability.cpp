/// Claims of fixed points and of stability: 11, 12, 15, 17 and 18.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sim/algorithms.h"
#include "sim/error.h"
#include "sim/math/rotation.h"
#include "sim/measure/claims_measurement.h"
#include "sim/measure/motion.h"
#include "sim/measure/substep_map.h"
#include "sim/measure/validity_maps.h"

namespace substep::claims {
namespace {

constexpr std::array algorithms{Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5};

/// Numbers of sub-steps of the runs whose fastest turns are measured.
constexpr std::array turn_substeps{4, 16, 64};

/// Returns the fastest rotation (rad/s) in 2 s of A3 with single rows, τ = m = 1, for each of turn_substeps.
std::vector<double> fastest_turns(const Scene& scene, double kappa) {
  std::vector<double> turns;
  for (const int n : turn_substeps) {
    Settings settings = settings_of(scene, Algorithm::a3, n, 1, Joints::rows);
    settings.kappa = kappa;
    Simulation simulation(scene, settings);
    double fastest = 0;
    for (int i = 0; i < 120; ++i) {
      if (simulation.step().status == StepReport::Status::diverged) fastest = infinity;
      for (const Velocity& v : simulation.state().v) fastest = std::max(fastest, v.angular.norm());
    }
    turns.push_back(fastest);
  }
  return turns;
}

/// A scene of claim 17, by which contacts are judged.
struct ContactScene {
  const char* name;
  bool from_reference;  ///< the cost is a distance from A1, else a displacement from the start
  double duration;      ///< s
};

/// Returns the positions from which the cost of a scene's contacts counts: those of A1 after each step of the
/// scene, in eight steps of its own, or the start alone.
Motion compared_path(const Scene& scene, const ContactScene& x) {
  constexpr int divisions = 8;
  const auto a1 = algorithm_stepper(scene, {.algorithm = Algorithm::a1, .step = scene.step / divisions});
  Motion path{scene.step, {a1->state()}};
  if (x.from_reference) continue_motion(*a1, divisions, std::lround(x.duration / scene.step), path);
  return path;
}

/// Returns the largest distance of a body from its position in `path` after any step, m.
double contact_cost(const Scene& scene, double duration, const Motion& path, Settings settings) {
  settings.step = scene.step;
  Simulation simulation(scene, settings);
  double largest = 0;
  const auto steps = static_cast<std::size_t>(std::lround(duration / scene.step));
  for (std::size_t k = 1; k <= steps; ++k) {
    if (simulation.step().status == StepReport::Status::diverged) return infinity;
    const State& from = path.samples[std::min(k, path.samples.size() - 1)];
    largest = std::max(largest, position_difference(simulation.state(), from));
  }
  return largest;
}

/// A pendulum at rest, by 0.01 rad out of the vertical.
struct SmallSwing {
  explicit SmallSwing(const Scene& pendulum) : scene(pendulum), body(pendulum.joints.front().body_a) {
    Body& rod = scene.bodies[body];
    const Vector3 anchor = rod.pose * scene.joints.front().frame_a.position;
    const Vector3 arm = rod.pose.position - anchor;
    const double moment = 1 / rod.inverse_inertia.z() + arm.squaredNorm() / rod.inverse_mass;
    squared_frequency = scene.gravity.norm() * arm.norm() / (rod.inverse_mass * moment);
    const Quaternion down = shortest_rotation(arm.normalized(), scene.gravity.normalized());
    hanging = compose(down, rod.pose.orientation);
    const Quaternion turn = compose(rotation_quaternion({0, 0, 0.01}), down);
    rod.pose = {anchor + turn * arm, compose(turn, rod.pose.orientation)};
  }

  /// Returns the rate at which the swing grows in ten periods, 1/s.
  double growth(const Settings& settings) const {
    const double frequency = std::sqrt(squared_frequency);
    const auto period = static_cast<int>(std::lround(2 * std::numbers::pi / (frequency * settings.step)));
    Simulation simulation(scene, settings);
    std::array<double, 11> squares{};  // of the amplitude, summed over each period
    for (double& sum : squares) {
      for (int i = 0; i < period; ++i) {
        simulation.step();
        const Quaternion turned = hanging.conjugate() * simulation.state().q[body].angular;
        sum += simulation.state().v[body].angular.squaredNorm() +
               squared_frequency * rotation_vector(turned).squaredNorm();
      }
    }
    return std::log(squares.back() / squares.front()) / (20 * period * settings.step);
  }

  Scene scene;
  int body;
  Quaternion hanging;
  double squared_frequency;  ///< of small swings, rad²/s²
};

}  // namespace

Claim claim11(Measurement& measurement) {
  Claim claim{
      11, "IV.2.2", "τ, κ are not PSOR's ω: micro-iteration goes to J v = (τ/κ) β, PSOR to J v = β",
      "Largest residual after 4000 sweeps on a disturbed rod_chain, β = 0.25, τ = 0.5, κ = 0.8; stability "
      "of one row over τ and κ against the closed form"};
  Scene out_of_place = disturbed(measurement.scene("rod_chain"), 3, 0.2);
  out_of_place.gravity.setZero();
  constexpr double beta = 0.25;
  constexpr double tau = 0.5;
  constexpr double kappa = 0.8;
  const auto residual = [&](const auto& solve_block, Joints joints, double expected) {
    Formulated at(out_of_place, joints, 0.01);
    Constraints& c = at.problem.c;
    for (Row& row : c.rows) row.beta = beta;
    std::vector<Velocity> v = at.local_velocities();
    for (int i = 0; i < 4000; ++i) {
      for (const Block& x : c.blocks) apply(c, x, solve_block(c, x, v), v);
    }
    double largest = 0;
    for (const Block& x : c.blocks) {
      for (int k = 0; k < x.rows; ++k) {
        const double velocity = row_velocity(c.rows[x.first + k], v[x.a], v[x.b]);
        largest = std::max(largest, std::abs(velocity - expected));
      }
    }
    return largest;
  };
  const auto micro = [&](Constraints& c, const Block& x, const std::vector<Velocity>& v) {
    return solve(c, x, {.tau = tau, .kappa = kappa}, v);
  };
  const auto relaxed = [&](Constraints& c, const Block& x, const std::vector<Velocity>& v) {
    return Impulse{solve_relaxed(c, x, kappa, v)};
  };
  const double to_ratio = residual(micro, Joints::plain, tau / kappa * beta);
  const double to_beta = residual(micro, Joints::plain, beta);
  const double psor = residual(relaxed, Joints::rows, beta);
  claim.add("micro-iteration, from (τ/κ) β", {to_ratio}, "m/s");
  claim.add("micro-iteration, from β", {to_beta}, "m/s");
  claim.add("PSOR with ω = 0.8, from β", {psor}, "m/s");
  const std::vector<StabilityPoint> points = stability_map();
  const auto wrong = std::ranges::count_if(
      points, [](const StabilityPoint& p) { return p.converges != (p.tau < stability_border(p.kappa)); });
  claim.add("points of the stability map", {static_cast<double>(points.size())});
  claim.add("points on the wrong side of τ = 4 − 2κ", {static_cast<double>(wrong)});
  claim.cases = {{"the fixed point of τ, κ", to_ratio < 1e-9 && to_beta > 0.01},
                 {"the fixed point of ω", psor < 1e-9},
                 {"the stability map", wrong == 0}};
  return claim;
}

Claim claim12(Measurement& measurement) {
  const Scene& wheel = measurement.scene("powered_wheel");
  const auto driven =
      std::ranges::find_if(wheel.joints, [](const Joint& joint) { return !joint.drives.empty(); });
  if (driven == wheel.joints.end()) throw Error("{}: no joint has a drive", wheel.file.string());
  const JointDrive& drive = driven->drives.front();
  Claim claim{12, "IV.3.1.4", "A velocity-level row must undo the update rule",
              "Speed of the motor of powered_wheel with n = m = 4 and plain blocks"};
  claim.measured += fmt::format(" at {:g} s, target {:g} rad/s", horizon, drive.velocity_target);
  const auto speed = [&](const Settings& settings, const Procedure& procedure) {
    Simulation simulation(wheel, settings, procedure);
    const State state = measured_run(simulation, horizon).state;
    const Vector3 axis_in_a = driven->frame_a.orientation * Vector3::Unit(drive.axis);
    const Vector3 axis = state.q[driven->body_a].angular * axis_in_a;
    return axis.dot(state.v[driven->body_b].angular - state.v[driven->body_a].angular);
  };
  // Let the motor's bias follow the update rule.
  const auto without_undoing = [](const Procedure& procedure) {
    return [procedure](CoordinateVector& q, VelocityVector& v, const Settings& settings, Problem& problem,
                       Work& work) {
      for (Block& x : problem.c.blocks) {
        if (x.kind == Block::Kind::drive) x.positional_bias_fraction = 1;
      }
      procedure(q, v, settings, problem, work);
    };
  };
  const auto off = [&](double value) { return std::abs(value - drive.velocity_target); };
  for (const Algorithm algorithm : algorithms) {
    const double rate = speed(settings_of(wheel, algorithm, 4, 4), Procedure{});
    claim.add(std::string(title_of(algorithm)), {rate}, "rad/s");
    claim.require(fmt::format("{} within 2 % of the target", title_of(algorithm)),
                  off(rate) < 0.02 * drive.velocity_target);
  }
  for (const auto& [algorithm, procedure] : {std::pair{Algorithm::a4, &proc4}, {Algorithm::a5, &proc5}}) {
    const double rate = speed(settings_of(wheel, algorithm, 4, 4), without_undoing(procedure));
    claim.add(fmt::format("{}, not undone", title_of(algorithm)), {rate}, "rad/s");
    claim.require(fmt::format("{} off by more than half of it where not undone", title_of(algorithm)),
                  off(rate) > 0.5 * drive.velocity_target);
  }
  return claim;
}

Claim claim15(Measurement& measurement) {
  Claim claim{
      15,
      "not the report's",
      "One row's limit, τ < 4 − 2κ, is not the system's: coupled rows may grow below it, and smaller "
      "sub-steps do not end it",
      "Spectral radius of a sub-step's map of A3 in blocks, less 1: the largest of seven positions of the "
      "motion. Turn: the highest angular speed in the governor with rods in 2 s, with single rows, τ = 1 and "
      "m = 1",
      {"κ=1 τ=1 m=1", "κ=1 τ=0.6 m=1", "κ=1 τ=0.3 m=1", "κ=1 τ=1 m=4", "κ=0.7 τ=1 m=1", "κ=0.7 τ=1 m=4"}};
  double one_row = 0;  // furthest from its closed form: |1 − τ| at κ = 1
  double hinged = -1;
  double governor = -1;
  double under_relaxed = -1;
  for (const CoupledRows& system : coupled_rows(measurement.folder())) {
    Figure figure{system.name, {}, ""};
    for (const auto& [tau, iterations] : {std::pair{1.0, 1}, {0.6, 1}, {0.3, 1}, {1.0, 4}}) {
      const double radius = largest_radius(system, {.tau = tau}, iterations);
      figure.values.push_back(radius - 1);
      if (system.positions.front().joints.size() == 1)
        one_row = std::max(one_row, std::abs(radius - (1 - tau)));
    }
    const bool has_rods = system.name == coupled_governor;
    (has_rods ? governor : hinged) = std::max(has_rods ? governor : hinged, figure.values.front());
    for (const int iterations : {1, 4}) {
      figure.values.push_back(largest_radius(system, {.kappa = lower_kappa}, iterations) - 1);
      under_relaxed = std::max(under_relaxed, figure.values.back());
    }
    claim.figures.push_back(std::move(figure));
  }
  const Scene rods = without_springs(measurement.scene("governor"));
  const std::vector<double> runs = fastest_turns(rods, 1);
  const std::vector<double> lower = fastest_turns(rods, lower_kappa);
  claim.cases = {{"one row and one block, as the closed form", one_row < 1e-9},
                 {"chains and loops of hinges do not grow", hinged < 0},
                 {"the governor with rods grows", governor > 0.005},
                 {"smaller sub-steps make it worse", runs[2] > 1e6 && runs[1] < 20},
                 {fmt::format("with κ = {:g} nothing grows", lower_kappa), under_relaxed < 0},
                 {fmt::format("with κ = {:g} smaller sub-steps make it better", lower_kappa),
                  lower[0] > lower[1] && lower[1] > lower[2] && lower[2] < 6.3}};
  for (const auto& [kappa, turns] : {std::pair{1.0, &runs}, {lower_kappa, &lower}}) {
    for (std::size_t i = 0; i < turns->size(); ++i) {
      claim.add(fmt::format("turn, κ = {:g}, n = {}", kappa, turn_substeps[i]), {(*turns)[i]}, "rad/s");
    }
  }
  return claim;
}

Claim claim17(Measurement& measurement) {
  Claim claim{
      17,
      "not the report's",
      "No τ and κ are best for all scenes",
      "A5 with n = 10, m = 1 and stable joints; in each column but the default all rows share one τ and κ",
      {"default", "τ/κ of joints", "τ=1 κ=1", "τ=1 κ=0.7", "τ of joints, κ=0.7"}};
  const Settings usual = default_settings(Algorithm::a5);
  std::vector<Settings> tried(5, usual);
  for (std::size_t i = 1; i < tried.size(); ++i) tried[i].contact_tau = tried[i].contact_kappa = 0;
  tried[2].tau = tried[2].kappa = tried[3].tau = 1;
  tried[3].kappa = tried[4].kappa = lower_kappa;
  const auto add = [&](const std::string& what, const std::string& unit, const auto& cost) {
    std::vector<double> values;
    for (const Settings& settings : tried) values.push_back(cost(settings));
    claim.add(what, values, unit);
    return values;
  };
  std::vector<std::ptrdiff_t> best;  // of one τ and κ for all rows
  bool stands_by_default = true;
  for (const ContactScene& x :
       {ContactScene{"box_stack", false, 5}, {"box_pyramid", false, 2}, {"balls_on_tray", true, 2}}) {
    const Scene& scene = measurement.scene(x.name);
    const Motion path = compared_path(scene, x);
    const std::vector<double> values =
        add(fmt::format("{}: largest {} in {:g} s", x.name,
                        x.from_reference ? "distance of a body from A1 at h/8" : "displacement of a body",
                        x.duration),
            "m", [&](const Settings& settings) { return contact_cost(scene, x.duration, path, settings); });
    best.push_back(std::ranges::min_element(values.begin() + 1, values.end()) - values.begin());
    stands_by_default = stands_by_default && values[0] < values[1];
  }
  const std::vector<CoupledRows> systems = coupled_rows(measurement.folder());
  const CoupledRows& governor = *std::ranges::find(systems, coupled_governor, &CoupledRows::name);
  const auto radii =
      add(fmt::format("{}: spectral radius, less 1", governor.name), "", [&](const Settings& s) {
        return largest_radius(governor, {s.tau, s.kappa}, s.iterations) - 1;
      });
  const auto run = [&](const char* name, Settings settings) {
    settings.step = measurement.scene(name).step;
    return measured_run(measurement.scene(name), settings, 5);
  };
  const auto growths = add("rod_chain: largest rise of energy in 5 s", "J",
                           [&](const Settings& s) { return run("rod_chain", s).energy_growth; });
  const auto gaps = add("heavy_chain: largest joint gap in 5 s", "m",
                        [&](const Settings& s) { return run("heavy_chain", s).largest_gap; });
  claim.cases = {
      {"one τ and κ for all rows: a stack is best off with others than a pyramid and rolling balls",
       best[0] != best[1] && best[0] != best[2]},
      {fmt::format("coupled rows grow with κ = 1, not with κ = {:g}", lower_kappa),
       std::min(radii[1], radii[2]) > 0 && std::max(radii[3], radii[4]) < 0},
      {"the rod chain's energy rises more with τ = 1, whatever κ is",
       std::max(growths[1], growths[4]) < std::min(growths[2], growths[3])},
      {"the heavy chain's joints hold best with τ = κ = 1",
       gaps[2] < gaps[1] && gaps[2] < gaps[3] && gaps[2] < gaps[4]},
      {"with their own τ and κ contacts are better off, and joints as they were",
       stands_by_default && growths[0] == growths[1] && gaps[0] == gaps[1]}};
  return claim;
}

Claim claim18(Measurement& measurement) {
  Claim claim{18,
              "not the report's",
              "Frozen Jacobians let swings grow at the rate ω² h (1 − 1/n)/4, next-frame Jacobians damp them "
              "at ω² h/(2n)",
              "Rate at which small swings of the pendulum grow with h = 1/60 s, in 1/s; A2 makes n sweeps",
              {"A1", "A2", "A3", "A4", "A5", "predicted for A4 and A5"}};
  const SmallSwing swing(measurement.scene("pendulum"));
  for (const Joints joints : {Joints::plain, Joints::stable}) {
    for (const int n : {4, 16}) {
      const bool frozen = joints == Joints::plain;
      const double scale = swing.squared_frequency * swing.scene.step;
      const double predicted = scale * (frozen ? (1 - 1.0 / n) / 4 : -1 / (2.0 * n));
      std::vector<double> rates;
      for (const Algorithm algorithm : algorithms)
        rates.push_back(
            swing.growth(settings_of(swing.scene, algorithm, n, algorithm == Algorithm::a2 ? n : 1, joints)));
      const auto off = [&](double rate) { return std::abs(rate - predicted) / std::abs(predicted); };
      const std::string what = fmt::format("{}, n = {}", name(joints), n);
      claim.require(what, std::max(off(rates[3]), off(rates[4])) < 0.01);
      const double exact = std::max(std::abs(rates[0]), std::abs(rates[1]));
      claim.require(fmt::format("exact Jacobians, {}", what),
                    std::max(exact, std::abs(rates[2] - (frozen ? 0 : predicted))) < 0.001 * scale);
      rates.push_back(predicted);
      claim.add(what, rates);
    }
  }
  return claim;
}

}  // namespace substep::claims
