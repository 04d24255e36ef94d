#include "render/renderer.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cfenv>
#include <chrono>
#include <map>
#include <thread>

#include "render/context.h"
#include "sim/error.h"
#include "sim/geometry/convex_hull.h"
#include "sim/math/rotation.h"
#include "test_scenes.h"

namespace substep::render {
namespace {

// Pin the renderer before the tests make the first context.
const bool pinned = [] {
  pin_renderer();
  return true;
}();

RenderSettings small_picture() {
  RenderSettings settings;
  settings.width = 240;
  settings.height = 135;
  return settings;
}

int body_at(const Image& colors, int x, int y) {
  const std::uint8_t* p = colors.pixel(x, y);
  return p[0] + 256 * p[1] + 65536 * p[2] - 1;
}

int luma(const Image& image, int x, int y) {
  const std::uint8_t* p = image.pixel(x, y);
  return (2 * p[0] + 5 * p[1] + p[2]) / 8;
}

std::map<int, int> pixels_per_body(const Image& colors) {
  std::map<int, int> count;
  for (int y = 0; y < colors.height; ++y) {
    for (int x = 0; x < colors.width; ++x) ++count[body_at(colors, x, y)];
  }
  return count;
}

TEST(Renderer, IsPinned) {
  ASSERT_TRUE(pinned);
  EXPECT_NE(renderer_description().find("llvmpipe"), std::string::npos) << renderer_description();
  EXPECT_EQ(is_pinned_renderer(), renderer_description().find("Mesa 22.3.6") != std::string::npos);
  EXPECT_NE(renderer_description().find("128 bits"), std::string::npos) << renderer_description();
}

TEST(Renderer, APictureInTilesHasNoSeams) {
  const Scene scene = three_shapes();
  const std::vector<Coordinates> poses = initial_state(scene).q;
  RenderSettings settings = small_picture();
  const Image whole = Renderer(scene, settings).draw(poses);
  const Image bodies = Renderer(scene, settings).draw_bodies(poses);
  settings.tile = 64;
  Renderer renderer(scene, settings);
  // Each tile rounds its own rays: measured at most 1 of 255, in one of 32,400 pixels. A seam would be lines.
  const Image in_tiles = renderer.draw(poses);
  ASSERT_EQ(in_tiles.rgb.size(), whole.rgb.size());
  int others = 0;
  for (std::size_t i = 0; i < whole.rgb.size(); ++i) {
    const int difference = std::abs(whole.rgb[i] - in_tiles.rgb[i]);
    EXPECT_LE(difference, 2) << i;
    others += difference > 0 ? 1 : 0;
  }
  EXPECT_LE(others, 100);
  EXPECT_EQ(renderer.draw_bodies(poses).rgb, bodies.rgb);
}

TEST(Renderer, DrawsTheSameEachTimeWhateverCameBefore) {
  const Scene scene = three_shapes();
  std::vector<Coordinates> poses = initial_state(scene).q;
  Renderer renderer(scene, small_picture());
  const Image first = renderer.draw(poses);
  poses[1].linear.x() += 0.3;
  const Image moved = renderer.draw(poses);
  poses[1].linear = scene.bodies[1].pose.position;
  renderer.draw_bodies(poses);
  EXPECT_EQ(renderer.draw(poses).rgb, first.rgb);
  EXPECT_NE(moved.rgb, first.rgb);
  Renderer other(scene, small_picture());
  EXPECT_EQ(other.draw(poses).rgb, first.rgb);
}

TEST(Renderer, RoundingModeOfTheCallerDoesNotMatter) {
  const Scene scene = three_shapes();
  const std::vector<Coordinates> poses = initial_state(scene).q;
  Renderer renderer(scene, small_picture());
  const Image nearest = renderer.draw(poses);
  ASSERT_EQ(std::fesetround(FE_UPWARD), 0);
  Image upward = renderer.draw(poses);
  EXPECT_EQ(std::fegetround(), FE_UPWARD);
  std::fesetround(FE_TONEAREST);
  EXPECT_EQ(upward.rgb, nearest.rgb);
}

TEST(Context, WaitsForAnotherThreadToRelease) {
  Context context;
  std::atomic<bool> is_released = false;
  bool has_waited = false;
  std::jthread other;
  {
    const Context::Current mine(context);
    other = std::jthread([&] {
      const Context::Current theirs(context);
      has_waited = is_released;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    is_released = true;
  }
  other.join();
  EXPECT_TRUE(has_waited);
}

TEST(Renderer, ColorsTellTheBodies) {
  const Scene scene = three_shapes();
  Renderer renderer(scene, small_picture());
  const std::map<int, int> count = pixels_per_body(renderer.draw_bodies(initial_state(scene).q));
  ASSERT_EQ(count.size(), 5u);    // sky, ground and three bodies
  EXPECT_GT(count.at(-1), 1000);  // the sky; measured 8,624
  EXPECT_GT(count.at(0), 10000);  // the ground; 20,799
  EXPECT_GT(count.at(1), 1000);   // the box; 1,712
  EXPECT_GT(count.at(2), 400);    // the ball; 745
  EXPECT_GT(count.at(3), 300);    // the capsule; 520
}

TEST(Renderer, AMovedBodyIsWhereItsColorSays) {
  const Scene scene = three_shapes();
  std::vector<Coordinates> poses = initial_state(scene).q;
  RenderSettings settings = small_picture();
  settings.antialiasing = false;
  settings.shadows = false;
  Renderer renderer(scene, settings);
  const Image before = renderer.draw(poses);
  const Image colors_before = renderer.draw_bodies(poses);
  poses[3].linear.y() += 0.4;
  const Image after = renderer.draw(poses);
  const Image colors_after = renderer.draw_bodies(poses);
  int on_body = 0;
  int elsewhere = 0;
  for (int y = 0; y < before.height; ++y) {
    for (int x = 0; x < before.width; ++x) {
      const std::uint8_t* a = before.pixel(x, y);
      const std::uint8_t* b = after.pixel(x, y);
      // The ground under the capsule is a little less or more open to the sky, by a few codes.
      const int difference = std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
      if (difference <= 12) continue;
      const bool is_body = body_at(colors_before, x, y) == 3 || body_at(colors_after, x, y) == 3;
      ++(is_body ? on_body : elsewhere);
    }
  }
  EXPECT_GT(on_body, 400);  // measured 967
  EXPECT_EQ(elsewhere, 0);
}

/// A floating box under a sun straight above, seen from above at a slant.
Scene floating_box() {
  Scene scene = empty_scene();
  add_body(scene, box({1, 0.2, 1}), {0, 1, 0});
  Camera& camera = scene.camera.emplace();
  camera.pose.position = {0, 3, 6};
  camera.pose.orientation = rotation_quaternion({-0.4636, 0, 0});
  scene.sun = Sun{{0, -1, 0}, {1, 1, 1}, 3};
  return scene;
}

/// Pixel of a point on the ground before that scene's camera.
std::pair<int, int> ground_pixel(double x, double z, const RenderSettings& settings) {
  const Vector3 eye(0, 3, 6);
  const Vector3 seen = rotation_quaternion({0.4636, 0, 0}) * (Vector3(x, 0, z) - eye);
  const SineCosine half = sine_cosine(0.4);
  const double scale = settings.height / 2.0 * half.cosine / half.sine / -seen.z();
  return {static_cast<int>(settings.width / 2.0 + scale * seen.x()),
          static_cast<int>(settings.height / 2.0 - scale * seen.y())};
}

TEST(Renderer, AFloatingBoxShadesTheGroundBelow) {
  const Scene scene = floating_box();
  RenderSettings settings = small_picture();
  const auto below = ground_pixel(0.1, 0.3, settings);
  const auto beside = ground_pixel(1.6, 0.3, settings);
  Renderer renderer(scene, settings);
  const Image lit = renderer.draw(initial_state(scene).q);
  ASSERT_EQ(body_at(renderer.draw_bodies(initial_state(scene).q), below.first, below.second), 0);
  EXPECT_LT(luma(lit, below.first, below.second), luma(lit, beside.first, beside.second) - 50);

  settings.shadows = false;
  Renderer without(scene, settings);
  const Image bright = without.draw(initial_state(scene).q);
  EXPECT_GT(luma(bright, below.first, below.second),
            luma(lit, below.first, below.second) + 40);  // measured 79 more
}

TEST(Renderer, SpreadsShadowsFromALamp) {
  Scene scene = floating_box();
  scene.sun.reset();
  Light& lamp = scene.lights.emplace_back();
  lamp.position = {-2, 3, 0};
  lamp.intensity = 30;
  RenderSettings settings = small_picture();
  const Image with = Renderer(scene, settings).draw(initial_state(scene).q);
  settings.shadows = false;
  const Image without = Renderer(scene, settings).draw(initial_state(scene).q);
  const auto darker = [&](double x, double z) {
    const auto [u, v] = ground_pixel(x, z, settings);
    return luma(without, u, v) - luma(with, u, v);
  };
  // The box's middle is 2 m below the lamp, the ground 3 m: its shadow begins 0.5 m and ends 2.5 m from the
  // lamp's side.
  EXPECT_GT(darker(1.0, 0.6), 30);
  EXPECT_GT(darker(1.4, 0.6), 30);
  EXPECT_NEAR(darker(-0.9, 0.6), 0, 3);
  EXPECT_NEAR(darker(2.6, 0.6), 0, 3);
}

TEST(Renderer, ALostBodyLeavesTheOthersTheirShadows) {
  Scene scene = floating_box();
  const int lost = add_body(scene, Sphere{0.3}, {2.5, 0.3, 0});
  const RenderSettings settings = small_picture();
  const auto below = ground_pixel(0.1, 0.3, settings);
  Renderer renderer(scene, settings);
  std::vector<Coordinates> poses = initial_state(scene).q;
  const int shaded = luma(renderer.draw(poses), below.first, below.second);
  poses[static_cast<std::size_t>(lost)].linear = {3e4, 2e4, -5e4};
  EXPECT_NEAR(luma(renderer.draw(poses), below.first, below.second), shaded, 3);  // measured −1
}

TEST(Renderer, LitSurfacesDoNotShadeThemselves) {
  // Where the light falls on a convex body, only the body itself could cast a shadow: with and without are
  // equal.
  for (const bool has_lamp : {false, true}) {
    Scene scene = empty_scene();
    add_body(scene, Sphere{1}, {0, 3, 0});
    add_body(scene, box({2, 2, 2}), {4, 3, 0}, rotation_quaternion({0.3, 0.5, 0.2}));
    if (has_lamp) {
      Light& lamp = scene.lights.emplace_back();
      lamp.position = {2, 6, 5};
      lamp.intensity = 60;
    } else {
      scene.sun = Sun{{-0.3, -0.8, -0.6}, {1, 1, 1}, 3};
    }
    RenderSettings settings = small_picture();
    settings.antialiasing = false;
    const std::vector<Coordinates> poses = initial_state(scene).q;
    Renderer shaded(scene, settings);
    const Image with = shaded.draw(poses);
    const Image colors = shaded.draw_bodies(poses);
    settings.shadows = false;
    const Image without = Renderer(scene, settings).draw(poses);
    int bodies = 0;
    int darker = 0;
    for (int y = 0; y < with.height; ++y) {
      for (int x = 0; x < with.width; ++x) {
        if (body_at(colors, x, y) <= 0) continue;
        ++bodies;
        darker += luma(with, x, y) < luma(without, x, y) - 3 ? 1 : 0;
      }
    }
    EXPECT_GT(bodies, 2000);
    EXPECT_LT(darker, bodies / 100) << has_lamp;  // measured 0 of 12,421
  }
}

TEST(Renderer, PosesThatCannotBeDrawnAreLeftOut) {
  const Scene scene = three_shapes();
  Renderer renderer(scene, small_picture());
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), 1e300}) {
    std::vector<Coordinates> poses = initial_state(scene).q;
    poses[1].linear.y() = bad;
    poses[2].angular.x() = std::numeric_limits<double>::infinity();
    const std::map<int, int> count = pixels_per_body(renderer.draw_bodies(poses));
    EXPECT_EQ(count.count(1), 0u);
    EXPECT_EQ(count.count(2), 0u);
    EXPECT_EQ(count.count(3), 1u);
    const Image image = renderer.draw(poses);
    EXPECT_EQ(image.rgb, renderer.draw(poses).rgb);
  }
}

TEST(Renderer, VisualsReplaceColliders) {
  Scene scene = three_shapes();
  Surface& paint = scene.surfaces.emplace_back();
  paint.base_color = {0.02, 0.6, 0.05};
  paint.roughness = 0.8;
  Mesh& mesh = scene.meshes.emplace_back();
  mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
  mesh.normals = {3, Vector3::UnitZ()};
  mesh.triangles = {{0, 1, 2}};
  Visual& visual = scene.visuals.emplace_back();
  visual.body = 1;
  visual.linear = Vector3(-0.2, 0.2, 0.2).asDiagonal();  // mirrored: the winding turns
  visual.translation = {0, 0.2, 0};
  Renderer renderer(scene, small_picture());
  const std::vector<Coordinates> poses = initial_state(scene).q;
  const Image colors = renderer.draw_bodies(poses);
  const int triangle = pixels_per_body(colors).at(1);
  EXPECT_GT(triangle, 40);  // measured 112
  EXPECT_LT(triangle, 400);
  const Image image = renderer.draw(poses);
  int green = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const std::uint8_t* p = image.pixel(x, y);
      green += body_at(colors, x, y) == 1 && p[1] > p[0] + 40 && p[1] > p[2] + 40 ? 1 : 0;
    }
  }
  EXPECT_GT(green, triangle * 8 / 10);
}

