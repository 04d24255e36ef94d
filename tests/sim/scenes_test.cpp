/// Compares scenes of the library with the closed forms and published values on their pages.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <tuple>
#include <variant>

#include "sim/algorithms.h"
#include "sim/measure/expectations.h"
#include "sim/measure/invariants.h"
#include "tests/scene_files.h"
#include "tests/sim/minimal_coordinates.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

using test::gravity;
using test::pi;

Settings settings_of(Algorithm algorithm, double step) {
  Settings settings{
      .algorithm = algorithm, .step = step, .substeps = 4, .iterations = algorithm == Algorithm::a2 ? 32 : 8};
  return settings;
}

/// Runs for `duration` and calls `look` with each step's time and state.
State run(const Scene& scene, const Settings& settings, double duration,
          const std::function<void(double, const State&)>& look = {}) {
  Simulation simulation(scene, settings);
  for (long i = 1; i <= std::lround(duration / settings.step); ++i) {
    if (simulation.step().status == StepReport::Status::diverged) {
      ADD_FAILURE() << scene.name << " diverged, " << label(settings);
      break;
    }
    if (look) look(static_cast<double>(i) * settings.step, simulation.state());
  }
  return simulation.state();
}

TEST(Scenes, TrayAndBallsFollowSimBenchmark) {
  const Scene scene = scene_named("balls_on_tray");
  const double acceleration = (150 - 0.4 * 35 * gravity) / (10 + 25 * 2.0 / 7);
  for (const Algorithm algorithm : test::all_algorithms) {
    // Measured 4e-13 (A1), 1.2e-5 (A2). Eight sweeps leave A4 and A5 0.025 m/s² of 0.7385. A3, for which the
    // balls' contacts turn with them, has 0.148.
    const double limit = algorithm == Algorithm::a1   ? 1e-9
                         : algorithm == Algorithm::a2 ? 2e-5
                         : algorithm == Algorithm::a3 ? 0.17
                                                      : 0.03;
    const State state = run(scene, settings_of(algorithm, 1.0 / 60), 2);
    EXPECT_NEAR(state.v[body_named(scene, "tray")].linear.x() / 2, acceleration, limit) << name(algorithm);
    for (int i = 1; i <= 25; ++i) {
      const Vector3& velocity = state.v[body_named(scene, "ball_" + std::to_string(i))].linear;
      EXPECT_NEAR(velocity.x() / 2, 2.0 / 7 * acceleration, limit) << name(algorithm) << " ball " << i;
    }
  }
}

TEST(Scenes, ShakenBlocksFollowClosedForm) {
  const Scene scene = scene_named("shaken_block");
  const int table = body_named(scene, "table");
  const auto range = [&](Algorithm algorithm, const char* block) {
    const int i = body_named(scene, block);
    std::array<double, 2> ends{};
    run(scene, settings_of(algorithm, 1.0 / 960), 4, [&](double, const State& state) {
      const double x = state.q[i].linear.x() - state.q[table].linear.x();
      ends = {std::min(ends[0], x), std::max(ends[1], x)};
    });
    return ends;
  };
  // The table starts with a jump to the crank's speed, and the first slip is short by as much: only A1 and
  // the range are compared for the block that slips by less than a millimetre.
  const auto small = range(Algorithm::a1, "wooden_block");
  EXPECT_NEAR(small[1] - small[0], 8.154e-4, 2e-6);  // measured 8.16e-4
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a2}) {
    const auto none = range(algorithm, "rubber_block");
    EXPECT_LT(none[1] - none[0], 2e-5) << name(algorithm);  // measured 8e-6
    const auto large = range(algorithm, "waxed_block");
    EXPECT_NEAR(large[0], -0.44308, 4e-3) << name(algorithm);  // measured −0.44436, −0.43997
    EXPECT_NEAR(large[1], 0.21903, 1e-3) << name(algorithm);   // measured 0.21855, 0.21969
  }
}

