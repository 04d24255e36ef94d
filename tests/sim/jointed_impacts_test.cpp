// Balls that hit bodies on joints, in scenes drawn from a seed: against closed forms, or Lagrange's
// equations.

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "tests/sim/minimal_coordinates.h"
#include "tests/sim/moving_solids.h"

namespace substep::test {
namespace {

/// A frictionless ball that flies against a normal.
struct Hit {
  Scene scene;
  int ball;
  Vector3 normal;
  double mass;
  double speed;
  double e;

  /// Returns the error of the ball's velocity at the end, relative to its exact change in the impact; `later`
  /// is the change of velocity after the impact.
  Trial trial(std::string parameters, double inverse_mass_of_struck, double duration,
              const Vector3& later = Vector3::Zero()) const {
    const Vector3 change = (1 + e) * speed / (1 / mass + inverse_mass_of_struck) / mass * normal;
    const Vector3 expected = scene.bodies[static_cast<std::size_t>(ball)].linear_velocity + change + later;
    return last_of(std::move(parameters), scene, duration,
                   [=, i = static_cast<std::size_t>(ball)](const State& state, double) {
                     return (state.v[i].linear - expected).norm() / change.norm();
                   });
  }
};

/// Adds a ball that meets a point after `meeting` seconds.
Hit add_hitting_ball(const Scene& scene, Random& random, double radius, const Vector3& point, double meeting,
                     const Vector3& normal, double mass, double speed, double e) {
  Hit hit{scene, 0, normal, mass, speed, e};
  hit.ball = add_body(hit.scene, ball(radius),
                      {{point + (radius + speed * meeting) * normal, random.orientation()}, -speed * normal},
                      {mass, ball_moments(mass, radius), e, 0});
  return hit;
}

/// A plank on a hinge in the world, about its y axis at its end x = −length/2.
struct Plank {
  Vector3 size;
  double mass;
  Pose frame;  ///< of its middle

  /// Moment of inertia, kg m².
  double about_hinge() const {
    return mass * ((size.x() * size.x() + size.z() * size.z()) / 12 + 0.25 * size.x() * size.x());
  }

  int add_to(Scene& scene, double e) const {
    const int plank = add_body(scene, box_of(size), {frame}, {mass, box_moments(mass, size), e, 0});
    const Vector3 end(-0.5 * size.x(), 0, 0);
    Joint hinge = ball_joint(plank, world_body, end, frame * end);
    hinge.frame_b.orientation = frame.orientation;
    hinge.limits.push_back(locked(true, {true, false, true}));  // free about y
    scene.joints.push_back(hinge);
    return plank;
  }
};

/// A door that turns about a hinge and a ball that touches it without friction, in the plane across the
/// hinge, where the closed door lies along x. A force acts on the ball along y.
struct DoorAndBall {
  double about_hinge;  ///< moment of inertia, kg m²
  double mass;         ///< of the ball
  double force;        ///< N
  double depth;        ///< of the ball's centre behind the door's middle plane, m
  std::vector<double>
      y;  ///< the ball's distance from the hinge along the door, the door's angle; their momenta

