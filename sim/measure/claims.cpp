#include "sim/measure/claims.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "sim/algorithms.h"
#include "sim/constraints/contact_finder.h"
#include "sim/constraints/formulate.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/math/rotation.h"
#include "sim/measure/measured_run.h"
#include "sim/measure/stability_map.h"

namespace substep {
namespace {

constexpr double horizon = 1;  // s: chaotic scenes are compared before their chaos shows

/// Equal but for rounding, m or rad: a thousand times what runs of 1 s differ by.
constexpr double rounding = 1e-9;

constexpr std::array algorithms{Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5};

/// "A3"
std::string title(Algorithm algorithm) {
  return fmt::format("A{}", static_cast<int>(algorithm) + 1);
}

Settings settings_of(const Scene& scene, Algorithm algorithm, int n, int m, Joints joints = Joints::plain) {
  Settings settings;
  settings.algorithm = algorithm;
  settings.step = scene.step;
  settings.substeps = n;
  settings.iterations = m;
  settings.joints = joints;
  return settings;
}

/// Numbers in [−1, 1], the same in every run.
class Numbers {
 public:
  explicit Numbers(std::uint32_t seed) : seed_(seed) {}
  double next() {
    seed_ = seed_ * 1664525u + 1013904223u;
    return static_cast<double>(seed_ >> 8) / 8388608.0 - 1;
  }
  Vector3 next_vector() {
    const double x = next();
    const double y = next();
    return {x, y, next()};
  }

 private:
  std::uint32_t seed_;
};

/// Every body turned and moving in a way of its own; joints are violated by it.
Scene disturbed(Scene scene, std::uint32_t seed, double amount) {
  Numbers numbers(seed);
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    Body& body = scene.bodies[i];
    if (body.inverse_mass == 0) continue;
    const Vector3 turn = amount * numbers.next_vector();
    body.pose.orientation = compose(body.pose.orientation, rotation_quaternion(turn));
    body.linear_velocity = amount * numbers.next_vector();
    body.angular_velocity = amount * numbers.next_vector();
  }
  return scene;
}

/// Every body moving in a way of its own, in space; joints that were closed stay closed.
Scene tumbling(Scene scene) {
  Scene turned = disturbed(scene, 7, 1);
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) turned.bodies[i].pose = scene.bodies[i].pose;
  // A1 at small steps takes away what the joints do not let pass, and leads out of the plane.
  Settings fine;
  fine.algorithm = Algorithm::a1;
  fine.step = 1.0 / 61440;
  const State state = measured_run(turned, fine, 0.2).state;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    scene.bodies[i].pose = {state.q[i].linear, state.q[i].angular};
    scene.bodies[i].linear_velocity = state.v[i].linear;
    scene.bodies[i].angular_velocity = state.v[i].angular;
  }
  return scene;
}

/// A scene's rows at one state, formulated as the algorithms do.
struct Formulated {
  Formulated(const Scene& scene, Frame frame, Joints joints, double hs)
      : model(build_model(scene)), finder(scene, model), state(initial_state(scene)) {
    problem.model = &model;
    problem.contacts = &no_contacts;
    problem.frame = frame;
    problem.substeps.duration = hs;
    problem.substeps.offset.resize(state.v.size());
    if (model.contacts) problem.contacts = &finder.find(state, scene.step);
    build_blocks(problem, joints);
    formulate(problem, state.q, hs);
  }
  Formulated(const Formulated&) = delete;
  Formulated& operator=(const Formulated&) = delete;

  std::vector<Velocity> local_velocities() const {
    std::vector<Velocity> local = state.v;
    for (std::size_t i = 0; i < local.size(); ++i) {
      local[i].angular = state.q[i].angular.conjugate() * local[i].angular;
    }
    return local;
  }

  std::vector<Contact> no_contacts;
  Model model;
  ContactFinder finder;
  State state;
  Problem problem;
};

/// By how many powers of two `of` falls from its last value but one to its last, as its argument halves.
double slope(const std::vector<double>& of) {
  return std::log2(of[of.size() - 2] / of.back());
}