TEST(Scenes, CradleGivesBothAnswers) {
  const Scene scene = scene_named("cradle");
  const double arrives = 1.5425358516997971;
  for (const Algorithm algorithm : test::all_algorithms) {
    std::array<double, 5> touching{};
    std::array<double, 5> spaced{};
    const State end = run(scene, settings_of(algorithm, 1.0 / 240), 0.62, [&](double, const State& state) {
      for (int i = 0; i < 5; ++i) {
        const double a = state.v[body_named(scene, "touching_" + std::to_string(i + 1))].linear.x();
        const double b = state.v[body_named(scene, "spaced_" + std::to_string(i + 1))].linear.x();
        touching[i] = i == 0 ? std::min(touching[i], a) : std::max(touching[i], a);
        spaced[i] = std::max(spaced[i], b);
      }
    });
    // Measured 0.0003 (A1, A2) and 0.028 (A3 to A5).
    const double limit = algorithm <= Algorithm::a2 ? 0.001 : 0.04;
    for (int i = 0; i < 5; ++i) {
      EXPECT_NEAR(touching[i] / arrives, i == 0 ? -0.6 : 0.4, limit) << name(algorithm) << " ball " << i + 1;
      // Each ball in turn has all the speed for a moment; the last keeps it. Measured at least 0.97.
      EXPECT_NEAR(spaced[i] / arrives, 1, 0.05) << name(algorithm) << " ball " << i + 1;
      if (i == 4) continue;
      const double rest = end.v[body_named(scene, "spaced_" + std::to_string(i + 1))].linear.x();
      EXPECT_LT(std::fabs(rest) / arrives, 0.06) << name(algorithm) << " ball " << i + 1;  // measured 0.037
    }
  }
}

/// Returns the scene's expected figures as a run of its duration measures them, by name.
std::map<std::string, ExpectedFigure> figures_of(const Scene& scene, const Settings& settings) {
  ExpectationMeter meter(scene, initial_state(scene));
  run(scene, settings, scene.duration, [&](double t, const State& state) { meter.add(state, t); });
  std::map<std::string, ExpectedFigure> figures;
  for (const ExpectedFigure& figure : meter.figures(false)) figures.emplace(figure.name, figure);
  return figures;
}

TEST(Scenes, GatesSwingAlikeOnAnyNumberOfHinges) {
  const Scene scene = scene_named("door");
  for (const Algorithm algorithm : test::all_algorithms) {
    const auto figures = figures_of(scene, settings_of(algorithm, 1.0 / 240));
    const ExpectedFigure& period = figures.at("hinges_1: period");
    EXPECT_LT(period.error(), 0.002) << name(algorithm);  // measured 7e-5 (A1, A2), 6e-6 (A3), 1.6e-3
    for (const char* other : {"hinges_2: period", "hinges_5: period", "hinges_10: period"})
      EXPECT_NEAR(figures.at(other).measured, period.measured, 1e-6) << name(algorithm) << ", " << other;
  }
}

TEST(Scenes, TurntableCarriesBallAtTwoSevenths) {
  const Scene scene = scene_named("turntable");
  for (const Algorithm algorithm : test::all_algorithms) {
    const auto figures = figures_of(scene, settings_of(algorithm, 1.0 / 60));
    SCOPED_TRACE(name(algorithm));
    // Measured 2.0e-4 and 0.0103.
    EXPECT_LT(figures.at("angle that the ball has gone round by after 6 s").error(), 1e-3);
    EXPECT_LT(figures.at("the ball's distance from the axis").error(), 0.011);
  }
}

TEST(Scenes, TurntableHoldsBlocksWithinFriction) {
  const Scene scene = scene_named("turntable");
  // Friction acts on velocities: along the tangent a step carries a block outwards by r (Ω h)²/2.
  const double growth = std::exp(6 * 2.5 * 2.5 / 960 / 2);
  for (const Algorithm algorithm : test::all_algorithms) {
    const auto figures = figures_of(scene, settings_of(algorithm, 1.0 / 960));
    const bool is_a1 = algorithm == Algorithm::a1;
    for (const char* block : {"inner_block", "middle_block"}) {
      const ExpectedFigure& distance = figures.at(block + std::string(": distance from the axis"));
      // Measured: A5 at most 8.9e-3, A4 8.4e-3.
      EXPECT_NEAR(distance.measured, distance.expected * (is_a1 ? growth : 1), is_a1 ? 1e-3 : 0.01)
          << name(algorithm) << ", " << block;
    }
    EXPECT_GT(figures.at("outer_block: distance from the axis at 6 s").measured, 1.25) << name(algorithm);
  }
}

