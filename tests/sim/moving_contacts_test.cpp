// Bodies that move and meet, or miss: against closed forms that share nothing with the solver, at default
// settings, in scenes drawn from a seed. Prints a table.
// One file, since its tables are printed as one.

#include <gtest/gtest.h>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/sim/moving_solids.h"
#include "tests/sim/random_trials.h"

namespace substep {
namespace {

using test::infinite_error;
using test::Random;
using test::Solid;
using test::Start;
using test::Substance;
using test::Trial;

constexpr double gravity = 9.81;

// Near misses

/// Two solids that fly past one another, or one past a plane.
struct FlyPast {
  Solid one;
  Solid other;
  bool is_plane = false;  ///< in place of `other`: through the origin
  Vector3 normal;         ///< of the plane
  Start start_of_one;
  Start start_of_other;
  double duration = 0;

  double gap(double time) const {
    const Pose pose = start_of_one.at(time);
    return is_plane ? test::height_above(normal, one, pose)
                    : test::distance(one, pose, other, start_of_other.at(time));
  }
  /// A bound of how fast the gap changes, m/s.
  double speed() const {
    const double relative = (start_of_one.velocity - start_of_other.velocity).norm();
    return relative + start_of_one.spin.norm() * one.reach() + start_of_other.spin.norm() * other.reach();
  }
  /// Returns true where they keep 0.8 of `clearance` throughout, by conservative advancement.
  bool keeps(double clearance) const {
    const double bound = std::max(speed(), 1e-9);
    for (double time = 0; time < duration;) {
      const double now = gap(time);
      if (now < 0.9 * clearance) return false;
      time += std::max(now - 0.8 * clearance, 0.1 * clearance) / bound;
    }
    return true;
  }
};

/// Sets how many sub-steps, or iterations of A2, instead of the scene's own where n is positive.
Settings settings_with(const Scene& scene, Algorithm algorithm, int n) {
  Settings settings = test::default_settings_of(scene, algorithm);
  if (n > 0) (algorithm == Algorithm::a2 ? settings.iterations : settings.substeps) = n;
  return settings;
}

/// The largest change of a body's velocity in a run, and of its spin times its reach, relative to `speed`.
/// Bodies fall freely where `falls`.
double change_of_motion(const Scene& scene, const Settings& settings, double duration,
                        const std::vector<double>& reaches, double speed, const Vector3& fall) {
  return test::largest(scene, settings, duration, [&](const State& state, double time) {
    double largest = 0;
    for (std::size_t i = 1; i < state.v.size(); ++i) {
      const Body& body = scene.bodies[i];
      const Vector3 change = state.v[i].linear - body.linear_velocity - time * fall;
      const Vector3 change_of_spin = state.v[i].angular - body.angular_velocity;
      largest = std::max({largest, change.norm() / speed, change_of_spin.norm() * reaches[i - 1] / speed});
    }
    return largest;
  });
}

Trial draw_fly_past(Random& random) {
  FlyPast scene_of;
  const double clearance = random.spread(0.001, 0.2);
  const double speed = random.spread(0.5, 30);
  const double meeting = random.between(0.05, 0.4);
  scene_of.one = test::random_solid(random, random.spread(0.05, 0.5));
  scene_of.duration = meeting + 0.3;
  const int kind = random.below(4);  // a moving solid, a still one, a mesh, a plane
  if (kind < 2) scene_of.other = test::random_solid(random, random.spread(0.05, 0.5));
  if (kind == 2) {
    const Vector3 size(random.between(0.2, 1), random.between(0.2, 1), random.between(0.2, 1));
    scene_of.other = random.flip() ? test::box_mesh(size) : test::rectangle_mesh(size.x(), size.z());
  }
  scene_of.is_plane = kind == 3;
  const auto spin = [&] { return Vector3(random.direction() * random.between(0, 50) * random.below(2)); };
  const Vector3 along = random.direction();
  const Vector3 aside = random.across(along);
  scene_of.normal = aside;
  scene_of.start_of_one.pose.orientation = random.orientation();
  scene_of.start_of_one.spin = spin();
  scene_of.start_of_other.pose.orientation = random.orientation();
  if (kind == 0) {
    scene_of.start_of_other.spin = spin();
    scene_of.start_of_other.velocity = speed * random.between(0, 1) * random.direction();
  }
  scene_of.start_of_one.velocity = scene_of.start_of_other.velocity + speed * along;
  // Shift the path aside until it is as close as drawn.
  const auto shifted = [&](double by) {
    FlyPast result = scene_of;
    result.start_of_one.pose.position = by * aside - speed * meeting * along;
    return result;
  };
  double near = 0;
  double far = scene_of.one.reach() + (kind == 3 ? 0 : scene_of.other.reach()) + 1.1 * clearance;
  for (int i = 0; i < 14; ++i) {
    const double middle = 0.5 * (near + far);
    (shifted(middle).keeps(clearance) ? far : near) = middle;
  }
  scene_of = shifted(far);

  const bool moves = kind == 0;
  Substance substance;
  substance.restitution = random.one_of({0.0, 0.5, 0.95});
  substance.friction = 0.6;
  const int n = random.one_of({0, 0, 1, 4, 30, 100});
  Scene scene = test::empty_scene();
  scene.gravity = random.flip() ? Vector3(0, -gravity, 0) : Vector3::Zero();
  // Equal moments: a body of unequal ones changes its spin without any contact.
  const auto substance_of = [&](const Solid& solid) {
    substance.mass = random.spread(0.3, 3);
    substance.moments.setConstant(0.3 * substance.mass * solid.reach() * solid.reach());
    return substance;
  };
  test::add_body(scene, scene_of.one, scene_of.start_of_one, substance_of(scene_of.one));
  std::vector<double> reaches{scene_of.one.reach()};
  if (moves) {
    test::add_body(scene, scene_of.other, scene_of.start_of_other, substance_of(scene_of.other));
    reaches.push_back(scene_of.other.reach());
  } else {
    scene.bodies[1].gravity_factor = 0;
    if (scene_of.is_plane) {
      test::add_static_plane(scene, {Vector3::Zero(), Quaternion::FromTwoVectors(Vector3::UnitY(), aside)},
                             substance);
    } else {
      test::add_static(scene, scene_of.other, scene_of.start_of_other.pose, substance);
    }
  }
  const Vector3 fall = moves ? scene.gravity : Vector3::Zero();
  const char* kinds[] = {"flying", "still", "still", "still"};
  return {
      fmt::format("{} past a {} {}, {:.4f} m clear at {:.2f} m/s, spins {:.1f} and {:.1f} rad/s, e {}, n {} "
                  "(0: default), meeting at {:.4f} s",
                  scene_of.one.name, kinds[kind], kind == 3 ? "plane" : scene_of.other.name, clearance, speed,
                  scene_of.start_of_one.spin.norm(), scene_of.start_of_other.spin.norm(),
                  substance.restitution, n, meeting),
      [=](Algorithm algorithm) {
        return change_of_motion(scene, settings_with(scene, algorithm, n), scene_of.duration, reaches, speed,
                                fall);
      }};
}

/// A blade turns on the spot beside a post or a plane: its corners pass at a clearance.
Trial draw_blade(Random& random) {
  const double length = random.between(0.3, 1.5);
  const double width = random.between(0.02, 0.1);
  const Vector3 size(length, random.between(0.2, 1) * width, width);  // it turns about its largest moment
  const double clearance = random.spread(0.001, 0.2);
  const double spin = random.between(5, 50);
  const double mass = random.spread(0.3, 3);
  const double circle = 0.5 * std::hypot(length, width);
  const Quaternion turn = random.orientation();
  Substance substance{mass, test::box_moments(mass, size), random.one_of({0.0, 0.5, 0.95}), 0.6};
  Scene scene = test::empty_scene();
  scene.gravity.setZero();
  const Solid blade = test::box_of(size);
  const Quaternion phase = rotation_quaternion({0, random.between(0, 3), 0});
  test::add_body(scene, blade, {{Vector3::Zero(), turn * phase}, Vector3::Zero(), turn * Vector3(0, spin, 0)},
                 substance);
  const int kind = random.below(3);
  const double post = random.between(0.02, 0.2);
  if (kind == 0) {
    test::add_static_plane(
        scene,
        {turn * Vector3(0, 0, -circle - clearance), turn * rotation_quaternion({std::numbers::pi / 2, 0, 0})},
        substance);
  } else {
    test::add_static(scene, kind == 1 ? test::cylinder(0.5, post, post) : test::capsule(0.5, post),
                     {turn * Vector3(0, 0, -circle - clearance - post), turn}, substance);
  }
  return {
      fmt::format("blade of {:.2f} m at {:.1f} rad/s, {:.4f} m clear of a {}, e {}", length, spin, clearance,
                  kind == 0   ? "plane"
                  : kind == 1 ? "post"
                              : "round post",
                  substance.restitution),
      [=](Algorithm algorithm) {
        return change_of_motion(scene, test::default_settings_of(scene, algorithm), 1, {circle},
                                spin * circle, Vector3::Zero());
      }};
}

/// Draws a body that slides on a floor without friction past a post or a block, as on a pinball table. Only
/// motion along the floor counts.
Trial draw_pinball(Random& random) {
  const double radius = random.between(0.03, 0.2);
  const double clearance = random.spread(0.001, 0.2);
  const double speed = random.spread(0.5, 10);
  const double meeting = random.between(0.1, 0.5);
  const double mass = random.spread(0.3, 3);
  const Quaternion turn = rotation_quaternion({0, random.between(-3, 3), 0});
  const bool is_ball = random.flip();
  const Vector3 size = 2 * Vector3(random.between(0.5, 2) * radius, radius, radius);
  Substance substance{mass, is_ball ? test::ball_moments(mass, radius) : test::box_moments(mass, size),
                      random.one_of({0.0, 0.5, 0.95}), 0};
  Scene scene = test::empty_scene();
  Substance floor = substance;
  floor.restitution = 0;
  test::add_static_plane(scene, {}, floor);
  const Solid slider = is_ball ? test::ball(radius) : test::box_of(size);
  test::add_body(scene, slider,
                 {{turn * Vector3(-speed * meeting, radius, 0), turn}, turn * Vector3(speed, 0, 0)},
                 substance);
  const int kind = random.below(3);
  const double post = random.between(0.02, 0.3);
  const Vector3 place(random.between(-0.1, 0.1), 0.5, radius + clearance + post);
  if (kind == 0) test::add_static(scene, test::cylinder(0.5, post, post), {turn * place, turn}, substance);
  if (kind == 1)
    test::add_static(scene, test::ball(post), {turn * Vector3(0, post, place.z()), turn}, substance);
  if (kind == 2) {
    test::add_static(scene, test::box_of(2 * Vector3(random.between(0.05, 1), 0.5, post)),
                     {turn * place, turn}, substance);
  }
  return {
      fmt::format("{} of {:.3f} m slides past a {}, {:.4f} m clear at {:.2f} m/s, e {}", slider.name, radius,
                  kind == 0   ? "post"
                  : kind == 1 ? "ball"
                              : "block",
                  clearance, speed, substance.restitution),
      [=](Algorithm algorithm) {
        return test::largest(scene, test::default_settings_of(scene, algorithm), meeting + 0.5,
                             [&](const State& state, double) {
                               Vector3 change = state.v[1].linear - scene.bodies[1].linear_velocity;
                               change.y() = 0;
                               return change.norm() / speed;
                             });
      }};
}

TEST(NearMiss, FlyingPastChangesNothing) {
  test::run({"near miss: change of velocity and spin", 1e-6, &draw_fly_past});
}

TEST(NearMiss, TurningBladeKeepsItsSpin) {
  test::run({"blade past a post or a plane: change of spin", 1e-6, &draw_blade});
}

TEST(NearMiss, SlidingPastChangesNothing) {
  test::run({"near miss on a floor: change of velocity", 1e-6, &draw_pinball});
}

// Grazing hits

/// The largest distance of a body's velocity at the end from `expected`, relative to the body's exact change
/// of velocity.
double error_of_changes(const Scene& scene, const Settings& settings, double duration,
                        const std::vector<Vector3>& expected) {
  return test::last(scene, settings, duration, [&](const State& state, double) {
    double largest = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const double change = (expected[i] - scene.bodies[i + 1].linear_velocity).norm();
      largest = std::max(largest, (state.v[i + 1].linear - expected[i]).norm() / change);
    }
    return largest;
  });
}

Trial draw_two_balls(Random& random) {
  const double radii[] = {random.spread(0.03, 0.3), random.spread(0.03, 0.3)};
  const double masses[] = {random.spread(0.3, 3), random.spread(0.3, 3)};
  const double both = radii[0] + radii[1];
  const double offset = random.between(0, 0.98);
  const double e = random.one_of({0.0, 0.5, 0.95});
  const double speed = random.spread(0.5, 30);
  const double meeting = random.between(0.05, 0.25);
  const Vector3 along = random.direction();
  const Vector3 normal = -std::sqrt(1 - offset * offset) * along + offset * random.across(along);
  const Vector3 common = speed * random.between(0, 1) * random.direction();
  const Vector3 velocities[] = {common + speed * along, common};
  const Vector3 places[] = {both * normal, Vector3::Zero()};
  Scene scene = test::empty_scene();
  scene.gravity.setZero();
  for (int i = 0; i < 2; ++i) {
    test::add_body(scene, test::ball(radii[i]),
                   {{places[i] - meeting * velocities[i], random.orientation()}, velocities[i]},
                   {masses[i], test::ball_moments(masses[i], radii[i]), e, 0});
  }
  const double impulse = -(1 + e) * speed * along.dot(normal) / (1 / masses[0] + 1 / masses[1]);
  const std::vector<Vector3> expected{velocities[0] + impulse / masses[0] * normal,
                                      velocities[1] - impulse / masses[1] * normal};
  return {fmt::format(
              "balls of {:.3f} and {:.3f} m, {:.2f} and {:.2f} kg, offset {:.3f} of the radii, {:.2f} m/s, "
              "e {}, meeting at {:.4f} s",
              radii[0], radii[1], masses[0], masses[1], offset, speed, e, meeting),
          [=](Algorithm algorithm) {
            return error_of_changes(scene, test::default_settings_of(scene, algorithm), meeting + 0.2,
                                    expected);
          }};
}

/// A ball meets an edge or a corner of a box that stands still, or with restitution a free one.
Trial draw_edge_hit(Random& random) {
  const Vector3 half(random.between(0.1, 0.5), random.between(0.1, 0.5), random.between(0.1, 0.5));
  const bool is_corner = random.flip();
  const bool is_free = random.flip();
  const double e = is_free ? random.one_of({0.5, 0.95}) : random.one_of({0.0, 0.5, 0.95});
  const double radius = random.spread(0.03, 0.3);
  const double speed = random.spread(0.5, 30);
  const double meeting = random.between(0.05, 0.25);
  const double box_mass = random.spread(0.3, 3);
  const Quaternion turn = random.orientation();
  // The box's frame: the normal lies between those of the two or three faces that meet.
  Vector3 point = half;
  Vector3 normal(random.between(0.2, 1), random.between(0.2, 1), random.between(0.2, 1));
  if (!is_corner) {
    point.z() *= random.between(-0.8, 0.8);
    normal.z() = 0;
  }
  normal = turn * normal.normalized();
  const Vector3 arm = turn * point;
  const double cosine = random.between(0.2, 1);
  const Vector3 velocity =
      speed * (-cosine * normal + std::sqrt(1 - cosine * cosine) * random.across(normal));
  const Substance of_box{box_mass, test::box_moments(box_mass, 2 * half), e, 0};
  const Vector3 lever = turn.conjugate() * arm.cross(normal);
  const double inverse_mass_of_box =
      is_free ? 1 / box_mass + lever.cwiseAbs2().dot(of_box.moments.cwiseInverse()) : 0;
  // So light that it rebounds: otherwise what is hit off its middle would turn and meet it again.
  const double ball_mass =
      is_free ? random.between(0.2, 0.9) * e / inverse_mass_of_box : random.spread(0.3, 3);
  Scene scene = test::empty_scene();
  scene.gravity.setZero();
  test::add_body(scene, test::ball(radius),
                 {{arm + radius * normal - meeting * velocity, random.orientation()}, velocity},
                 {ball_mass, test::ball_moments(ball_mass, radius), e, 0});
  if (is_free) {
    test::add_body(scene, test::box_of(2 * half), {{Vector3::Zero(), turn}}, of_box);
  } else {
    test::add_static(scene, test::box_of(2 * half), {Vector3::Zero(), turn}, of_box);
  }
  const double impulse = (1 + e) * cosine * speed / (1 / ball_mass + inverse_mass_of_box);
  std::vector<Vector3> expected{velocity + impulse / ball_mass * normal};
  if (is_free) expected.emplace_back(-impulse / box_mass * normal);
  const double duration = is_free ? std::ceil(meeting * 60) / 60 : meeting + 0.2;
  return {fmt::format(
              "ball of {:.3f} m and {:.2f} kg on a {} of a {} box of {:.2f} kg, cosine {:.3f}, {:.2f} m/s, "
              "e {}, meeting at {:.4f} s",
              radius, ball_mass, is_corner ? "corner" : "edge", is_free ? "free" : "still", box_mass, cosine,
              speed, e, meeting),
          [=](Algorithm algorithm) {
            return error_of_changes(scene, test::default_settings_of(scene, algorithm), duration, expected);
          }};
}

TEST(GrazingHit, TwoBallsExchangeTheirMomentum) {
  test::run({"two balls at any offset: momentum", 0.02, &draw_two_balls});
}

TEST(GrazingHit, BallOnEdgeOrCornerExchangesItsMomentum) {
  test::run({"ball on an edge or corner: momentum", 0.02, &draw_edge_hit});
}

// Seams

struct OverSeams {
  Scene scene;
  double speed;
  double duration;  ///< of 2 m
};

/// Draws something that slides, without friction, or rolls over a floor of flush blocks.
OverSeams draw_over_seams(Random& random, std::string& parameters) {
  OverSeams result{test::empty_scene(), random.spread(0.3, 4), 0};
  result.duration = 2 / result.speed;
  const double radius = random.one_of({0.0625, 0.125, 0.25});
  const double length = random.between(0.8, 2) * radius;
  const double mass = random.spread(0.3, 3);
  const Quaternion lying_across = rotation_quaternion({std::numbers::pi / 2, 0, 0});
  const Quaternion lying_along = rotation_quaternion({0, 0, std::numbers::pi / 2});
  const int kind = random.below(8);
  Solid solid;
  Quaternion placed = Quaternion::Identity();
  double friction = 0;
  if (kind == 0) solid = test::box_of(2 * Vector3(length, radius, random.between(0.8, 2) * radius));
  if (kind == 1) solid = test::box_hull(2 * Vector3(length, radius, random.between(0.8, 2) * radius));
  if (kind == 2) solid = test::cylinder(radius, length, length);
  if (kind == 3 || kind == 4) solid = test::ball(radius);
  if (kind == 5) solid = test::capsule(length, radius);
  if (kind == 6) solid = test::cylinder(length, radius, radius);
  if (kind == 7) solid = test::capsule(length, radius);
  if (kind == 5) placed = lying_along;
  if (kind == 6 || kind == 7) placed = lying_across;
  const bool rolls = kind == 4 || kind == 6 || kind == 7;
  if (rolls) friction = 0.6;
  const Quaternion turn = rotation_quaternion({0, random.one_of({0.0, random.between(-0.5, 0.5)}), 0});
  Start start;
  start.pose = {{0, radius, 0}, turn * placed};
  start.velocity = turn * Vector3(result.speed, 0, 0);
  if (rolls) start.spin = turn * Vector3(0, 0, -result.speed / radius);
  const Substance substance{mass, Vector3::Constant(0.4 * mass * radius * radius), 0, friction};
  test::add_body(result.scene, solid, start, substance);
  // Tops at y = 0 exactly; blocks have random lengths and widths.
  const int floor = random.below(3);
  double x = -1.5;
  while (x < 3.5) {
    const double size_x = random.between(0.2, 0.6);
    double z = -2;
    while (z < 2) {
      const double size_z = random.between(0.3, 1);
      const Vector3 size(size_x, 0.5, size_z);
      const Pose pose{{x + 0.5 * size_x, -0.25, z + 0.5 * size_z}, Quaternion::Identity()};
      const Solid block = floor == 1 ? test::box_hull(size) : test::box_of(size);
      if (floor == 2) {
        const int body = test::add_body(result.scene, block, {pose}, substance);
        result.scene.bodies[static_cast<std::size_t>(body)].inverse_mass = 0;
        result.scene.bodies[static_cast<std::size_t>(body)].inverse_inertia.setZero();
      } else {
        test::add_static(result.scene, block, pose, substance);
      }
      z += size_z;
    }
    x += size_x;
  }
  const char* floors[] = {"boxes", "hulls", "bodies of one box each"};
  parameters = fmt::format("{} (kind {}) of {:.3f} m {} at {:.3f} m/s over {}", solid.name, kind, radius,
                           rolls ? "rolls" : "slides", result.speed, floors[floor]);
  return result;
}

enum class OverSeamsError { speed, height, side };

/// The largest change of the speed, relative to the start's, or the largest way up or aside, m.
template <OverSeamsError measured>
Trial draw_seams(Random& random) {
  Trial trial;
  const OverSeams over = draw_over_seams(random, trial.parameters);
  trial.error = [=](Algorithm algorithm) {
    const Body& body = over.scene.bodies[1];
    const Vector3 aside = body.linear_velocity.cross(Vector3::UnitY()).normalized();
    return test::largest(over.scene, test::default_settings_of(over.scene, algorithm), over.duration,
                         [&](const State& state, double) {
                           const Vector3 way = state.q[1].linear - body.pose.position;
                           if (measured == OverSeamsError::height) return std::abs(way.y());
                           if (measured == OverSeamsError::side) return std::abs(aside.dot(way));
                           return std::abs(state.v[1].linear.norm() / over.speed - 1);
                         });
  };
  return trial;
}

TEST(Seams, KeepSpeed) {
  test::run({"2 m over flush blocks: speed", 0.002, &draw_seams<OverSeamsError::speed>});
}

TEST(Seams, KeepHeight) {
  test::run({"2 m over flush blocks: height, m", 1e-4, &draw_seams<OverSeamsError::height>});
}

// Sweeps end before the points on both sides of a seam agree, which leaves some turning: 0.52 mm in 400
// draws.
TEST(Seams, KeepCourse) {
  test::run({"2 m over flush blocks: aside, m", 1e-3, &draw_seams<OverSeamsError::side>});
}

// Struck bodies

struct Balls {
  Scene scene;
  std::vector<double> radii;
  std::vector<double> masses;
  Vector3 along = Vector3::UnitX();
  double wall = infinite_error;  ///< of a 1 cm wall across `along`, where its face is, m
  double e = 1;
  double speed = 1;
  double duration = 0.5;
};

void add_ball(Balls& balls, double radius, double mass, const Vector3& place, const Vector3& velocity) {
  test::add_body(balls.scene, test::ball(radius), {{place, Quaternion::Identity()}, velocity},
                 {mass, test::ball_moments(mass, radius), balls.e, 0});
  balls.radii.push_back(radius);
  balls.masses.push_back(mass);
}

enum class Row { before_a_wall, in_line, equal, crooked };

/// A ball flies into a row of others with gaps of 3 mm to 3 cm, the last of them to the wall. Equal: of equal
/// masses, without loss. Crooked: off the line by up to half a radius.
Balls draw_row(Random& random, Row row) {
  Balls balls;
  balls.scene = test::empty_scene();
  balls.scene.gravity.setZero();
  balls.along = random.direction();
  balls.e = row == Row::equal ? 1 : random.one_of({0.5, 0.8, 0.95, 1.0});
  balls.speed = random.spread(1, 20);
  const bool has_wall = row == Row::before_a_wall;
  const auto mass = [&] { return row == Row::equal ? 1 : random.spread(0.3, 3); };
  const int count = has_wall ? 1 + random.below(2) : 1 + random.below(4);
  double radius = random.between(0.03, 0.1);
  add_ball(balls, radius, mass(), Vector3::Zero(), balls.speed * balls.along);
  double reached = radius + balls.speed * random.between(0.02, 0.15);
  for (int i = 0; i < count; ++i) {
    radius = random.between(0.03, 0.1);
    const Vector3 aside = row != Row::crooked
                              ? Vector3::Zero()
                              : Vector3(random.between(0, 0.5) * radius * random.across(balls.along));
    add_ball(balls, radius, mass(), (reached + radius) * balls.along + aside, Vector3::Zero());
    reached += 2 * radius + random.spread(0.003, 0.03);
  }
  if (has_wall) {
    balls.wall = reached;
    test::add_static(
        balls.scene, test::box_of({2, 0.01, 2}),
        {(reached + 0.005) * balls.along, Quaternion::FromTwoVectors(Vector3::UnitY(), balls.along)},
        {1, Vector3::Ones(), balls.e, 0});
  }
  return balls;
}

std::string parameters_of(const Balls& balls) {
  std::string text =
      fmt::format("{} balls at {:.2f} m/s, e {}, radii", balls.radii.size(), balls.speed, balls.e);
  for (const double radius : balls.radii) text += fmt::format(" {:.3f}", radius);
  text += ", masses";
  for (const double mass : balls.masses) text += fmt::format(" {:.2f}", mass);
  return text + (std::isfinite(balls.wall) ? ", a wall" : "");
}

/// The largest `look(state, time)` in the balls' run.
template <class Look>
double largest_of(const Balls& balls, Algorithm algorithm, Look look) {
  return test::largest(balls.scene, test::default_settings_of(balls.scene, algorithm), balls.duration, look);
}

enum class Measured { penetration, momentum, energy };

/// The largest over the run. Penetration: of two balls, or of a ball and the wall, relative to the smaller
/// diameter. Momentum: its change relative to the start's. Energy: its rise, relative to the start's.
double invariant(const Balls& balls, Algorithm algorithm, Measured measured) {
  const std::size_t count = balls.radii.size();
  Vector3 momentum = Vector3::Zero();
  double energy = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3& v = balls.scene.bodies[i + 1].linear_velocity;
    momentum += balls.masses[i] * v;
    energy += 0.5 * balls.masses[i] * v.squaredNorm();
  }
  return largest_of(balls, algorithm, [&](const State& state, double) {
    double depth = 0;
    Vector3 momentum_now = Vector3::Zero();
    double energy_now = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Vector3& v = state.v[i + 1].linear;
      const Vector3& x = state.q[i + 1].linear;
      momentum_now += balls.masses[i] * v;
      energy_now += 0.5 * balls.masses[i] * v.squaredNorm() + 0.2 * balls.masses[i] * balls.radii[i] *
                                                                  balls.radii[i] *
                                                                  state.v[i + 1].angular.squaredNorm();
      if (measured != Measured::penetration) continue;
      depth = std::max(depth, (balls.along.dot(x) + balls.radii[i] - balls.wall) / (2 * balls.radii[i]));
      for (std::size_t j = 0; j < i; ++j) {
        const double both = balls.radii[i] + balls.radii[j] - (x - state.q[j + 1].linear).norm();
        depth = std::max(depth, both / (2 * std::min(balls.radii[i], balls.radii[j])));
      }
    }
    if (measured == Measured::momentum) return (momentum_now - momentum).norm() / momentum.norm();
    return measured == Measured::energy ? energy_now / energy - 1 : depth;
  });
}

