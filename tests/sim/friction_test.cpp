// Compares blocks that slide, stop and stay with closed forms.
// One file, since its tests share blocks on slopes and planes.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "sim/constraints/contact_finder.h"
#include "sim/direct/mlcp.h"
#include "sim/model/model.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

using test::gravity;
using test::pi;
constexpr double slope_angle = pi / 9;

/// Returns the friction coefficient of a box on a fixed plank, both moving at the scene's start.
double coefficient(const Vector3& box_velocity, const Vector3& plank_velocity,
                   const Vector3& plank_spin = {0, 0, 0}, const Vector3& box_spin = {0, 0, 0}) {
  Scene scene = test::empty_scene();
  const int plank = test::add_box(scene, {9, 1, 9}, 1, test::at(0, -0.5, 0), 0);
  const int box = test::add_box(scene, {0.2, 0.2, 0.2}, 1, test::at(2, 0.1, 1), 0);
  scene.bodies[plank].inverse_mass = 0;
  scene.bodies[plank].inverse_inertia.setZero();
  scene.bodies[plank].linear_velocity = plank_velocity;
  scene.bodies[plank].angular_velocity = plank_spin;
  scene.bodies[box].linear_velocity = box_velocity;
  scene.bodies[box].angular_velocity = box_spin;
  for (Collider& collider : scene.colliders) {
    collider.material.static_friction = 0.9;
    collider.material.dynamic_friction = 0.4;
  }
  const Model model = build_model(scene);
  ContactFinder finder(scene, model);
  const std::vector<Contact>& contacts = finder.find(initial_state(scene), 1.0 / 60, 1);
  EXPECT_GE(contacts.size(), 4u);
  for (const Contact& contact : contacts) EXPECT_EQ(contact.friction, contacts.front().friction);
  return contacts.empty() ? 0 : contacts.front().friction;
}

TEST(Friction, SticksWithoutSlipAndSlidesWithIt) {
  // g hs = 0.16 m/s: slower is at rest.
  const Vector3 east(2, 0, 0);
  const Vector3 north(0, 0, 2);
  EXPECT_EQ(coefficient({0, 0, 0}, {0, 0, 0}), 0.9);
  EXPECT_EQ(coefficient(east, {0, 0, 0}), 0.4);
  EXPECT_EQ(coefficient({0, 0, 0}, east), 0.4);
  EXPECT_EQ(coefficient(east, east), 0.9);
  EXPECT_EQ(coefficient(north, east), 0.4);
  // Put the box on a turntable, at the speed ω × r of its position and turning with the table.
  const Vector3 spin(0, 1.5, 0);
  const Vector3 arm(2, 0.6, 1);
  EXPECT_EQ(coefficient(spin.cross(arm), {0, 0, 0}, spin, spin), 0.9);
  EXPECT_EQ(coefficient(-spin.cross(arm), {0, 0, 0}, spin, spin), 0.4);
  EXPECT_EQ(coefficient({0, 0, 0}, {0, 0, 0}, {0, 0, 0}, Vector3(0, 9, 0)), 0.4);
}

/// A block of 2 kg on a slope, sent up along it.
struct Slope {
  Scene scene;
  Vector3 up;
};

Slope slope_of(double friction, double heading, double speed) {
  const Quaternion turned =
      compose(rotation_quaternion({0, heading, 0}), rotation_quaternion({0, 0, slope_angle}));
  Slope slope{test::floor_scene(friction), turned * Vector3(1, 0, 0)};
  slope.scene.colliders[0].placement.orientation = turned;
  test::add_box(slope.scene, {0.5, 0.2, 0.3}, 2, {turned * Vector3(0, 0.1, 0), turned}, friction);
  slope.scene.bodies[1].linear_velocity = speed * slope.up;
  return slope;
}

/// The block's position along the slope, and its path length up and down, m.
struct Place {
  double place;
  double way;
};

