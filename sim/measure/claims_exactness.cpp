/// Claims of exact equality, and of errors of a known order: 1, 2, 4, 5, 8 to 10 and 16.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/math/rotation.h"
#include "sim/measure/claims_measurement.h"

namespace substep::claims {
namespace {

/// Limit of rounding errors, m or rad: a thousand times the differences that runs of 1 s show.
constexpr double rounding = 1e-9;

/// Returns the power of two by which the last error is less than the one before, at twice the argument.
double slope(const std::vector<double>& errors) {
  return std::log2(errors[errors.size() - 2] / errors.back());
}

bool is_near(double value, double expected) {
  return std::abs(value - expected) < 0.1;
}

/// Returns the differences in position, m, and orientation, rad, and raises `largest` to them.
std::vector<double> differences(const MeasuredRun& a, const MeasuredRun& b, std::vector<double>& largest) {
  std::vector<double> both{position_difference(a, b), a.diverged || b.diverged ? infinity : 0};
  for (std::size_t i = 1; i < a.state.q.size(); ++i) {
    const Quaternion turn = a.state.q[i].angular.conjugate() * b.state.q[i].angular;
    both[1] = std::max(both[1], rotation_vector(turn).norm());
  }
  largest = {std::max(largest[0], both[0]), std::max(largest[1], both[1])};
  return both;
}

/// Returns β of all rows that follow the coordinates.
std::vector<double> position_level_biases(const Constraints& c) {
  std::vector<double> biases;
  for (const Block& x : c.blocks) {
    if (x.positional_bias_fraction == 1) biases.push_back(c.rows[x.first].beta);
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
    // Move every other body the other way, so that they do not move as one.
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
  Claim claim{1,
              "IV.2.1",
              "One sub-step is one sweep: Γ̂(t,h,1) = Γ̂(t,h)",
              "Largest difference after 1 s between A3 with n = m = 1, single rows, and A2 with one sweep",
              {"position, m", "orientation, rad"}};
  std::vector<double> largest{0, 0};
  for (const char* name : {"rod_chain", "tumbling_body", "incline", "powered_wheel"}) {
    const MeasuredRun a3 = measurement.run(name, Algorithm::a3, 1, 1, Joints::rows);
    const MeasuredRun a2 = measurement.run(name, Algorithm::a2, 1, 1, Joints::rows);
    claim.require(name, std::ranges::max(differences(a3, a2, largest)) < rounding);
  }
  claim.add("rod_chain, tumbling_body, incline, powered_wheel", largest);
  return claim;
}

Claim claim2(Measurement& measurement) {
  Claim claim{2,
              "IV.2.2",
              "Sub-steps are as good as smaller steps where geometry does not change: Γ̂¹(t,h,n) = Γ̂¹(t,h/n)",
              "Largest difference after 1 s between A3 with single rows and A2 with one sweep at h/n",
              {"position, m", "orientation, rad"}};
  std::vector<double> largest{0, 0};
  const auto compare = [&](const std::string& name, int n) {
    Settings small = settings_of(measurement.scene(name), Algorithm::a2, 1, 1);
    small.step /= n;
    const MeasuredRun a3 = measurement.run(name, Algorithm::a3, n, 1, Joints::rows);
    return differences(a3, measured_run(measurement.scene(name), small, horizon), largest);
  };
  for (const char* name : {"pendulum", "rod_chain", "tumbling_body"}) {
    for (const int n : {4, 16})
      claim.require(fmt::format("{}, n = {}", name, n), std::ranges::max(compare(name, n)) < rounding);
  }
  claim.add("pendulum, rod_chain, tumbling_body, n = 4 and 16", largest);
  claim.add("powered_wheel, n = 4: contacts found once a step", compare("powered_wheel", 4));
  return claim;
}

Claim claim4(Measurement& measurement) {
  Claim claim{
      4, "IV.3", "A4 is a first-order approximation of A3",
      "One step of the tumbling rod_chain with n = 4 and plain blocks; h is halved from 1/240 to 1/15360 s. "
      "The slope of the difference should be 2 in position and 1 in velocity"};
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
  claim.add("difference after one step of 1/240 s", {positions.front()}, "m");
  claim.add("slope in position", {slope(positions)});
  claim.add("slope in velocity", {slope(velocities)});
  claim.require("positions", is_near(slope(positions), 2));
  claim.require("velocities", is_near(slope(velocities), 1));
  return claim;
}

Claim claim5(Measurement& measurement) {
  Claim claim{
      5, "IV.4", "A5 is A4 refactored: with frozen Jacobians they agree",
      "Largest difference in position with n = 4, m = 1 and 3 and plain blocks, over five pairs of τ and κ"};
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
  // Compare contacts, which multiply rounding, for a shorter time.
  for (const auto& [name, duration] : {std::pair{"tumbling rod_chain", horizon}, {"powered_wheel", 0.25}}) {
    const double difference = largest(measurement.scene(name), duration);
    claim.add(fmt::format("{}, {:g} s", name, duration), {difference}, "m");
    claim.require(name, difference < rounding);
  }
  return claim;
}

Claim claim8(Measurement& measurement) {
  Claim claim{
      8, "IV.3.1",
      "The bias update is exact for a body on a fixed plane that does not rotate, else of first order",
      "Error of the constraint value C in m by A4's update rule over one sub-step, or the slope of that "
      "error in the angle turned, which should be 2"};
  const Vector3 linear(0.3, -0.1, 0.2);
  const Vector3 angular(1, 2, -1.5);
  double sliding = 0;
  for (int k = 4; k < 10; ++k) {
    sliding = std::max(sliding,
                       bias_error(measurement.scene("incline"), linear, Vector3::Zero(), std::ldexp(1, -k)));
  }
  claim.add("incline, blocks slide without turning", {sliding}, "m");
  claim.require("sliding on a fixed plane", sliding < 1e-13);
  for (const char* name : {"incline", "box_stack", "rod_chain"}) {
    std::vector<double> errors;
    for (int k = 6; k < 12; ++k)
      errors.push_back(bias_error(measurement.scene(name), linear, angular, std::ldexp(1, -k)));
    claim.add(fmt::format("{}, bodies turn: slope", name), {slope(errors)});
    claim.require(fmt::format("turning, {}", name), is_near(slope(errors), 2));
  }
  return claim;
}

Claim claim9(Measurement&) {
  Claim claim{
      9,
      "V.1, V.2",
      "Small rotations commute and add to first order",
      "200 pairs of rotation vectors with components up to 2⁻⁴ rad, halved down to 2⁻¹⁰; the slope of the "
      "largest error should be 2",
      {"error at 2⁻⁴", "slope"}};
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
  claim.add("order", {commuting.front(), slope(commuting)});
  claim.add("sum", {adding.front(), slope(adding)});
  claim.require("commuting", is_near(slope(commuting), 2));
  claim.require("adding", is_near(slope(adding), 2));
  return claim;
}

Claim claim10(Measurement& measurement) {
  Claim claim{
      10,
      "III",
      "Local velocities change nothing: J v = J̆ v̆, and M̆⁻¹ does not change with time",
      "Largest differences over 100 random poses and velocities, of row velocities and of the responses "
      "R⁻¹M⁻¹Jᵀ and M̆⁻¹J̆ᵀ",
      {"velocities, m/s and rad/s", "responses, relative"}};
  for (const char* name : {"rod_chain", "powered_wheel"}) {
    double velocities = 0;
    double responses = 0;
    for (std::uint32_t seed = 1; seed <= 100; ++seed) {
      Scene posed = disturbed(measurement.scene(name), seed, 3);
      posed.colliders.clear();
      const Formulated body(posed, Joints::rows, 0.01);
      const std::vector<Velocity> local = body.local_velocities();
      for (const Block& x : body.problem.c.blocks) {
        const Row in_world = body.in_world(x, x.first);
        const Row& in_body = body.problem.c.rows[x.first];
        velocities =
            std::max(velocities, std::abs(row_velocity(in_world, body.state.v[x.a], body.state.v[x.b]) -
                                          row_velocity(in_body, local[x.a], local[x.b])));
        const Vector3 turned = body.state.q[x.a].angular.conjugate() * in_world.response_a;
        responses = std::max(responses, (turned - in_body.response_a).norm() / (1 + turned.norm()));
      }
    }
    claim.add(name, {velocities, responses});
    claim.require(name, velocities < 1e-12 && responses < 1e-12);
  }
  return claim;
}

Claim claim16(Measurement& measurement) {
  Claim claim{16, "not the report's",
              "A3 with stable joints and τ = κ = 1 is small-step position-based dynamics without compliance "
              "(Macklin et al. 2019)",
              "Largest distance of a body's centre in 2 s from an independent program, written from the "
              "paper, with m = 1"};
  double same = 0;
  const auto add = [&](const std::string& name, int n, Joints joints, double tau) {
    Settings settings = settings_of(measurement.scene(name), Algorithm::a3, n, 1, joints);
    settings.tau = tau;
    const double distance = distance_from_xpbd(measurement.scene(name), settings, 2);
    claim.add(fmt::format("{}, n = {}, {}, τ = {:g}", name, n, substep::name(joints), tau), {distance}, "m");
    return distance;
  };
  for (const auto& [name, n] : {std::pair{"rod_chain", 4}, {"rod_chain", 16}, {"heavy_chain", 16}})
    same = std::max(same, add(name, n, Joints::stable, 1));
  const double plain = add("rod_chain", 4, Joints::plain, 1);
  const double slower = add("rod_chain", 4, Joints::stable, 0.9);
  claim.require("stable joints, τ = 1", same < 1e-11);
  claim.require("not with plain joints or another τ", std::min(plain, slower) > 1e-3);
  return claim;
}

}  // namespace substep::claims
