// What the report claims of its algorithms, by equality or by order of error. Sections are the report's.

#include <gtest/gtest.h>

#include "sim/measure/claims_measurement.h"
#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

using test::chain;
using test::run;
using test::velocity_difference;

Settings settings(Algorithm algorithm, int substeps, int iterations, Joints joints = Joints::plain) {
  Settings s;
  s.algorithm = algorithm;
  s.substeps = substeps;
  s.iterations = iterations;
  s.joints = joints;
  return s;
}

/// A chain that moves in all directions, with a motor-less mixture of ball joints and a hinge, and a body
/// with unequal moments.
Scene moving_chain() {
  Scene scene = chain(4, 0.3);
  scene.joints[2].limits.push_back(test::locked(true, {true, true, false}));
  scene = claims::disturbed(scene, 7, 0.2);
  scene.bodies[4].inverse_inertia = {1 / 0.02, 1 / 0.03, 1 / 0.04};
  return scene;
}

// Claim 1 (IV.2.1): Γ̂(t,h,1) = Γ̂(t,h).
TEST(Claim1, OneSubstepEqualsTheIterativeStep) {
  const Scene scene = moving_chain();
  const State a3 = run(scene, settings(Algorithm::a3, 1, 1, Joints::rows), 1);
  const State a2 = run(scene, settings(Algorithm::a2, 1, 1), 1);
  EXPECT_LT(position_difference(a3, a2), 1e-12);     // measured 1e-14
  EXPECT_LT(orientation_difference(a3, a2), 1e-11);  // measured 2e-13
  EXPECT_GT(position_difference(a3, initial_state(scene)), 0.1);
}

// Claim 2 (IV.2.2): the quality of Γ̂¹(t,h,n) equals that of Γ̂¹(t,h/n), without geometry.
TEST(Claim2, SubstepsEqualSmallerSteps) {
  const Scene scene = moving_chain();
  for (const int n : {2, 4, 16}) {
    const State a3 = run(scene, settings(Algorithm::a3, n, 1, Joints::rows), 1);
    Settings small = settings(Algorithm::a2, 1, 1);
    small.step /= n;
    const State a2 = run(scene, small, 1);
    EXPECT_LT(position_difference(a3, a2), 1e-11) << n;     // measured at most 1e-13
    EXPECT_LT(orientation_difference(a3, a2), 1e-10) << n;  // measured at most 1e-12
  }
}

// Claim 3 (IV.2.2): at equal row solves, sub-steps buy more than iterations.
TEST(Claim3, SubstepsBeatIterationsOnAChain) {
  const Scene scene = chain(3);
  Settings fine = settings(Algorithm::a1, 1, 1);
  fine.step /= 1024;
  const State reference = run(scene, fine, 1);
  for (const int n : {4, 16}) {
    const double substeps =
        position_difference(run(scene, settings(Algorithm::a3, n, 1, Joints::rows), 1), reference);
    const double iterations = position_difference(run(scene, settings(Algorithm::a2, 1, n), 1), reference);
    EXPECT_LT(substeps, 0.5 * iterations) << n;  // measured 0.34 at n = 4, 0.10 at n = 16
  }
}

// Claim 4 (IV.3): A4 is a first-order approximation of A3.
TEST(Claim4, OneStepOfA4DiffersFromA3BySecondOrderInPosition) {
  // From a state on the constraints: a gap that does not shrink with h would be all that is seen. A long step
  // of A1 from rest, without weight, is a step of Newton's method to it.
  Scene scene = moving_chain();
  Settings direct = settings(Algorithm::a1, 1, 1);
  const auto continue_from = [&scene](const State& state) {
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
      scene.bodies[i].pose = {state.q[i].linear, state.q[i].angular};
      scene.bodies[i].linear_velocity = state.v[i].linear;
      scene.bodies[i].angular_velocity = state.v[i].angular;
    }
  };
  State moving = initial_state(scene);
  const Vector3 gravity = scene.gravity;
  scene.gravity.setZero();
  direct.step = 1;
  for (int i = 0; i < 8; ++i) {
    State still = initial_state(scene);
    set_zero(still.v);
    continue_from(still);
    continue_from(run(scene, direct, direct.step));
  }
  scene.gravity = gravity;
  moving.q = initial_state(scene).q;
  continue_from(moving);
  direct.step = 1e-5;
  continue_from(run(scene, direct, 0.01));
  double last_position = 0;
  double last_velocity = 0;
  for (int k = 0; k < 7; ++k) {
    Settings a3 = settings(Algorithm::a3, 4, 1);
    a3.step = 1.0 / (240 << k);
    Settings a4 = a3;
    a4.algorithm = Algorithm::a4;
    const State one = run(scene, a3, a3.step);
    const State other = run(scene, a4, a4.step);
    const double position = position_difference(one, other);
    const double velocity = velocity_difference(one, other);
    if (k > 3) {
      EXPECT_NEAR(std::log2(last_position / position), 2, 0.05) << k;  // measured 2.007
      EXPECT_NEAR(std::log2(last_velocity / velocity), 1, 0.05) << k;  // measured 1.008
    }
    last_position = position;
    last_velocity = velocity;
  }
}