Place closed_form(double friction, double speed, double time) {
  const double weight = gravity * std::sin(slope_angle);
  const double grip = friction * gravity * std::cos(slope_angle);
  const double stop = speed / (weight + grip);
  if (time < stop) {
    const double x = speed * time - 0.5 * (weight + grip) * time * time;
    return {x, x};
  }
  const double top = 0.5 * speed * stop;
  const double back = grip < weight ? 0.5 * (weight - grip) * (time - stop) * (time - stop) : 0;
  return {top - back, top + back};
}

/// The largest distances of the run from the closed form, relative to the path length.
struct SlopeErrors {
  double all = 0;     ///< at any time
  double beyond = 0;  ///< uphill, beyond a t hs/2, the error of semi-implicit steps hs
  double aside = 0;   ///< off the line, m
};

SlopeErrors errors_on_slope(double rate, int substeps, double friction, bool by_default) {
  constexpr double speed = 3;
  const double brake = gravity * (std::sin(slope_angle) + friction * std::cos(slope_angle));
  SlopeErrors errors;
  for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    for (const double heading : {0.0, 0.7, 2.5}) {
      Settings settings = default_settings(algorithm);
      settings.step = 1 / rate;
      settings.substeps = substeps;
      if (!by_default) settings.contact_tau = settings.contact_kappa = 0;
      const Slope slope = slope_of(friction, heading, speed);
      const double end = test::last(slope.scene, settings, 2, [&](const State& state, double time) {
        const Vector3 moved = state.q[1].linear - slope.scene.bodies[1].pose.position;
        const Place place = closed_form(friction, speed, time);
        const double error = moved.dot(slope.up) - place.place;
        errors.all = std::max(errors.all, std::abs(error) / place.way);
        errors.aside = std::max(errors.aside, (moved - moved.dot(slope.up) * slope.up).norm());
        const double of_step = -0.5 * brake * time * settings.step / substeps;
        if (time < speed / brake)
          errors.beyond = std::max(errors.beyond, std::abs(error - of_step) / place.way);
        return 0.0;
      });
      EXPECT_EQ(end, 0) << "diverged";
    }
  }
  return errors;
}

// The errors are at most a t hs/2, that of semi-implicit steps, so that 0.1 % takes thirteen sub-steps. κ < 1
// leaves 1 − κ of friction's impulse to the next sub-step: a delay of a fraction of a sub-step at the start.
TEST(Friction, BlockSentUphillFollowsClosedForm) {
  struct Case {
    double rate;
    int substeps;
    double friction;  // 0.2: it slides back; 0.6: it stays
    bool by_default;  // otherwise with the default τ and κ of joints
    SlopeErrors limits;
  };
  for (const Case& one : {Case{60, 10, 0.2, false, {0.005, 2e-6, 1e-4}},   // measured 0.29 %, 8e-8, 8.1e-5 m
                          Case{60, 10, 0.6, false, {0.005, 2e-6, 1e-4}},   // 0.496 %, 1.1e-6
                          Case{240, 30, 0.2, false, {0.001, 3e-8, 1e-5}},  // 0.024 %, 8e-10, 8.2e-6 m
                          Case{240, 30, 0.6, false, {0.001, 3e-8, 1e-5}},  // 0.041 %, 1.5e-8
                          Case{240, 10, 0.2, false, {0.001, 1, 1}},        // 0.073 %
                          Case{240, 10, 0.6, false, {0.0013, 3e-7, 1}},    // 0.124 %, 1.5e-7
                          Case{60, 10, 0.2, true, {0.005, 1.5e-4, 1e-4}},  // beyond: 3.5e-5
                          Case{60, 10, 0.6, true, {0.005, 1.5e-4, 1e-4}},  // 1.05e-4
                          Case{240, 30, 0.2, true, {0.001, 4e-6, 1e-5}},   // 9.5e-7
                          Case{240, 30, 0.6, true, {0.001, 4e-6, 1e-5}}}) {  // 2.9e-6
    const SlopeErrors errors = errors_on_slope(one.rate, one.substeps, one.friction, one.by_default);
    SCOPED_TRACE(testing::Message() << one.rate << " Hz, n " << one.substeps << ", μ " << one.friction);
    EXPECT_LT(errors.all, one.limits.all);
    EXPECT_LT(errors.beyond, one.limits.beyond);
    EXPECT_LT(errors.aside, one.limits.aside);
  }
}