/// The largest difference of a ball's velocity at the end from the exact one, relative to the first ball's at
/// the start. Balls of equal masses without loss swap their velocities, so that all stop but the last.
double error_of_equal_row(const Balls& balls, Algorithm algorithm) {
  const Settings settings = test::default_settings_of(balls.scene, algorithm);
  return test::last(balls.scene, settings, balls.duration, [&](const State& state, double) {
    double largest = 0;
    for (std::size_t i = 1; i < state.v.size(); ++i) {
      const Vector3 expected = i + 1 < state.v.size() ? Vector3::Zero() : Vector3(balls.speed * balls.along);
      largest = std::max(largest, (state.v[i].linear - expected).norm() / balls.speed);
    }
    return largest;
  });
}

/// Returns how far two balls of a row, or the last and the wall, have swapped positions: 0 or 1.
double passed_through(const Balls& balls, Algorithm algorithm) {
  return largest_of(balls, algorithm, [&](const State& state, double) {
    double before = -infinite_error;
    for (std::size_t i = 1; i <= balls.radii.size(); ++i) {
      const double x = balls.along.dot(state.q[i].linear);
      if (x < before || x > balls.wall) return 1.0;
      before = x;
    }
    return 0.0;
  });
}

/// Fifteen touching balls and a sixteenth that flies at them along the line of symmetry, or `aside` from it
/// by up to a radius.
Balls draw_break(Random& random, bool aside) {
  Balls balls;
  balls.scene = test::empty_scene();
  balls.scene.gravity.setZero();
  balls.e = random.one_of({0.5, 0.9, 0.95, 1.0});
  balls.speed = random.spread(2, 10);
  const double radius = random.between(0.02, 0.1);
  const double mass = random.spread(0.1, 1);
  const double offset = aside ? random.between(0.2, 1) * radius : 0;
  const double away = 2 * radius + balls.speed * random.between(0.02, 0.1);
  add_ball(balls, radius, mass, {-away, 0, offset}, {balls.speed, 0, 0});
  for (int row = 0; row < 5; ++row) {
    for (int i = 0; i <= row; ++i) {
      add_ball(balls, radius, mass, {row * std::sqrt(3.0) * radius, 0, (2 * i - row) * radius},
               Vector3::Zero());
    }
  }
  return balls;
}

