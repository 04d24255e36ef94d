#include <gtest/gtest.h>

#include <cmath>

#include "sim/geometry/contact.h"
#include "tests/geometry/solids.h"

namespace substep {
namespace {

using Pairs = BroadPhase::Pairs;

Pairs brute_pairs(const std::vector<Bounds>& boxes) {
  Pairs pairs;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    for (std::uint32_t j = i + 1; j < boxes.size(); ++j) {
      if ((boxes[i].min().array() <= boxes[j].max().array()).all() &&
          (boxes[j].min().array() <= boxes[i].max().array()).all()) {
        pairs.emplace_back(i, j);
      }
    }
  }
  return pairs;
}

std::vector<Bounds> random_boxes(std::mt19937& random, int count, const Vector3& spread, double largest) {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Bounds> boxes;
  for (int i = 0; i < count; ++i) {
    const Vector3 lower = test::random_point(random, 1).cwiseProduct(spread);
    // Draw sizes over three powers of ten, so that some are wider than the lanes of BroadPhase.
    const double size = largest * std::pow(10, -3 * uniform(random));
    boxes.push_back({lower, lower + size * (Vector3::Ones() + test::random_point(random, 0.5))});
  }
  return boxes;
}

TEST(BroadPhase, FindsSamePairsAsBruteForce) {
  std::mt19937 random(1);
  BroadPhase broad_phase;
  Pairs pairs;
  for (const Vector3& spread : {Vector3(1, 1, 1), Vector3(10, 1, 0), Vector3(0, 0, 5), Vector3(0, 0, 0)}) {
    for (const int count : {0, 1, 2, 50, 400}) {
      std::vector<Bounds> boxes = random_boxes(random, count, spread, 1);
      broad_phase.find_pairs(boxes, pairs);
      EXPECT_EQ(pairs, brute_pairs(boxes));
      // Add planes, whose bounds are infinite, and boxes with NaN, which are in no pair.
      boxes.insert(boxes.begin(), {Vector3::Constant(-infinity), Vector3(infinity, 0, infinity)});
      boxes.push_back({Vector3(0.5, -infinity, -infinity), Vector3::Constant(infinity)});
      boxes.push_back({Vector3::Constant(-infinity), Vector3::Constant(infinity)});
      boxes.insert(boxes.begin() + boxes.size() / 2, {Vector3(std::nan(""), 0, 0), Vector3::Ones()});
      boxes.push_back({Vector3::Zero(), Vector3::Constant(std::nan(""))});
      broad_phase.find_pairs(boxes, pairs);
      EXPECT_EQ(pairs, brute_pairs(boxes));
    }
  }
  // Put boxes on a grid, where orders have ties and boxes end where lanes do.
  std::vector<Bounds> grid;
  for (int i = 0; i < 343; ++i)
    grid.push_back({test::grid_point(i, 7), test::grid_point(i, 7) + Vector3::Ones()});
  broad_phase.find_pairs(grid, pairs);
  EXPECT_EQ(pairs, brute_pairs(grid));
}

TEST(BroadPhase, IgnoresEarlierCalls) {
  std::mt19937 random(2);
  BroadPhase used;
  Pairs pairs;
  std::vector<Bounds> boxes = random_boxes(random, 300, {3, 3, 3}, 1);
  for (int step = 0; step < 30; ++step) {
    used.find_pairs(boxes, pairs);
    ASSERT_EQ(pairs, brute_pairs(boxes)) << step;
    for (Bounds& box : boxes) {
      // Move the boxes slowly, then to random positions.
      const Vector3 move = test::random_point(random, step < 20 ? 0.01 : 3);
      box.min() += move;
      box.max() += move;
    }
  }
}

TEST(BroadPhase, SweepsOnlyWhenABoxLeaves) {
  std::mt19937 random(5);
  BroadPhase broad_phase;
  Pairs pairs;
  std::vector<Bounds> boxes;
  for (int i = 0; i < 200; ++i) {
    const Vector3 lower = test::random_point(random, 3);
    boxes.push_back({lower, lower + Vector3::Ones()});
  }
  broad_phase.find_pairs(boxes, pairs);
  EXPECT_GT(broad_phase.pairs_tested(), 0u);
  // Move each box by less than a twentieth of its side: nothing is swept, but pairs change.
  const std::size_t before = pairs.size();
  for (Bounds& box : boxes) {
    const Vector3 move = test::random_point(random, 0.049);
    box.min() += move;
    box.max() += move;
  }
  broad_phase.find_pairs(boxes, pairs);
  EXPECT_EQ(broad_phase.pairs_tested(), 0u);
  EXPECT_EQ(pairs, brute_pairs(boxes));
  EXPECT_NE(pairs.size(), before);
  boxes[7].min().z() -= 0.11;
  broad_phase.find_pairs(boxes, pairs);
  EXPECT_GT(broad_phase.pairs_tested(), 0u);
  EXPECT_EQ(pairs, brute_pairs(boxes));
}

/// Returns `count` unit cubes with gaps above an infinite floor, in `wide` × `wide` columns.
std::vector<Bounds> pile(std::mt19937& random, int count, int wide) {
  std::vector<Bounds> boxes = {{Vector3(-infinity, -infinity, -infinity), Vector3(infinity, 0, infinity)}};
  for (int i = 0; i < count; ++i) {
    const Vector3 at(i % wide, i / (wide * wide), i / wide % wide);
    const Vector3 lower = 1.01 * at + test::random_point(random, 0.01);
    boxes.push_back({lower, lower + Vector3::Ones()});
  }
  return boxes;
}

TEST(BroadPhase, TestsBoundedPairsPerBody) {
  // Count the tested pairs: with a hundred times the bodies there are no more per body, in a scattered field,
  // a pile as high as wide and a tall tower.
  std::mt19937 random(4);
  Pairs pairs;
  BroadPhase broad_phase;
  const auto work = [&](const std::vector<Bounds>& boxes) {
    broad_phase.find_pairs(boxes, pairs);
    return static_cast<double>(broad_phase.pairs_tested()) / static_cast<double>(boxes.size());
  };
  const auto scattered = [&](int count) {
    std::vector<Bounds> boxes;
    const double side = std::cbrt(20.0 * count);
    for (int i = 0; i < count; ++i) {
      const Vector3 lower = test::random_point(random, side / 2);
      boxes.push_back({lower, lower + Vector3::Ones()});
    }
    return boxes;
  };
  EXPECT_LT(work(scattered(100)), 5);
  EXPECT_LT(work(scattered(1000)), 5);
  EXPECT_LT(work(scattered(10000)), 5);
  EXPECT_LT(work(pile(random, 100, 5)), 40);
  EXPECT_LT(work(pile(random, 1000, 10)), 40);
  EXPECT_LT(work(pile(random, 10000, 22)), 40);
  EXPECT_LT(work(pile(random, 10000, 2)), 40);
}

}  // namespace
}  // namespace substep
