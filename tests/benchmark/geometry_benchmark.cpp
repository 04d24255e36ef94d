// Measures the cost of finding contacts: the broad phase by the number of bodies, and pairs of shapes by
// kind.

#include <benchmark/benchmark.h>

#include <cmath>
#include <random>
#include <vector>

#include "sim/geometry/contact.h"
#include "sim/geometry/convex_hull.h"
#include "sim/geometry/round_solids.h"
#include "tests/geometry/solids.h"

namespace substep {
namespace {

using Boxes = std::vector<Bounds>;

/// Unit boxes at random, one in twenty cubic metres.
Boxes scattered(int count) {
  std::mt19937 random(1);
  Boxes boxes;
  const double half = std::cbrt(20.0 * count) / 2;
  for (int i = 0; i < count; ++i) {
    const Vector3 lower = test::random_point(random, half);
    boxes.push_back({lower, lower + Vector3::Ones()});
  }
  return boxes;
}

/// Unit boxes packed as high as wide, near enough to touch.
Boxes pile(int count) {
  std::mt19937 random(1);
  Boxes boxes;
  const int wide = static_cast<int>(std::ceil(std::cbrt(count)));
  for (int i = 0; i < count; ++i) {
    const Vector3 lower = 0.99 * test::grid_point(i, wide) + test::random_point(random, 0.005);
    boxes.push_back({lower, lower + Vector3::Ones()});
  }
  return boxes;
}

/// Finds pairs of boxes that move a little from step to step, as in a run.
void find_pairs(benchmark::State& state, Boxes (*make)(int)) {
  Boxes boxes = make(static_cast<int>(state.range(0)));
  BroadPhase broad_phase;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  std::mt19937 random(2);
  std::vector<Vector3> moves;
  for (std::size_t i = 0; i < boxes.size(); ++i) moves.push_back(test::random_point(random, 1e-3));
  double sign = 1;
  for (auto _ : state) {
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      boxes[i].lower += sign * moves[i];
      boxes[i].upper += sign * moves[i];
    }
    sign = -sign;
    broad_phase.find_pairs(boxes, pairs);
    benchmark::DoNotOptimize(pairs.data());
  }
  const auto bodies = static_cast<double>(boxes.size());
  state.counters["per_body"] =
      benchmark::Counter(bodies, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["tests_per_body"] = static_cast<double>(broad_phase.pairs_tested()) / bodies;
  state.counters["pairs_per_body"] = static_cast<double>(pairs.size()) / bodies;
}

BENCHMARK_CAPTURE(find_pairs, scattered, scattered)->Arg(100)->Arg(1000)->Arg(3000)->Arg(10000);
BENCHMARK_CAPTURE(find_pairs, pile, pile)->Arg(100)->Arg(1000)->Arg(3000)->Arg(10000);

/// One shape resting on another at the height 0, its turn about the vertical different each time.
void touch(benchmark::State& state, const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
  std::vector<Pose> poses;
  for (int i = 0; i < 64; ++i) {
    const Pose turned = {Vector3::Zero(), test::turn(0.1 * i, Vector3::UnitY())};
    poses.push_back(turned * pose_a);
  }
  std::vector<ContactPoint> points;
  std::size_t i = 0;
  for (auto _ : state) {
    points.clear();
    find_contacts(a, poses[i++ % poses.size()], b, pose_b, 0.02, points);
    benchmark::DoNotOptimize(points.data());
  }
  state.counters["contacts"] = static_cast<double>(points.size());
}

const Quaternion upright = Quaternion::Identity();
const Pose below = {{0, -0.5, 0}, upright};

Polytope dodecahedron() {
  return convex_hull(test::dodecahedron_points(), "dodecahedron");
}

Pose on_face(const Polytope& solid, double sign) {
  return {{0, sign * (solid.inner_radius - 5e-5), 0},
          Quaternion::FromTwoVectors(solid.face_normals[0], Vector3(0, -sign, 0))};
}

void register_pairs() {
  const auto add = [](const char* name, Shape a, Pose pose_a, Shape b, Pose pose_b) {
    benchmark::RegisterBenchmark(name, [=](benchmark::State& state) { touch(state, a, pose_a, b, pose_b); });
  };
  const Polytope cube = box({1, 1, 1});
  const Polytope solid = dodecahedron();
  const Polytope prism = cylinder(1, 0.5, 0.5);
  const Cylinder can = make_cylinder(1, 0.5, 0.5);
  const TriangleMesh floor = test::flat_mesh(16, 0.5, 0);
  const Pose standing = {{0.1, 0.4999, 0.05}, upright};
  const Pose lying = {{0.1, 0.4999, 0.05}, test::turn(std::acos(0.0), {0, 0, 1})};
  add("touch/box_box", cube, standing, cube, below);
  add("touch/dodecahedron_dodecahedron", solid, on_face(solid, 1), solid, on_face(solid, -1));
  add("touch/prism32_prism32", prism, standing, prism, below);
  add("touch/cylinder_box", can, standing, box({4, 1, 4}), below);
  add("touch/cylinder_cylinder", can, standing, can, below);
  add("touch/lying_cylinder_box", can, lying, box({4, 1, 4}), below);
  add("touch/cylinder_mesh", can, standing, floor, {});
  add("touch/sphere_mesh", Sphere{0.5}, standing, floor, {});
  add("touch/box_mesh", cube, standing, floor, {});
}

}  // namespace
}  // namespace substep

int main(int argc, char** argv) {
  substep::register_pairs();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
