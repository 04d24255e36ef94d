#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sim/geometry/contact.h"
#include "tests/geometry/solids.h"

namespace substep {
namespace {

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

constexpr double infinity = std::numeric_limits<double>::infinity();

Pairs brute_pairs(const std::vector<Bounds>& boxes) {
  Pairs pairs;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    for (std::uint32_t j = i + 1; j < boxes.size(); ++j) {
      if ((boxes[i].lower.array() <= boxes[j].upper.array()).all() &&
          (boxes[j].lower.array() <= boxes[i].upper.array()).all()) {
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
    // Sizes over several powers of ten, so that some are wider than the lanes.
    const double size = largest * std::pow(10, -3 * uniform(random));
    boxes.push_back({lower, lower + size * (Vector3::Ones() + test::random_point(random, 0.5))});
  }
  return boxes;
}

TEST(BroadPhase, FindsThePairsThatBruteForceFinds) {
  std::mt19937 random(1);
  BroadPhase broad_phase;
  Pairs pairs;
  for (const Vector3& spread : {Vector3(1, 1, 1), Vector3(10, 1, 0), Vector3(0, 0, 5), Vector3(0, 0, 0)}) {
    for (const int count : {0, 1, 2, 50, 400}) {
      std::vector<Bounds> boxes = random_boxes(random, count, spread, 1);
      broad_phase.find_pairs(boxes, pairs);
      EXPECT_EQ(pairs, brute_pairs(boxes));
      // With planes, whose bounds have no end.
      boxes.insert(boxes.begin(), {Vector3::Constant(-infinity), Vector3(infinity, 0, infinity)});
      boxes.push_back({Vector3(0.5, -infinity, -infinity), Vector3::Constant(infinity)});
      boxes.push_back({Vector3::Constant(-infinity), Vector3::Constant(infinity)});
      broad_phase.find_pairs(boxes, pairs);
      EXPECT_EQ(pairs, brute_pairs(boxes));
    }
  }
}

TEST(BroadPhase, DoesNotDependOnEarlierCalls) {
  std::mt19937 random(2);
  BroadPhase used;
  Pairs pairs;
  std::vector<Bounds> boxes = random_boxes(random, 300, {3, 3, 3}, 1);
  for (int step = 0; step < 30; ++step) {
    used.find_pairs(boxes, pairs);
    Pairs fresh;
    BroadPhase().find_pairs(boxes, fresh);
    ASSERT_EQ(pairs, fresh) << step;
    ASSERT_EQ(pairs, brute_pairs(boxes)) << step;
    for (Bounds& box : boxes) {
      // Slowly, then all over the place.
      const Vector3 move = test::random_point(random, step < 20 ? 0.01 : 3);
      box.lower += move;
      box.upper += move;
    }
  }
}

TEST(BroadPhase, TouchingBoxesOnAGridAreFound) {
  // All corners at equal coordinates: ties in every order, boxes that end where lanes do.
  std::vector<Bounds> boxes;
  for (int i = 0; i < 343; ++i) {
    const Vector3 lower = test::grid_point(i, 7);
    boxes.push_back({lower, lower + Vector3::Ones()});
  }
  Pairs pairs;
  BroadPhase().find_pairs(boxes, pairs);
  EXPECT_EQ(pairs, brute_pairs(boxes));
}

TEST(BroadPhase, LeavesOutWhatIsNotANumber) {
  std::mt19937 random(3);
  std::vector<Bounds> boxes = random_boxes(random, 100, {1, 1, 1}, 1);
  boxes[20].lower.x() = std::nan("");
  boxes[50].upper = Vector3::Constant(std::nan(""));
  Pairs pairs;
  BroadPhase().find_pairs(boxes, pairs);
  for (const auto& [i, j] : pairs) {
    EXPECT_TRUE(i != 20 && j != 20 && i != 50 && j != 50);
  }
  EXPECT_FALSE(pairs.empty());
}

}  // namespace
}  // namespace substep
