// The reference DAE integrator against closed forms, published end values and A1.

#include "sim/measure/reference_integrator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "sim/error.h"
#include "sim/math/rotation.h"
#include "sim/measure/joint_gap.h"
#include "sim/measure/measured_run.h"
#include "sim/measure/motion.h"
#include "tests/scene_files.h"
#include "tests/sim/squeezer_end.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

constexpr double pi = std::numbers::pi;

/// Returns the state after `duration`, with steps of the scene's step over `divisions`; calls `at_step` with
/// time and state.
template <typename AtStep>
State run(const Scene& scene, int order, int divisions, double duration, const AtStep& at_step) {
  const double step = scene.step / divisions;
  const auto stepper = reference_stepper(scene, step, order);
  const auto steps = static_cast<int>(std::lround(duration / step));
  for (int k = 1; k <= steps; ++k) {
    EXPECT_TRUE(stepper->step());
    at_step(k * step, stepper->state());
  }
  return stepper->state();
}
State run(const Scene& scene, int order, int divisions, double duration) {
  return run(scene, order, divisions, duration, [](double, const State&) {});
}

double distance(const State& a, const State& b) {
  double largest = 0;
  for (std::size_t i = 1; i < a.q.size(); ++i)
    largest = std::max(largest, (a.q[i].linear - b.q[i].linear).norm());
  return largest;
}

TEST(SmoothMotion, SwingsWithThePeriodOfTheRodPendulum) {
  // A rod of 1 m about its end, released level. After a quarter of the period it hangs: its centre is then
  // off by the rest of the step at the speed √(3 g / 4) of the closed form.
  Scene scene = scene_named("pendulum");
  constexpr double quarter = 1.93333485 / 4;
  scene.step = quarter / 30;
  const State state = run(scene, 12, 1, quarter);
  EXPECT_NEAR(state.q[1].linear.x(), 0, 6e-9);  // the period is given to 5e-9 s; measured 8.2e-10
  EXPECT_NEAR(state.v[1].linear.norm(), std::sqrt(0.75 * 9.81), 1e-12);  // measured 5e-16
}

TEST(SmoothMotion, HeavyTopFollowsLagrange) {
  const Scene scene = scene_named("heavy_top");
  double azimuth = 0;
  double before = 0;
  double most_tilt = 0;
  const State state = run(scene, 12, 4, 10, [&](double, const State& now) {
    const Vector3 axis = now.q[1].angular * Vector3::UnitY();
    const double angle = std::atan2(axis.x(), axis.z());
    if (before != 0) azimuth += std::remainder(angle - before, 2 * pi);
    before = angle;
    most_tilt = std::max(most_tilt, std::acos(axis.y()));
  });
  // The file's height begins 0.62 m below the point, at which the weight is 20 N.
  EXPECT_NEAR(energy(scene, state) - 20 * 0.62, 1269.97500521, 1e-8);  // measured 3e-10
  EXPECT_NEAR(most_tilt, 0.0545517, 1e-6);                             // at samples 1/240 s apart
  EXPECT_NEAR(std::abs(azimuth), 4.196191, 1e-3);
}

TEST(SmoothMotion, SqueezerEndsAsPublished) {
  const Scene scene = scene_named("squeezer");
  const State state = run(scene, 12, 4, 3);
  for (const auto& [body, angle] : test::squeezer_angles) {
    const Vector3 turn = rotation_vector(state.q[body_named(scene, body)].angular);
    EXPECT_NEAR(std::remainder(turn.z() - angle, 2 * pi), 0, 1e-7) << body;
  }
}

TEST(SmoothMotion, ConvergesAtItsOrder) {
  const Scene scene = scene_named("rod_chain");
  const State exact = run(scene, 12, 8, 0.5);
  for (const int order : {2, 4, 6}) {
    const double coarse = distance(run(scene, order, 4, 0.5), exact);
    const double fine = distance(run(scene, order, 8, 0.5), exact);
    EXPECT_NEAR(std::log2(coarse / fine), order, 0.3) << order;  // measured 1.98, 3.80, 5.89
  }
}

TEST(SmoothMotion, A1ConvergesToIt) {
  // Another method with other errors: A1's steps, extrapolated by themselves.
  for (const char* const name : {"pendulum", "rod_chain", "heavy_chain", "heavy_top", "squeezer"}) {
    const Scene scene = scene_named(name);
    const Reference direct = reference_run(scene, 0.5, 256);
    const State state = run(scene, 12, 16, 0.5);
    for (std::size_t i = 1; i < state.q.size(); ++i) {
      EXPECT_LT((state.q[i].linear - direct.centres[i]).norm(), direct.uncertainty + 1e-12)
          << name << " " << i;
    }
  }
}

