// A1 on Bricard's mechanism: its hinges leave it one freedom only because one of their thirty rows is
// redundant, and a step's rounding and drift make that row contradict the others.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

const Vector3 corners[] = {{0, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, -1, 1}, {0, -1, 1}, {0, 0, 1}};
constexpr int axes[] = {1, 2, 0, 1, 2, 0};
constexpr int count = 6;

/// Six rods of 1 m and 1 kg, 0.1 m square, from corner to corner; the last one, from (0, 0, 1) to the origin,
/// is the ground. Hinges at the corners, about y, z, x, y, z, x.
Scene bricard() {
  Scene scene = test::empty_scene();
  int body_of[count];
  for (int i = 0; i < count; ++i) {
    const Vector3 along = corners[(i + 1) % count] - corners[i];
    Body body;
    body.name = "rod";
    body.pose.position = 0.5 * (corners[i] + corners[(i + 1) % count]);
    if (i < count - 1) {
      body.inverse_mass = 1;
      for (int k = 0; k < 3; ++k) body.inverse_inertia[k] = 12 / (along[k] != 0 ? 0.02 : 1.01);
    }
    body_of[i] = static_cast<int>(scene.bodies.size());
    scene.bodies.push_back(body);
  }
  for (int i = 0; i < count; ++i) {
    const int a = body_of[i];
    const int b = body_of[(i + count - 1) % count];
    Joint joint = test::ball_joint(a, b, corners[i] - scene.bodies[a].pose.position,
                                   corners[i] - scene.bodies[b].pose.position);
    std::array<bool, 3> locked{true, true, true};
    locked[axes[i]] = false;
    joint.limits.push_back(test::locked(true, locked));
    scene.joints.push_back(joint);
  }
  return scene;
}

struct Fall {
  int unsolved = 0;
  int least_squares = 0;
  double fastest = 0;
  double most_energy = -1e9;
  double least_energy = 1e9;
  double widest_gap = 0;
  std::vector<Vector3> path;  // of the rod opposite
};

double widest_gap(const Scene& scene, const State& state) {
  double widest = 0;
  for (const Joint& joint : scene.joints) {
    const Coordinates& a = state.q[joint.body_a];
    const Coordinates& b = state.q[joint.body_b];
    widest = std::max(widest, (a.linear + a.angular * joint.frame_a.position - b.linear -
                               b.angular * joint.frame_b.position)
                                  .norm());
  }
  return widest;
}

Fall run(int rate, double seconds) {
  const Scene scene = bricard();
  Settings settings;
  settings.algorithm = Algorithm::a1;
  settings.step = 1.0 / rate;
  Simulation simulation(scene, settings);
  Fall result;
  for (int i = 0; i < static_cast<int>(seconds * rate); ++i) {
    const StepReport& report = simulation.step();
    const State& state = simulation.state();
    result.unsolved += report.status == StepReport::Status::unsolved ? 1 : 0;
    result.least_squares += report.status == StepReport::Status::least_squares ? 1 : 0;
    for (const Velocity& v : state.v) result.fastest = std::max(result.fastest, v.linear.norm());
    const double now = energy(scene, state);
    result.most_energy = std::max(result.most_energy, now);
    result.least_energy = std::min(result.least_energy, now);
    result.widest_gap = std::max(result.widest_gap, widest_gap(scene, state));
    result.path.push_back(state.q[3].linear);
  }
  return result;
}

// It starts from rest with all corners' energy above its lowest state: no speed exceeds what that gives.
TEST(Bricard, SwingsAtSixtySteps) {
  const Fall coarse = run(60, 8);
  const Fall fine = run(240, 8);
  for (const Fall* fall : {&coarse, &fine}) {
    EXPECT_EQ(fall->unsolved, 0);
    EXPECT_GT(fall->least_squares, 0);
    EXPECT_LT(fall->fastest, 1.7);  // measured 1.667 and 1.669 m/s
  }
  EXPECT_LT(coarse.widest_gap, 5e-4);  // measured 3.4e-4 m: of the second order in h
  EXPECT_LT(fine.widest_gap, 4e-5);    // measured 2.1e-5 m
  // The least and the most, of 4.5 J that it falls through: nothing is lost at once, as when it is stopped.
  EXPECT_LT(coarse.most_energy - coarse.least_energy, 0.2);  // measured 0.14 J
  EXPECT_LT(fine.most_energy - fine.least_energy, 0.05);     // measured 0.033 J
  double furthest = 0;
  for (std::size_t i = 0; i < coarse.path.size(); ++i) {
    furthest = std::max(furthest, (coarse.path[i] - fine.path[4 * i + 3]).norm());
  }
  EXPECT_LT(furthest, 0.02);  // measured 0.0095 m, of a swing of 2 m
}

// A kick or a stop shows as a change of speed that gravity does not give in a step.
TEST(Bricard, IsNeitherKickedNorStopped) {
  const Fall fall = run(60, 8);
  double most = 0;
  for (std::size_t i = 2; i < fall.path.size(); ++i) {
    most = std::max(most, (fall.path[i] - 2 * fall.path[i - 1] + fall.path[i - 2]).norm() * 3600);
  }
  EXPECT_LT(most, 5);  // measured 3.27 m/s²; a stop from 0.43 m/s has 26
}

}  // namespace
}  // namespace substep