/// The largest difference of a ball's velocity from the mirror image of its partner's, relative to the first
/// ball's at the start.
double asymmetry(const Balls& balls, Algorithm algorithm) {
  return largest_of(balls, algorithm, [&](const State& state, double) {
    double largest = 0;
    for (std::size_t row = 0; row < 5; ++row) {
      for (std::size_t i = 0; i <= row; ++i) {
        const std::size_t first = 2 + row * (row + 1) / 2;
        Vector3 mirrored = state.v[first + row - i].linear;
        mirrored.z() *= -1;
        const Vector3 difference = state.v[first + i].linear - mirrored;
        largest = std::max(largest, difference.norm() / balls.speed);
      }
    }
    return largest;
  });
}

template <class Draw, class Measure>
void run_balls(const char* name, double limit, Draw draw, Measure measure,
               const std::vector<Algorithm>& algorithms = {test::all_algorithms.begin(),
                                                           test::all_algorithms.end()}) {
  test::run({name, limit,
             [=](Random& random) -> Trial {
               const Balls balls = draw(random);
               return {parameters_of(balls), [=](Algorithm algorithm) { return measure(balls, algorithm); }};
             },
             algorithms});
}

constexpr auto row_before_a_wall = [](Random& random) { return draw_row(random, Row::before_a_wall); };
constexpr auto row_in_line = [](Random& random) { return draw_row(random, Row::in_line); };
constexpr auto equal_row = [](Random& random) { return draw_row(random, Row::equal); };
constexpr auto crooked_row = [](Random& random) { return draw_row(random, Row::crooked); };
constexpr auto full_break = [](Random& random) { return draw_break(random, false); };
constexpr auto cut_break = [](Random& random) { return draw_break(random, true); };