bool is_near(double value, double expected) {
  return std::abs(value - expected) < 0.1;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class Measurement {
 public:
  explicit Measurement(const std::filesystem::path& folder) {
    for (const char* name : {"rod_chain", "heavy_chain", "pendulum", "incline", "powered_wheel", "box_stack",
                             "tumbling_body", "stone_pyramid", "card_house"}) {
      scenes_[name] = load_scene(folder / (std::string(name) + ".gltf"));
    }
    scenes_["tumbling rod_chain"] = tumbling(scenes_["rod_chain"]);
  }

  Claim claim1();
  Claim claim2();
  Claim claim3();
  Claim claim4();
  Claim claim5();
  Claim claim6();
  Claim claim7();
  Claim claim8();
  Claim claim9();
  Claim claim10();
  Claim claim11();
  Claim claim12();
  Claim claim13();
  Claim claim14();
  AblationCosts ablation(const std::string& name, int n);
  EnergyDrift energy_drift(const std::string& run, Algorithm algorithm, Joints joints,
                           const std::vector<std::string>& names);

 private:
  const Scene& scene(const std::string& name) const { return scenes_.at(name); }

  /// Made once, since A1 at small steps takes most of the time.
  const Reference& reference(const std::string& name) {
    const auto found = references_.find(name);
    if (found != references_.end()) return found->second;
    // What stands still has no step's error.
    const bool stands = name == "stone_pyramid" || name == "card_house";
    return references_[name] = reference_run(scene(name), horizon, stands ? 4 : 128);
  }

  MeasuredRun run(const std::string& name, Algorithm algorithm, int n, int m, Joints joints) const {
    return measured_run(scene(name), settings_of(scene(name), algorithm, n, m, joints), horizon);
  }

  double error(const std::string& name, Algorithm algorithm, int n, int m, Joints joints) {
    return error_of(run(name, algorithm, n, m, joints), reference(name));
  }

  void add_uncertainties(const std::vector<std::string>& names, Claim& claim) {
    Figure figure{"uncertainty of the reference, in this order", {}, "m"};
    for (const std::string& name : names) figure.values.push_back(reference(name).uncertainty);
    claim.figures.push_back(figure);
  }

  std::map<std::string, Scene> scenes_;
  std::map<std::string, Reference> references_;
};

Claim Measurement::claim1() {
  Claim claim{1,
              "IV.2.1",
              "One sub-step is one sweep: Γ̂(t,h,1) = Γ̂(t,h)",
              "A3 with n = m = 1 and single rows against A2 with one sweep, 1 s: largest difference in "
              "position (m) / orientation (rad)",
              {},
              {}};
  for (const char* name : {"rod_chain", "tumbling_body", "incline", "powered_wheel"}) {
    const MeasuredRun a3 = run(name, Algorithm::a3, 1, 1, Joints::rows);
    const MeasuredRun a2 = run(name, Algorithm::a2, 1, 1, Joints::rows);
    const double position = position_difference(a3, a2);
    const double orientation = orientation_difference(a3, a2);
    claim.figures.push_back({name, {position, orientation}, ""});
    claim.cases.push_back({name, position < rounding && orientation < rounding});
  }
  return claim;
}

Claim Measurement::claim2() {
  Claim claim{
      2,
      "IV.2.2",
      "Sub-steps are as good as smaller steps where geometry does not change: Γ̂¹(t,h,n) = Γ̂¹(t,h/n)",
      "A3 with single rows against A2 with one sweep at h/n, 1 s: largest difference in position (m) / "
      "orientation (rad)",
      {},
      {}};
  const auto compare = [&](const std::string& name, int n) {
    Settings small = settings_of(scene(name), Algorithm::a2, 1, 1);
    small.step /= n;
    const MeasuredRun a3 = run(name, Algorithm::a3, n, 1, Joints::rows);
    const MeasuredRun a2 = measured_run(scene(name), small, horizon);
    return std::vector{position_difference(a3, a2), orientation_difference(a3, a2)};
  };
  for (const char* name : {"pendulum", "rod_chain", "tumbling_body"}) {
    for (const int n : {4, 16}) {
      const std::string what = fmt::format("{}, n = {}", name, n);
      claim.figures.push_back({what, compare(name, n), ""});
      claim.cases.push_back({what, std::ranges::max(claim.figures.back().values) < rounding});
    }
  }
  claim.figures.push_back({"with contacts found once a step, for comparison: powered_wheel, n = 4",
                           compare("powered_wheel", 4), ""});
  return claim;
}

Claim Measurement::claim3() {
  Claim claim{
      3,
      "IV.2.2",
      "At equal row solves, n sub-steps beat n iterations: Γ̂¹(t,h,n) is better than Γ̂ⁿ(t,h)",
      "error at 1 s of A3 (n sub-steps, m = 1) / A2 (one step, n sweeps); equal are h, the order of "
      "the rows, the row solves (each row n times a step, a contact's within its manifold), τ = κ = 1 "
      "and joints by single rows; contacts are found once a step in both",
      {},
      {}};
  const std::vector<std::string> names{"pendulum",  "rod_chain",     "heavy_chain", "powered_wheel",
                                       "box_stack", "stone_pyramid", "card_house"};
  for (const std::string& name : names) {
    for (const int n : {4, 16}) {
      const double substeps = error(name, Algorithm::a3, n, 1, Joints::rows);
      const double iterations = error(name, Algorithm::a2, 1, n, Joints::rows);
      const std::string what = fmt::format("{}, n = {}", name, n);
      claim.figures.push_back({what, {substeps, iterations}, "m"});
      claim.cases.push_back({what, substeps < iterations});
    }
  }
  add_uncertainties(names, claim);
  return claim;
}

Claim Measurement::claim4() {
  Claim claim{
      4,
      "IV.3",
      "A4 is a first-order approximation of A3",
      "tumbling rod_chain: one step, n = 4, plain blocks, h halved from 1/240 to 1/15360 s; slope of the "
      "difference in h, to be 2 in position and 1 in velocity",
      {},
      {}};
  const Scene start = scene("tumbling rod_chain");
  std::vector<double> positions;
  std::vector<double> velocities;
  for (int k = 0; k < 7; ++k) {
    Settings a3 = settings_of(start, Algorithm::a3, 4, 1);
    a3.step = 1.0 / (240 << k);
    Settings a4 = a3;
    a4.algorithm = Algorithm::a4;
    const MeasuredRun one = measured_run(start, a3, a3.step);
    const MeasuredRun other = measured_run(start, a4, a4.step);
    positions.push_back(position_difference(one, other));
    double velocity = 0;
    for (std::size_t i = 1; i < one.state.v.size(); ++i) {
      velocity = std::max(velocity, (one.state.v[i].linear - other.state.v[i].linear).norm());
    }
    velocities.push_back(velocity);
  }
  claim.figures.push_back({"difference of one step of 1/240 s", {positions.front()}, "m"});
  claim.figures.push_back({"slope in position", {slope(positions)}, ""});
  claim.figures.push_back({"slope in velocity", {slope(velocities)}, ""});
  claim.cases.push_back({"positions", is_near(slope(positions), 2)});
  claim.cases.push_back({"velocities", is_near(slope(velocities), 1)});
  return claim;
}

Claim Measurement::claim5() {
  Claim claim{5,
              "IV.4",
              "A5 is A4 refactored: with frozen Jacobians they agree",
              "n = 4, m = 1 and 3, plain blocks: largest difference in position over τ/κ of 1/1, 0.6/0.9, "
              "0.3/1, 0.9/0.5, 1.2/1.1",
              {},
              {}};
  const auto largest = [&](const Scene& on, double duration) {
    double difference = 0;
    for (const auto& [tau, kappa] : {std::pair{1.0, 1.0}, {0.6, 0.9}, {0.3, 1.0}, {0.9, 0.5}, {1.2, 1.1}}) {
      for (const int m : {1, 3}) {
        Settings a4 = settings_of(on, Algorithm::a4, 4, m);
        a4.tau = tau;
        a4.kappa = kappa;
        Settings a5 = a4;
        a5.algorithm = Algorithm::a5;
        difference = std::max(
            difference, position_difference(measured_run(on, a4, duration), measured_run(on, a5, duration)));
      }
    }
    return difference;
  };
  // Contacts multiply rounding, so that they are compared for a shorter time.
  for (const auto& [name, duration] : {std::pair{"tumbling rod_chain", horizon}, {"powered_wheel", 0.25}}) {
    const double difference = largest(scene(name), duration);
    claim.figures.push_back({fmt::format("{}, {:g} s", name, duration), {difference}, "m"});
    claim.cases.push_back({name, difference < rounding});
  }
  return claim;
}

Claim Measurement::claim6() {
  Claim claim{6,
              "IV.4.1",
              "With recomputed Jacobians A5 falls below A4: its error has a floor where A4's goes on falling",
              "rod_chain, stable joints, m = 1: error at 1 s of A4 / A5",
              {},
              {}};
  std::map<int, double> a4;
  std::map<int, double> a5;
  for (const int n : {4, 16, 64, 256}) {
    a4[n] = error("rod_chain", Algorithm::a4, n, 1, Joints::stable);
    a5[n] = error("rod_chain", Algorithm::a5, n, 1, Joints::stable);
    claim.figures.push_back({fmt::format("n = {}", n), {a4[n], a5[n]}, "m"});
  }
  claim.cases.push_back(
      {"A5 above A4 from n = 16 on", a5[16] > a4[16] && a5[64] > a4[64] && a5[256] > a4[256]});
  claim.cases.push_back({"A4 still falling by more than half from n = 16 to 64", a4[64] < 0.5 * a4[16]});
  claim.cases.push_back({"A5 not falling by half from n = 16 to 256", a5[256] > 0.5 * a5[16]});
  return claim;
}

/// Time of the solver alone (s3, s4) in each step, in seconds, of several procedures step by step in turn.
std::vector<std::vector<double>> solver_times(const Scene& scene, const std::vector<Settings>& all,
                                              const std::vector<Procedure>& procedures, int steps) {
  std::vector<std::vector<double>> times(all.size());
  std::vector<Simulation> simulations;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const auto timed = [&times, k, procedure = procedures[k]](CoordinateVector& q, VelocityVector& v,
                                                              const Settings& settings, Problem& problem,
                                                              Work& work) {
      using Clock = std::chrono::steady_clock;
      const Clock::time_point start = Clock::now();
      procedure(q, v, settings, problem, work);
      times[k].push_back(std::chrono::duration<double>(Clock::now() - start).count());
    };
    simulations.emplace_back(scene, all[k], timed);
  }
  for (int i = 0; i < steps; ++i) {
    for (Simulation& simulation : simulations) simulation.step();
  }
  return times;
}

