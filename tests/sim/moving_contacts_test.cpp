// Compares bodies that miss each other, slide over seams or fly fast with closed forms that share nothing
// with the solver, in random scenes: near misses with several n, others at defaults. Prints a table.

#include "sim/math/rotation.h"
#include "tests/sim/moving_solids.h"

namespace substep::test {
namespace {

// Near misses

/// The kind of obstacle that a solid flies past.
enum class Kind { moving_solid, still_solid, mesh, plane };

/// Two solids that fly past one another, or one past a plane, a solid or a mesh at rest.
struct FlyPast {
  double clearance;  ///< least distance of the two, m
  double speed;      ///< relative, m/s
  double closest;    ///< time at which they are closest, s
  Solid one;
  Solid other;
  Kind kind;       ///< of `other`
  Vector3 normal;  ///< of the plane, through the origin
  Start start_of_one;
  Start start_of_other;

  double duration() const { return closest + 0.3; }
  double gap(double time) const {
    const Pose pose = start_of_one.at(time);
    return kind == Kind::plane ? height_above(normal, one, pose)
                               : distance(one, pose, other, start_of_other.at(time));
  }
  /// Returns true where they keep 0.8 of the clearance throughout, by conservative advancement.
  bool keeps_clearance() const {
    // A bound of the gap's rate of change, m/s.
    const double rate = (start_of_one.velocity - start_of_other.velocity).norm() +
                        start_of_one.spin.norm() * one.reach() + start_of_other.spin.norm() * other.reach();
    for (double time = 0; time < duration();) {
      const double now = gap(time);
      if (now < 0.9 * clearance) return false;
      time += std::max(now - 0.8 * clearance, 0.1 * clearance) / std::max(rate, 1e-9);
    }
    return true;
  }
};

/// Returns a function of state and time: the largest change of a body's velocity, and of its spin times its
/// reach, over `speed`. Bodies fall freely with the acceleration `fall`.
auto change_of_motion(const Scene& scene, std::vector<double> reaches, double speed, const Vector3& fall) {
  return [=](const State& state, double time) {
    double change = 0;
    for (std::size_t i = 1; i < state.v.size(); ++i) {
      const Body& body = scene.bodies[i];
      const Vector3 linear = state.v[i].linear - body.linear_velocity - time * fall;
      const Vector3 angular = state.v[i].angular - body.angular_velocity;
      change = std::max({change, linear.norm() / speed, angular.norm() * reaches[i - 1] / speed});
    }
    return change;
  };
}

/// Draws two solids and their motions, and shifts the paths until their least distance is the clearance.
FlyPast draw_paths(Random& random) {
  FlyPast drawn;
  drawn.clearance = random.spread(0.001, 0.2);
  drawn.speed = random.spread(0.5, 30);
  drawn.closest = random.between(0.05, 0.4);
  drawn.one = random_solid(random, random.spread(0.05, 0.5));
  drawn.kind = static_cast<Kind>(random.below(4));
  if (drawn.kind < Kind::mesh) drawn.other = random_solid(random, random.spread(0.05, 0.5));
  if (drawn.kind == Kind::mesh) {
    const Vector3 size(random.between(0.2, 1), random.between(0.2, 1), random.between(0.2, 1));
    drawn.other = random.flip() ? box_mesh(size) : rectangle_mesh(size.x(), size.z());
  }
  const auto spin = [&] { return Vector3(random.direction() * random.between(0, 50) * random.below(2)); };
  const Vector3 along = random.direction();
  drawn.normal = random.across(along);
  drawn.start_of_one.pose.orientation = random.orientation();
  drawn.start_of_one.spin = spin();
  drawn.start_of_other.pose.orientation = random.orientation();
  if (drawn.kind == Kind::moving_solid) {
    drawn.start_of_other.spin = spin();
    drawn.start_of_other.velocity = drawn.speed * random.between(0, 1) * random.direction();
  }
  drawn.start_of_one.velocity = drawn.start_of_other.velocity + drawn.speed * along;
  // Shift the path aside until it is as close as drawn, by bisection.
  const auto shifted = [&](double by) {
    FlyPast result = drawn;
    result.start_of_one.pose.position = by * drawn.normal - drawn.speed * drawn.closest * along;
    return result;
  };
  double near = 0;
  double far = drawn.one.reach() + drawn.other.reach() + 1.1 * drawn.clearance;
  for (int i = 0; i < 14; ++i) {
    const double middle = 0.5 * (near + far);
    (shifted(middle).keeps_clearance() ? far : near) = middle;
  }
  return shifted(far);
}

Trial draw_fly_past(Random& random) {
  const FlyPast drawn = draw_paths(random);
  Substance substance;
  substance.restitution = random.one_of({0.0, 0.5, 0.95});
  substance.friction = 0.6;
  const int n = random.one_of({0, 0, 1, 4, 30, 100});
  Scene scene = empty_scene();
  scene.gravity = random.flip() ? Vector3(0, -gravity, 0) : Vector3::Zero();
  // Take equal moments: a body of unequal ones changes its spin without contact.
  const auto substance_of = [&](const Solid& solid) {
    substance.mass = random.spread(0.3, 3);
    substance.moments.setConstant(0.3 * substance.mass * solid.reach() * solid.reach());
    return substance;
  };
  add_body(scene, drawn.one, drawn.start_of_one, substance_of(drawn.one));
  std::vector<double> reaches{drawn.one.reach()};
  const bool both_move = drawn.kind == Kind::moving_solid;
  if (both_move) {
    add_body(scene, drawn.other, drawn.start_of_other, substance_of(drawn.other));
    reaches.push_back(drawn.other.reach());
  } else if (drawn.kind == Kind::plane) {
    const Quaternion turn = shortest_rotation(Vector3::UnitY(), drawn.normal);
    add_static_plane(scene, {Vector3::Zero(), turn}, substance);
  } else {
    add_static(scene, drawn.other, drawn.start_of_other.pose, substance);
  }
  if (!both_move) scene.bodies[1].gravity_factor = 0;
  const Vector3 fall = both_move ? scene.gravity : Vector3::Zero();
  const auto change = change_of_motion(scene, reaches, drawn.speed, fall);
  return {
      fmt::format("{} past a {} {}, {:.4f} m clear at {:.2f} m/s, spins {:.1f} and {:.1f} rad/s, e {}, n {} "
                  "(0: default), closest at {:.4f} s",
                  drawn.one.name, both_move ? "flying" : "still",
                  drawn.kind == Kind::plane ? "plane" : drawn.other.name, drawn.clearance, drawn.speed,
                  drawn.start_of_one.spin.norm(), drawn.start_of_other.spin.norm(), substance.restitution, n,
                  drawn.closest),
      [=](Algorithm algorithm) {
        Settings settings = default_settings_of(scene, algorithm);
        if (n > 0) (algorithm == Algorithm::a2 ? settings.iterations : settings.substeps) = n;
        return largest(scene, settings, drawn.duration(), change);
      }};
}

/// Draws a blade that spins in place: its corners pass a post, a plane or a free box at a clearance.
Trial draw_blade(Random& random) {
  const double length = random.between(0.3, 1.5);
  const double width = random.between(0.02, 0.1);
  // Make the height the least size, so that the blade turns about its largest moment of inertia.
  const Vector3 size(length, random.between(0.2, 1) * width, width);
  const double clearance = random.spread(1e-4, 0.2);
  const double spin = random.between(5, 50);
  const double mass = random.spread(0.3, 3);
  const double circle = 0.5 * std::hypot(length, width);
  const Quaternion turn = random.orientation();
  const Substance substance{mass, box_moments(mass, size), random.one_of({0.0, 0.5, 0.95}), 0.6};
  Scene scene = weightless_scene();
  const Quaternion phase = rotation_quaternion({0, random.between(0, 3), 0});
  add_body(scene, box_of(size),
           {{Vector3::Zero(), turn * phase}, Vector3::Zero(), turn * Vector3(0, spin, 0)}, substance);
  const int kind = random.below(4);
  const double post = random.between(0.02, 0.2);
  const double near = -circle - clearance;
  if (kind == 0) {
    add_static_plane(scene, {turn * Vector3(0, 0, near), turn * rotation_quaternion({pi / 2, 0, 0})},
                     substance);
  } else if (kind == 3) {
    add_body(scene, box_of(Vector3::Constant(2 * post)), {{turn * Vector3(0, 0, near - post), turn}},
             substance);
  } else {
    add_static(scene, kind == 1 ? cylinder(0.5, post, post) : capsule(0.5, post),
               {turn * Vector3(0, 0, near - post), turn}, substance);
  }
  constexpr std::array kinds{"plane", "post", "round post", "free box"};
  return largest_of(fmt::format("blade of {:.2f} m at {:.1f} rad/s, {:.4f} m clear of a {}, e {}", length,
                                spin, clearance, kinds[kind], substance.restitution),
                    scene, 1, change_of_motion(scene, {circle, post}, spin * circle, Vector3::Zero()));
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
  Substance substance{mass, is_ball ? ball_moments(mass, radius) : box_moments(mass, size),
                      random.one_of({0.0, 0.5, 0.95}), 0};
  Scene scene = empty_scene();
  Substance floor = substance;
  floor.restitution = 0;
  add_static_plane(scene, {}, floor);
  const Solid slider = is_ball ? ball(radius) : box_of(size);
  add_body(scene, slider, {{turn * Vector3(-speed * meeting, radius, 0), turn}, turn * Vector3(speed, 0, 0)},
           substance);
  const int kind = random.below(3);
  const double post = random.between(0.02, 0.3);
  const Vector3 centre(random.between(-0.1, 0.1), 0.5, radius + clearance + post);
  if (kind == 0) add_static(scene, cylinder(0.5, post, post), {turn * centre, turn}, substance);
  if (kind == 1) add_static(scene, ball(post), {turn * Vector3(0, post, centre.z()), turn}, substance);
  if (kind == 2)
    add_static(scene, box_of(2 * Vector3(random.between(0.05, 1), 0.5, post)), {turn * centre, turn},
               substance);
  constexpr std::array kinds{"post", "ball", "block"};
  return largest_of(fmt::format("{} of {:.3f} m slides past a {}, {:.4f} m clear at {:.2f} m/s, e {}",
                                slider.name, radius, kinds[kind], clearance, speed, substance.restitution),
                    scene, meeting + 0.5, [=](const State& state, double) {
                      const Vector3 change = state.v[1].linear - scene.bodies[1].linear_velocity;
                      return std::hypot(change.x(), change.z()) / speed;
                    });
}

/// Draws a box or a cylinder that flies past the edge of a still box or mesh, along the plane of its face or
/// beside that plane. Half of them start a step just before the edge.
Trial draw_flush_passage(Random& random) {
  const Vector3 size(random.between(0.05, 0.5), random.between(0.05, 0.5), random.between(0.05, 0.5));
  const double gap = random.one_of({0.0, 1e-9, 1e-7, 1e-5}) * size.x();
  const double speed = random.spread(0.5, 30);
  const double before = 1e-4 * size.x() * random.between(0, 1);
  const double meeting =
      random.flip() ? random.between(0.05, 0.25) : (3 + random.below(10)) / 60.0 + before / speed;
  const Quaternion turn = random.orientation();
  const Substance substance{1, box_moments(1, size), random.one_of({0.0, 0.5, 0.95}), 0.6};
  Scene scene = weightless_scene();
  const Vector3 start(size.x() / 2 + gap, size.y() / 2 + speed * meeting, random.between(-0.3, 0.3));
  const double radius = size.x() / 2;
  const Solid flying = random.flip() ? box_of(size) : cylinder(size.y() / 2, radius, radius);
  const Solid still = random.flip() ? box_of(Vector3::Ones()) : box_mesh(Vector3::Ones());
  add_static(scene, still, {turn * Vector3(-0.5, -0.5, 0), turn}, substance);
  add_body(scene, flying, {{turn * start, turn}, turn * Vector3(0, -speed, 0)}, substance);
  return largest_of(fmt::format("{} {:.1e} m beside an edge of a {} at {:.2f} m/s, e {}, there at {:.4f} s",
                                flying.name, gap, still.name, speed, substance.restitution, meeting),
                    scene, meeting + 1 / speed,
                    change_of_motion(scene, {size.norm() / 2}, speed, Vector3::Zero()));
}

TEST(NearMiss, FlushPassageChangesNothing) {
  run({"near miss, flush with an edge: motion", 1e-6, &draw_flush_passage});
}

TEST(NearMiss, FlyingPastChangesNothing) {
  run({"near miss: change of velocity and spin", 1e-6, &draw_fly_past});
}

TEST(NearMiss, TurningBladeKeepsItsSpin) {
  run({"blade past a post or a plane: change of spin", 1e-6, &draw_blade});
}

TEST(NearMiss, SlidingPastChangesNothing) {
  run({"near miss on a floor: change of velocity", 1e-6, &draw_pinball});
}

// Seams

/// Adds a floor of flush blocks, whose tops are at y = 0 exactly, of random lengths and widths. Returns its
/// name.
std::string add_blocks(Scene& scene, Random& random, const Substance& substance) {
  constexpr std::array floors{"boxes", "hulls", "bodies of one box each"};
  const int floor = random.below(3);
  for (double x = -1.5; x < 3.5;) {
    const double size_x = random.between(0.2, 0.6);
    for (double z = -2; z < 2;) {
      const double size_z = random.between(0.3, 1);
      const Vector3 size(size_x, 0.5, size_z);
      const Pose pose = at(x + 0.5 * size_x, -0.25, z + 0.5 * size_z);
      const Solid block = floor == 1 ? box_hull(size) : box_of(size);
      if (floor == 2) {
        Body& body = scene.bodies[static_cast<std::size_t>(add_body(scene, block, {pose}, substance))];
        body.inverse_mass = 0;
        body.inverse_inertia.setZero();
      } else {
        add_static(scene, block, pose, substance);
      }
      z += size_z;
    }
    x += size_x;
  }
  return floors[floor];
}

/// Draws a body that slides without friction, or rolls, over a floor of flush blocks for 2 m. The error is
/// the largest of three over their limits: speed 0.002 of the start's, drift up 0.1 mm, drift aside 1 mm.
Trial draw_seams(Random& random) {
  Scene scene = empty_scene();
  const double speed = random.spread(0.3, 4);
  const double radius = random.one_of({0.0625, 0.125, 0.25});
  const double length = random.between(0.8, 2) * radius;
  const double mass = random.spread(0.3, 3);
  const int kind = random.below(8);
  const Vector3 size = 2 * Vector3(length, radius, kind < 2 ? random.between(0.8, 2) * radius : radius);
  const Solid solids[]{
      box_of(size), box_hull(size),          cylinder(radius, length, length), ball(radius),
      ball(radius), capsule(length, radius), cylinder(length, radius, radius), capsule(length, radius)};
  const Solid& solid = solids[kind];
  Quaternion placed = Quaternion::Identity();
  if (kind == 5) placed = rotation_quaternion({0, 0, pi / 2});
  if (kind > 5) placed = rotation_quaternion({pi / 2, 0, 0});
  const bool rolls = kind == 4 || kind > 5;
  const Quaternion turn = rotation_quaternion({0, random.one_of({0.0, random.between(-0.5, 0.5)}), 0});
  Start start{{{0, radius, 0}, turn * placed}, turn * Vector3(speed, 0, 0)};
  if (rolls) start.spin = turn * Vector3(0, 0, -speed / radius);
  const Substance substance{mass, Vector3::Constant(0.4 * mass * radius * radius), 0, rolls ? 0.6 : 0};
  add_body(scene, solid, start, substance);
  const std::string floor = add_blocks(scene, random, substance);
  const Vector3 aside = start.velocity.cross(Vector3::UnitY()).normalized();
  return largest_of(fmt::format("{} (kind {}) of {:.3f} m {} at {:.3f} m/s over {}", solid.name, kind, radius,
                                rolls ? "rolls" : "slides", speed, floor),
                    scene, 2 / speed, [=](const State& state, double) {
                      const Vector3 moved = state.q[1].linear - start.pose.position;
                      return std::max({std::abs(state.v[1].linear.norm() / speed - 1) / 0.002,
                                       std::abs(moved.y()) / 1e-4, std::abs(aside.dot(moved)) / 1e-3});
                    });
}

// Sweeps end before the points on both sides of a seam agree, so the body turns a little: it drifts aside by
// at most 0.52 mm in 400 draws.
TEST(Seams, KeepSpeedHeightAndCourse) {
  run({"2 m over flush blocks: speed, height, aside", 1, &draw_seams});
}

// Fast bodies

/// Draws a ball that flies at a plane, a 1 cm wall or a post, or a thin rod at a post. The error is 1 where
/// the body ends behind.
Trial draw_fast(Random& random) {
  const int kind = random.below(4);
  const double most[] = {300, 300, 100, 60};
  const double speed = random.between(0.3, 1) * most[kind];
  const double meeting = random.between(0.05, 0.2);
  const bool is_rod = kind == 3;
  const double radius = is_rod ? 0.01 : random.between(0.02, 0.1);
  const double e = random.one_of({0.0, 0.5, 0.95});
  const Vector3 along = random.direction();
  const Quaternion turn = shortest_rotation(Vector3::UnitY(), Vector3(-along));
  const double half_length = 0.5;  // of the rod, m
  Substance substance{1, ball_moments(1, radius), e, 0.6};
  if (is_rod) substance.moments = Vector3(0.1, 1, 1) * half_length * half_length / 3;
  Scene scene = weightless_scene();
  const Quaternion across = rotation_quaternion({0, 0, pi / 2});
  add_body(scene, is_rod ? capsule(half_length, radius) : ball(radius),
           {{-speed * meeting * along, turn * across}, speed * along}, substance);
  // Place the struck face, with Y towards the body.
  const Pose face{radius * along, turn};
  const double post = 0.03;
  if (kind == 0) add_static_plane(scene, face, substance);
  if (kind == 1) add_static(scene, box_of({4, 0.2, 4}), face * at(0, -0.1, 0), substance);
  if (kind == 2) add_static(scene, box_of({4, 0.01, 4}), face * at(0, -0.005, 0), substance);
  if (is_rod) {
    const Vector3 middle(random.between(-0.02, 0.02), -post, 0);
    const Quaternion up = rotation_quaternion({pi / 2, 0, 0});
    add_static(scene, cylinder(1, post, post), face * Pose{middle, up}, substance);
  }
  // Allow for a rod that is hit off its middle, which continues by 8 mm at most.
  const double farthest = is_rod ? radius + post : radius;
  constexpr std::array kinds{"ball at a plane", "ball at a slab", "ball at a 1 cm wall", "rod at a post"};
  return largest_of(fmt::format("{}, {:.1f} m/s, e {}, meeting at {:.4f} s", kinds[kind], speed, e, meeting),
                    scene, meeting + 0.03, [=](const State& state, double) {
                      return along.dot(state.q[1].linear) > farthest ? 1.0 : 0.0;
                    });
}

TEST(FastBodies, NeverPassThrough) {
  run({"fast bodies: passed through", 0, &draw_fast});
}

}  // namespace
}  // namespace substep::test