Quaternion turn(double degrees) {
  return rotation_quaternion({0, degrees * pi / 180, 0});
}

Vector3 heading_of(double heading, const Quaternion& slope) {
  const auto [sine, cosine] = sine_cosine(heading * pi / 180);
  return slope * Vector3(cosine, 0, sine);
}

/// A flat block on a plane, turned by `block` about the plane's normal, pushed along the plane by `push`
/// times the largest friction in the direction `heading`. The push is a part of gravity, so it acts at the
/// centre of mass. All of it stands on a plane at `slope`.
constexpr double tray_friction = 0.45;
Scene pushed_block(double push, double heading, double block, const Quaternion& slope) {
  Scene scene = test::floor_scene(tray_friction);
  scene.colliders[0].placement.orientation = slope;
  scene.gravity =
      slope * Vector3(0, -gravity, 0) + push * tray_friction * gravity * heading_of(heading, slope);
  test::add_box(scene, {0.8, 0.1, 0.5}, 35, {slope * Vector3(0, 0.05, 0), slope * turn(block)},
                tray_friction);
  return scene;
}

const Quaternion slopes[] = {Quaternion::Identity(), rotation_quaternion({0.2, 0.1, -0.35})};

/// Calls `use` with the angle of the block and of the push, in degrees, and with the plane's slope.
template <class Use>
void with_all_pushes(Use use) {
  for (const Quaternion& slope : slopes) {
    for (const double block : {0, 22, 45, 70}) {
      for (int k = 0; k < 16; ++k) use(block, 22.5 * k, slope);
    }
  }
}

/// The largest errors along and across the push, relative to the distance `expected`.
struct PushErrors {
  double along = 0;
  double aside = 0;
};

PushErrors errors_of_pushes(const Settings& settings, double duration, double expected) {
  PushErrors errors;
  with_all_pushes([&](double block, double heading, const Quaternion& slope) {
    const Scene scene = pushed_block(1.06, heading, block, slope);
    const MeasuredRun run = measured_run(scene, settings, duration);
    const Vector3 moved = run.state.q[1].linear - scene.bodies[1].pose.position;
    const Vector3 along = heading_of(heading, slope);
    errors.along = std::max(errors.along, std::abs(moved.dot(along) / expected - 1));
    errors.aside = std::max(errors.aside, (moved - moved.dot(along) * along).norm() / expected);
    EXPECT_LE(run.largest_residual, MlcpSolver::tolerance);  // of A1
  });
  return errors;
}

TEST(Friction, PushedTrayMovesAlikeInAllDirections) {
  for (const Algorithm algorithm : test::all_algorithms) {
    // A1's friction is a disc to rounding. Measured 2.4e-11 along, of the distance, and 1.9e-10 aside.
    const bool is_exact = algorithm == Algorithm::a1;
    const double time = is_exact ? 1 : 2;
    const Settings settings = is_exact ? Settings{.algorithm = algorithm} : default_settings(algorithm);
    // The excess over friction, stepped by h: velocities first, then coordinates.
    const double stepped = is_exact ? time * (time + settings.step) : time * time;
    const PushErrors errors =
        errors_of_pushes(settings, time, 0.5 * 0.06 * tray_friction * gravity * stepped);
    EXPECT_LT(errors.along, is_exact ? 1e-9 : 0.02) << name(algorithm);  // 1.2 % (A2), 0.25 % (A3 to A5)
    EXPECT_LT(errors.aside, is_exact ? 1e-9 : 5e-4) << name(algorithm);  // 1e-5 (A2), 2.5e-4 (A3 to A5)
  }
}

/// Returns the largest displacement of any tray in two seconds, m.
double largest_displacement(Algorithm algorithm, double push) {
  double largest = 0;
  with_all_pushes([&](double block, double heading, const Quaternion& slope) {
    const Scene scene = pushed_block(push, heading, block, slope);
    largest = std::max(largest, test::largest_displacement(scene, default_settings(algorithm), 2));
  });
  return largest;
}