TEST(Scenes, PainlevesRodComesToTheParadoxAsPublished) {
  // The time is sensitive to the start: a rod that starts 0.05° steeper is there 0.11 s earlier.
  const Scene scene = scene_named("painleve_rod");
  const int rod = body_named(scene, "rod");
  double time = 0;
  double slip = 0;
  run(scene, settings_of(Algorithm::a1, 1.0 / 7680), 0.95, [&](double t, const State& state) {
    const Vector3 along = state.q[rod].angular * Vector3::UnitX();
    if (time > 0 || -along.y() < std::sin(pi / 4)) return;
    time = t;
    slip = (state.v[rod].linear + state.v[rod].angular.cross(along)).x() + 30;
  });
  EXPECT_NEAR(time, 0.8145, 0.03);  // measured 0.7932
  EXPECT_NEAR(slip, 9.41, 0.6);     // measured 9.840
  for (const Algorithm algorithm : test::all_algorithms) {
    const auto figures = figures_of(scene, settings_of(algorithm, 1.0 / 60));
    EXPECT_LT(figures.at("time at which the rod stands at 45°").error(), 0.04)
        << name(algorithm);  // measured 0.036: A4 and A5
  }
}

TEST(Scenes, BouncingBallComesToRest) {
  const Scene scene = scene_named("bouncing_balls");
  const int ball = body_named(scene, "ball_2");
  for (const Algorithm algorithm : test::all_algorithms) {
    double moving = 0;
    run(scene, settings_of(algorithm, 1.0 / 960), 3, [&](double t, const State& state) {
      if (state.v[ball].linear.norm() > 1e-9) moving = t;
    });
    EXPECT_NEAR(moving, 1.354571, 0.045) << name(algorithm);  // measured 0.019 (A1, A2), 0.039 (A3 to A5)
  }
}

/// The active sets of A1's solver may not settle while many contacts slide and open: a few steps stay a
/// little above the tolerance of 1e-9.
TEST(Scenes, A1SolvesNearlyAllStepsOfHeaps) {
  for (const char* name : {"card_house", "dominoes", "masonry_arch", "ragdoll", "water_wheel"}) {
    Simulation simulation(scene_named(name), settings_of(Algorithm::a1, 1.0 / 60));
    int unsolved = 0;
    for (int step = 1; step <= 180; ++step) {
      const StepReport& report = simulation.step();
      if (report.status != StepReport::Status::ok) ++unsolved;
      EXPECT_LT(report.residual, 1e-7) << name << ", step " << step;
    }
    EXPECT_LE(unsolved, 9) << name;
  }
}

/// A rattleback that rolls without slipping on y = 0, as T. R. Kane and D. A. Levinson (1982) have it. The
/// state is the ellipsoid's orientation (x, y, z, w) and its angular velocity in its own frame, rad/s.
class Rattleback {
 public:
  Rattleback(const Body& body, const Vector3& half_axes, const Pose& ellipsoid_in_body)
      : squares_(half_axes.cwiseAbs2()), centre_(ellipsoid_in_body.inverse().position) {
    const Matrix3 axes = ellipsoid_in_body.orientation.conjugate().toRotationMatrix();
    inertia_ = axes * body.inverse_inertia.cwiseInverse().asDiagonal() * axes.transpose();
    mass_ = 1 / body.inverse_mass;
    const Quaternion q = body.pose.orientation * ellipsoid_in_body.orientation;
    const Vector3 w = q.conjugate() * body.angular_velocity;
    state_ = {q.x(), q.y(), q.z(), q.w(), w.x(), w.y(), w.z()};
  }

  double spin() const { return (Quaternion(state_.data()).normalized() * Vector3(state_.data() + 4)).y(); }

  void advance(double h) {
    test::runge_kutta([this](const std::vector<double>& y) { return rate(y); }, h, state_);
  }