Claim Measurement::claim7() {
  Claim claim{
      7,
      "IV.2.2, IV.3",
      "A3 costs about as much as A2 with n iterations; A4 and A5 less",
      "n = 4, single rows, 600 steps in turn: row solves a step of A2 / A3 / A4 / A5, and the ratio of "
      "median solver times (geometry, the step's first formulation and what contacts keep for the next step "
      "left out) to A2's of A3 / A4 / A5",
      {},
      {}};
  const std::vector<Procedure> procedures{proc2, proc3, proc4, proc5};
  bool equal = true;
  bool near = true;
  bool faster = true;
  for (const char* name : {"rod_chain", "powered_wheel", "box_stack"}) {
    std::vector<Settings> all{settings_of(scene(name), Algorithm::a2, 1, 4)};
    for (const Algorithm a : {Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
      all.push_back(settings_of(scene(name), a, 4, 1, Joints::rows));
    }
    Figure solves{fmt::format("{}, row solves", name), {}, ""};
    for (const Settings& settings : all) {
      Simulation simulation(scene(name), settings);
      solves.values.push_back(static_cast<double>(simulation.step().row_solves));
    }
    std::vector<std::vector<double>> times(all.size());
    for (int repetition = 0; repetition < 10; ++repetition) {
      const auto more = solver_times(scene(name), all, procedures, 60);
      for (std::size_t k = 0; k < all.size(); ++k)
        times[k].insert(times[k].end(), more[k].begin(), more[k].end());
    }
    const double a2 = median(times[0]);
    const double a3 = median(times[1]) / a2;
    const double a4 = median(times[2]) / a2;
    const double a5 = median(times[3]) / a2;
    claim.figures.push_back(solves);
    claim.figures.push_back({fmt::format("{}, time", name), {a3, a4, a5}, "× A2", true});
    equal = equal && std::ranges::all_of(solves.values, [&](double v) { return v == solves.values[0]; });
    near = near && a3 < 1.25;
    faster = faster && a4 < a3 && a5 < a3;
  }
  claim.cases = {{"the same row solves", equal},
                 {"A3's time within a quarter of A2's", near, true},
                 {"A4 and A5 faster than A3", faster, true}};
  return claim;
}

/// β of all rows that follow the coordinates.
std::vector<double> position_level_biases(const Constraints& c) {
  std::vector<double> biases;
  for (const Block& x : c.blocks) {
    if (x.positional_bias_fraction == 1) biases.push_back(c.rows[static_cast<std::size_t>(x.first)].beta);
  }
  const auto add = [&biases](const ContactRow& row) {
    for (int lane = 0; lane < lanes; ++lane) biases.push_back(row.beta[lane]);
  };
  for (const NormalRow& normal : c.contacts.normals) add(normal.row);
  for (const FrictionRows& friction : c.contacts.frictions) {
    for (const ContactRow& row : friction.row) add(row);
  }
  return biases;
}

/// Largest error in C that the update rule of proc4:16 leaves after one sub-step, m: of position-level rows,
/// where all dynamic bodies move with `linear` and `angular` (world).
double bias_error(const Scene& scene, const Vector3& linear, const Vector3& angular, double hs) {
  Formulated at(scene, Frame::body, Joints::rows, hs);
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    if (scene.bodies[i].inverse_mass == 0) continue;
    // Every other body moves the other way, so that they do not move as one.
    const double sign = i % 2 == 0 ? 1 : -1;
    at.state.v[i].linear = sign * linear;
    at.state.v[i].angular = sign * angular;
  }
  const std::vector<Velocity> local = at.local_velocities();
  update_biases(at.problem, local);
  const std::vector<double> updated = position_level_biases(at.problem.c);
  std::vector<Coordinates> stepped = at.state.q;
  step_coordinates(hs, local, stepped);
  formulate(at.problem, stepped, hs);
  const std::vector<double> exact = position_level_biases(at.problem.c);
  double largest = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    largest = std::max(largest, hs * std::abs(updated[i] - exact[i]));
  }
  return largest;
}

