// Compares rolling bodies with closed forms in all five algorithms: balls, a cylinder and a capsule, off the
// axes, of unusual sizes and masses, on a tilted floor. In A3, sub-steps must be as good as steps of A1.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "sim/geometry/round_shapes.h"
#include "sim/math/rotation.h"
#include "sim/simulation.h"
#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

constexpr double rolling_friction = 0.5;
using test::gravity;

/// A body that rolls on the floor: a ball, or a solid about Y whose axis is across the slope. Gravity is
/// turned by `slope` about an axis other than x and z.
struct Rolling {
  Shape shape;
  double radius;          ///< m
  double mass;            ///< kg
  double inertia_factor;  ///< moment of inertia over m r²: solid ball 2/5, hollow ball 2/3, cylinder 1/2
  double slope;           ///< rad
  double direction;       ///< of the way down, angle from x towards z, rad
  double limit;           ///< of the errors relative to the speed
};

class Rolls : public testing::TestWithParam<Algorithm> {};

TEST_P(Rolls, FollowsClosedFormDownhill) {
  // Measured with balls: A1 1e-13, A2 4e-5, A3 7e-4 (the small one, which turns by 0.8 rad in the last
  // steps), A4 and A5 8e-5; with a cylinder and a capsule: A1 3e-13, A2 2e-4, A3 to A5 3e-4 (the cylinder).
  const double of_solids = GetParam() == Algorithm::a1 ? 1e-11 : 6e-4;
  const double of_balls = GetParam() == Algorithm::a3 ? 1e-3 : std::min(of_solids, 1e-4);
  for (const Rolling& x : {Rolling{Sphere{0.3}, 0.3, 2, 0.4, 0.2, 0.7, of_balls},
                           Rolling{Sphere{0.07}, 0.07, 0.5, 2.0 / 3, 0.3, 2.5, of_balls},
                           Rolling{make_cylinder(0.3, 0.11, 0.11), 0.11, 3, 0.5, 0.25, 0.7, of_solids},
                           Rolling{Capsule{0.2, 0.17}, 0.17, 3, 0.45, 0.25, -1.9, of_solids}}) {
    Scene scene = test::floor_scene(rolling_friction);
    const Vector3 down(std::cos(x.direction), 0, std::sin(x.direction));
    scene.gravity = gravity * (std::sin(x.slope) * down - std::cos(x.slope) * Vector3::UnitY());
    Body& body = scene.bodies[test::add_ball(scene, x.radius, x.mass, Vector3::Zero(), rolling_friction)];
    body.inverse_inertia *= 0.4 / x.inertia_factor;
    body.pose = {{3, x.radius, -2}, Quaternion(0.5, 0.5, -0.5, 0.5)};
    // Lay the axis of a solid in the floor, across the slope.
    if (!std::holds_alternative<Sphere>(x.shape))
      body.pose.orientation = shortest_rotation(Vector3::UnitY(), down.cross(Vector3::UnitY()));
    scene.colliders.back().shape = x.shape;
    const double acceleration = gravity * std::sin(x.slope) / (1 + x.inertia_factor);
    const auto error = [&](const State& state, double time) {
      const auto& [linear, angular] = state.v[1];
      const double speed = acceleration * time;
      // Allow for sideways velocity in the first step, m/s: with κ < 1 it fades. Measured 1.3e-5.
      const double fading = time < 1.5 / 60 ? 2e-5 : 0;
      return std::max({std::abs(linear.dot(down) - speed), std::abs(angular.norm() * x.radius - speed),
                       (linear - linear.dot(down) * down).norm() - fading}) /
             speed;
    };
    EXPECT_LT(test::largest(scene, default_settings(GetParam()), 2, error), x.limit) << x.radius;
  }
}

/// Returns the position of a ball that rolls on a tilting slab; the slab is body 1 where `slab_first`.
Vector3 position_on_tilting_slab(Algorithm algorithm, bool slab_first) {
  Scene scene = test::empty_scene();
  const Pose pose{{0.4, 1, 0.2}, rotation_quaternion({0.1, 0.7, 0})};
  for (const bool is_slab : {slab_first, !slab_first}) {
    if (!is_slab) {
      test::add_ball(scene, 0.2, 2, pose * Vector3(0.3, 0.4, -0.2), rolling_friction);
      continue;
    }
    Body& slab = scene.bodies[test::add_box(scene, {4, 0.4, 4}, 1e6, pose, rolling_friction)];
    slab.inverse_inertia = Vector3::Constant(1e-6);
    slab.gravity_factor = 0;
    slab.angular_velocity = {1.5, 0.2, -0.8};
  }
  const State end = test::run(scene, default_settings(algorithm), 20.0 / 60);
  const auto& [position, orientation] = end.q[slab_first ? 1 : 2];
  const Vector3 ball = end.q[slab_first ? 2 : 1].linear;
  EXPECT_NEAR((orientation.inverse() * (ball - position)).y(), 0.4, 1e-3);  // still on the slab
  return ball;
}

TEST_P(Rolls, IgnoresOrderOnTiltingSlab) {
  const Vector3 position = position_on_tilting_slab(GetParam(), true);
  // Measured in m: A1 2e-16, A2, A4 and A5 1.5e-6, A3 9e-6: friction's displacements are in the second body's
  // frame, which turns. With a normal that turned with the ball A3 would differ by 5e-3.
  EXPECT_LT((position - position_on_tilting_slab(GetParam(), false)).norm(),
            GetParam() == Algorithm::a1 ? 1e-13 : 2e-5);
}

