#include "render/ground.h"

#include <gtest/gtest.h>

#include "render/body_mesh.h"
#include "test_scenes.h"

namespace substep::render {
namespace {

double height_of(const Scene& scene) {
  return ground_height(scene, gather_body_mesh(scene).parts);
}

TEST(Ground, IsTheWorldsHorizontalPlane) {
  Scene scene = three_shapes();
  scene.colliders[0].placement.position.y() = -0.75;
  EXPECT_EQ(height_of(scene), -0.75);
}

TEST(Ground, CarriesTheLowestPartOfTheWorld) {
  Scene scene = empty_scene(false);
  add_body(scene, Sphere{0.5}, {0, 2, 0});
  Collider& block = scene.colliders.emplace_back();
  block.shape = box({2, 1, 2});
  EXPECT_EQ(height_of(scene), -0.5);
}

TEST(Ground, LiesBelowFallingBodiesAtTheStart) {
  Scene scene = empty_scene(false);
  add_body(scene, Sphere{0.25}, {0, 2, 0});
  EXPECT_LT(height_of(scene), 1.75);
  EXPECT_GT(height_of(scene), 1.5);
}

/// Adds a ball joint of two limits between `body` at `anchor` and the world or `other` at `other_anchor`.
void join(Scene& scene, int body, const Vector3& anchor, const Vector3& other_anchor,
          int other = world_body) {
  Joint& joint = scene.joints.emplace_back();
  joint.body_a = body;
  joint.body_b = other;
  joint.frame_a.position = anchor;
  joint.frame_b.position = other_anchor;
  for (const bool upright : {false, true}) {
    JointLimit& limit = joint.limits.emplace_back();
    limit.axes = {!upright, upright, !upright};
    limit.min = limit.max = 0;
  }
}

TEST(Ground, LiesBelowAllThatCanSwing) {
  // Two balls of radius 0.1 stand above their pivot, 1 m from each other and from the pivot.
  Scene scene = empty_scene(false);
  const int first = add_body(scene, Sphere{0.1}, {0, 3, 0});
  const int second = add_body(scene, Sphere{0.1}, {0, 4, 0});
  join(scene, first, {0, -1, 0}, {0, 2, 0});
  join(scene, second, {0, -1, 0}, {0, 0, 0}, first);
  // The second can hang 2 m below, and its box's corners a little more.
  EXPECT_LT(height_of(scene), -0.1);
  EXPECT_GT(height_of(scene), -2);
}

TEST(Ground, LiesCloseBelowATightRope) {
  Scene scene = empty_scene(false);
  const int left = add_body(scene, Sphere{0.1}, {-1, 2, 0});
  const int right = add_body(scene, Sphere{0.1}, {1, 2, 0});
  join(scene, left, {-1, 0, 0}, {-2, 2, 0});
  join(scene, left, {1, 0, 0}, {-1, 0, 0}, right);
  join(scene, right, {1, 0, 0}, {2, 2, 0});
  EXPECT_GT(height_of(scene), 1);
}

/// Returns the fraction of the sky that is seen from the middle of a square of 4 m below a disc of `radius`,
/// between two heights.
double open_below(double radius, float lowest, float highest) {
  Relief relief;
  relief.width = 4;
  for (int z = 0; z < Relief::size; ++z) {
    for (int x = 0; x < Relief::size; ++x) {
      const double cell = relief.width / Relief::size;
      const double distance = std::hypot((x - Relief::size / 2) * cell, (z - Relief::size / 2) * cell);
      if (distance > radius) continue;
      const auto index = static_cast<std::size_t>(z * Relief::size + x);
      relief.lowest[index] = lowest;
      relief.highest[index] = highest;
    }
  }
  const std::vector<float> openness = ground_openness(relief);
  const double open = openness[Relief::size / 2 * Relief::size + Relief::size / 2];
  return (open - ambient_floor) / (1 - ambient_floor);
}

TEST(Ground, DiscAboveHidesItsFractionOfTheSky) {
  // Below its middle a disc hides r² / (r² + h²).
  for (const double height : {0.3, 0.6, 1.2}) {
    const double share = 0.6 * 0.6 / (0.6 * 0.6 + height * height);
    EXPECT_NEAR(1 - open_below(0.6, static_cast<float>(height), static_cast<float>(height) + 0.02F), share,
                0.12)  // the rim is found between places half as far again
        << height;
  }
}

TEST(Ground, GetsOpenSkyOrAmbientFloor) {
  EXPECT_EQ(open_below(-1, 0, 1), 1);
  EXPECT_NEAR(open_below(1, 0, 1), 0, 0.02);
  Relief relief;
  EXPECT_EQ(ground_openness(relief)[0], 1);
}

}  // namespace
}  // namespace substep::render