template <Measured measured>
double measure(const Balls& balls, Algorithm algorithm) {
  return invariant(balls, algorithm, measured);
}

TEST(StruckBodies, BallBeforeAWallNeverPasses) {
  run_balls("struck before a wall: passed through", 0, row_before_a_wall, passed_through);
}

TEST(StruckBodies, BallBeforeAWallHardlyPenetrates) {
  run_balls("struck before a wall: penetration / size", 0.02, row_before_a_wall,
            measure<Measured::penetration>);
}

TEST(StruckBodies, BallBeforeAWallGainsNoEnergy) {
  run_balls("struck before a wall: energy rise", 0.01, row_before_a_wall, measure<Measured::energy>);
}

TEST(StruckBodies, RowKeepsItsOrder) {
  run_balls("struck row: passed through", 0, row_in_line, passed_through);
}

TEST(StruckBodies, EqualRowSwapsItsSpeeds) {
  run_balls("struck row of equal masses: speeds", 0.02, equal_row, error_of_equal_row);
}

TEST(StruckBodies, CrookedRowHardlyPenetrates) {
  run_balls("struck crooked row: penetration / size", 0.02, crooked_row, measure<Measured::penetration>);
}

TEST(StruckBodies, CrookedRowKeepsMomentum) {
  run_balls("struck crooked row: momentum", 1e-9, crooked_row, measure<Measured::momentum>);
}