Claim Measurement::claim8() {
  Claim claim{
      8,
      "IV.3.1",
      "The bias update is exact for a body that does not rotate on a fixed plane, else of first order",
      "one sub-step: error of C by proc4:16 (m); else slope of that error in the angle turned, to be 2",
      {},
      {}};
  const Vector3 linear(0.3, -0.1, 0.2);
  const Vector3 angular(1, 2, -1.5);
  double sliding = 0;
  for (int k = 4; k < 10; ++k) {
    sliding = std::max(sliding, bias_error(scene("incline"), linear, Vector3::Zero(), std::ldexp(1, -k)));
  }
  claim.figures.push_back({"incline, blocks slide without turning", {sliding}, "m"});
  claim.cases.push_back({"sliding on a fixed plane", sliding < 1e-13});
  for (const char* name : {"incline", "box_stack", "rod_chain"}) {
    std::vector<double> errors;
    for (int k = 6; k < 12; ++k)
      errors.push_back(bias_error(scene(name), linear, angular, std::ldexp(1, -k)));
    claim.figures.push_back({fmt::format("{}, bodies turn: slope", name), {slope(errors)}, ""});
    claim.cases.push_back({fmt::format("turning, {}", name), is_near(slope(errors), 2)});
  }
  return claim;
}

Claim Measurement::claim9() {
  Claim claim{9,
              "V.1, V.2",
              "Small rotations commute and add to first order",
              "200 pairs of rotation vectors, angles halved from 2⁻⁴ to 2⁻¹⁰ rad: slope of the largest "
              "error, to be 2",
              {},
              {}};
  std::vector<double> commuting;
  std::vector<double> adding;
  for (int k = 4; k <= 10; ++k) {
    Numbers numbers(1);
    double order = 0;
    double sum = 0;
    for (int i = 0; i < 200; ++i) {
      const Vector3 a = std::ldexp(1, -k) * numbers.next_vector();
      const Vector3 b = std::ldexp(1, -k) * numbers.next_vector();
      const Quaternion one = compose(rotation_quaternion(a), rotation_quaternion(b));
      const Quaternion other = compose(rotation_quaternion(b), rotation_quaternion(a));
      const Quaternion added = rotation_quaternion(a + b);
      order = std::max(order, rotation_vector(one.conjugate() * other).norm());
      sum = std::max(sum, rotation_vector(one.conjugate() * added).norm());
    }
    commuting.push_back(order);
    adding.push_back(sum);
  }
  claim.figures.push_back({"order: error at 2⁻⁴ rad / slope", {commuting.front(), slope(commuting)}, ""});
  claim.figures.push_back({"sum: error at 2⁻⁴ rad / slope", {adding.front(), slope(adding)}, ""});
  claim.cases.push_back({"commuting", is_near(slope(commuting), 2)});
  claim.cases.push_back({"adding", is_near(slope(adding), 2)});
  return claim;
}