 private:
  std::vector<double> rate(const std::vector<double>& y) const {
    const Quaternion q(y.data());
    const Vector3 w(y.data() + 4);
    const Vector3 up = q.normalized().conjugate() * Vector3::UnitY();
    const Vector3 up_rate = up.cross(w);
    const double reach = std::sqrt(squares_.dot(up.cwiseAbs2()));
    const double reach_rate = squares_.dot(up.cwiseProduct(up_rate)) / reach;
    // Vector from the centre of mass to the point of contact, and its rate in the body's frame.
    const Vector3 arm = -squares_.cwiseProduct(up) / reach - centre_;
    const Vector3 arm_rate =
        -squares_.cwiseProduct(up_rate) / reach + squares_.cwiseProduct(up) * (reach_rate / (reach * reach));
    // The point of contact is at rest: v = arm × w. The force there is m (v' + g up).
    const Vector3 known = w.cross(arm.cross(w)) - w.cross(arm_rate);
    Matrix3 cross;
    cross << 0, -arm.z(), arm.y(), arm.z(), 0, -arm.x(), -arm.y(), arm.x(), 0;
    const Matrix3 about_contact = inertia_ - mass_ * cross * cross;
    const Vector3 a =
        about_contact.inverse() * (arm.cross(mass_ * (known + gravity * up)) - w.cross(inertia_ * w));
    const Quaternion turn = q * Quaternion(0, w.x() / 2, w.y() / 2, w.z() / 2);
    return {turn.x(), turn.y(), turn.z(), turn.w(), a.x(), a.y(), a.z()};
  }

  Vector3 squares_;  // of the half axes
  Vector3 centre_;   // of mass, from the ellipsoid's
  Matrix3 inertia_;
  double mass_ = 0;
  std::vector<double> state_;
};

TEST(Scenes, RattlebackTurnsBackOneWayOnly) {
  const Scene scene = scene_named("rattleback");
  const auto reference_of = [&](int body) {
    const auto collider = std::ranges::find(scene.colliders, body, &Collider::body);
    return Rattleback(scene.bodies[static_cast<std::size_t>(body)],
                      std::get<Polytope>(collider->shape).ellipsoid.value(), collider->placement);
  };
  const int back = body_named(scene, "turns_back");
  const int on = body_named(scene, "goes_on");

  Rattleback reference = reference_of(back);
  double turns = 0;
  for (; reference.spin() < 0; turns += 1e-4) reference.advance(1e-4);
  EXPECT_NEAR(turns, 2.8044, 1e-3);  // found by another program for the same equations
  Rattleback other = reference_of(on);
  for (int i = 0; i < 50000; ++i) other.advance(1e-4);
  EXPECT_NEAR(other.spin(), 4.361, 1e-3);

  for (const auto& [algorithm, late, slow] :
       {std::tuple{Algorithm::a1, 0.30, 0.03}, {Algorithm::a3, 0.13, 0.007}, {Algorithm::a5, 0.50, 0.10}}) {
    double found = 0;
    double spin = 0;  // of the other one
    const Settings settings = settings_of(algorithm, 1.0 / 15360);
    double slowest = other.spin();
    run(scene, settings, 5, [&](double t, const State& state) {
      if (found == 0 && state.v[back].angular.y() > 0) found = t;
      spin = state.v[on].angular.y();
      slowest = std::min(slowest, spin);
    });
    // Measured: 0.288 s early (A1), 0.125 (A3, whose sub-steps are steps of A1: see rolling_test.cpp), 0.207
    // (A5); the other one's spin is off by −0.024 (A1), −0.006 (A3) and −0.086 rad/s (A5), and by half of
    // that at half the step.
    EXPECT_GT(slowest, 0) << name(algorithm);
    EXPECT_NEAR(found, turns, late) << name(algorithm);
    EXPECT_NEAR(spin, other.spin(), slow) << name(algorithm);
  }
}

/// Returns the height of a mesh of the world without overhangs at (x, z); 0, that of the ground, beside it.
double height_of(const TriangleMesh& mesh, double x, double z) {
  for (const Triangle& triangle : mesh.triangles) {
    const Vector3& a = mesh.vertices[triangle[0]];
    const Vector3 b = mesh.vertices[triangle[1]] - a;
    const Vector3 c = mesh.vertices[triangle[2]] - a;
    const double area = b.z() * c.x() - b.x() * c.z();
    const double s = ((z - a.z()) * c.x() - (x - a.x()) * c.z()) / area;
    const double t = (b.z() * (x - a.x()) - b.x() * (z - a.z())) / area;
    if (s >= 0 && t >= 0 && s + t <= 1) return a.y() + s * b.y() + t * c.y();
  }
  return 0;
}

