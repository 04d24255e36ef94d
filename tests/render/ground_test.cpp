#include "render/ground.h"

#include <gtest/gtest.h>

#include "render/body_mesh.h"
#include "sim/geometry/convex_hull.h"
#include "test_scenes.h"

namespace substep {
namespace {

double height_of(const Scene& scene) {
  return ground_height(scene, gather_body_mesh(scene).parts);
}

TEST(Ground, IsTheWorldsHorizontalPlane) {
  Scene scene = three_shapes();
  scene.colliders[0].placement.position.y() = -0.75;
  EXPECT_EQ(height_of(scene), -0.75);
}

TEST(Ground, CarriesTheLowestThingOfTheWorld) {
  Scene scene = empty_scene(false);
  add_body(scene, Sphere{0.5}, {0, 2, 0});
  Collider& block = scene.colliders.emplace_back();
  block.shape = box({2, 1, 2});
  EXPECT_EQ(height_of(scene), -0.5);
}

TEST(Ground, LiesBelowWhatFallsAsItStandsAtTheStart) {
  Scene scene = empty_scene(false);
  add_body(scene, Sphere{0.25}, {0, 2, 0});
  EXPECT_LT(height_of(scene), 1.75);
  EXPECT_GT(height_of(scene), 1.5);
}

/// A ball joint between `body` at `anchor` and the world, or another body at `other_anchor`.
void join(Scene& scene, int body, const Vector3& anchor, const Vector3& other_anchor,
          int other = world_body) {
  Joint& joint = scene.joints.emplace_back();
  joint.body_a = body;
  joint.body_b = other;
  joint.frame_a.position = anchor;
  joint.frame_b.position = other_anchor;
  JointLimit& limit = joint.limits.emplace_back();
  limit.axes = {true, true, true};
  limit.min = limit.max = 0;
}

TEST(Ground, LiesBelowAllThatCanSwing) {
  // Two balls of radius 0.1 stand above the point that they hang on, 1 m from each other and from it.
  Scene scene = empty_scene(false);
  const int first = add_body(scene, Sphere{0.1}, {0, 3, 0});
  const int second = add_body(scene, Sphere{0.1}, {0, 4, 0});
  join(scene, first, {0, -1, 0}, {0, 2, 0});
  join(scene, second, {0, -1, 0}, {0, 0, 0}, first);
  // The second can hang 2 m below, and its box's corners a little more.
  EXPECT_LT(height_of(scene), -0.1);
  EXPECT_GT(height_of(scene), -2);
}

TEST(Ground, KnowsThatATightRopeDoesNotSag) {
  Scene scene = empty_scene(false);
  const int left = add_body(scene, Sphere{0.1}, {-1, 2, 0});
  const int right = add_body(scene, Sphere{0.1}, {1, 2, 0});
  join(scene, left, {-1, 0, 0}, {-2, 2, 0});
  join(scene, left, {1, 0, 0}, {-1, 0, 0}, right);
  join(scene, right, {1, 0, 0}, {2, 2, 0});
  EXPECT_GT(height_of(scene), 1);
}

TEST(Ground, IsDarkestUnderABody) {
  Scene scene = empty_scene();
  add_body(scene, Sphere{0.5}, {0, 2, 0});
  const BodyMesh mesh = gather_body_mesh(scene);
  const GroundOcclusion map = ground_occlusion(mesh.parts, initial_state(scene).q, 0, -4, -4, 8);
  const auto at = [&map](double x, double z) {
    const auto cell = [&](double u) { return static_cast<std::size_t>((u + 4) / 8 * GroundOcclusion::size); };
    return map.openness[cell(z) * GroundOcclusion::size + cell(x)];
  };
  // Straight below, the ball (drawn a tenth wider) hides (r/h)² of the sky: 1 − 0.275².
  EXPECT_NEAR(at(0, 0), 1 - 0.275 * 0.275, 2e-3);  // measured 6e-5 off
  EXPECT_EQ(at(0.5, 0), at(-0.51, 0));
  EXPECT_EQ(at(0.5, 0), at(0, 0.5));
  EXPECT_GT(at(1, 0), at(0.5, 0));
  EXPECT_EQ(at(3.5, 0), 1);
}

}  // namespace
}  // namespace substep