// Claim 5 (IV.4): A5 is A4 refactored.
TEST(Claim5, A5EqualsA4WithFrozenJacobians) {
  const Scene scene = moving_chain();
  for (const auto& [tau, kappa] : {std::pair{1.0, 1.0}, {0.6, 0.9}, {0.3, 1.0}, {0.9, 0.5}, {1.2, 1.1}}) {
    for (const int m : {1, 3}) {
      Settings a4 = settings(Algorithm::a4, 4, m);
      a4.tau = tau;
      a4.kappa = kappa;
      Settings a5 = a4;
      a5.algorithm = Algorithm::a5;
      const State one = run(scene, a4, 1);
      const State other = run(scene, a5, 1);
      EXPECT_LT(position_difference(one, other), 1e-11) << tau << ' ' << kappa << ' ' << m;  // measured 1e-13
      EXPECT_LT(orientation_difference(one, other), 1e-9) << tau << ' ' << kappa << ' ' << m;
    }
  }
}

TEST(Claim5, HoldsForOneSidedAndLimitedRowsToo) {
  Scene scene = test::floor_scene(0.4);
  test::add_box(scene, {1, 1, 1}, 1, {{0, 0.6, 0}, rotation_quaternion({0.1, 0.2, 0.05})}, 0.4);
  scene.bodies[1].linear_velocity = {1, 0, 0.3};
  Settings a4 = settings(Algorithm::a4, 4, 2);
  a4.tau = 0.6;
  a4.kappa = 0.9;
  Settings a5 = a4;
  a5.algorithm = Algorithm::a5;
  // Contacts amplify rounding by each new contact set, so the time is short: 20 steps, 4 of them with
  // contact.
  const State one = run(scene, a4, 20 * a4.step);
  const State other = run(scene, a5, 20 * a5.step);
  EXPECT_LT(position_difference(one, other), 1e-11);
}

// A joint beside contacts: A5's sum of velocities follows the joint's τ and κ, contacts take their own share.
TEST(Claim5, HoldsWhereContactsHaveTheirOwnStabilization) {
  const Scene scene = scene_named("powered_wheel");
  Settings a4 = settings(Algorithm::a4, 4, 2);
  a4.tau = 0.6;
  a4.kappa = 0.9;
  a4.contact_tau = 1.1;
  a4.contact_kappa = 0.7;
  Settings a5 = a4;
  a5.algorithm = Algorithm::a5;
  const State one = run(scene, a4, 0.25);
  EXPECT_LT(position_difference(one, run(scene, a5, 0.25)), 1e-11);
  Settings all = a5;
  all.contact_tau = all.contact_kappa = 0;
  EXPECT_GT(position_difference(one, run(scene, all, 0.25)), 1e-6);
}

// Claim 6 (IV.4.1): with recomputed ('stable') Jacobians A5 stops improving where A4 goes on.
TEST(Claim6, A5FallsBehindA4WithManyStableSubsteps) {
  const Scene scene = chain(3);
  Settings fine = settings(Algorithm::a1, 1, 1);
  fine.step /= 1024;
  const State reference = run(scene, fine, 1);
  const auto error = [&](Algorithm algorithm, int n) {
    return position_difference(run(scene, settings(algorithm, n, 1, Joints::stable), 1), reference);
  };
  EXPECT_GT(error(Algorithm::a5, 16), 1.5 * error(Algorithm::a4, 16));  // measured 1.67
  EXPECT_LT(error(Algorithm::a4, 64), 0.5 * error(Algorithm::a4, 16));
  EXPECT_GT(error(Algorithm::a5, 64), error(Algorithm::a5, 16) * 0.7);
}

