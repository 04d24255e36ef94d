// Tests each quantity, and each way to read a number off it, on motions given by formulas.

#include "sim/measure/expectations.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <tuple>

#include "sim/math/rotation.h"

namespace substep {
namespace {

using std::numbers::pi;
const Vector3 along = Vector3(2, -3, 6) / 7;  // unit
const Vector3 across = Vector3(3, 6, 2) / 7;  // unit, across `along`
const Vector3 centre(0.3, -1.2, 0.7);
const Vector3 other_centre(1, 2, 3);

/// Returns the world and two bodies of 2 and 3 kg.
Scene two_bodies() {
  Scene scene;
  scene.duration = 2;
  scene.bodies.resize(3);
  for (const int i : {1, 2}) {
    scene.bodies[i].name = i == 1 ? "one" : "other";
    scene.bodies[i].inverse_mass = 1.0 / (i + 1);
    scene.bodies[i].inverse_inertia = Vector3(1, 0.5, 0.25);
    scene.bodies[i].pose.position = i == 1 ? centre : other_centre;
  }
  return scene;
}

/// Returns an expectation of body 1 throughout a run, along `along`.
Expectation of(Quantity quantity, double value, double tolerance = 0.01) {
  Expectation e;
  e.quantity = quantity;
  e.bodies = {1};
  e.direction = along;
  e.to = INFINITY;
  e.value = value;
  e.tolerance = tolerance;
  return e;
}

/// Returns an expectation of the value at a time.
Expectation at(double time, Quantity quantity, double value = 0) {
  Expectation e = of(quantity, value);
  e.reading = Reading::at;
  e.from = e.to = time;
  return e;
}

using Move = std::function<void(State&, double)>;

/// Returns the figures of a run whose states `move` derives from the start.
std::vector<ExpectedFigure> figures(Scene scene, const std::vector<Expectation>& expected, const Move& move,
                                    double ends = 2) {
  constexpr double step = 1.0 / 64;
  scene.expected = expected;
  State start = initial_state(scene);
  move(start, 0);
  ExpectationMeter meter(scene, start);
  for (int i = 1; i * step <= ends + 1e-9; ++i) {
    State state = initial_state(scene);
    move(state, i * step);
    meter.add(state, i * step);
  }
  return meter.figures(ends < scene.duration);
}

double measured(const Expectation& expectation, const Move& move) {
  return figures(two_bodies(), {expectation}, move).at(0).measured;
}

/// Moves body 1 at 1.5 m/s along `along`, and swings it by 0.4 m along `across`.
void glide(State& state, double t) {
  state.q[1].linear += 1.5 * t * along + 0.4 * std::sin(pi * t) * across;
  state.v[1].linear = 1.5 * along + 0.4 * pi * std::cos(pi * t) * across;
}

TEST(Expectations, WorstOfSeveralBodiesCounts) {
  Expectation e = of(Quantity::displacement, 0, 0.3);
  e.bodies = {1, 2};
  const Move swing = [](State& state, double t) { state.q[2].linear += 0.4 * std::sin(pi * t) * across; };
  const auto result = figures(two_bodies(), {e}, swing);
  EXPECT_NEAR(result[0].measured, 0.4, 1e-12);  // at 0.5 s; at 2 s the body is back
  EXPECT_NEAR(result[0].error(), 0.4, 1e-12);
  EXPECT_TRUE(result[0].is_bad());
  EXPECT_EQ(result[0].unit, "m");
  e = at(2, Quantity::way, 1);
  e.bodies = {1, 2};
  const Move move = [](State& state, double t) {
    state.q[1].linear += 0.45 * t * along;
    state.q[2].linear += 0.6 * t * along;
  };
  for (const auto& [bound, worst] :
       {std::pair{Bound::equal, 1.2}, {Bound::at_least, 0.9}, {Bound::at_most, 1.2}}) {
    e.bound = bound;
    EXPECT_NEAR(measured(e, move), worst, 1e-12);
  }
}

TEST(Expectations, QuantitiesFollowDirectionAndBody) {
  for (const auto& [quantity, time, relative_to, value] :
       {std::tuple{Quantity::way, 0.77, 0, 1.5 * 0.77},  // between two steps
        {Quantity::way, 0.77, 2, 1.5 * 0.77},
        {Quantity::position, 2.0, 0, centre.dot(along) + 3},
        {Quantity::position, 2.0, 2, (centre - other_centre).dot(along) + 3},
        {Quantity::velocity, 2.0, 0, 1.5},
        {Quantity::speed, 2.0, 0, std::hypot(1.5, 0.4 * pi)}}) {
    Expectation e = at(time, quantity);
    e.relative_to = relative_to;
    EXPECT_NEAR(measured(e, glide), value, 1e-12) << name(quantity) << " " << relative_to;
  }
}

TEST(Expectations, ThroughoutFindsWorstValue) {
  Expectation e = of(Quantity::velocity, 0.1);
  e.direction = across;  // 0.4 π cos π t
  EXPECT_NEAR(measured(e, glide), -0.4 * pi, 1e-12);
  e.value = -0.1;
  EXPECT_NEAR(measured(e, glide), 0.4 * pi, 1e-12);
  e.from = 0.25;
  e.to = 0.75;
  EXPECT_NEAR(measured(e, glide), 0.4 * pi * std::cos(pi / 4), 1e-12);
  e.to = INFINITY;
  e.from = 0;
  for (const auto& [bound, value, error] : {std::tuple{Bound::at_most, 1.0, 0.4 * pi - 1},
                                            {Bound::at_most, 1.3, 0.0},
                                            {Bound::at_least, -1.0, 0.4 * pi - 1}}) {
    e.bound = bound;
    e.value = value;
    const ExpectedFigure figure = figures(two_bodies(), {e}, glide)[0];
    EXPECT_NEAR(std::abs(figure.measured), 0.4 * pi, 1e-12);
    EXPECT_NEAR(figure.error(), error, 1e-12);
  }
}

TEST(Expectations, MeanCoversItsInterval) {
  Expectation e = of(Quantity::velocity, 0);
  e.direction = across;
  e.reading = Reading::mean;
  e.to = 0.5;
  // The mean of cos over a quarter is 2/π; trapezoids of 1/64 s err.
  EXPECT_NEAR(measured(e, glide), 0.4 * pi * 2 / pi, 2e-4);
}

/// Lets body 1 bounce: it starts at a height of 1 m, and rises to 1/2, 1/4 and 1/8 m, on a slope.
void bounce(State& state, double t) {
  const double hop = std::floor(2 * t + 0.5);
  state.q[1].linear = std::pow(0.5, hop) * std::fabs(std::cos(2 * pi * t)) * along + 0.2 * t * across;
}

TEST(Expectations, PeaksCountFromFirstRise) {
  Expectation e = of(Quantity::position, 0, 0.02);
  e.reading = Reading::peak;
  for (const auto& [count, height] : {std::pair{1, 0.5}, {2, 0.25}, {3, 0.125}}) {
    e.count = count;
    EXPECT_NEAR(measured(e, bounce), height, 1e-12) << count;
  }
  e.count = 9;
  EXPECT_EQ(measured(e, bounce), INFINITY);
  // A rise by less than a tenth of the tolerance is no maximum.
  e.count = 1;
  e.tolerance = 6;
  EXPECT_EQ(measured(e, bounce), INFINITY);
}

TEST(Expectations, CrossingsAreInterpolatedBetweenSteps) {
  Expectation e = of(Quantity::velocity, 0);
  e.direction = across;
  e.reading = Reading::crossing;
  const double level = 0.4 * pi * std::cos(pi / 3);
  for (const auto& [at_level, count, time] : {std::tuple{0.0, 1, 0.5}, {0.0, 2, 1.5}, {level, 2, 5.0 / 3}}) {
    e.level = at_level;
    e.count = count;
    EXPECT_NEAR(measured(e, glide), time, 1e-3);
  }
  e.count = 3;
  EXPECT_EQ(measured(e, glide), INFINITY);
  EXPECT_STREQ(unit_of(e), "s");
}

TEST(Expectations, StaysEndsAtFirstCrossing) {
  Expectation e = of(Quantity::way, 2);
  e.reading = Reading::stays;
  e.bound = Bound::at_least;
  e.level = 1.2;
  EXPECT_NEAR(measured(e, glide), 0.8, 1e-12);
  e.level = 5;
  EXPECT_NEAR(measured(e, glide), 2, 1e-12);
  EXPECT_STREQ(unit_of(e), "s");
  // Take the first of several bodies to cross; a run that diverged ends there.
  e.bodies = {2, 1};
  e.level = 1.2;
  EXPECT_NEAR(measured(e, glide), 0.8, 1e-12);
  e.bodies = {2};
  const auto cut = figures(two_bodies(), {e}, glide, 1);
  EXPECT_NEAR(cut[0].measured, 1, 1e-12);
  EXPECT_TRUE(cut[0].is_bad());
}

TEST(ExpectationOfPoses, SkipsQuantitiesOfVelocitiesAndJoints) {
  Scene scene = two_bodies();
  EXPECT_EQ(expectation_of_poses(scene), nullptr);
  Expectation crossing = of(Quantity::displacement, 1);
  crossing.reading = Reading::crossing;
  scene.expected = {at(1, Quantity::speed), crossing, at(1, Quantity::joint_gap), at(1, Quantity::position)};
  EXPECT_EQ(expectation_of_poses(scene), &scene.expected[2]);
}

TEST(Expectations, ReadsContactsOfTheStep) {
  Scene scene = two_bodies();
  Expectation work = of(Quantity::contact_work, 0);
  work.bound = Bound::at_most;
  scene.expected = {at(1, Quantity::contact_impulse, 5), work};
  const State start = initial_state(scene);
  ExpectationMeter meter(scene, start);
  EXPECT_TRUE(meter.needs_contacts());
  State state = start;
  state.v[1].linear = 0.25 * along;
  state.v[1].angular = 2 * along;
  // The other body does not move; body 1 turns about `along` under an arm of 0.5 m.
  const std::vector<ContactImpulse> contacts{{1, 2, state.q[1].linear, 3 * along},
                                             {2, 1, state.q[1].linear + 0.5 * across, -2 * along + across},
                                             {1, 0, state.q[1].linear, 7 * across}};
  meter.add(state, 1, &contacts);
  EXPECT_NEAR(meter.figures(false)[0].measured, 5, 1e-12);
  EXPECT_NEAR(meter.figures(false)[1].measured, 0.75, 1e-12);
  // Without contacts these figures are unknown.
  ExpectationMeter unknown(scene, start);
  unknown.add(state, 1);
  EXPECT_EQ(unknown.figures(false)[0].measured, INFINITY);
}

TEST(Expectations, AnglesCountWholeTurns) {
  // Turn also so fast that a step turns the body by 5.6 rad and the centre by 4.4 rad.
  for (const double faster : {1, 40}) {
    const Move spin = [faster](State& state, double t) {
      state.q[1].angular = rotation_quaternion(9 * faster * t * along);
      state.v[1].angular = 9 * faster * along;
      // Move the centre round the axis the other way.
      const double angle = -7 * faster * t;
      const Vector3 arm = 0.6 * (std::cos(angle) * across + std::sin(angle) * along.cross(across));
      state.q[1].linear = centre + arm + 0.3 * t * along;
      state.v[1].linear = -7 * faster * along.cross(arm) + 0.3 * along;
    };
    for (const auto& [quantity, value] : {std::pair{Quantity::angle, 18 * faster},
                                          {Quantity::azimuth, -14 * faster},
                                          {Quantity::distance, 0.6},
                                          {Quantity::angular_velocity, 9 * faster}}) {
      Expectation e = at(2, quantity, value);
      e.centre = centre;
      EXPECT_NEAR(measured(e, spin), value, 1e-9) << name(quantity);
    }
  }
  // A body that passes the axis closely turns by less than π.
  const Move pass = [](State& state, double t) {
    state.q[1].linear = centre + (99 * t - 1.55) * across + 0.01 * along.cross(across);
    state.v[1].linear = 99 * across;
  };
  Expectation e = at(2, Quantity::azimuth, -pi);
  e.centre = centre;
  EXPECT_NEAR(measured(e, pass), -pi, 0.01);
}

TEST(Expectations, DirectionTurnsWithNode) {
  Scene scene = two_bodies();
  const Quaternion node = rotation_quaternion({0.3, 0.8, -0.4});
  scene.bodies[1].body_from_node.orientation = node;
  Expectation e = of(Quantity::angular_velocity, 0);
  e.in_node = true;
  const Move move = [&](State& state, double t) {
    state.q[1].angular = rotation_quaternion(Vector3(0.5, -0.2, 0.9) * t);
    state.v[1].angular = state.q[1].angular * (node * (2.5 * along + 0.7 * across));
  };
  EXPECT_NEAR(figures(scene, {e}, move)[0].measured, 2.5, 1e-12);
}

TEST(Expectations, InvariantsCountFromStart) {
  const Scene scene = two_bodies();
  // Gravity's energy and momentum do not count: a fall keeps both.
  const Move fall = [&](State& state, double t) {
    for (const int i : {1, 2}) {
      state.q[i].linear += t * across + 0.5 * t * t * scene.gravity;
      state.v[i].linear = across + t * scene.gravity;
    }
  };
  const Move pushed = [&](State& state, double t) {
    fall(state, t);
    state.v[1].linear += 0.5 * t * along;
    state.v[2].angular += t * Vector3(0.1, 0, 0);  // of a moment of 1 about its X
  };
  for (const Quantity quantity :
       {Quantity::energy_change, Quantity::momentum_change, Quantity::angular_momentum_change}) {
    EXPECT_NEAR(measured(of(quantity, 0), fall), 0, 1e-11) << name(quantity);
    EXPECT_GT(std::fabs(measured(of(quantity, 0), pushed)), 0.1) << name(quantity);
  }
  EXPECT_NEAR(measured(of(Quantity::momentum_change, 0), pushed), 2 * 0.5 * 2, 1e-12);
  // A pivoting body has the energy of its turn.
  Scene pivoting = scene;
  pivoting.bodies[2].inverse_mass = 0;
  const Move turn = [](State& state, double t) { state.v[2].angular.y() = 3 * t; };
  EXPECT_NEAR(figures(pivoting, {of(Quantity::energy_change, 0)}, turn)[0].measured, 36, 1e-11);
}

TEST(Expectations, DivergedRunHasNoLaterValue) {
  Expectation mean = at(1.5, Quantity::way);
  mean.reading = Reading::mean;
  mean.from = 0.25;
  const auto result = figures(
      two_bodies(), {at(0.5, Quantity::way), at(1.5, Quantity::way), mean, of(Quantity::displacement, 0)},
      glide, 1);
  EXPECT_NEAR(result[0].measured, 0.75, 1e-12);
  for (const int i : {1, 2, 3}) {
    EXPECT_EQ(result[i].measured, INFINITY) << i;
    EXPECT_TRUE(result[i].is_bad()) << i;
  }
}

TEST(Expectations, ShorterRunOmitsLaterFigures) {
  Scene scene = two_bodies();
  Expectation late = of(Quantity::way, 0);
  late.needs = 2;
  scene.duration = 1;
  EXPECT_EQ(figures(scene, {late, of(Quantity::way, 0)}, glide, 1).size(), 1u);
}

}  // namespace
}  // namespace substep