Claim Measurement::claim10() {
  Claim claim{
      10,
      "III",
      "Local velocities change nothing: J v = J̆ v̆, and M̆⁻¹ does not change with time",
      "100 random poses and velocities up to 3 rad, 3 m/s, 3 rad/s: largest difference of row velocities "
      "(m/s, rad/s) / of responses R⁻¹M⁻¹Jᵀ and M̆⁻¹J̆ᵀ, relative",
      {},
      {}};
  for (const char* name : {"rod_chain", "powered_wheel"}) {
    double velocities = 0;
    double responses = 0;
    for (std::uint32_t seed = 1; seed <= 100; ++seed) {
      Scene posed = disturbed(scene(name), seed, 3);
      posed.colliders.clear();
      const Formulated world(posed, Frame::world, Joints::rows, 0.01);
      const Formulated body(posed, Frame::body, Joints::rows, 0.01);
      const std::vector<Velocity> local = body.local_velocities();
      for (std::size_t k = 0; k < world.problem.c.blocks.size(); ++k) {
        const Block& x = world.problem.c.blocks[k];
        const auto row = static_cast<std::size_t>(x.first);
        const auto a = static_cast<std::size_t>(x.a);
        const auto b = static_cast<std::size_t>(x.b);
        const Row& in_world = world.problem.c.rows[row];
        const Row& in_body = body.problem.c.rows[row];
        velocities =
            std::max(velocities, std::abs(row_velocity(in_world, world.state.v[a], world.state.v[b]) -
                                          row_velocity(in_body, local[a], local[b])));
        const Vector3 turned = body.state.q[a].angular.conjugate() * in_world.response_a;
        responses = std::max(responses, (turned - in_body.response_a).norm() / (1 + turned.norm()));
      }
    }
    claim.figures.push_back({name, {velocities, responses}, ""});
    claim.cases.push_back({name, velocities < 1e-12 && responses < 1e-12});
  }
  return claim;
}

