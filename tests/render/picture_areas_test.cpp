#include "render/picture_areas.h"

#include <gtest/gtest.h>

#include "render/camera.h"
#include "render/renderer.h"
#include "test_scenes.h"

namespace substep {
namespace {

const bool pinned = [] {
  pin_renderer();
  return true;
}();

TEST(PictureAreas, HoldAllThatIsSeenOfBodiesAndLeaveTheRest) {
  ASSERT_TRUE(pinned);
  const Scene scene = three_shapes();
  std::vector<Coordinates> poses = initial_state(scene).q;
  RenderSettings settings;
  settings.width = 250;  // no whole number of tiles
  settings.height = 135;
  Renderer renderer(scene, settings);
  const BodyMesh mesh = gather_body_mesh(scene);
  const glm::dmat4 clip = clip_from_world(renderer.view(), 0.01, 1000);
  const auto outside_and_area = [&] {
    std::vector<int> covered(std::size_t{250} * 135, 0);
    for (const Rectangle& area : areas_of(mesh.parts, poses, clip, 250, 135)) {
      for (int y = area.y; y < std::min(area.y + area.height, 135); ++y) {
        for (int x = area.x; x < std::min(area.x + area.width, 250); ++x) {
          ++covered[static_cast<std::size_t>(134 - y) * 250 + static_cast<std::size_t>(x)];
        }
      }
    }
    const Image bodies = renderer.draw_bodies(poses);
    int outside = 0;
    int area = 0;
    for (std::size_t i = 0; i < covered.size(); ++i) {
      EXPECT_LE(covered[i], 1);
      area += covered[i];
      const int body = bodies.rgb[3 * i] + 256 * bodies.rgb[3 * i + 1] - 1;
      outside += body > 0 && covered[i] == 0 ? 1 : 0;
    }
    return std::pair(outside, area);
  };
  auto [outside, area] = outside_and_area();
  EXPECT_EQ(outside, 0);
  EXPECT_LT(area, 250 * 135 / 3);
  // Half out of the picture, and behind the eye.
  poses[1].linear += Vector3(renderer.view().right.x, renderer.view().right.y, renderer.view().right.z) * 2;
  EXPECT_EQ(outside_and_area().first, 0);
  poses[1].linear = Vector3(renderer.view().eye.x, renderer.view().eye.y, renderer.view().eye.z);
  EXPECT_EQ(outside_and_area().second, 250 * 135);
}

}  // namespace
}  // namespace substep
