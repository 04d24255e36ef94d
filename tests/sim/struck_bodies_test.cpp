// Compares hits of balls on balls, edges, walls and planes, in random scenes, with the law of impact.

#include "sim/math/rotation.h"
#include "tests/sim/moving_solids.h"

namespace substep::test {
namespace {

// Grazing hits

/// Returns the largest distance of a body's velocity from `expected`, relative to the body's exact change of
/// velocity.
auto error_of_changes(const Scene& scene, std::vector<Vector3> expected) {
  return [=](const State& state, double) {
    double error = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const double change = (expected[i] - scene.bodies[i + 1].linear_velocity).norm();
      error = std::max(error, (state.v[i + 1].linear - expected[i]).norm() / change);
    }
    return error;
  };
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
  Scene scene = weightless_scene();
  for (int i = 0; i < 2; ++i) {
    add_body(scene, ball(radii[i]),
             {{places[i] - meeting * velocities[i], random.orientation()}, velocities[i]},
             {masses[i], ball_moments(masses[i], radii[i]), e, 0});
  }
  const double impulse = -(1 + e) * speed * along.dot(normal) / (1 / masses[0] + 1 / masses[1]);
  return last_of(
      fmt::format(
          "balls of {:.3f} and {:.3f} m, {:.2f} and {:.2f} kg, offset {:.3f} of the radii, {:.2f} m/s, "
          "e {}, meeting at {:.4f} s",
          radii[0], radii[1], masses[0], masses[1], offset, speed, e, meeting),
      scene, meeting + 0.2,
      error_of_changes(scene, {velocities[0] + impulse / masses[0] * normal,
                               velocities[1] - impulse / masses[1] * normal}));
}

/// Draws a ball that hits an edge or a corner of a fixed box, or with restitution of a free one that spins.
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
  // Choose the normal between the normals of the two or three adjacent faces, in the box's frame.
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
  // Take equal moments: a body of unequal ones changes its spin without contact.
  const Substance of_box{box_mass, Vector3::Constant(0.3 * box_mass * half.squaredNorm()), e, 0};
  const Vector3 lever = turn.conjugate() * arm.cross(normal);
  const double inverse_mass_of_box =
      is_free ? 1 / box_mass + lever.cwiseAbs2().dot(of_box.moments.cwiseInverse()) : 0;
  // Make the ball so light that it rebounds: a box hit off its middle could turn and hit it again.
  const double ball_mass =
      is_free ? random.between(0.2, 0.9) * e / inverse_mass_of_box : random.spread(0.3, 3);
  Scene scene = weightless_scene();
  add_body(scene, ball(radius),
           {{arm + radius * normal - meeting * velocity, random.orientation()}, velocity},
           {ball_mass, ball_moments(ball_mass, radius), e, 0});
  // Spin slowly enough that the box turns no other part to the ball before they meet.
  const double spin_speed = is_free ? random.between(0, 0.15) * speed / half.norm() : 0;
  const Vector3 spin = spin_speed * random.direction();
  const double approach = cosine * speed + normal.dot(spin.cross(arm));
  const double impulse = (1 + e) * approach / (1 / ball_mass + inverse_mass_of_box);
  std::vector<Vector3> expected{velocity + impulse / ball_mass * normal};
  if (is_free) {
    add_body(scene, box_of(2 * half),
             {{Vector3::Zero(), rotation_quaternion(-meeting * spin) * turn}, Vector3::Zero(), spin}, of_box);
    expected.emplace_back(-impulse / box_mass * normal);
  } else {
    add_static(scene, box_of(2 * half), {Vector3::Zero(), turn}, of_box);
  }
  return last_of(
      fmt::format(
          "ball of {:.3f} m and {:.2f} kg on a {} of a {} box of {:.2f} kg, cosine {:.3f}, {:.2f} m/s, "
          "e {}, meeting at {:.4f} s",
          radius, ball_mass, is_corner ? "corner" : "edge", is_free ? "free" : "still", box_mass, cosine,
          speed, e, meeting),
      scene, is_free ? std::ceil(meeting * 60) / 60 : meeting + 0.2, error_of_changes(scene, expected));
}