Claim Measurement::claim11() {
  Claim claim{11,
              "IV.2.2",
              "τ, κ are not PSOR's ω: micro-iteration goes to J v = (τ/κ) β, PSOR to J v = β",
              "rod_chain out of place, without gravity, β = 0.25, τ = 0.5, κ = 0.8, 4000 sweeps: largest "
              "residual; stability of one row for τ, κ on a grid, A3 to A5, against the closed form",
              {},
              {}};
  Scene out_of_place = disturbed(scene("rod_chain"), 3, 0.2);
  out_of_place.gravity.setZero();
  constexpr double beta = 0.25;
  constexpr double tau = 0.5;
  constexpr double kappa = 0.8;
  const auto residual = [&](const auto& solve_block, Joints joints, double expected) {
    Formulated at(out_of_place, Frame::body, joints, 0.01);
    Constraints& c = at.problem.c;
    for (Row& row : c.rows) row.beta = beta;
    std::vector<Velocity> v = at.local_velocities();
    for (int i = 0; i < 4000; ++i) {
      for (const Block& x : c.blocks) apply(c, x, solve_block(c, x, v), v);
    }
    double largest = 0;
    for (const Block& x : c.blocks) {
      for (int k = 0; k < x.rows; ++k) {
        const Row& row = c.rows[x.first + k];
        largest = std::max(largest, std::abs(row_velocity(row, v[static_cast<std::size_t>(x.a)],
                                                          v[static_cast<std::size_t>(x.b)]) -
                                             expected));
      }
    }
    return largest;
  };
  const auto micro = [&](Constraints& c, const Block& x, const std::vector<Velocity>& v) {
    return solve(c, x, kappa, tau, v);
  };
  const auto relaxed = [&](Constraints& c, const Block& x, const std::vector<Velocity>& v) {
    return Impulse{solve_relaxed(c, x, kappa, v)};
  };
  const double to_ratio = residual(micro, Joints::plain, tau / kappa * beta);
  const double to_beta = residual(micro, Joints::plain, beta);
  const double psor = residual(relaxed, Joints::rows, beta);
  claim.figures.push_back({"micro-iteration, from (τ/κ) β / from β", {to_ratio, to_beta}, "m/s"});
  claim.figures.push_back({"PSOR with ω = 0.8, from β", {psor}, "m/s"});
  claim.cases.push_back({"the fixed point of τ, κ", to_ratio < 1e-9 && to_beta > 0.01});
  claim.cases.push_back({"the fixed point of ω", psor < 1e-9});
  const StabilityMatch match = match_closed_form(measure_stability_map());
  claim.figures.push_back({"points of the stability map / on the wrong side of τ = 4 − 2κ",
                           {static_cast<double>(match.points), static_cast<double>(match.wrong)},
                           ""});
  claim.cases.push_back({"the stability map", match.wrong == 0});
  return claim;
}