TEST(SmoothMotion, ContinuesThroughLimits) {
  const Scene scene = scene_named("joint_kinds");
  const int slider = body_named(scene, "stopped_slider");
  const double height = scene.bodies[slider].pose.position.y();
  double largest = 0;
  run(scene, 12, 8, 1, [&](double time, const State& state) {
    const double fallen = std::min(0.6, 0.5 * 9.81 * time * time);
    largest = std::max(largest, std::abs(state.q[slider].linear.y() - (height - fallen)));
  });
  EXPECT_LT(largest, 1e-11);  // it falls for 0.35 s, meets its stop between two steps, and stays
}

TEST(SmoothMotion, KeepsJointsClosed) {
  // Loops have redundant rows.
  for (const char* const name : {"heavy_chain", "bricard", "four_bar"}) {
    const Scene scene = scene_named(name);
    double largest = 0;
    run(scene, 8, 4, 2,
        [&](double, const State& state) { largest = std::max(largest, joint_gap(scene, state)); });
    EXPECT_LT(largest, 1e-13) << name;  // measured 5e-15
  }
}

/// A ball of 1 kg, 0.1 m from its centre held to the world's origin by `limit`, from (x, 0, 0) m.
Scene held_ball(double x, const JointLimit& limit) {
  Scene scene = test::empty_scene();
  Body ball;
  ball.name = "ball";
  ball.inverse_mass = 1;
  ball.inverse_inertia = Vector3::Constant(1 / 0.004);
  ball.pose.position = {x, 0, 0};
  scene.bodies.push_back(ball);
  Joint joint = test::ball_joint(1, world_body, {0, 0, 0}, {0, 0, 0});
  joint.limits = {limit};
  scene.joints.push_back(joint);
  return scene;
}

// The integrator, not A1, is the reference of springs, soft and stiff, a rod, taut and slack ropes, and a
// constant torque.
TEST(SmoothMotion, IsReferenceOfScenesWithoutContacts) {
  JointLimit soft = test::range(false, {true, true, true}, 1, 1);
  soft.stiffness = 50;
  soft.damping = 0.5;
  JointLimit stiff = test::range(false, {true, true, true}, 1, 1);
  stiff.stiffness = 1e6;
  JointLimit overdamped = stiff;
  overdamped.damping = 3e4;
  Scene torque = test::chain(2);
  torque.joints[1].drives.push_back(
      {.angular = true, .axis = 2, .max_force = 3, .velocity_target = 1e6, .damping = 1});
  const std::pair<const char*, Scene> scenes[] = {
      {"soft spring", held_ball(1.2, soft)},
      {"stiff spring", held_ball(1.001, stiff)},
      {"overdamped spring", held_ball(1.001, overdamped)},
      {"rod", held_ball(1, test::range(false, {true, true, true}, 1, 1))},
      {"taut rope", held_ball(1, test::range(false, {true, true, true}, 0, 1))},
      {"slack rope", held_ball(0.5, test::range(false, {true, true, true}, 0, 1))},
      {"constant torque", torque}};
  for (const auto& [what, scene] : scenes) {
    const ReferenceMotion reference = reference_motion(scene, 1);
    EXPECT_EQ(reference.method.substr(0, 3), "own") << what << ": " << reference.method;
    EXPECT_GT(reference.horizon, 0.99) << what;
    EXPECT_LT(reference.uncertainty, 1e-7) << what;
  }
}

TEST(SmoothMotion, SpringsFollowClosedForm) {
  JointLimit spring = test::locked(false, {true, false, false});
  spring.stiffness = 1e6;
  Scene scene = held_ball(0.001, spring);
  scene.gravity.setZero();
  const ReferenceMotion reference = reference_motion(scene, 1);
  for (std::size_t k = 0; k < reference.uncertainties.size(); ++k) {
    EXPECT_NEAR(reference.motion.samples[k].q[1].linear.x(),
                0.001 * std::cos(1000 * static_cast<double>(k) / 60),
                reference.uncertainties[k].position + 1e-12)
        << k;
  }
  EXPECT_EQ(reference.uncertainties.size(), 61U);
}

TEST(SmoothMotion, RefusesScenesThatAreNotSmooth) {
  EXPECT_THROW(reference_stepper(scene_named("box_stack"), 0.01, 8), Error);
  EXPECT_THROW(reference_stepper(scene_named("short_chain"), 0.01, 8), Error);
}

}  // namespace
}  // namespace substep