TEST(StruckBodies, CrookedRowGainsNoEnergy) {
  run_balls("struck crooked row: energy rise", 0.01, crooked_row, measure<Measured::energy>);
}

TEST(Break, KeepsItsMirrorSymmetryInA1) {
  run_balls("break of fifteen: asymmetry", 0.01, full_break, asymmetry, {Algorithm::a1});
}

TEST(Break, KeepsMomentum) {
  run_balls("break of fifteen: momentum", 1e-9, cut_break, measure<Measured::momentum>);
}

TEST(Break, GainsNoEnergy) {
  run_balls("break of fifteen: energy rise", 0.01, cut_break, measure<Measured::energy>);
}

TEST(Break, HardlyPenetrates) {
  run_balls("break of fifteen: penetration / size", 0.02, cut_break, measure<Measured::penetration>);
}

// Fast bodies

/// A ball flies at a plane, a 1 cm wall or a post, or a thin rod at a post: 1 where it ends behind.
Trial draw_fast(Random& random) {
  const int kind = random.below(4);
  const double most[] = {300, 300, 100, 60};
  const double speed = random.between(0.3, 1) * most[kind];
  const double meeting = random.between(0.05, 0.2);
  const bool is_rod = kind == 3;
  const double radius = is_rod ? 0.01 : random.between(0.02, 0.1);
  const double e = random.one_of({0.0, 0.5, 0.95});
  const Vector3 along = random.direction();
  const Quaternion turn = Quaternion::FromTwoVectors(Vector3::UnitY(), Vector3(-along));
  const double rod = 0.5;  // half of its length
  Substance substance{1, test::ball_moments(1, radius), e, 0.6};
  if (is_rod) substance.moments = Vector3(0.1, 1, 1) * rod * rod / 3;
  Scene scene = test::empty_scene();
  scene.gravity.setZero();
  const Quaternion across = rotation_quaternion({0, 0, std::numbers::pi / 2});
  test::add_body(scene, is_rod ? test::capsule(rod, radius) : test::ball(radius),
                 {{-speed * meeting * along, turn * across}, speed * along}, substance);
  // The face that is met; Y is towards the body.
  const Pose face{radius * along, turn};
  const auto behind = [&](double y) { return face * Pose{{0, -y, 0}, Quaternion::Identity()}; };
  const double post = 0.03;
  if (kind == 0) test::add_static_plane(scene, face, substance);
  if (kind == 1) test::add_static(scene, test::box_of({4, 0.2, 4}), behind(0.1), substance);
  if (kind == 2) test::add_static(scene, test::box_of({4, 0.01, 4}), behind(0.005), substance);
  if (is_rod) {
    const Vector3 middle(random.between(-0.02, 0.02), -post, 0);
    const Quaternion up = rotation_quaternion({std::numbers::pi / 2, 0, 0});
    test::add_static(scene, test::cylinder(1, post, post), face * Pose{middle, up}, substance);
  }
  // A rod that is hit off its middle goes on by 8 mm at most.
  const double farthest = is_rod ? radius + post : radius;
  const char* kinds[] = {"ball at a plane", "ball at a slab", "ball at a 1 cm wall", "rod at a post"};
  return {fmt::format("{}, {:.1f} m/s, e {}, meeting at {:.4f} s", kinds[kind], speed, e, meeting),
          [=](Algorithm algorithm) {
            return test::largest(scene, test::default_settings_of(scene, algorithm), meeting + 0.03,
                                 [&](const State& state, double) {
                                   return along.dot(state.q[1].linear) > farthest ? 1.0 : 0.0;
                                 });
          }};
}

