// One uniform rod of 1 m on a ball joint, released level: period 1.93333485 s (closed form, elliptic
// integral).

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

constexpr double period = 1.93333485;

Scene pendulum() {
  Scene scene = test::empty_scene();
  Body body = test::rod(1, 1);
  body.pose.position = {0.5, 0, 0};
  scene.bodies.push_back(body);
  scene.joints.push_back(test::ball_joint(1, 0, {-0.5, 0, 0}, Vector3::Zero()));
  return scene;
}

/// Time at which the rod hangs straight down for the first time, between two steps by the line through them.
double first_quarter(const Settings& settings) {
  Simulation simulation(pendulum(), settings);
  double before = simulation.state().q[1].linear.x();
  for (;;) {
    simulation.step();
    const double now = simulation.state().q[1].linear.x();
    if (now <= 0) return settings.step * (static_cast<double>(simulation.steps()) - now / (now - before));
    before = now;
    if (simulation.steps() > 1000000) return NAN;
  }
}

TEST(Pendulum, CountsRowsAndSolves) {
  for (const Algorithm algorithm : test::all_algorithms) {
    Settings settings;
    settings.algorithm = algorithm;
    settings.substeps = 5;
    settings.iterations = 4;
    Simulation simulation(pendulum(), settings);
    const StepReport& report = simulation.step();
    EXPECT_EQ(report.rows, 3) << name(algorithm);
    EXPECT_EQ(report.contacts, 0) << name(algorithm);
    // A1 has one active set; A2 ends after the sweep that changes nothing; the others have four sweeps in
    // each of five sub-steps.
    const int sweeps = algorithm == Algorithm::a1 ? 1 : algorithm == Algorithm::a2 ? 2 : 20;
    EXPECT_EQ(report.row_solves, 3 * sweeps) << name(algorithm);
  }
}

TEST(Box, CountsContacts) {
  Scene scene = test::floor_scene(0.5);
  test::add_box(scene, {1, 1, 1}, 1, {{0, 0.5, 0}, Quaternion::Identity()}, 0.5);
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a2, Algorithm::a5}) {
    Settings settings;
    settings.algorithm = algorithm;
    Simulation simulation(scene, settings);
    const StepReport& report = simulation.step();
    EXPECT_EQ(report.contacts, 4) << name(algorithm);
    // A1 has a normal and two rows of friction for each point; a patch has six rows.
    EXPECT_EQ(report.rows, algorithm == Algorithm::a1 ? 12 : 6) << name(algorithm);
  }
}

TEST(Pendulum, AllFiveSwingWithItsPeriod) {
  for (const Algorithm algorithm : test::all_algorithms) {
    Settings settings;
    settings.algorithm = algorithm;
    settings.step = 1.0 / 960;
    settings.iterations = algorithm == Algorithm::a2 ? 4 : 1;
    EXPECT_NEAR(first_quarter(settings), period / 4, 2e-3) << name(algorithm);
  }
}

}  // namespace
}  // namespace substep