// Points that reach their disc's edge in turn release half of their displacement each time: near the limit of
// friction the tray creeps by 0.13 mm/s (A2: 0.7) where A1 does not move.
TEST(Friction, TrayWithinFrictionStays) {
  EXPECT_LT(largest_displacement(Algorithm::a1, 0.96), 1e-12);  // measured 1.7e-14 m
  for (const Algorithm algorithm : {Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    EXPECT_LT(largest_displacement(algorithm, 0.5), 1e-5) << name(algorithm);  // measured 9.2e-6 m; A2: 4e-13
    EXPECT_LT(largest_displacement(algorithm, 0.96), 2e-3) << name(algorithm);  // 1.5 (A2) and 0.26 mm
  }
}

/// A body that slides and turns on a plane, in the plane's axes x and z, its centre at `height`.
struct PlaneMotion {
  Vector3 place = Vector3::Zero();  ///< x, z, m, and the angle about y, rad
  Vector3 rate = Vector3::Zero();   ///< of these, 1/s
};

/// A body thrown with spin on a plane. Friction at each point of contact is opposite to the point's slip, and
/// the pressure varies linearly between points, so that the body does not tip.
class ThrownBody {
 public:
  /// `squared_gyration`: the moment of inertia about y by the mass, m². The points are about their centre.
  ThrownBody(std::vector<std::array<double, 2>> points, double height, double squared_gyration, double mu)
      : points_(std::move(points)), height_(height), squared_gyration_(squared_gyration), mu_(mu) {
    for (const auto& [x, z] : points_) {
      moments_[0] += x * x / static_cast<double>(points_.size());
      moments_[1] += z * z / static_cast<double>(points_.size());
    }
  }

  /// Returns the position at which the body comes to rest.
  Vector3 stop(PlaneMotion motion) const {
    constexpr double step = 1e-4;
    constexpr double slow = 1e-3;
    while (motion.rate.norm() > slow) {
      PlaneMotion half = motion;
      half.place += 0.5 * step * motion.rate;
      half.rate += 0.5 * step * acceleration(motion);
      motion.place += step * half.rate;
      motion.rate += step * acceleration(half);
      if (motion.rate.dot(half.rate) < 0) break;
    }
    return motion.place;
  }

 private:
  Vector3 acceleration(const PlaneMotion& motion) const {
    const auto [sine, cosine] = sine_cosine(motion.place[2]);
    Vector3 result = Vector3::Zero();
    // The centre of pressure shifts with the force, and the force with the pressure.
    for (int i = 0; i < 4; ++i) {
      const double shift_x = -height_ * (cosine * result[0] - sine * result[1]) / gravity;
      const double shift_z = -height_ * (sine * result[0] + cosine * result[1]) / gravity;
      result.setZero();
      for (const auto& [along, across] : points_) {
        const double pressure = gravity / static_cast<double>(points_.size()) *
                                (1 + shift_x * along / moments_[0] + shift_z * across / moments_[1]);
        const double x = cosine * along + sine * across;
        const double z = cosine * across - sine * along;
        const Vector3 slip(motion.rate[0] + motion.rate[2] * z, motion.rate[1] - motion.rate[2] * x, 0);
        const Vector3 force = -mu_ * pressure * slip / std::max(slip.norm(), 1e-9);
        result += Vector3(force[0], force[1], (z * force[0] - x * force[1]) / squared_gyration_);
      }
    }
    return result;
  }

  std::vector<std::array<double, 2>> points_;
  double height_;
  double squared_gyration_;
  double mu_;
  double moments_[2] = {0, 0};
};

/// A thrown block or disc, and where it comes to rest.
struct Throw {
  Scene scene;
  Quaternion slope;
  Vector3 stop;  ///< x, z and the angle about y, in the plane's axes
};

Throw random_throw(bool is_disc, std::mt19937& random) {
  const auto draw = [&](double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random);
  };
  const double mu = draw(0.2, 0.6);
  const double height = draw(0.01, 0.04);
  const Vector3 size(draw(0.5, 1.2), 2 * height, draw(0.4, 0.9));
  const double mass = draw(0.5, 20);
  const double radius = size.x() / 2;
  const double turned = draw(0, 2 * pi);
  const PlaneMotion start{{0, 0, turned}, {draw(-2, 2), draw(-2, 2), draw(-10, 10)}};

  Throw result{test::floor_scene(mu), rotation_quaternion({draw(-1, 1), draw(-1, 1), draw(-1, 1)}), {}};
  Scene& scene = result.scene;
  const Quaternion& slope = result.slope;
  scene.colliders[0].placement.orientation = slope;
  scene.gravity = slope * Vector3(0, -gravity, 0);
  test::add_box(scene, size, mass, {slope * Vector3(0, height, 0), slope * turn(turned * 180 / pi)}, mu);
  Body& body = scene.bodies[1];
  body.linear_velocity = slope * Vector3(start.rate[0], 0, start.rate[1]);
  body.angular_velocity = slope * Vector3(0, start.rate[2], 0);
  std::vector<std::array<double, 2>> points;
  double squared_gyration = radius * radius / 2;
  if (is_disc) {
    scene.colliders.back().shape = Cylinder{height, radius, radius};
    const double across = mass * (radius * radius / 4 + height * height / 3);
    body.inverse_inertia = {1 / across, 1 / (mass * squared_gyration), 1 / across};
    for (int i = 0; i < 64; ++i) {
      const auto [sine, cosine] = sine_cosine(2 * pi * i / 64);
      points.push_back({radius * cosine, radius * sine});
    }
  } else {
    squared_gyration = (size.x() * size.x() + size.z() * size.z()) / 12;
    for (const double x : {-0.5, 0.5}) {
      for (const double z : {-0.5, 0.5}) points.push_back({x * size.x(), z * size.z()});
    }
  }
  result.stop = ThrownBody(points, height, squared_gyration, mu).stop(start) - start.place;
  return result;
}