// Claim 10 (III): J v = J̆ v̆, and M̆⁻¹ does not change with time.
TEST(Claim10, LocalRowsGiveTheSameVelocitiesAndResponses) {
  Scene scene = moving_chain();
  scene.bodies[2].inverse_inertia = {3, 40, 50};
  double largest = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const Scene posed = claims::disturbed(scene, seed, 3);
    const claims::Formulated body(posed, Joints::rows, 0.01);
    const std::vector<Velocity> local = body.local_velocities();
    for (const Block& block : body.problem.c.blocks) {
      const Row in_world = body.in_world(block, block.first);
      const Row& in_body = body.problem.c.rows[block.first];
      const double one = row_velocity(in_world, body.state.v[block.a], body.state.v[block.b]);
      const double other = row_velocity(in_body, local[block.a], local[block.b]);
      largest = std::max(largest, std::abs(one - other));
      // M̆⁻¹ J̆ᵀ with the constant M̆⁻¹ is R⁻¹ M⁻¹ Jᵀ.
      const Vector3 turned = body.state.q[block.a].angular.conjugate() * in_world.response_a;
      largest = std::max(largest, (turned - in_body.response_a).norm() / (1 + turned.norm()));
    }
  }
  EXPECT_LT(largest, 1e-13);  // measured 1.4e-14 at velocities of up to 5 m/s
}

// Claim 11 (IV.2.2, point 3): micro-iteration with τ, κ converges to J v = (τ/κ) β, which ω of PSOR would
// not.
TEST(Claim11, TheFixedPointOfMicroIterationIsTauOverKappa) {
  Scene scene = chain(3, 0.3);
  scene = claims::disturbed(scene, 3, 0.2);
  scene.gravity.setZero();
  claims::Formulated at(scene, Joints::plain, 0.01);
  Constraints& c = at.problem.c;
  std::vector<Velocity>& v = at.state.v;
  for (Row& row : c.rows) row.beta = 0.25;
  const double tau = 0.5;
  const double kappa = 0.8;
  for (int i = 0; i < 4000; ++i) {
    for (const Block& x : c.blocks) apply(c, x, solve(c, x, kappa, tau, v), v);
  }
  for (const Block& x : c.blocks) {
    for (int k = 0; k < x.rows; ++k) {
      const Row& row = c.rows[x.first + k];
      EXPECT_NEAR(row_velocity(row, v[x.a], v[x.b]), tau / kappa * row.beta, 1e-9);
    }
  }
}

// Claim 12 (IV.3.1.4): a velocity-level row must undo the baked-in update rule; then a motor holds its speed.
TEST(Claim12, AMotorHoldsItsSpeedInAllFive) {
  Scene scene = test::empty_scene();
  Body wheel;
  wheel.name = "wheel";
  wheel.inverse_mass = 0.5;
  wheel.inverse_inertia = {10, 10, 5};
  scene.bodies.push_back(wheel);
  // The joint stands in the world, the wheel is the connected node: coordinates are the wheel's in the world.
  Joint axle = test::ball_joint(0, 1, Vector3::Zero(), Vector3::Zero());
  axle.limits.push_back(test::locked(true, {true, true, false}));
  JointDrive drive;
  drive.angular = true;
  drive.axis = 2;
  drive.velocity_target = 6;
  drive.damping = 1e6;
  axle.drives.push_back(drive);
  scene.joints.push_back(axle);
  for (const Algorithm algorithm :
       {Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    Settings s = settings(algorithm, 4, 4);
    const State state = run(scene, s, 1);
    EXPECT_NEAR(state.v[1].angular.z(), 6, 1e-4)
        << name(algorithm);  // 6 · γ/(Γ+γ): the drive is soft by 1e-5
    if (algorithm >= Algorithm::a3) {
      s.tau = s.kappa = 0.8;
      EXPECT_NEAR(run(scene, s, 1).v[1].angular.z(), 6, 1e-4) << name(algorithm) << " with τ, κ";
    }
  }
}

}  // namespace
}  // namespace substep