/// Returns a floor and a step of a height at x = 0 as one mesh, 8 m wide and long, in random strips.
Solid step_mesh(Random& random, double height) {
  std::vector<Vector3> positions;
  for (const double z : {-4.0, random.between(-3, -1), random.between(-0.5, 0.5), 4.0}) {
    for (const auto& [x, y] :
         {std::pair(-4.0, 0.0), std::pair(0.0, 0.0), std::pair(0.0, height), std::pair(4.0, height)}) {
      positions.emplace_back(x, y, z);
    }
  }
  std::vector<Triangle> triangles;
  for (const std::uint32_t row : {0U, 4U, 8U}) {
    for (std::uint32_t i = row; i < row + 3; ++i) {
      triangles.push_back({i, i + 4, i + 5});
      triangles.push_back({i, i + 5, i + 1});
    }
  }
  return {"step", {{make_triangle_mesh(positions, triangles, "step"), {}, {positions, {}, 0}}}};
}

/// Draws a ball that slides along a mesh's floor and hits the edge of a step, or the wall, of the same mesh.
Trial draw_step_hit(Random& random) {
  const double radius = random.spread(0.03, 0.3);
  const double height = radius * random.one_of({0.3, 0.5, 0.7, 3.0});
  const double e = random.one_of({0.0, 0.5, 0.95});
  const double speed = radius * random.spread(5, 60);
  const double meeting = random.between(0.05, 0.25);
  const Quaternion turn = random.orientation();
  const double up = std::max(1 - height / radius, 0.0);
  const Vector3 normal(-std::sqrt(1 - up * up), up, 0);
  const Vector3 velocity = speed * Vector3(1, 0, random.between(-0.5, 0.5));
  const Vector3 place(radius * normal.x(), radius, 0);
  const Vector3 expected = velocity - (1 + e) * velocity.dot(normal) * normal;
  Scene scene = weightless_scene();
  const Substance substance{1, ball_moments(1, radius), e, 0};
  add_body(scene, ball(radius), {{turn * (place - meeting * velocity), turn}, turn * velocity}, substance);
  add_static(scene, step_mesh(random, height), {Vector3::Zero(), turn}, substance);
  return last_of(fmt::format("ball of {:.3f} m on a step of {:.3f} m, {:.2f} m/s, e {}, meeting at {:.4f} s",
                             radius, height, speed, e, meeting),
                 scene, meeting + 0.1, error_of_changes(scene, {turn * expected}));
}

TEST(GrazingHit, TwoBallsExchangeMomentum) {
  run({"two balls at any offset: momentum", 0.02, &draw_two_balls});
}

TEST(GrazingHit, BallOnEdgeExchangesMomentum) {
  run({"ball on an edge or corner: momentum", 0.02, &draw_edge_hit});
}

TEST(GrazingHit, ExchangesMomentumOnStepOfMesh) {
  run({"ball on a step of the mesh it slides on", 0.02, &draw_step_hit});
}

// Struck rows and racks

struct Balls {
  Scene scene = weightless_scene();
  std::vector<double> radii;
  std::vector<double> masses;
  Vector3 along = Vector3::UnitX();
  double wall = infinity;  ///< of a 1 cm wall across `along`, where its face is, m
  double e = 1;
  double speed = 1;

  void add(double radius, double mass, const Vector3& centre, const Vector3& velocity) {
    add_body(scene, ball(radius), {{centre, Quaternion::Identity()}, velocity},
             {mass, ball_moments(mass, radius), e, 0});
    radii.push_back(radius);
    masses.push_back(mass);
  }
};

enum class Row { before_a_wall, in_line, equal, crooked };