  double spin_at(const std::vector<double>& state) const {
    return (state[3] - depth * state[2]) / (about_hinge + mass * state[0] * state[0]);
  }
  double spin() const { return spin_at(y); }
  /// Returns the ball's velocity along x and y.
  Eigen::Vector2d velocity() const {
    return Eigen::Rotation2Dd(y[1]) * Eigen::Vector2d(y[2] / mass, y[0] * spin());
  }
  /// Advances by Lagrange's equations, for as long as the ball presses the door.
  void advance(double duration) {
    const auto rate = [&](const std::vector<double>& state) {
      const double w = spin_at(state);
      return std::vector<double>{state[2] / mass - depth * w, w,
                                 mass * state[0] * w * w + force * std::sin(state[1]),
                                 force * (state[0] * std::cos(state[1]) + depth * std::sin(state[1]))};
    };
    for (int i = 0; i < 2000; ++i) {
      std::vector<double> next = y;
      runge_kutta(rate, duration / 2000, next);
      if (spin_at(next) < spin()) return;
      y = next;
    }
  }
};

/// Draws a ball that hits a plank on a hinge, at a random distance from the hinge.
Trial draw_hinged_plank(Random& random) {
  const Vector3 size(random.between(0.5, 2), random.between(0.1, 0.5), random.between(0.02, 0.1));
  const double mass = random.spread(0.5, 5);
  const double ball_mass = random.spread(0.5, 5);
  const double e = random.one_of({0.0, 0.5, 0.9});
  double speed = random.spread(1, 10);
  const double meeting = random.between(0.02, 0.2);
  const double radius = random.between(0.03, 0.1);
  const double lever = random.between(0.3, 1) * size.x();
  const Plank plank{size, mass, {random.direction(), random.orientation()}};
  const double about_hinge = plank.about_hinge();
  // Without restitution the two go on together. Where they turn by 0.3 rad a step, the step alone is off by
  // up to 7 %, which its halves quarter; 0.05 rad leave the impact to be seen.
  const double spin_after =
      ball_mass * lever / (about_hinge + ball_mass * lever * lever);  // a metre a second
  if (e == 0) speed = std::min(speed, 0.05 * 60 / spin_after);
  Scene scene = weightless_scene();
  plank.add_to(scene, e);
  const Hit hit = add_hitting_ball(scene, random, radius,
                                   plank.frame * Vector3(lever - 0.5 * size.x(), 0, -0.5 * size.z()), meeting,
                                   plank.frame.orientation * Vector3(0, 0, -1), ball_mass, speed, e);
  // Without restitution the ball continues to press for a while, since its centre is farther from the hinge.
  const double duration = std::ceil((meeting + 0.03) * 60) / 60;
  Vector3 later = Vector3::Zero();
  if (e == 0) {
    DoorAndBall exact{
        about_hinge, ball_mass, 0, 0.5 * size.z() + radius, {lever, 0, 0, ball_mass * lever * speed}};
    const Eigen::Vector2d before = exact.velocity();
    exact.advance(duration - meeting);
    const Eigen::Vector2d change = exact.velocity() - before;
    later = plank.frame.orientation * Vector3(change.x(), 0, change.y());
  }
  return hit.trial(
      fmt::format("plank of {:.2f} m and {:.2f} kg, ball of {:.2f} kg at {:.2f} m/s, {:.2f} m from "
                  "the hinge, e {}, meeting at {:.4f} s",
                  size.x(), mass, ball_mass, speed, lever, e, meeting),
      lever * lever / about_hinge, duration, later);
}

Trial draw_pushed_door(Random& random) {
  const Vector3 size(random.between(0.5, 1.5), random.between(0.5, 2), random.between(0.02, 0.1));
  const double mass = random.spread(1, 10);
  const double ball_mass = random.spread(0.5, 5);
  const double radius = random.between(0.03, 0.1);
  const double lever = random.between(0.3, 0.8) * size.x();
  const Plank plank{size, mass, {random.direction(), random.orientation()}};
  Scene scene = empty_scene();
  const auto door = static_cast<std::size_t>(plank.add_to(scene, 0));
  scene.bodies[door].gravity_factor = 0;
  const double depth = 0.5 * size.z() + radius;
  add_body(scene, ball(radius),
           {{plank.frame * Vector3(lever - 0.5 * size.x(), 0, -depth), random.orientation()}},
           {ball_mass, ball_moments(ball_mass, radius), 0, 0});
  // Such that it turns by about 0.4 rad in 1 to 2 s: in a few steps an algorithm of first order is off by
  // more than the limit for the step alone.
  const double duration = std::ceil(random.between(1, 2) * 60) / 60;
  const double acceleration =
      0.8 / (duration * duration) *
      (plank.about_hinge() / (ball_mass * lever) + lever);  // m/s², of the ball's weight
  scene.gravity = acceleration * (plank.frame.orientation * Vector3(0, 0, 1));
  DoorAndBall exact{plank.about_hinge(), ball_mass, ball_mass * acceleration, depth, {lever, 0, 0, 0}};
  exact.advance(duration);
  return last_of(
      fmt::format("door of {:.2f} m and {:.2f} kg, ball of {:.2f} kg, {:.2f} m from the hinge, {:.3f} s",
                  size.x(), mass, ball_mass, lever, duration),
      scene, duration, [=, expected = exact.spin()](const State& state, double) {
        return std::abs(state.v[door].angular.norm() / expected - 1);
      });
}

/// Draws a ball that hits the hammer at the end of a straight chain, across the chain.
Trial draw_hammer(Random& random) {
  const int links = 1 + random.below(6);
  const double length = random.between(0.1, 0.4);
  const double link_mass = random.spread(0.3, 2);
  const double hammer_mass = link_mass * random.spread(1, 10);
  const double e = random.one_of({0.3, 0.6, 0.9});
  const double speed = random.spread(1, 10);
  const double meeting = random.between(0.02, 0.2);
  const double radius = random.between(0.05, 0.1);
  const double half = random.between(0.05, 0.15);  // of the hammer, a cube
  const Quaternion turn = random.orientation();
  const Vector3 origin = random.direction();
  Scene scene = weightless_scene();
  // y of all bodies' middles by the bodies' spins, and their masses: the chain lies along x.
  const int count = links + 1;
  Eigen::MatrixXd arms = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd masses(count);
  Eigen::VectorXd moments(count);
  double reached = 0;
  for (int i = 0; i < count; ++i) {
    const bool is_hammer = i == links;
    const double half_length = is_hammer ? half : 0.5 * length;
    masses[i] = is_hammer ? hammer_mass : link_mass;
    const Vector3 size =
        is_hammer ? Vector3(2 * half, 2 * half, 2 * half) : Vector3(length, 0.1 * length, 0.1 * length);
    const Vector3 principal = box_moments(masses[i], size);
    moments[i] = principal.y();
    Solid solid = box_of(size);
    if (!is_hammer) solid.parts.clear();
    const int body = add_body(scene, solid, {{origin + turn * Vector3(reached + half_length, 0, 0), turn}},
                              {masses[i], principal, e, 0});
    const Vector3 before = i == 0 ? origin : Vector3(0.5 * length, 0, 0);
    scene.joints.push_back(ball_joint(body, i == 0 ? world_body : body - 1, {-half_length, 0, 0}, before));
    for (int j = 0; j < i; ++j) arms(i, j) = length;
    arms(i, i) = half_length;
    reached += 2 * half_length;
  }
  const Eigen::MatrixXd inertia =
      arms.transpose() * masses.asDiagonal() * arms + Eigen::MatrixXd(moments.asDiagonal());
  const double offset = random.between(-0.9, 0.9) * half;  // along the chain, from the hammer's middle
  Eigen::VectorXd row = arms.row(links).transpose();
  row[links] += offset;
  const double inverse_mass = row.dot(inertia.ldlt().solve(row));
  // Make the ball so light that it rebounds: otherwise the hammer could turn and hit it again.
  const double ball_mass = random.between(0.2, 0.9) * e / inverse_mass;
  const Vector3 point = origin + turn * Vector3(reached - half + offset, 0, -half);
  return add_hitting_ball(scene, random, radius, point, meeting, turn * Vector3(0, 0, -1), ball_mass, speed,
                          e)
      .trial(
          fmt::format("{} links of {:.2f} m and {:.2f} kg, hammer of {:.2f} kg, ball of {:.2f} kg at {:.2f} "
                      "m/s, {:.3f} m off its middle, e {}, meeting at {:.4f} s",
                      links, length, link_mass, hammer_mass, ball_mass, speed, offset, e, meeting),
          inverse_mass, meeting + 0.03);
}

TEST(JointedImpact, HingedPlankTakesItsImpulse) {
  run({"hinged plank: momentum", 0.02, &draw_hinged_plank});
}

TEST(JointedImpact, PushedDoorTurnsAsFast) {
  run({"pushed door: angular speed", 0.02, &draw_pushed_door});
}

TEST(JointedImpact, HammerOnAChainTakesItsImpulse) {
  run({"hammer on a chain: momentum", 0.02, &draw_hammer});
}

// Two rods in line turn at 1 rad/s until the first one's hinge meets a stop. The second one keeps its angular
// momentum about the hinge between them, m (1.5 · 0.5 + 1/12), where its moment is m/3.
TEST(JointLimit, PassesSpinOfStoppedLinkOn) {
  Scene scene = weightless_scene();
  for (int i = 0; i < 2; ++i) {
    Body& body = scene.bodies.emplace_back(rod(1, 1));
    body.pose.position = {0.5 + i, 0, 0};
    body.linear_velocity = {0, 0.5 + i, 0};
    body.angular_velocity = {0, 0, 1};
    scene.joints.push_back(ball_joint(i, i + 1, {i == 0 ? 0 : 0.5, 0, 0}, {-0.5, 0, 0}));
    scene.joints.back().limits.push_back(locked(true, {true, true, false}));
  }
  scene.joints[0].limits.push_back(range(true, {false, false, true}, -infinity, 0.1));
  // A2 is off by 5 % after its ten sweeps.
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    for (const double step : {1.0 / 60, 1.0 / 120, 1.0 / 240}) {
      const State state = run(scene, {.algorithm = algorithm, .step = step}, 0.2);
      EXPECT_NEAR(state.v[1].angular.z(), 0, 0.06) << name(algorithm) << " " << step;
      EXPECT_NEAR(state.v[2].angular.z(), 2.5, 0.06) << name(algorithm) << " " << step;
    }
  }
}

}  // namespace
}  // namespace substep::test