/// A plank rocks on a fixed drum, with the frequency ω = √(m g (R − t/2) / (I + m t²/4)) for a thickness t.
TEST_P(Rolls, RocksOnDrum) {
  constexpr double radius = 0.4;
  constexpr double thickness = 0.1;
  constexpr double mass = 2;
  constexpr double tilt = 0.01;
  const Quaternion turn = rotation_quaternion({0, 0.7, 0});
  const Vector3 centre(3, 1, -2);
  Scene scene = test::empty_scene();
  const Vector3 upwards(-std::sin(tilt), std::cos(tilt), 0);
  const Vector3 along(std::cos(tilt), std::sin(tilt), 0);
  const Vector3 from_centre = (radius + thickness / 2) * upwards + radius * tilt * along;
  const Pose start{centre + turn * from_centre, turn * rotation_quaternion({0, 0, tilt})};
  const int plank = test::add_box(scene, {1.2, thickness, 0.3}, mass, start, 2);
  Collider drum = scene.colliders[0];
  drum.body = world_body;
  drum.shape = make_cylinder(1, radius, radius);
  drum.placement = {centre, turn * shortest_rotation(Vector3::UnitY(), Vector3::UnitZ())};
  scene.colliders.push_back(drum);
  const double inertia = 1 / scene.bodies[plank].inverse_inertia.z() + mass * thickness * thickness / 4;
  const double square = mass * gravity * (radius - thickness / 2) / inertia;  // ω²
  for (const int substeps : {4, 16}) {
    const Settings settings = test::with_substeps(GetParam(), substeps);
    const auto period = static_cast<int>(std::lround(2 * test::pi / std::sqrt(square) / settings.step));
    Simulation simulation(scene, settings);
    std::array<double, 6> squares{};  // of the swing, summed over each period
    for (double& sum : squares) {
      for (int i = 0; i < period; ++i) {
        simulation.step();
        const double angle = 2 * (turn.inverse() * simulation.state().q[plank].angular).z();
        sum += simulation.state().v[plank].angular.squaredNorm() + square * angle * angle;
      }
    }
    const double rate = std::log(squares[5] / squares[1]) / (8 * period * settings.step);
    // In A4 and A5 swings grow, since they push where the bodies touched as the step began (claim 18).
    const bool frozen = GetParam() == Algorithm::a4 || GetParam() == Algorithm::a5;
    const double predicted = square * settings.step * (1 - 1.0 / substeps) / 4;  // 0.087 and 0.109 1/s
    // Measured: 0.0003 off in A4 and A5, below 0.00005 in the others.
    EXPECT_NEAR(rate, frozen ? predicted : 0, 5e-4) << substeps;
  }
}

INSTANTIATE_TEST_SUITE_P(All, Rolls, testing::ValuesIn(test::all_algorithms),
                         [](const auto& algorithm) { return std::string(name(algorithm.param)); });

/// Returns the largest distance of a body's centre in A3 from that in A1 with A3's sub-steps as steps, m.
/// Returns infinity where A3 diverges or the body stands still in A1.
double farthest_from_fine_steps(const Scene& scene, int body, double step, int substeps, double duration) {
  Settings fine = default_settings(Algorithm::a1);
  fine.step = step / substeps;
  Settings coarse = default_settings(Algorithm::a3);
  coarse.step = step;
  coarse.substeps = substeps;
  coarse.iterations = 8;
  Simulation exact(scene, fine);
  Simulation rolled(scene, coarse);
  double farthest = 0;
  for (int i = 0; i < static_cast<int>(duration / step + 0.5); ++i) {
    for (int k = 0; k < substeps; ++k) exact.step();
    if (rolled.step().status == StepReport::Status::diverged) return infinity;
    farthest = std::max(farthest, (exact.state().q[body].linear - rolled.state().q[body].linear).norm());
  }
  return exact.state().q[body].linear == scene.bodies[body].pose.position ? infinity : farthest;
}

TEST(RollingOfA3, SubstepsEqualStepsOfA1) {
  // The point of contact runs round Euler's disk by 0.33 rad a step, and over decimetres of the rattleback.
  // Measured: 0.098 and 0.062 mm; 237 and 2.4 mm where the point is fixed in the body for a step.
  EXPECT_LT(farthest_from_fine_steps(scene_named("euler_disk"), 1, 1.0 / 60, 10, 1), 2e-4);
  EXPECT_LT(farthest_from_fine_steps(scene_named("rattleback"), 1, 1.0 / 480, 10, 1), 1e-4);
}

/// Two spinning balls meet in the air: the normal joins their centres, and turns with neither.
TEST(RollingOfA3, SpinningBallsPushAlongTheirLine) {
  Scene scene = test::weightless_scene();
  const Vector3 towards = Vector3(0.6, 0.48, 0.64);
  for (const double side : {-1.0, 1.0}) {
    const int ball = test::add_ball(scene, 0.09, 0.7, Vector3(1, 2, 3) + side * 0.0899 * towards, 0);
    scene.bodies[ball].linear_velocity = -side * 0.1 * towards;
    scene.bodies[ball].angular_velocity = Vector3(30, -20, 40);
  }
  for (const int substeps : {4, 30}) {
    const Settings settings = test::with_substeps(Algorithm::a3, substeps);
    const Vector3 velocity = test::run(scene, settings, 10 * settings.step).v[2].linear;
    const Vector3 across = velocity - towards * towards.dot(velocity);
    // Measured: 2e-16 m/s; 0.5 and 0.9 m/s with a normal that turns with a ball.
    EXPECT_LT(across.norm(), 1e-14) << substeps;
    EXPECT_GT(towards.dot(velocity), -0.05) << substeps;  // the balls touched
  }
}

}  // namespace
}  // namespace substep