/// Draws a ball that flies into a row of others with gaps of 3 mm to 3 cm, the last one to the wall. Balls of
/// an equal row have equal masses and no loss; those of a crooked one are up to half a radius off the line.
template <Row row>
Balls draw_row(Random& random) {
  Balls balls;
  balls.along = random.direction();
  balls.e = row == Row::equal ? 1 : random.one_of({0.5, 0.8, 0.95, 1.0});
  balls.speed = random.spread(1, 20);
  const bool has_wall = row == Row::before_a_wall;
  const auto mass = [&] { return row == Row::equal ? 1 : random.spread(0.3, 3); };
  const int count = has_wall ? 1 + random.below(2) : 1 + random.below(4);
  double radius = random.between(0.03, 0.1);
  balls.add(radius, mass(), Vector3::Zero(), balls.speed * balls.along);
  double reached = radius + balls.speed * random.between(0.02, 0.15);
  for (int i = 0; i < count; ++i) {
    radius = random.between(0.03, 0.1);
    Vector3 aside = Vector3::Zero();
    if (row == Row::crooked) aside = random.between(0, 0.5) * radius * random.across(balls.along);
    balls.add(radius, mass(), (reached + radius) * balls.along + aside, Vector3::Zero());
    reached += 2 * radius + random.spread(0.003, 0.03);
  }
  if (has_wall) {
    balls.wall = reached;
    add_static(balls.scene, box_of({2, 0.01, 2}),
               {(reached + 0.005) * balls.along, shortest_rotation(Vector3::UnitY(), balls.along)},
               {1, Vector3::Ones(), balls.e, 0});
  }
  return balls;
}

/// Draws fifteen touching balls and a sixteenth that flies at them along the line of symmetry, or aside from
/// it by up to a radius.
template <bool aside>
Balls draw_break(Random& random) {
  Balls balls;
  balls.e = random.one_of({0.5, 0.9, 0.95, 1.0});
  balls.speed = random.spread(2, 10);
  const double radius = random.between(0.02, 0.1);
  const double mass = random.spread(0.1, 1);
  const double offset = aside ? random.between(0.2, 1) * radius : 0;
  const double away = 2 * radius + balls.speed * random.between(0.02, 0.1);
  balls.add(radius, mass, {-away, 0, offset}, {balls.speed, 0, 0});
  for (int row = 0; row < 5; ++row) {
    for (int i = 0; i <= row; ++i)
      balls.add(radius, mass, {row * std::sqrt(3.0) * radius, 0, (2 * i - row) * radius}, Vector3::Zero());
  }
  return balls;
}

/// Returns the penetration of two balls, or of a ball and the wall, relative to the smaller diameter.
double penetration(const Balls& balls, const State& state) {
  double depth = 0;
  for (std::size_t i = 0; i < balls.radii.size(); ++i) {
    const Vector3& x = state.q[i + 1].linear;
    depth = std::max(depth, (balls.along.dot(x) + balls.radii[i] - balls.wall) / (2 * balls.radii[i]));
    for (std::size_t j = 0; j < i; ++j) {
      const double both = balls.radii[i] + balls.radii[j] - (x - state.q[j + 1].linear).norm();
      depth = std::max(depth, both / (2 * std::min(balls.radii[i], balls.radii[j])));
    }
  }
  return depth;
}

/// Returns the change of momentum relative to the start's.
double change_of_momentum(const Balls& balls, const State& state) {
  Vector3 start = Vector3::Zero();
  Vector3 now = Vector3::Zero();
  for (std::size_t i = 0; i < balls.radii.size(); ++i) {
    start += balls.masses[i] * balls.scene.bodies[i + 1].linear_velocity;
    now += balls.masses[i] * state.v[i + 1].linear;
  }
  return (now - start).norm() / start.norm();
}

/// Returns the rise of the energy relative to the start's.
double rise_of_energy(const Balls& balls, const State& state) {
  double start = 0;
  double now = 0;
  for (std::size_t i = 0; i < balls.radii.size(); ++i) {
    start += 0.5 * balls.masses[i] * balls.scene.bodies[i + 1].linear_velocity.squaredNorm();
    now += balls.masses[i] * (0.5 * state.v[i + 1].linear.squaredNorm() +
                              0.2 * balls.radii[i] * balls.radii[i] * state.v[i + 1].angular.squaredNorm());
  }
  return now / start - 1;
}

