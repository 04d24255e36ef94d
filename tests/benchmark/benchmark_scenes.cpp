#include "tests/benchmark/benchmark_scenes.h"

#include <algorithm>
#include <cmath>

#include "tests/sim/test_scenes.h"

namespace substep::benchmark {
namespace {

constexpr double friction = 0.6;
constexpr double frame = 1.0 / 60;
const Vector3 unit_cube = Vector3::Ones();

constexpr double pile_pitch = 1.3;

/// Returns the number of boxes along a layer's side.
int side_of_pile(int boxes) {
  return boxes <= 250 ? 5 : 10;
}

}  // namespace

bool BenchmarkScene::is_chosen_by(const std::vector<std::string>& words) const {
  return words.empty() ||
         std::ranges::any_of(words, [&](const std::string& begin) { return name.starts_with(begin); });
}

BenchmarkScene pendulum() {
  Scene scene = test::empty_scene();
  test::add_box(scene, {1, 0.05, 0.05}, 1, test::at(0.5, 0, 0), 0);
  scene.colliders.clear();
  scene.joints.push_back(test::ball_joint(1, 0, {-0.5, 0, 0}, Vector3::Zero()));
  return {"pendulum", scene, frame, 600, BenchmarkScene::Judge::trajectory};
}

BenchmarkScene chain_of(int rods) {
  return {"chain " + std::to_string(rods), test::chain(rods), frame, std::clamp(3000 / rods, 2, 300),
          BenchmarkScene::Judge::trajectory};
}

BenchmarkScene net_of(int side) {
  return {"net " + std::to_string(side * side), test::net(side), frame, std::clamp(3000 / side / side, 4, 60),
          BenchmarkScene::Judge::trajectory};
}

BenchmarkScene heavy_chain() {
  return {"heavy chain", test::chain(10, 0, 1000), 1.0 / 480, 480, BenchmarkScene::Judge::trajectory};
}

BenchmarkScene stack_of(int boxes, double top_mass) {
  std::string name = "stack " + std::to_string(boxes);
  if (top_mass != 1) name += " top " + std::to_string(static_cast<int>(top_mass)) + " kg";
  return {name, test::box_stack(boxes, friction, top_mass), frame, 300, BenchmarkScene::Judge::standing};
}

BenchmarkScene pyramid_of(int base) {
  return {"pyramid " + std::to_string(base * (base + 1) / 2), test::box_pyramid(base), frame, 120,
          BenchmarkScene::Judge::standing};
}

BenchmarkScene wall_of(int side) {
  Scene scene = test::floor_scene(friction);
  for (int i = 0; i < side * side; ++i) {
    const int row = i / side;
    const double x = i % side - 0.5 * (side - 1) + (row % 2 == 0 ? 0.15 : -0.15);
    test::add_box(scene, unit_cube, 1, test::at(x, 0.5 + row, 0), friction);
  }
  return {"wall " + std::to_string(side * side), scene, frame, 120, BenchmarkScene::Judge::standing};
}

BenchmarkScene pile_of(int boxes) {
  Scene scene = test::floor_scene(friction);
  const int side = side_of_pile(boxes);
  const double inside = pile_pitch * side;
  const double high = 1.5 * boxes / (side * side) + 2;
  for (int wall = 0; wall < 4; ++wall) {
    const bool along_x = wall < 2;
    const double place = (wall % 2 == 0 ? 0.5 : -0.5) * (inside + 1);
    Collider collider;
    collider.shape = box(along_x ? Vector3(1, high, inside + 2) : Vector3(inside + 2, high, 1));
    collider.placement.position = along_x ? Vector3(place, high / 2, 0) : Vector3(0, high / 2, place);
    collider.material.dynamic_friction = collider.material.static_friction = friction;
    scene.colliders.push_back(collider);
  }
  unsigned seed = 1;
  const auto next = [&seed] {  // the same numbers on every machine
    seed = seed * 1664525u + 1013904223u;
    return static_cast<double>(seed >> 8) / 8388608.0 - 1.0;
  };
  for (int i = 0; i < boxes; ++i) {
    const int layer = i / (side * side);
    const int column = i % side;
    const int row = i / side % side;
    const Vector3 position(pile_pitch * (column - 0.5 * (side - 1)), 1 + 1.5 * layer,
                           pile_pitch * (row - 0.5 * (side - 1)));
    const Vector3 turn(0.1 * next(), 0.1 * next(), 0.1 * next());
    test::add_box(scene, unit_cube, 1, {position, rotation_quaternion(turn)}, friction);
  }
  return {"pile " + std::to_string(boxes), scene, frame, 480, BenchmarkScene::Judge::contained};
}

State target_of(const BenchmarkScene& scene) {
  if (scene.judge == BenchmarkScene::Judge::trajectory) return reference_run(scene.scene, 1, 128);
  return initial_state(scene.scene);
}

Verdict judge(const BenchmarkScene& scene, const State& target, Stepper& engine) {
  const bool trajectory = scene.judge == BenchmarkScene::Judge::trajectory;
  const int steps = trajectory ? static_cast<int>(std::lround(1 / scene.step)) : scene.steps;
  for (int i = 0; i < steps; ++i) {
    if (!engine.step()) return {false, infinity};
  }
  double error = 0;
  if (scene.judge == BenchmarkScene::Judge::contained) {
    // A contained box's centre lies half a box inside the walls and above the floor.
    const double inside = 0.5 * pile_pitch * side_of_pile(static_cast<int>(target.q.size()) - 1) - 0.5;
    for (std::size_t i = 1; i < target.q.size(); ++i) {
      const Vector3& x = engine.state().q[i].linear;
      error = std::max({error, std::abs(x.x()) - inside, std::abs(x.z()) - inside, 0.5 - x.y()});
    }
  } else {
    error = position_difference(engine.state(), target);
  }
  // Bodies that stand move by less than the scenes' own limit (scenes/format.md). A step of 1/60 s is some
  // centimetres from the reference in a second; bodies that leave the container are a box or more outside.
  const double limit = scene.judge == BenchmarkScene::Judge::standing ? 0.05 : 0.5;
  return {error < limit, error};
}

}  // namespace substep::benchmark
