/// Scenes of near misses, seams and fast impacts, each with a closed form.

#include "scenes.h"

namespace substep::scenes {
namespace {

constexpr double small_radius = 0.05;  // m, of all balls

/// Returns the motion of a body of 1 kg along its node's +X.
Motion moving(double speed) {
  return {.mass = 1, .linear_velocity = {speed, 0, 0}};
}

/// A lane between two rows of posts, for one ball or two.
struct PassingLane {
  double speed;         // m/s
  double clearance;     // m, between the ball and each post
  double angle;         // rad, from +X
  double z;             // m
  double oncoming = 0;  // m/s, of a second ball that passes at the same clearance
  Finish finish;
};

constexpr std::array<PassingLane, 5> lanes{{{1, 0.005, 0.05, 1.1, 0, finish::terracotta},
                                            {2, 0.008, -0.04, 0.65, 3.5, finish::mustard},
                                            {3, 0.012, 0.03, 0.2, 5, finish::teal},
                                            {4.5, 0.016, -0.05, -0.35, 0, finish::blue},
                                            {6, 0.02, 0.04, -0.95, 0, finish::ivory}}};

/// Adds a ball that moves along its node's +X and meets nothing. Expects it to keep its velocity and line.
void send_past(GltfBuilder& gltf, const std::string& name, const Pose& pose, double speed,
               const Collider& collider, const NodeMesh& look, const Json& window) {
  gltf.body(name, pose, moving(speed), collider, look);
  const Matrix3 axes = pose.orientation.toRotationMatrix();
  gltf.expect({name + ": velocity along its line", "velocity", {name}, axes.col(0)}, window, speed,
              1e-6 * speed, "nothing is met");
  gltf.expect({name + ": way across its line", "way", {name}, axes.col(2)}, window, 0, 1e-6,
              "nothing is met");
}

GltfBuilder near_miss() {
  constexpr double duration = 1;
  constexpr std::array<double, 4> passes{0.17, 0.37, 0.58, 0.79};  // s
  constexpr double post_radius = 0.04;
  constexpr double post_height = 0.2;
  const double corner = post_height / 4 * std::numbers::sqrt2;  // of a square post, from its axis

  GltfBuilder gltf("near_miss", {.duration = duration, .poster = 0.4},
                   {.eye = {0.4, 3.6, 4.6}, .target = {0, -0.05, 0.1}, .yfov = 0.42});
  const int bouncing = gltf.bouncing_material(0.9);
  gltf.ground(bouncing);

  const int round = gltf.sphere_shape(small_radius);
  const int ball_geometry = gltf.geometry(ball(small_radius));
  const int cylinder = gltf.cylinder_shape(post_radius, post_radius, post_height);
  const int square = gltf.box_shape({post_height / 2, post_height, post_height / 2});
  const int pin = gltf.mesh("pin", {{rod(post_height, post_radius, 0.006), finish::steel}});
  const int stake =
      gltf.mesh("stake", {{cuboid({post_height / 2, post_height, post_height / 2}, 0.004), finish::walnut}});

  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const PassingLane& lane = lanes[i];
    const std::string number = std::to_string(i + 1);
    const Pose middle = at(0, 0, lane.z) * turn(Y, lane.angle);
    const int look = gltf.mesh("ball_" + number, {{ball_geometry, lane.finish}});
    const double start = -lane.speed * duration / 2;

    // Place pins and corners of stakes on both sides of the lane, or on +Z alone where a second ball passes
    // on −Z.
    for (std::size_t k = 0; k < passes.size(); ++k) {
      const bool is_pin = (i + k) % 2 == 0;
      const double side = lane.oncoming > 0 || k < 2 ? 1 : -1;
      const double z = side * (small_radius + lane.clearance + (is_pin ? post_radius : corner));
      const Pose upright = middle * at(start + lane.speed * passes[k], post_height / 2, z);
      gltf.fixed_body("post_" + number + "_" + std::to_string(k + 1),
                      is_pin ? upright : upright * turn(Y, pi / 4), {is_pin ? cylinder : square, bouncing},
                      is_pin ? pin : stake);
    }

    // Send the balls, the second one backwards.
    const Collider collider{round, bouncing};
    const auto window = throughout(0, duration);
    send_past(gltf, "ball_" + number, middle * at(start, small_radius, 0), lane.speed, collider, look,
              window);
    if (lane.oncoming > 0) {
      const double beside = -2 * small_radius - lane.clearance;
      const Pose pose = middle * at(lane.oncoming * duration / 2, small_radius, beside) * turn(Y, pi);
      send_past(gltf, "oncoming_" + number, pose, lane.oncoming, collider, look, window);
    }
  }
  return gltf;
}

GltfBuilder seams() {
  constexpr double duration = 2;
  constexpr double tile = 0.25;
  constexpr double thickness = 0.1;
  constexpr double pitch = 0.3;
  constexpr int tiles = 20;
  constexpr std::array<double, 3> speeds{0.5, 1, 2};
  const Vector3 block(0.16, 0.1, 0.1);
  const Pose row = turn(Y, 0.35);
  const Matrix3 axes = row.orientation.toRotationMatrix();

  GltfBuilder gltf("seams", {.duration = duration, .poster = 1.6},
                   {.eye = {1.5, 3.2, 4.9}, .target = {0, 0, 0}, .yfov = 0.62, .friction = 0.5});
  const int grip = gltf.physics_material(0.5);
  const int smooth = gltf.physics_material(0);
  const double width = 9 * pitch;
  for (int i = 0; i < tiles; ++i) {
    const double x = tile * (i - (tiles - 1) / 2.0);
    gltf.fixed_box(numbered("tile", i + 1), {tile, thickness, width}, row * at(x, thickness / 2, 0), grip,
                   i % 2 == 0 ? finish::maple : finish::oak, 0.002);
  }

  const int shapes[]{gltf.box_shape(block), gltf.sphere_shape(small_radius),
                     gltf.cylinder_shape(small_radius, small_radius, 0.12)};
  const Pose stands[]{at(0, block.y() / 2, 0), at(0, small_radius, 0),
                      at(0, small_radius, 0) * turn(X, pi / 2)};
  const int geometries[]{gltf.geometry(cuboid(block, 0.004)), gltf.geometry(ball(small_radius)),
                         gltf.geometry(rod(0.12, small_radius, 0.004))};
  const Finish finishes[]{finish::terracotta, finish::ivory, finish::teal};
  const char* const names[]{"box", "ball", "cylinder"};
  std::vector<std::string> bodies;
  for (int kind = 0; kind < 3; ++kind) {
    const int look = gltf.mesh(names[kind], {{geometries[kind], finishes[kind]}});
    for (int i = 0; i < 3; ++i) {
      const double speed = speeds[i];
      const std::string name = std::string(names[kind]) + "_" + std::to_string(i + 1);
      Motion motion = moving(speed);
      if (kind == 1) motion.angular_velocity = {0, 0, -speed / small_radius};
      // The cylinder's own −Y is the row's −Z, about which it rolls.
      if (kind == 2) motion.angular_velocity = {0, -speed / small_radius, 0};
      const Pose start = row * at(-speed * duration / 2, thickness, pitch * (3 * kind + i - 4));
      gltf.body(name, start * stands[kind], motion, {shapes[kind], kind == 0 ? smooth : grip}, look);
      bodies.push_back(name);
      gltf.expect({name + ": way along the row", "way", {name}, axes.col(0)}, at_time(duration),
                  speed * duration, 0.002 * speed * duration,
                  kind == 0 ? "no friction: v t" : "rolling does not slip: v t");
    }
  }
  gltf.expect({"way up, of all", "way", bodies, Y}, throughout(0, duration), 0, 1e-4, "the boxes are flush");
  gltf.expect({"way across the row, of all", "way", bodies, axes.col(2)}, throughout(0, duration), 0, 1e-4,
              "nothing pushes across");
  return gltf;
}

/// A ball in front of a wall, and the final velocities of the ball and of its striker.
struct BallAtWall {
  const char* name;
  double restitution;
  double striker;  // as a fraction of the striker's speed
  double ball;     // as a fraction of the striker's speed
};

constexpr std::array<BallAtWall, 3> balls_at_walls{
    {{"elastic", 1, -1, 0}, {"half", 0.5, -7.0 / 32, -3.0 / 64}, {"plastic", 0, 0, 0}}};

GltfBuilder struck() {
  constexpr double duration = 0.4;
  constexpr double speed = 8;
  constexpr double gap = 0.003;
  constexpr double run_up = 0.5;
  constexpr double thickness = 0.01;
  constexpr double pitch = 2 * small_radius + gap;
  const Pose line = turn(Y, 0.2);
  const Vector3 along = line.orientation.toRotationMatrix().col(0);

  GltfBuilder gltf("struck", {.duration = duration, .poster = 0.1},
                   {.eye = {0.5, 2.2, 3.4}, .target = {0.1, 0, 0}, .yfov = 0.36});
  gltf.ground(gltf.bouncing_material(0));
  const int round = gltf.sphere_shape(small_radius);
  const int geometry = gltf.geometry(ball(small_radius));
  const int striking = gltf.mesh("striker", {{geometry, finish::terracotta}});
  const int hit = gltf.mesh("ball", {{geometry, finish::steel}});

  // Place a row of balls, each of which hands its speed on to the next.
  const int elastic = gltf.bouncing_material(1);
  gltf.body("striker", line * at(-run_up - 2 * small_radius, small_radius, 0.6), moving(speed),
            {round, elastic}, striking);
  std::vector<std::string> stopped{"striker"};
  for (int i = 0; i < 5; ++i) {
    gltf.body(numbered("ball", i + 1), line * at(i * pitch, small_radius, 0.6), moving(0), {round, elastic},
              hit);
    if (i < 4) stopped.push_back(numbered("ball", i + 1));
  }
  const std::string_view hands_on = "equal masses, restitution 1: each takes all the speed of the one before";
  gltf.expect({"ball_5: way at 0.4 s", "way", {"ball_5"}, along}, at_time(duration),
              speed * duration - run_up - 4 * gap, gap, hands_on);
  gltf.expect({"ball_5: speed at 0.4 s", "velocity", {"ball_5"}, along}, at_time(duration), speed,
              0.01 * speed, hands_on);
  gltf.expect({"speed of the others at 0.4 s", "speed", stopped}, at_time(duration), 0, 0.01 * speed,
              hands_on);

  // Place balls in front of walls, by restitution: the final velocities follow from one impact after another.
  for (const BallAtWall& lane : balls_at_walls) {
    const std::string name = lane.name;
    const double z = lane.restitution == 1 ? 0.2 : lane.restitution == 0 ? -0.6 : -0.2;
    const int material = gltf.bouncing_material(lane.restitution);
    gltf.fixed_box(name + "_wall", {thickness, 0.2, 0.3},
                   line * at(small_radius + gap + thickness / 2, 0.1, z), material, finish::walnut, 0.002);
    gltf.body(name + "_striker", line * at(-run_up - 2 * small_radius, small_radius, z), moving(speed),
              {round, material}, striking);
    gltf.body(name + "_ball", line * at(0, small_radius, z), moving(0), {round, material}, hit);
    const std::string_view source = "one impact after another, each with its restitution";
    const auto expect_velocity = [&](const std::string& body, double value) {
      gltf.expect({body + ": velocity at 0.4 s", "velocity", {body}, along}, at_time(duration), value,
                  0.01 * speed, source);
    };
    expect_velocity(name + "_striker", lane.striker * speed);
    expect_velocity(name + "_ball", lane.ball * speed);
    gltf.expect({name + "_ball: furthest way", "way", {name + "_ball"}, along}, throughout(0, duration),
                at_most(gap), 0.01 * thickness, "there the wall begins");
  }
  return gltf;
}

}  // namespace

std::vector<SceneFunction> meeting_scenes() {
  return {near_miss, seams, struck};
}

}  // namespace substep::scenes
