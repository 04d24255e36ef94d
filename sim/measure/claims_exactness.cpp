/// Claims of exact equality, and of errors of a known order: 1, 2, 4, 5 and 8 to 10.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/math/rotation.h"
#include "sim/measure/claims_measurement.h"
#include "sim/measure/small_step_xpbd.h"

namespace substep::claims {
namespace {

/// Limit of rounding, m or rad: a thousand times the differences of runs of 1 s.
constexpr double rounding = 1e-9;

/// Returns the power of two by which `of` falls from its last value but one to its last, as its argument
/// halves.
double slope(const std::vector<double>& of) {
  return std::log2(of[of.size() - 2] / of.back());
}

bool is_near(double value, double expected) {
  return std::abs(value - expected) < 0.1;
}

/// Raises each value of the figure to at least the given one.
void raise_to(Figure& figure, const std::vector<double>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) figure.values[i] = std::max(figure.values[i], values[i]);
}

/// Returns β of all rows that follow the coordinates.
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

/// Returns the largest error in C of position-level rows that the update rule of proc4:16 leaves after one
/// sub-step, m, where all dynamic bodies move with `linear` and `angular` (world).
double bias_error(const Scene& scene, const Vector3& linear, const Vector3& angular, double hs) {
  Formulated at(scene, Joints::rows, hs);
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

}  // namespace

Claim claim1(Measurement& measurement) {
  Claim claim = unmeasured_claim(1);
  Figure largest{"rod_chain, tumbling_body, incline, powered_wheel", {0, 0}, ""};
  for (const char* name : {"rod_chain", "tumbling_body", "incline", "powered_wheel"}) {
    const MeasuredRun a3 = measurement.run(name, Algorithm::a3, 1, 1, Joints::rows);
    const MeasuredRun a2 = measurement.run(name, Algorithm::a2, 1, 1, Joints::rows);
    const double position = position_difference(a3, a2);
    const double orientation = orientation_difference(a3, a2);
    raise_to(largest, {position, orientation});
    claim.cases.push_back({name, position < rounding && orientation < rounding});
  }
  claim.figures.push_back(std::move(largest));
  return claim;
}

Claim claim2(Measurement& measurement) {
  Claim claim = unmeasured_claim(2);
  const auto compare = [&](const std::string& name, int n) {
    Settings small = settings_of(measurement.scene(name), Algorithm::a2, 1, 1);
    small.step /= n;
    const MeasuredRun a3 = measurement.run(name, Algorithm::a3, n, 1, Joints::rows);
    const MeasuredRun a2 = measured_run(measurement.scene(name), small, horizon);
    return std::vector{position_difference(a3, a2), orientation_difference(a3, a2)};
  };
  Figure largest{"pendulum, rod_chain, tumbling_body, n = 4 and 16", {0, 0}, ""};
  for (const char* name : {"pendulum", "rod_chain", "tumbling_body"}) {
    for (const int n : {4, 16}) {
      const std::vector<double> differences = compare(name, n);
      raise_to(largest, differences);
      claim.cases.push_back({fmt::format("{}, n = {}", name, n), std::ranges::max(differences) < rounding});
    }
  }
  claim.figures.push_back(std::move(largest));
  claim.figures.push_back(
      {"powered_wheel, n = 4: contacts found once a step", compare("powered_wheel", 4), ""});
  return claim;
}

Claim claim4(Measurement& measurement) {
  Claim claim = unmeasured_claim(4);
  const Scene start = measurement.scene("tumbling rod_chain");
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
  claim.figures.push_back({"difference after one step of 1/240 s", {positions.front()}, "m"});
  claim.figures.push_back({"slope in position", {slope(positions)}, ""});
  claim.figures.push_back({"slope in velocity", {slope(velocities)}, ""});
  claim.cases.push_back({"positions", is_near(slope(positions), 2)});
  claim.cases.push_back({"velocities", is_near(slope(velocities), 1)});
  return claim;
}

Claim claim5(Measurement& measurement) {
  Claim claim = unmeasured_claim(5);
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
    const double difference = largest(measurement.scene(name), duration);
    claim.figures.push_back({fmt::format("{}, {:g} s", name, duration), {difference}, "m"});
    claim.cases.push_back({name, difference < rounding});
  }
  return claim;
}