/// Returns infinity where two balls of a row, or the last and the wall, have swapped positions, otherwise 0.
double passed_through(const Balls& balls, const State& state) {
  double before = -infinity;
  for (std::size_t i = 1; i <= balls.radii.size(); ++i) {
    const double x = balls.along.dot(state.q[i].linear);
    if (x < before || x > balls.wall) return infinity;
    before = x;
  }
  return 0;
}

/// Returns the largest difference of a ball's velocity from the mirror image of its partner's, relative to
/// the first ball's at the start.
double asymmetry(const Balls& balls, const State& state) {
  double error = 0;
  for (std::size_t row = 0; row < 5; ++row) {
    for (std::size_t i = 0; i <= row; ++i) {
      const std::size_t first = 2 + row * (row + 1) / 2;
      Vector3 mirrored = state.v[first + row - i].linear;
      mirrored.z() *= -1;
      error = std::max(error, (state.v[first + i].linear - mirrored).norm() / balls.speed);
    }
  }
  return error;
}

std::string parameters_of(const Balls& balls) {
  return fmt::format("{} balls at {:.2f} m/s, e {}, radii {:.3f}, masses {:.2f}{}", balls.radii.size(),
                     balls.speed, balls.e, fmt::join(balls.radii, " "), fmt::join(balls.masses, " "),
                     std::isfinite(balls.wall) ? ", a wall" : "");
}

/// An error of the balls after any step, and its limit.
struct Law {
  double (*error_of)(const Balls& balls, const State& state);
  double limit;
};

/// Runs a check of several laws: prints the largest error over its limit.
void run_balls(const char* name, Balls (*draw)(Random&), const std::vector<Law>& laws,
               const std::vector<Algorithm>& algorithms = {all_algorithms.begin(), all_algorithms.end()}) {
  run({name, 1,
       [=](Random& random) {
         const Balls balls = draw(random);
         return largest_of(parameters_of(balls), balls.scene, 0.5, [=](const State& state, double) {
           double worst = 0;
           for (const Law& law : laws) worst = std::max(worst, law.error_of(balls, state) / law.limit);
           return worst;
         });
       },
       algorithms});
}

TEST(StruckBodies, BallBeforeAWallStaysInFront) {
  run_balls("struck before a wall: order, penetration, energy", draw_row<Row::before_a_wall>,
            {{passed_through, 1}, {penetration, 0.02}, {rise_of_energy, 0.01}});
}

TEST(StruckBodies, RowKeepsItsOrder) {
  run_balls("struck row: order", draw_row<Row::in_line>, {{passed_through, 1}});
}

// Balls of equal masses swap their velocities in lossless impacts, so that all but the last stop.
TEST(StruckBodies, EqualRowSwapsItsSpeeds) {
  run({"struck row of equal masses: speeds", 0.02, [](Random& random) {
         const Balls balls = draw_row<Row::equal>(random);
         return last_of(parameters_of(balls), balls.scene, 0.5, [=](const State& state, double) {
           double error = (state.v.back().linear - balls.speed * balls.along).norm();
           for (std::size_t i = 1; i + 1 < state.v.size(); ++i)
             error = std::max(error, state.v[i].linear.norm());
           return error / balls.speed;
         });
       }});
}

TEST(StruckBodies, CrookedRowKeepsLawsOfImpact) {
  run_balls("struck crooked row: penetration, momentum, energy", draw_row<Row::crooked>,
            {{penetration, 0.02}, {change_of_momentum, 1e-9}, {rise_of_energy, 0.01}});
}

TEST(Break, KeepsItsMirrorSymmetryInA1) {
  run_balls("break of fifteen: asymmetry", draw_break<false>, {{asymmetry, 0.01}}, {Algorithm::a1});
}

TEST(Break, KeepsLawsOfImpact) {
  run_balls("break of fifteen: penetration, momentum, energy", draw_break<true>,
            {{penetration, 0.02}, {change_of_momentum, 1e-9}, {rise_of_energy, 0.01}});
}

