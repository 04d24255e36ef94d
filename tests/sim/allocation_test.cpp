// Steps of all algorithms but A1, and searches for contacts, allocate nothing once they had as many contacts.

#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "sim/constraints/constraint.h"
#include "sim/geometry/contact.h"
#include "sim/geometry/convex_hull.h"
#include "tests/geometry/solids.h"
#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"

namespace {
bool counting = false;
long allocations = 0;
}  // namespace

void* operator new(std::size_t size) {
  if (counting) ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  if (counting) ++allocations;
  const std::size_t unit = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(unit, (size + unit - 1) / unit * unit)) return memory;
  throw std::bad_alloc();
}
// gcc 12 takes an inlined free() for a mismatch.
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}

namespace substep {
namespace {

long allocations_of_steps(const Scene& scene, Settings settings) {
  Simulation simulation(scene, settings);
  simulation.step();
  allocations = 0;
  counting = true;
  std::int64_t contacts = 0;
  for (int i = 0; i < 30; ++i) contacts += simulation.step().contacts;
  counting = false;
  EXPECT_EQ(contacts > 0, !scene.colliders.empty());
  return allocations;
}

/// Returns balls that roll and bounce a little: contacts with restitution.
Scene balls_in_a_row() {
  Scene scene = test::floor_scene(0.4);
  scene.colliders[0].material.restitution = 0.5;
  for (int i = 0; i < 5; ++i) {
    const int ball = test::add_ball(scene, 0.1, 1, {0.19 * i, 0.11, 0}, 0.6, 0.5);
    scene.bodies[ball].linear_velocity = {1, -0.5, 0};
  }
  return scene;
}

TEST(Step, AllocatesNothingAfterFirst) {
  for (const auto& [algorithm, warm_start] : {std::pair(Algorithm::a2, 0.0),
                                              {Algorithm::a3, 0.0},
                                              {Algorithm::a4, 0.0},
                                              {Algorithm::a5, 0.0},
                                              {Algorithm::a5, 0.5},
                                              {Algorithm::soft, 0.0},
                                              {Algorithm::avbd, 0.0}}) {
    Settings settings = default_settings(algorithm);
    settings.warm_start = warm_start;
    EXPECT_EQ(allocations_of_steps(test::chain(5, 0.4), settings), 0) << name(algorithm) << " chain";
    EXPECT_EQ(allocations_of_steps(test::box_stack(6), settings), 0) << name(algorithm) << " stack";
    EXPECT_EQ(allocations_of_steps(balls_in_a_row(), settings), 0) << name(algorithm) << " balls";
    for (const char* scene :
         {"box_stack", "stone_pyramid", "card_house", "brick_wall", "incline", "balls_on_tray"}) {
      EXPECT_EQ(allocations_of_steps(scene_named(scene), settings), 0) << name(algorithm) << ' ' << scene;
    }
  }
}

TEST(ContactSearch, AllocatesNothingOnceWarm) {
  std::mt19937 random(1);
  std::vector<Shape> shapes = test::round_shapes();
  const Shape others[] = {Plane{}, test::flat_mesh(8, 0.25, 0.3), box({1, 1, 1}), cylinder(1, 0.5, 0.5),
                          test::random_hull(random, 30)};
  shapes.insert(shapes.end(), std::begin(others), std::end(others));
  std::vector<Pose> poses;
  poses.reserve(40);
  for (int i = 0; i < 40; ++i) {
    poses.push_back({test::random_point(random, 0.8), test::random_orientation(random)});
  }
  std::vector<Bounds> boxes;
  BroadPhase broad_phase;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  std::vector<ContactPoint> points;
  std::size_t found = 0;
  const auto run = [&] {
    points.clear();
    for (const Shape& a : shapes) {
      for (const Shape& b : shapes) {
        for (const Pose& pose : poses) find_contacts(a, pose, b, {}, 0.05, points);
      }
    }
    found = points.size();
    boxes.clear();
    for (const Pose& pose : poses) boxes.push_back(bounds(shapes.back(), pose));
    broad_phase.find_pairs(boxes, pairs);
  };
  run();
  allocations = 0;
  counting = true;
  run();
  counting = false;
  EXPECT_EQ(allocations, 0);
  EXPECT_GT(found, 1000U);
  EXPECT_FALSE(pairs.empty());
}

/// Counts the allocations of a vector of three elements that is itself on the heap.
template <class Element>
long allocations_of_a_vector() {
  counting = true;
  allocations = 0;
  std::vector<Element>* volatile made = new std::vector<Element>(3);
  delete made;
  counting = false;
  return allocations;
}

TEST(Allocation, CounterCountsAlignedMemory) {
  EXPECT_GE(allocations_of_a_vector<int>(), 1);
  EXPECT_EQ(allocations_of_a_vector<NormalRow>(), 2);
}

}  // namespace
}  // namespace substep