/// Returns the error of the position and angle of rest, relative to the distance and the angle turned.
double error_of(const Throw& thrown, const Settings& settings) {
  Simulation simulation(thrown.scene, settings);
  const State start = simulation.state();
  double angle = 0;
  for (double time = 0; time < 2.5; time += settings.step) {
    const Quaternion before = simulation.state().q[1].angular;
    simulation.step();
    const Quaternion turned = simulation.state().q[1].angular * before.conjugate();
    angle += (thrown.slope.conjugate() * rotation_vector(turned)).y();
    const Velocity& v = simulation.state().v[1];
    if (v.linear.norm() + v.angular.norm() < 1e-4) break;
  }
  const Vector3 moved = thrown.slope.conjugate() * (simulation.state().q[1].linear - start.q[1].linear);
  const double place = std::hypot(moved.x() - thrown.stop[0], moved.z() - thrown.stop[1]);
  const double way = std::hypot(thrown.stop[0], thrown.stop[1]);
  return std::max(place / std::max(way, 0.1),
                  std::abs(angle - thrown.stop[2]) / std::max(std::abs(thrown.stop[2]), 0.3));
}

double largest_error_of_throws(bool is_disc, const Settings& settings) {
  std::mt19937 random(is_disc ? 7 : 11);
  double worst = 0;
  for (int i = 0; i < 8; ++i) worst = std::max(worst, error_of(random_throw(is_disc, random), settings));
  return worst;
}

TEST(Friction, ThrownBodiesFollowClosedForm) {
  for (const bool is_disc : {false, true}) {
    for (const Algorithm algorithm : test::all_algorithms) {
      Settings settings = default_settings(algorithm);
      // One step is first order; ten sub-steps are a tenth of it.
      settings.step = 1.0 / (algorithm <= Algorithm::a2 ? 480 : 60);
      const double worst = largest_error_of_throws(is_disc, settings);
      // Measured: blocks 0.84 % (A1, A2), 0.98 % (A3 to A5), discs 1.48 and 1.56 %.
      EXPECT_LT(worst, 0.02) << name(algorithm) << (is_disc ? ", discs" : ", blocks");
    }
  }
}