// Bounces with spin

/// Draws a spinning ball that bounces off a plane, a slab or a mesh. Friction's impulse is 2/7 of slip times
/// mass (sticking), or μ times the normal one. Errors are relative to the exact tangential change.
template <bool sticks>
Trial draw_spinning_bounce(Random& random) {
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
  Scene scene = weightless_scene();
  const Substance substance{mass, ball_moments(mass, radius), e, friction};
  add_body(scene, ball(radius), {{radius * up - meeting * velocity, random.orientation()}, velocity, spin},
           substance);
  const int kind = random.below(3);
  if (kind == 0) add_static_plane(scene, {Vector3::Zero(), turn}, substance);
  if (kind == 1) add_static(scene, box_of({5, 1, 5}), {-0.5 * up, turn}, substance);
  if (kind == 2) add_static(scene, rectangle_mesh(5, 5), {Vector3::Zero(), turn}, substance);
  constexpr std::array kinds{"plane", "slab", "mesh"};
  return last_of(
      fmt::format(
          "ball of {:.3f} m on a {}, {:.2f} m/s down, slip {:.2f} m/s, μ {:.3f}, e {:.2f}, meeting at "
          "{:.4f} s",
          radius, kinds[kind], down, slip.norm(), friction, e, meeting),
      scene, meeting + 0.1, [=](const State& state, double) {
        const double error = (state.v[1].linear - expected).norm();
        const double of_spin = (state.v[1].angular - expected_spin).norm();
        return std::max(error, 0.4 * radius * of_spin) / tangential;
      });
}

/// Draws a stick that falls on its corner, without spin and friction, and bounces with e = 1. The error is
/// that of its energy.
Trial draw_corner_hit(Random& random) {
  const double length = random.spread(0.02, 0.5);
  const Vector3 size = length * Vector3(1, random.between(0.1, 0.5), random.between(0.1, 0.5));
  const double mass = random.spread(0.01, 3);
  const double speed = random.between(1, 4) * length;
  const double meeting = random.between(0.02, 0.1);
  const Quaternion turn = random.orientation();
  // Tilt all faces, so that no second corner hits in the same step.
  const Vector3 up = turn * Vector3(1, random.between(0.5, 1), random.between(0.5, 1)).normalized();
  const Vector3 velocity = speed * (random.between(0, 1) * random.across(up) - up);
  const Vector3 squares = size.cwiseAbs2();
  const Vector3 moments = mass / 12 * (Vector3::Constant(squares.sum()) - squares);
  const double height = -height_above(up, box_of(size), {Vector3::Zero(), turn});
  Scene scene = weightless_scene();
  add_static_plane(scene, {Vector3::Zero(), shortest_rotation(Vector3(0, 1, 0), up)}, {1, moments, 1, 0});
  add_body(scene, box_of(size), {{height * up - meeting * velocity, turn}, velocity}, {mass, moments, 1, 0});
  return last_of(
      fmt::format("stick of {:.3f} m, {:.2f} m/s, meeting at {:.4f} s", length, velocity.norm(), meeting),
      scene, std::ceil(meeting * 60) / 60, [=](const State& state, double) {
        const Vector3 spin = state.q[1].angular.conjugate() * state.v[1].angular;
        const double energy = state.v[1].linear.squaredNorm() + moments.dot(spin.cwiseAbs2()) / mass;
        return std::abs(energy / velocity.squaredNorm() - 1);
      });
}

TEST(CornerHit, KeepsEnergy) {
  run({"stick on its corner: energy", 1e-9, &draw_corner_hit});  // measured 3e-13
}

TEST(SpinningBounce, StickingTakesAllSlip) {
  run({"bounce with spin, sticking", 0.02, &draw_spinning_bounce<true>});
}

TEST(SpinningBounce, SlidingTakesFrictionTimesTheImpulse) {
  run({"bounce with spin, sliding", 0.02, &draw_spinning_bounce<false>});
}

}  // namespace
}  // namespace substep::test