TEST(FastBodies, NeverPassThrough) {
  test::run({"fast bodies: passed through", 0, &draw_fast});
}

// Impacts through joints

/// The error of the ball's velocity at the end, relative to its exact change in the impact; `later` is what
/// it gets after the impact.
Trial hit_by_a_ball(Scene scene, int ball, const Vector3& normal, double mass, double speed, double e,
                    double inverse_mass_of_struck, double duration, std::string parameters,
                    const Vector3& later = Vector3::Zero()) {
  const Vector3 change = (1 + e) * speed / (1 / mass + inverse_mass_of_struck) / mass * normal;
  const Vector3 expected = scene.bodies[static_cast<std::size_t>(ball)].linear_velocity + change + later;
  return {std::move(parameters), [=](Algorithm algorithm) {
            return test::last(scene, test::default_settings_of(scene, algorithm), duration,
                              [&](const State& state, double) {
                                const Vector3& v = state.v[static_cast<std::size_t>(ball)].linear;
                                return (v - expected).norm() / change.norm();
                              });
          }};
}

JointLimit hinge_limit() {
  return test::locked(true, {true, false, true});  // free about y
}

/// A plank on a hinge in the world, about its y axis at its end x = −length/2. Its middle is at the origin of
/// `frame`.
int add_hinged_plank(Scene& scene, const Pose& frame, const Vector3& size, double mass, double e) {
  const int plank =
      test::add_body(scene, test::box_of(size), {frame}, {mass, test::box_moments(mass, size), e, 0});
  const Vector3 end(-0.5 * size.x(), 0, 0);
  Joint hinge = test::ball_joint(plank, world_body, end, frame * end);
  hinge.frame_b.orientation = frame.orientation;
  hinge.limits.push_back(hinge_limit());
  scene.joints.push_back(hinge);
  return plank;
}