TEST(Scenes, RocksSlideOnTheMeshAndComeToRest) {
  const Scene scene = scene_named("rock_slide");
  const auto ground = std::ranges::find_if(scene.colliders, [](const Collider& collider) {
    return std::holds_alternative<TriangleMesh>(collider.shape);
  });
  ASSERT_NE(ground, scene.colliders.end());
  const auto& mesh = std::get<TriangleMesh>(ground->shape);
  Scene weightless = scene;
  weightless.gravity.setZero();
  for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a5}) {
    Settings settings = settings_of(algorithm, 1.0 / 60);
    settings.tau = 0.3;
    double energy_before = infinity;
    double largest_rise = 0;
    double greatest = 0;  // kinetic energy
    double moving = 0;    // until when it is more than a hundredth of that
    const State end = run(scene, settings, 14, [&](double t, const State& state) {
      largest_rise = std::max(largest_rise, energy(scene, state) - energy_before);
      energy_before = energy(scene, state);
      const double kinetic = energy(weightless, state);
      greatest = std::max(greatest, kinetic);
      if (kinetic > 0.01 * greatest) moving = t;
    });
    // The energy is 13 MJ. A rock of 3.7 t that wedges may be lifted by 2 mm, for 73 J. Stones that hit each
    // other amplify rounding: measured 0 to 2.8 J (A3), 0 to 56 J (A5) in versions alike but for rounding.
    EXPECT_LT(largest_rise, 73) << name(algorithm);
    EXPECT_LT(moving, 13.5) << name(algorithm);  // measured 10.3 (A3), 12.0 (A5)
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
      const Vector3& x = end.q[i].linear;
      // Resting, a log's middle is 0.2 m above the ground and a rock's at least 0.25 m.
      EXPECT_GT(x.y() - height_of(mesh, x.x(), x.z()), 0.1) << name(algorithm) << " " << scene.bodies[i].name;
    }
  }
}

// Impacts divide some of the cradle's steps.

TEST(DividedStep, RestoresStateWhereALaterPartDiverges) {
  State before;
  const auto diverge_in_later_part = [&](CoordinateVector& q, VelocityVector& v, const Settings& settings,
                                         Problem& problem, Work& work) {
    const bool is_later = q[1].linear != before.q[1].linear;
    proc4(q, v, settings, problem, work);
    if (is_later) v[1].linear.x() = infinity;
  };
  Simulation simulation(scene_named("cradle"), default_settings(Algorithm::a4), diverge_in_later_part);
  do {
    before = simulation.state();
  } while (simulation.step().status != StepReport::Status::diverged && simulation.steps() < 60);
  ASSERT_LT(simulation.steps(), 60);
  EXPECT_GT(before.contacts.size(), 0U);
  EXPECT_EQ(hash(simulation.state()), hash(before));
}

TEST(DividedStep, CountsContradictingRowsOfAllParts) {
  Scene scene = scene_named("cradle");
  scene.joints.push_back(scene.joints[0]);
  scene.joints.back().frame_a.position.x() += 1e-10;
  Simulation simulation(scene, default_settings(Algorithm::a1));
  for (int i = 0; i < 60; ++i) {
    const StepReport& report = simulation.step();
    EXPECT_EQ(report.status == StepReport::Status::least_squares, report.contradicting > 0) << i;
  }
}

TEST(Scenes, PlanetsFollowKepler) {
  Scene scene = scene_named("funnel");
  // Remove all bodies but the planets, which touch only the funnel.
  const int bodies = body_named(scene, "inner_planet") + 1;
  scene.bodies.resize(static_cast<std::size_t>(bodies));
  std::erase_if(scene.colliders, [&](const Collider& collider) { return collider.body >= bodies; });
  std::erase_if(scene.expected, [&](const Expectation& one) {
    return one.bodies.empty() || std::ranges::max(one.bodies) >= bodies;
  });
  ASSERT_EQ(scene.expected.size(), 6U);
  // Follow them for 2 s of the 6 s, in which they go round by a third of the angle.
  scene.duration = 2;
  for (Expectation& one : scene.expected) {
    if (one.reading != Reading::at) continue;
    one.from = one.to = 2;
    one.value /= 3;
  }
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a3, Algorithm::a5}) {
    for (const auto& [figure, found] : figures_of(scene, settings_of(algorithm, 1.0 / 240))) {
      // Measured: by 0.41 % at most and 5.7 mm (A1, the inner planet); A5 by 0.30 % and 3.8 mm.
      EXPECT_LT(found.error(), found.unit == "m" ? 0.007 : 0.005 * found.expected)
          << name(algorithm) << ", " << figure;
    }
  }
}

}  // namespace
}  // namespace substep