Claim Measurement::claim12() {
  const Scene& wheel = scene("powered_wheel");
  const auto driven =
      std::ranges::find_if(wheel.joints, [](const Joint& joint) { return !joint.drives.empty(); });
  if (driven == wheel.joints.end()) throw Error(fmt::format("{}: no joint has a drive", wheel.file.string()));
  const JointDrive& drive = driven->drives.front();
  Claim claim{
      12,
      "IV.3.1.4",
      "A velocity-level row must undo the update rule",
      fmt::format("powered_wheel, n = m = 4, plain blocks: speed of the motor at {:g} s, target {:g} rad/s",
                  horizon, drive.velocity_target),
      {},
      {}};
  const auto speed = [&](const Settings& settings, const Procedure& procedure) {
    Simulation simulation(wheel, settings, procedure);
    const State state = measured_run(simulation, horizon).state;
    const auto a = static_cast<std::size_t>(driven->body_a);
    const auto b = static_cast<std::size_t>(driven->body_b);
    const Vector3 axis = state.q[a].angular * (driven->frame_a.orientation * Vector3::Unit(drive.axis));
    return axis.dot(state.v[b].angular - state.v[a].angular);
  };
  // The same, but for the motor's bias, which follows the update rule.
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
  Figure with{"A1 / A2 / A3 / A4 / A5", {}, "rad/s"};
  for (const Algorithm algorithm : algorithms) {
    with.values.push_back(speed(settings_of(wheel, algorithm, 4, 4), Procedure{}));
    claim.cases.push_back({fmt::format("{} within 2 % of the target", title(algorithm)),
                           off(with.values.back()) < 0.02 * drive.velocity_target});
  }
  Figure without{"A4 / A5 where it is not undone", {}, "rad/s"};
  for (const auto& [algorithm, procedure] : {std::pair{Algorithm::a4, &proc4}, {Algorithm::a5, &proc5}}) {
    without.values.push_back(speed(settings_of(wheel, algorithm, 4, 4), without_undoing(procedure)));
    claim.cases.push_back({fmt::format("{} off by more than half of it where not undone", title(algorithm)),
                           off(without.values.back()) > 0.5 * drive.velocity_target});
  }
  claim.figures = {with, without};
  return claim;
}

Claim Measurement::claim13() {
  Claim claim{
      13,
      "IV.2.2",
      "Blocks help: 3×3 blocks beat single rows at equal cost",
      "A3, m = 1, 1 s, the same row solves: error of blocks / rows, then largest joint gap of blocks / rows",
      {},
      {}};
  const std::vector<std::string> names{"pendulum", "rod_chain", "heavy_chain"};
  for (const std::string& name : names) {
    for (const int n : {4, 16}) {
      const MeasuredRun blocks = run(name, Algorithm::a3, n, 1, Joints::plain);
      const MeasuredRun rows = run(name, Algorithm::a3, n, 1, Joints::rows);
      const double block_error = error_of(blocks, reference(name));
      const double row_error = error_of(rows, reference(name));
      const std::string what = fmt::format("{}, n = {}", name, n);
      claim.figures.push_back({what, {block_error, row_error, blocks.largest_gap, rows.largest_gap}, "m"});
      claim.cases.push_back({"error on " + what, block_error < row_error});
      claim.cases.push_back({"gap on " + what, blocks.largest_gap < rows.largest_gap});
    }
  }
  for (const std::string& name : names) {
    const std::vector<Settings> all{settings_of(scene(name), Algorithm::a3, 16, 1, Joints::plain),
                                    settings_of(scene(name), Algorithm::a3, 16, 1, Joints::rows)};
    const auto times = solver_times(scene(name), all, {proc3, proc3}, 120);
    claim.figures.push_back({fmt::format("{}, n = 16: solver time of blocks", name),
                             {median(times[0]) / median(times[1])},
                             "× rows'",
                             true});
  }
  add_uncertainties(names, claim);
  return claim;
}