/// A door that turns about a hinge and a ball that touches it without friction, in the plane across the
/// hinge, where the closed door lies along x. A force acts on the ball along y.
struct DoorAndBall {
  double about_hinge;  ///< moment of inertia, kg m²
  double mass;         ///< of the ball
  double force;        ///< N
  double depth;        ///< of the ball's centre behind the door's middle plane, m
  Eigen::Vector4d y;   ///< the ball's distance from the hinge along the door, the door's angle; their momenta

  double spin_at(const Eigen::Vector4d& at) const {
    return (at[3] - depth * at[2]) / (about_hinge + mass * at[0] * at[0]);
  }
  double spin() const { return spin_at(y); }
  /// Returns the ball's velocity along x and y.
  Eigen::Vector2d velocity() const {
    return Eigen::Rotation2Dd(y[1]) * Eigen::Vector2d(y[2] / mass, y[0] * spin());
  }
  /// Moves on by Lagrange's equations and the classical Runge-Kutta method, for as long as the ball presses
  /// the door on.
  void advance(double duration) {
    const auto rate = [&](const Eigen::Vector4d& at) {
      const double w = spin_at(at);
      return Eigen::Vector4d(at[2] / mass - depth * w, w, mass * at[0] * w * w + force * std::sin(at[1]),
                             force * (at[0] * std::cos(at[1]) + depth * std::sin(at[1])));
    };
    const int steps = 2000;
    const double h = duration / steps;
    for (int i = 0; i < steps; ++i) {
      const Eigen::Vector4d a = rate(y);
      const Eigen::Vector4d b = rate(y + 0.5 * h * a);
      const Eigen::Vector4d c = rate(y + 0.5 * h * b);
      const Eigen::Vector4d d = rate(y + h * c);
      const Eigen::Vector4d next = y + h / 6 * (a + 2 * b + 2 * c + d);
      if (spin_at(next) < spin()) return;
      y = next;
    }
  }
};

/// A ball meets a plank that hangs on a hinge, at any distance from it.
Trial draw_hinged_plank(Random& random) {
  const Vector3 size(random.between(0.5, 2), random.between(0.1, 0.5), random.between(0.02, 0.1));
  const double mass = random.spread(0.5, 5);
  const double ball_mass = random.spread(0.5, 5);
  const double e = random.one_of({0.0, 0.5, 0.9});
  double speed = random.spread(1, 10);
  const double meeting = random.between(0.02, 0.2);
  const double radius = random.between(0.03, 0.1);
  const double lever = random.between(0.3, 1) * size.x();
  const Pose frame{random.direction(), random.orientation()};
  const double about_hinge =
      mass * ((size.x() * size.x() + size.z() * size.z()) / 12 + 0.25 * size.x() * size.x());
  // Without restitution the two go on together. Where they turn by 0.3 rad a step, the step alone is off by
  // up to 7 %, which its halves quarter; 0.05 rad leave the impact to be seen.
  const double spin_after =
      ball_mass * lever / (about_hinge + ball_mass * lever * lever);  // a metre a second
  if (e == 0) speed = std::min(speed, 0.05 * 60 / spin_after);
  Scene scene = test::empty_scene();
  scene.gravity.setZero();
  add_hinged_plank(scene, frame, size, mass, e);
  const Vector3 normal = frame.orientation * Vector3(0, 0, -1);
  const Vector3 point = frame * Vector3(lever - 0.5 * size.x(), 0, -0.5 * size.z());
  const int ball =
      test::add_body(scene, test::ball(radius),
                     {{point + (radius + speed * meeting) * normal, random.orientation()}, -speed * normal},
                     {ball_mass, test::ball_moments(ball_mass, radius), e, 0});
  // Without restitution the ball goes on pressing for a while, since its centre is farther from the hinge.
  const double duration = std::ceil((meeting + 0.03) * 60) / 60;
  Vector3 later = Vector3::Zero();
  if (e == 0) {
    DoorAndBall exact{
        about_hinge, ball_mass, 0, 0.5 * size.z() + radius, {lever, 0, 0, ball_mass * lever * speed}};
    const Eigen::Vector2d before = exact.velocity();
    exact.advance(duration - meeting);
    const Eigen::Vector2d change = exact.velocity() - before;
    later = frame.orientation * Vector3(change.x(), 0, change.y());
  }
  return hit_by_a_ball(
      scene, ball, normal, ball_mass, speed, e, lever * lever / about_hinge, duration,
      fmt::format("plank of {:.2f} m and {:.2f} kg, ball of {:.2f} kg at {:.2f} m/s, {:.2f} m from "
                  "the hinge, e {}, meeting at {:.4f} s",
                  size.x(), mass, ball_mass, speed, lever, e, meeting),
      later);
}

Trial draw_pushed_door(Random& random) {
  const Vector3 size(random.between(0.5, 1.5), random.between(0.5, 2), random.between(0.02, 0.1));
  const double mass = random.spread(1, 10);
  const double ball_mass = random.spread(0.5, 5);
  const double radius = random.between(0.03, 0.1);
  const double lever = random.between(0.3, 0.8) * size.x();
  const Pose frame{random.direction(), random.orientation()};
  Scene scene = test::empty_scene();
  const int door = add_hinged_plank(scene, frame, size, mass, 0);
  scene.bodies[static_cast<std::size_t>(door)].gravity_factor = 0;
  const Vector3 push = frame.orientation * Vector3(0, 0, 1);
  const double depth = 0.5 * size.z() + radius;
  test::add_body(scene, test::ball(radius),
                 {{frame * Vector3(lever - 0.5 * size.x(), 0, -depth), random.orientation()}},
                 {ball_mass, test::ball_moments(ball_mass, radius), 0, 0});
  const double about_hinge =
      mass * ((size.x() * size.x() + size.z() * size.z()) / 12 + 0.25 * size.x() * size.x());
  // Such that it turns by about 0.4 rad in 1 to 2 s: in a few steps an algorithm of first order is off by
  // more than the limit for the step alone.
  const double duration = std::ceil(random.between(1, 2) * 60) / 60;
  const double acceleration = 0.8 / (duration * duration) *
                              (about_hinge / (ball_mass * lever) + lever);  // m/s², of the ball's weight
  scene.gravity = acceleration * push;
  DoorAndBall exact{about_hinge, ball_mass, ball_mass * acceleration, depth, {lever, 0, 0, 0}};
  exact.advance(duration);
  const double expected = exact.spin();
  return {fmt::format("door of {:.2f} m and {:.2f} kg, ball of {:.2f} kg, {:.2f} m from the hinge, {:.3f} s",
                      size.x(), mass, ball_mass, lever, duration),
          [=](Algorithm algorithm) {
            return test::last(scene, test::default_settings_of(scene, algorithm), duration,
                              [&](const State& state, double) {
                                const double spin = state.v[static_cast<std::size_t>(door)].angular.norm();
                                return std::abs(spin / expected - 1);
                              });
          }};
}