// A patch can stop a turn by its torque: μ m g times the points' mean distance from their centre.
TEST(Friction, PatchHoldsTheTorqueOfItsPoints) {
  constexpr double mu = 0.5;
  for (const double fraction : {0.95, 1.05}) {
    Scene scene = test::floor_scene(mu);
    test::add_box(scene, {0.8, 0.1, 0.6}, 3, {Vector3(0, 0.05, 0), turn(25)}, mu);
    Settings settings = test::sub_stepped(Algorithm::a3, 1, 1, 1);
    const double stopped = settings.step * mu * gravity * 0.5 / ((0.64 + 0.36) / 12);
    scene.bodies[1].angular_velocity = {0, fraction * stopped, 0};
    const double expected = std::max(0.0, fraction - 1) * stopped;
    EXPECT_NEAR(test::run(scene, settings, settings.step).v[1].angular.y(), expected, 1e-9) << fraction;
  }
}

/// Returns by how much a box that slides has tipped about its leading edge after `duration`: friction acts at
/// that edge. Its centre is at the angle φ above the edge, from behind.
double tilt_of_sliding_box(double width, double height, double mu, double duration) {
  constexpr double step = 1e-5;
  const double to_edge = std::hypot(width, height) / 2;
  const double mass_by_inertia = 3 / (to_edge * to_edge);
  double angle = std::atan2(height, width);
  double rate = 0;
  for (double time = 0; time < duration; time += step) {
    const double sine = std::sin(angle);
    const double cosine = std::cos(angle);
    // φ″ = N r (μ sin φ − cos φ)/I, with N = m (g + (r sin φ)″)
    const double factor = mass_by_inertia * to_edge * (mu * sine - cosine);
    rate += step * factor * (gravity - to_edge * rate * rate * sine) / (1 - factor * to_edge * cosine);
    angle += step * rate;
  }
  return angle - std::atan2(height, width);
}

TEST(SlidingBox, TipsByTheClosedForm) {
  constexpr double mu = 0.8;
  constexpr double duration = 0.25;
  const Quaternion slope = rotation_quaternion({0.3, -0.5, 0.8});
  Scene scene = test::floor_scene(mu);
  scene.colliders[0].placement.orientation = slope;
  scene.gravity = slope * Vector3(0, -gravity, 0);
  test::add_box(scene, {0.5, 0.8, 0.6}, 7, {slope * Vector3(0, 0.4, 0), slope}, mu);
  scene.bodies[1].linear_velocity = slope * Vector3(4, 0, 0);
  const double expected = tilt_of_sliding_box(0.5, 0.8, mu, duration);
  for (const Algorithm algorithm : test::all_algorithms) {
    Settings settings = default_settings(algorithm);
    settings.step = 1.0 / 480;
    const Quaternion turned = test::run(scene, settings, duration).q[1].angular * slope.conjugate();
    const double tilt = -(slope.conjugate() * rotation_vector(turned)).z();
    EXPECT_NEAR(tilt, expected, 0.015 * expected) << name(algorithm);  // measured 0.8 %: A1, A2, A4, A5
  }
}

// A body that cannot turn sticks and slides like a point: its contacts form no patch, whose Γ would be
// singular.
TEST(Friction, UnturnableBlockSlidesByTheClosedForm) {
  constexpr double mu = 0.3;
  constexpr double way = 1.5 * 1.5 / (2 * mu * gravity);
  for (const Vector3& inverse_inertia : {Vector3(0, 0, 0), Vector3(0, 4, 0)}) {
    Scene scene = test::floor_scene(mu);
    test::add_box(scene, {0.8, 0.1, 0.6}, 3, test::at(0, 0.05, 0), mu);
    scene.bodies[1].inverse_inertia = inverse_inertia;
    scene.bodies[1].linear_velocity = {1.2, 0, 0.9};
    for (const Algorithm algorithm : test::all_algorithms) {
      Settings settings = default_settings(algorithm);
      settings.step = 1.0 / (algorithm <= Algorithm::a2 ? 600 : 60);
      const Vector3 place = test::run(scene, settings, 1).q[1].linear;
      const Vector3 expected(0.8 * way, 0.05, 0.6 * way);
      EXPECT_LT((place - expected).norm(), 0.006 * way) << name(algorithm) << ' ' << inverse_inertia[1];
    }
  }
}

}  // namespace
}  // namespace substep