TEST(Renderer, AFrameDoesNotDependOnTheRunItIsOf) {
  Scene scene = empty_scene(false);
  const int ball = add_body(scene, Sphere{0.25}, {0, 2, 0});
  scene.camera = Camera{{{0, 2, 6}, Quaternion::Identity()}, 0.8};
  std::vector<std::vector<Coordinates>> falls(2, initial_state(scene).q);
  falls[1][static_cast<std::size_t>(ball)].linear.y() = -8;
  EXPECT_EQ(hash(Renderer(scene, small_picture(), falls).draw(falls[0])),
            hash(Renderer(scene, small_picture()).draw(falls[0])));
}

TEST(Renderer, SizesThatCannotBeAreRefused) {
  const Scene scene = three_shapes();
  RenderSettings settings;
  settings.width = 0;
  EXPECT_THROW(Renderer(scene, settings), Error);
  settings.width = 100000;
  settings.antialiasing = false;
  EXPECT_THROW(Renderer(scene, settings), Error);
  // The picture alone: 3 GiB.
  settings.width = settings.height = 32768;
  settings.antialiasing = true;
  EXPECT_THROW(check(settings), Error);
  settings.width = settings.height = 16384;
  EXPECT_NO_THROW(check(settings));
}

TEST(Renderer, AnEmptySceneIsGroundAndSky) {
  const Scene scene = empty_scene();
  Renderer renderer(scene, small_picture());
  const std::map<int, int> count = pixels_per_body(renderer.draw_bodies(initial_state(scene).q));
  ASSERT_EQ(count.size(), 2u);
  EXPECT_GT(count.at(0), 1000);
  EXPECT_GT(renderer.draw(initial_state(scene).q).rgb[0], 0);
}

}  // namespace
}  // namespace substep::render