/// A ball meets the hammer at the end of a straight chain that hangs in the world, across the chain.
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
  const Vector3 rod_size(length, 0.1 * length, 0.1 * length);
  const Vector3 hammer_size = Vector3::Constant(2 * half);
  Scene scene = test::empty_scene();
  scene.gravity.setZero();
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
    const Vector3 principal = test::box_moments(masses[i], is_hammer ? hammer_size : rod_size);
    moments[i] = principal.y();
    Solid solid = test::box_of(hammer_size);
    if (!is_hammer) solid.parts.clear();
    const int body =
        test::add_body(scene, solid, {{origin + turn * Vector3(reached + half_length, 0, 0), turn}},
                       {masses[i], principal, e, 0});
    const Vector3 before = i == 0 ? origin : Vector3(0.5 * length, 0, 0);
    scene.joints.push_back(
        test::ball_joint(body, i == 0 ? world_body : body - 1, {-half_length, 0, 0}, before));
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
  // So light that it rebounds: otherwise the hammer would turn and meet it again.
  const double ball_mass = random.between(0.2, 0.9) * e / inverse_mass;
  const Vector3 normal = turn * Vector3(0, 0, -1);
  const Vector3 point = origin + turn * Vector3(reached - half + offset, 0, -half);
  const int ball =
      test::add_body(scene, test::ball(radius),
                     {{point + (radius + speed * meeting) * normal, random.orientation()}, -speed * normal},
                     {ball_mass, test::ball_moments(ball_mass, radius), e, 0});
  return hit_by_a_ball(
      scene, ball, normal, ball_mass, speed, e, inverse_mass, meeting + 0.03,
      fmt::format("{} links of {:.2f} m and {:.2f} kg, hammer of {:.2f} kg, ball of {:.2f} kg at {:.2f} "
                  "m/s, {:.3f} m off its middle, e {}, meeting at {:.4f} s",
                  links, length, link_mass, hammer_mass, ball_mass, speed, offset, e, meeting));
}

TEST(JointedImpact, HingedPlankTakesItsImpulse) {
  test::run({"hinged plank: momentum", 0.02, &draw_hinged_plank});
}

TEST(JointedImpact, PushedDoorTurnsAsFast) {
  test::run({"pushed door: angular speed", 0.02, &draw_pushed_door});
}

TEST(JointedImpact, HammerOnAChainTakesItsImpulse) {
  test::run({"hammer on a chain: momentum", 0.02, &draw_hammer});
}

// Bounces with spin

/// A ball that spins bounces off a plane, a slab or a mesh. Friction takes all slip (2/7 of it per mass) or μ
/// times the normal impulse. Errors are relative to the exact tangential change.
Trial draw_spinning_bounce(Random& random, bool sticks) {
  const double mass = random.spread(0.3, 3);
  const double radius = random.spread(0.03, 0.3);
  const double e = random.between(0.3, 0.95);
  const double down = random.spread(1, 10);
  const double meeting = random.between(0.02, 0.2);
  const Quaternion turn = random.orientation();
  const Vector3 up = turn * Vector3(0, 1, 0);
  const Vector3 spin = random.between(0, 50) * random.direction();
  const Vector3 velocity = -down * up + random.between(0, 1) * down * random.across(up);
  // Slip of the ball's lowest point, across the normal.
  Vector3 slip = velocity + spin.cross(Vector3(-radius * up));
  slip -= up.dot(slip) * up;
  const double needed = 2.0 / 7 * slip.norm() / ((1 + e) * down);
  const double friction = needed * (sticks ? random.between(1.2, 3) : random.between(0.2, 0.8));
  const double tangential = sticks ? 2.0 / 7 * slip.norm() : friction * (1 + e) * down;
  const Vector3 change = -tangential * slip.normalized();
  const Vector3 expected = velocity + (1 + e) * down * up + change;
  const Vector3 expected_spin = spin + Vector3(-radius * up).cross(change) / (0.4 * radius * radius);
  Scene scene = test::empty_scene();
  scene.gravity.setZero();
  const Substance substance{mass, test::ball_moments(mass, radius), e, friction};
  test::add_body(scene, test::ball(radius),
                 {{radius * up - meeting * velocity, random.orientation()}, velocity, spin}, substance);
  const int kind = random.below(3);
  if (kind == 0) test::add_static_plane(scene, {Vector3::Zero(), turn}, substance);
  if (kind == 1) test::add_static(scene, test::box_of({5, 1, 5}), {-0.5 * up, turn}, substance);
  if (kind == 2) test::add_static(scene, test::rectangle_mesh(5, 5), {Vector3::Zero(), turn}, substance);
  const char* kinds[] = {"plane", "slab", "mesh"};
  return {fmt::format(
              "ball of {:.3f} m on a {}, {:.2f} m/s down, slip {:.2f} m/s, μ {:.3f}, e {:.2f}, meeting at "
              "{:.4f} s",
              radius, kinds[kind], down, slip.norm(), friction, e, meeting),
          [=](Algorithm algorithm) {
            return test::last(scene, test::default_settings_of(scene, algorithm), meeting + 0.1,
                              [&](const State& state, double) {
                                const double error = (state.v[1].linear - expected).norm();
                                const double of_spin = (state.v[1].angular - expected_spin).norm();
                                return std::max(error, 0.4 * radius * of_spin) / tangential;
                              });
          }};
}

TEST(SpinningBounce, StickingTakesAllSlip) {
  test::run({"bounce with spin, sticking", 0.02,
             [](Random& random) { return draw_spinning_bounce(random, true); }});
}

TEST(SpinningBounce, SlidingTakesFrictionTimesTheImpulse) {
  test::run({"bounce with spin, sliding", 0.02,
             [](Random& random) { return draw_spinning_bounce(random, false); }});
}

}  // namespace
}  // namespace substep