Claim claim8(Measurement& measurement) {
  Claim claim = unmeasured_claim(8);
  const Vector3 linear(0.3, -0.1, 0.2);
  const Vector3 angular(1, 2, -1.5);
  double sliding = 0;
  for (int k = 4; k < 10; ++k) {
    sliding = std::max(sliding,
                       bias_error(measurement.scene("incline"), linear, Vector3::Zero(), std::ldexp(1, -k)));
  }
  claim.figures.push_back({"incline, blocks slide without turning", {sliding}, "m"});
  claim.cases = {{"sliding on a fixed plane", sliding < 1e-13}};
  for (const char* name : {"incline", "box_stack", "rod_chain"}) {
    std::vector<double> errors;
    for (int k = 6; k < 12; ++k)
      errors.push_back(bias_error(measurement.scene(name), linear, angular, std::ldexp(1, -k)));
    claim.figures.push_back({fmt::format("{}, bodies turn: slope", name), {slope(errors)}, ""});
    claim.cases.push_back({fmt::format("turning, {}", name), is_near(slope(errors), 2)});
  }
  return claim;
}

Claim claim9(Measurement&) {
  Claim claim = unmeasured_claim(9);
  std::vector<double> commuting;
  std::vector<double> adding;
  for (int k = 4; k <= 10; ++k) {
    RandomNumbers numbers(1);
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
  claim.figures.push_back({"order", {commuting.front(), slope(commuting)}, ""});
  claim.figures.push_back({"sum", {adding.front(), slope(adding)}, ""});
  claim.cases.push_back({"commuting", is_near(slope(commuting), 2)});
  claim.cases.push_back({"adding", is_near(slope(adding), 2)});
  return claim;
}

Claim claim10(Measurement& measurement) {
  Claim claim = unmeasured_claim(10);
  for (const char* name : {"rod_chain", "powered_wheel"}) {
    double velocities = 0;
    double responses = 0;
    for (std::uint32_t seed = 1; seed <= 100; ++seed) {
      Scene posed = disturbed(measurement.scene(name), seed, 3);
      posed.colliders.clear();
      const Formulated body(posed, Joints::rows, 0.01);
      const std::vector<Velocity> local = body.local_velocities();
      for (std::size_t k = 0; k < body.problem.c.blocks.size(); ++k) {
        const Block& x = body.problem.c.blocks[k];
        const auto row = static_cast<std::size_t>(x.first);
        const auto a = static_cast<std::size_t>(x.a);
        const auto b = static_cast<std::size_t>(x.b);
        const Row in_world = body.in_world(x, x.first);
        const Row& in_body = body.problem.c.rows[row];
        velocities = std::max(velocities, std::abs(row_velocity(in_world, body.state.v[a], body.state.v[b]) -
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

Claim claim16(Measurement& measurement) {
  Claim claim = unmeasured_claim(16);
  double same = 0;
  const auto add = [&](const std::string& name, int n, Joints joints, double tau) {
    Settings settings = settings_of(measurement.scene(name), Algorithm::a3, n, 1, joints);
    settings.tau = tau;
    const double distance = distance_from_xpbd(measurement.scene(name), settings, 2);
    claim.figures.push_back(
        {fmt::format("{}, n = {}, {}, τ = {:g}", name, n, substep::name(joints), tau), {distance}, "m"});
    return distance;
  };
  for (const auto& [name, n] : {std::pair{"rod_chain", 4}, {"rod_chain", 16}, {"heavy_chain", 16}})
    same = std::max(same, add(name, n, Joints::stable, 1));
  const double plain = add("rod_chain", 4, Joints::plain, 1);
  const double slower = add("rod_chain", 4, Joints::stable, 0.9);
  claim.cases = {{"stable joints, τ = 1", same < 1e-11},
                 {"not with plain joints or another τ", std::min(plain, slower) > 1e-3}};
  return claim;
}

}  // namespace substep::claims
