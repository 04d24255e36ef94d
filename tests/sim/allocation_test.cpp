// A step of A2–A5 allocates nothing after the first.

#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

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
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace substep {
namespace {

long allocations_of_steps(const Scene& scene, Settings settings) {
  Simulation simulation(scene, settings);
  simulation.step();
  allocations = 0;
  counting = true;
  for (int i = 0; i < 30; ++i) simulation.step();
  counting = false;
  return allocations;
}

Scene stack_of(int boxes) {
  Scene scene = test::floor_scene(0.6);
  for (int i = 0; i < boxes; ++i)
    test::add_box(scene, {1, 1, 1}, 1, {{0, 0.5 + i, 0}, Quaternion::Identity()}, 0.6);
  return scene;
}

TEST(Allocation, NoneInAStepAfterTheFirst) {
  for (const Algorithm algorithm : {Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    Settings settings;
    settings.algorithm = algorithm;
    settings.iterations = 4;
    EXPECT_EQ(allocations_of_steps(test::chain(5, 0.4), settings), 0) << name(algorithm) << " chain";
    EXPECT_EQ(allocations_of_steps(stack_of(6), settings), 0) << name(algorithm) << " stack";
  }
}

TEST(Allocation, TheCounterCounts) {
  counting = true;
  allocations = 0;
  std::vector<int>* volatile made = new std::vector<int>(1);
  delete made;
  counting = false;
  EXPECT_GE(allocations, 1);
}

}  // namespace
}  // namespace substep