Claim Measurement::claim14() {
  Claim claim{14,
              "IV.3.2",
              "Frozen Jacobians hurt joints, next-frame ones mend it, at the cost of damping",
              "m = 1, 1 s: error (m) / largest joint gap (m) / change of energy (J)",
              {},
              {}};
  const std::vector<std::string> names{"rod_chain", "heavy_chain"};
  for (const std::string& name : names) {
    for (const int n : {4, 16}) {
      const auto measure = [&](Algorithm algorithm, Joints joints) {
        MeasuredRun result = run(name, algorithm, n, 1, joints);
        claim.figures.push_back(
            {fmt::format("{}, n = {}: {} {}", name, n, title(algorithm), substep::name(joints)),
             {error_of(result, reference(name)), result.largest_gap, result.energy_change},
             ""});
        return result;
      };
      const MeasuredRun exact = measure(Algorithm::a3, Joints::plain);
      const MeasuredRun plain = measure(Algorithm::a4, Joints::plain);
      const MeasuredRun stable4 = measure(Algorithm::a4, Joints::stable);
      const MeasuredRun stable5 = measure(Algorithm::a5, Joints::stable);
      const std::string what = fmt::format("{}, n = {}", name, n);
      claim.cases.push_back({"gaps by frozen ones, " + what, plain.largest_gap > exact.largest_gap});
      for (const auto& [algorithm, stable] :
           {std::pair{Algorithm::a4, &stable4}, {Algorithm::a5, &stable5}}) {
        claim.cases.push_back({fmt::format("gaps mended in {}, {}", title(algorithm), what),
                               stable->largest_gap < plain.largest_gap});
        claim.cases.push_back({fmt::format("damping by {}, {}", title(algorithm), what),
                               stable->energy_change < std::min(0.0, exact.energy_change)});
      }
    }
  }
  return claim;
}

AblationCosts Measurement::ablation(const std::string& name, int n) {
  AblationCosts costs{name, n, {}};
  const Settings settings = settings_of(scene(name), Algorithm::a3, n, 1);
  const MeasuredRun a3 = measured_run(scene(name), settings, horizon);
  for (const Approximation approximation : approximations) {
    Simulation simulation(scene(name), settings, ablation_procedure(approximation));
    costs.costs.push_back(position_difference(measured_run(simulation, horizon), a3));
  }
  return costs;
}

EnergyDrift Measurement::energy_drift(const std::string& run, Algorithm algorithm, Joints joints,
                                      const std::vector<std::string>& names) {
  EnergyDrift drift{run, {}, {}};
  for (const std::string& name : names) {
    Settings settings = settings_of(scene(name), algorithm, 4, algorithm == Algorithm::a2 ? 4 : 1);
    settings.joints = joints;
    const MeasuredRun result = measured_run(scene(name), settings, 5);
    constexpr double infinite = std::numeric_limits<double>::infinity();
    drift.growth.push_back(result.diverged ? infinite : result.energy_growth);
    drift.change.push_back(result.diverged ? infinite : result.energy_change);
  }
  return drift;
}

}  // namespace

ClaimsReport measure_claims(const std::filesystem::path& folder, const std::function<void(int)>& progress) {
  Measurement measurement(folder);
  ClaimsReport report;
  using Member = Claim (Measurement::*)();
  for (const Member member :
       {&Measurement::claim1, &Measurement::claim2, &Measurement::claim3, &Measurement::claim4,
        &Measurement::claim5, &Measurement::claim6, &Measurement::claim7, &Measurement::claim8,
        &Measurement::claim9, &Measurement::claim10, &Measurement::claim11, &Measurement::claim12,
        &Measurement::claim13, &Measurement::claim14}) {
    progress(static_cast<int>(report.claims.size()) + 1);
    report.claims.push_back((measurement.*member)());
  }
  // The heavy chain needs more sub-steps to stay a chain at all.
  for (const auto& [name, n] : {std::pair{"pendulum", 4},
                                {"rod_chain", 4},
                                {"tumbling rod_chain", 4},
                                {"heavy_chain", 16},
                                {"powered_wheel", 4}}) {
    report.ablation.push_back(measurement.ablation(name, n));
  }
  report.contact_ablation = contact_ablation(folder);
  report.energy_scenes = {"pendulum", "rod_chain", "heavy_chain", "tumbling_body"};
  const auto add_energy = [&](const std::string& run, Algorithm algorithm, Joints joints) {
    report.energy.push_back(measurement.energy_drift(run, algorithm, joints, report.energy_scenes));
  };
  add_energy("A1", Algorithm::a1, Joints::plain);
  add_energy("A2, m = 4", Algorithm::a2, Joints::plain);
  for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    for (const Joints joints : {Joints::rows, Joints::plain, Joints::stable}) {
      const std::string number(1, name(algorithm)[1]);
      add_energy("A" + number + ", " + std::string(name(joints)), algorithm, joints);
    }
  }
  return report;
}

}  // namespace substep
