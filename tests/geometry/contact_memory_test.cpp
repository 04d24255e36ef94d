#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "sim/geometry/contact.h"
#include "sim/geometry/convex_hull.h"
#include "sim/geometry/round_shapes.h"
#include "tests/geometry/solids.h"

namespace {

std::atomic<long> allocations = 0;

}  // namespace

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}

namespace substep {
namespace {

TEST(ContactMemory, AllocatesNothingOnceWarm) {
  std::mt19937 random(1);
  const std::vector<Shape> shapes = {Sphere{0.4},
                                     Capsule{0.5, 0.3},
                                     Plane{},
                                     make_cylinder(1, 0.5, 0.5),
                                     make_cylinder(1, 0.5, 0),
                                     make_tapered_capsule(1, 0.3, 0.1),
                                     test::flat_mesh(8, 0.25, 0.3),
                                     box({1, 1, 1}),
                                     cylinder(1, 0.5, 0.5),
                                     test::random_hull(random, 30)};
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
  const long before = allocations;
  run();
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(before, 0);
  EXPECT_GT(found, 1000U);
  EXPECT_FALSE(pairs.empty());
}

}  // namespace
}  // namespace substep
