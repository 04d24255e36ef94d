#include "render/ground.h"

#include <gtest/gtest.h>

#include "render/body_mesh.h"
#include "sim/geometry/convex_hull.h"
#include "test_scenes.h"

namespace substep {
namespace {

double height_of(const Scene& scene, std::vector<std::vector<Coordinates>> frames = {}) {
  if (frames.empty()) frames.push_back(initial_state(scene).q);
  return ground_height(scene, gather_body_mesh(scene).parts, frames);
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

TEST(Ground, LiesBelowAllThatHangs) {
  Scene scene = empty_scene(false);
  const int ball = add_body(scene, Sphere{0.25}, {0, 2, 0});
  EXPECT_LT(height_of(scene), 1.75);
  std::vector<std::vector<Coordinates>> frames(2, initial_state(scene).q);
  frames[1][static_cast<std::size_t>(ball)].linear.y() = 1.5;
  EXPECT_LT(height_of(scene, frames), 1.25);
  EXPECT_GT(height_of(scene, frames), 0.25);
}

TEST(Ground, DoesNotFollowWhatFallsOutOfTheScene) {
  Scene scene = empty_scene(false);
  const int ball = add_body(scene, Sphere{0.25}, {0, 2, 0});
  std::vector<std::vector<Coordinates>> frames(2, initial_state(scene).q);
  frames[1][static_cast<std::size_t>(ball)].linear.y() = -200;
  EXPECT_GT(height_of(scene, frames), 0);
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
