#include "render/renderer.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cfenv>
#include <chrono>
#include <limits>
#include <map>
#include <thread>

#include "render/gl.h"
#include "sim/error.h"
#include "test_scenes.h"

namespace substep::render {
namespace {

// Pin the renderer before the tests make the first context.
const bool pinned = [] {
  pin_renderer();
  return true;
}();

constexpr RenderSettings small_picture{.width = 240, .height = 135};

int body_at(const Image& colors, int x, int y) {
  const std::uint8_t* p = colors.pixel(x, y);
  return p[0] + 256 * p[1] + 65536 * p[2] - 1;
}

int luma(const Image& image, std::pair<int, int> at) {
  const std::uint8_t* p = image.pixel(at.first, at.second);
  return (2 * p[0] + 5 * p[1] + p[2]) / 8;
}

/// Counts the pixels for which a condition of (x, y) holds.
template <typename Condition>
int count_pixels(const Image& image, const Condition& condition) {
  int count = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) count += condition(x, y) ? 1 : 0;
  }
  return count;
}

std::map<int, int> pixels_per_body(const Image& colors) {
  std::map<int, int> count;
  count_pixels(colors, [&](int x, int y) { return ++count[body_at(colors, x, y)]; });
  return count;
}

TEST(Renderer, IsPinned) {
  ASSERT_TRUE(pinned);
  EXPECT_NE(renderer_description().find("llvmpipe"), std::string::npos) << renderer_description();
  EXPECT_EQ(is_pinned_renderer(), renderer_description().find("Mesa 22.3.6") != std::string::npos);
  EXPECT_NE(renderer_description().find("128 bits"), std::string::npos) << renderer_description();
}

TEST(Renderer, TilesHaveNoSeams) {
  const Scene scene = three_shapes();
  RenderSettings settings = small_picture;
  Renderer whole(scene, settings);
  settings.tile = 64;
  Renderer tiled(scene, settings);
  EXPECT_EQ(tiled.draw_bodies(start_of(scene)).rgb, whole.draw_bodies(start_of(scene)).rgb);
  // Each tile rounds its own rays: measured at most 1 of 255, in one of 32,400 pixels. A seam would be lines.
  const Image picture = whole.draw(start_of(scene));
  const Image in_tiles = tiled.draw(start_of(scene));
  ASSERT_EQ(in_tiles.rgb.size(), picture.rgb.size());
  int others = 0;
  for (std::size_t i = 0; i < picture.rgb.size(); ++i) {
    EXPECT_NEAR(picture.rgb[i], in_tiles.rgb[i], 2) << i;
    others += picture.rgb[i] != in_tiles.rgb[i] ? 1 : 0;
  }
  EXPECT_LE(others, 100);
}

TEST(Renderer, PictureDependsOnPosesAlone) {
  const Scene scene = three_shapes();
  std::vector<Coordinates> poses = start_of(scene);
  Renderer renderer(scene, small_picture);
  const Image first = renderer.draw(poses);
  poses[1].linear.x() += 0.3;
  EXPECT_NE(renderer.draw(poses).rgb, first.rgb);
  poses[1].linear = scene.bodies[1].pose.position;
  renderer.draw_bodies(poses);
  EXPECT_EQ(renderer.draw(poses).rgb, first.rgb);
  EXPECT_EQ(picture_of(scene, small_picture).rgb, first.rgb);
  // Draw in another rounding mode of the caller.
  ASSERT_EQ(std::fesetround(FE_UPWARD), 0);
  const Image upward = renderer.draw(poses);
  EXPECT_EQ(std::fegetround(), FE_UPWARD);
  std::fesetround(FE_TONEAREST);
  EXPECT_EQ(upward.rgb, first.rgb);
}

TEST(Renderer, PictureDoesNotDependOnOtherFrames) {
  Scene scene = empty_scene(false);
  const int ball = add_body(scene, Sphere{0.25}, {0, 2, 0});
  scene.camera = Camera{{{0, 2, 6}, Quaternion::Identity()}, 0.8};
  std::vector<std::vector<Coordinates>> falls(2, start_of(scene));
  falls[1][ball].linear.y() = -8;
  EXPECT_EQ(hash(Renderer(scene, small_picture, falls).draw(falls[0])),
            hash(picture_of(scene, small_picture)));
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

/// Returns a floating box under a sun straight above, seen from above at a slant.
Scene floating_box() {
  Scene scene = empty_scene();
  add_body(scene, box({1, 0.2, 1}), {0, 1, 0});
  scene.camera = Camera{{{0, 3, 6}, rotation_quaternion({-0.4636, 0, 0})}, 0.8};
  scene.sun = Sun{{0, -1, 0}, {1, 1, 1}, 3};
  return scene;
}

/// Returns the pixel of a point on the ground in floating_box()'s picture.
std::pair<int, int> ground_pixel(double x, double z) {
  const Vector3 seen = rotation_quaternion({0.4636, 0, 0}) * (Vector3(x, 0, z) - Vector3(0, 3, 6));
  const SineCosine half = sine_cosine(0.4);
  const double scale = small_picture.height / 2.0 * half.cosine / half.sine / -seen.z();
  return {static_cast<int>(small_picture.width / 2.0 + scale * seen.x()),
          static_cast<int>(small_picture.height / 2.0 - scale * seen.y())};
}

/// Returns a lamp at a position.
Light lamp_at(const Vector3& position, double intensity) {
  return {.kind = Light::Kind::point, .position = position, .intensity = intensity};
}

RenderSettings without_shadows() {
  RenderSettings settings = small_picture;
  settings.shadows = false;
  return settings;
}

TEST(Shadows, SunShadowStaysWhenABodyIsLost) {
  Scene scene = floating_box();
  const int lost = add_body(scene, Sphere{0.3}, {2.5, 0.3, 0});
  const auto below = ground_pixel(0.1, 0.3);
  std::vector<Coordinates> poses = start_of(scene);
  Renderer renderer(scene, small_picture);
  const Image lit = renderer.draw(poses);
  ASSERT_EQ(body_at(renderer.draw_bodies(poses), below.first, below.second), 0);
  EXPECT_LT(luma(lit, below), luma(lit, ground_pixel(1.6, 0.3)) - 50);
  EXPECT_GT(luma(picture_of(scene, without_shadows()), below), luma(lit, below) + 40);  // measured 79 more
  poses[lost].linear = {3e4, 2e4, -5e4};
  EXPECT_NEAR(luma(renderer.draw(poses), below), luma(lit, below), 3);  // measured −1
}

TEST(Shadows, LampShadowSpreads) {
  Scene scene = floating_box();
  scene.sun.reset();
  scene.lights.push_back(lamp_at({-2, 3, 0}, 30));
  const Image with = picture_of(scene, small_picture);
  const Image without = picture_of(scene, without_shadows());
  const auto darker = [&](double x) {
    return luma(without, ground_pixel(x, 0.6)) - luma(with, ground_pixel(x, 0.6));
  };
  // The box's middle is 2 m below the lamp, the ground 3 m: its shadow goes from x = 0.25 m to 1.75 m.
  EXPECT_GT(darker(1.0), 30);
  EXPECT_GT(darker(1.4), 30);
  EXPECT_NEAR(darker(-0.9), 0, 3);
  EXPECT_NEAR(darker(2.6), 0, 3);
}

TEST(Shadows, AreAlikeInMillimetresAndMetres) {
  const auto shaded_pixels = [](double size) {
    Scene scene = empty_scene();
    add_body(scene, box(Vector3::Constant(size)), {0, 0.5 * size, 0});
    add_body(scene, box(Vector3::Constant(0.6 * size)), {0.2 * size, 1.3 * size, 0.1 * size});
    scene.camera = Camera{{{0, 3 * size, 6 * size}, rotation_quaternion({-0.4636, 0, 0})}, 0.8};
    scene.sun = Sun{{-0.4, -1, 0.5}, {1, 1, 1}, 3};
    const Image with = picture_of(scene, small_picture);
    const Image without = picture_of(scene, without_shadows());
    return count_pixels(with, [&](int x, int y) { return luma(with, {x, y}) < luma(without, {x, y}) - 20; });
  };
  const int in_metres = shaded_pixels(1);
  EXPECT_GT(in_metres, 300);
  EXPECT_NEAR(shaded_pixels(0.001), in_metres, in_metres / 8);  // measured 395 and 422
}

TEST(Shadows, SpareLitSurfacesOfConvexBodies) {
  // Where the light falls on a convex body, only the body itself could cast a shadow: with and without are
  // equal.
  for (const bool has_lamp : {false, true}) {
    Scene scene = empty_scene();
    add_body(scene, Sphere{1}, {0, 3, 0});
    add_body(scene, box({2, 2, 2}), {4, 3, 0}, rotation_quaternion({0.3, 0.5, 0.2}));
    if (has_lamp) {
      scene.lights.push_back(lamp_at({2, 6, 5}, 60));
    } else {
      scene.sun = Sun{{-0.3, -0.8, -0.6}, {1, 1, 1}, 3};
    }
    RenderSettings settings = small_picture;
    settings.antialiasing = false;
    Renderer shaded(scene, settings);
    const Image with = shaded.draw(start_of(scene));
    const Image colors = shaded.draw_bodies(start_of(scene));
    settings.shadows = false;
    const Image without = picture_of(scene, settings);
    const auto is_body = [&](int x, int y) { return body_at(colors, x, y) > 0; };
    const int bodies = count_pixels(with, is_body);
    const int darker = count_pixels(with, [&](int x, int y) {
      return is_body(x, y) && luma(with, {x, y}) < luma(without, {x, y}) - 3;
    });
    EXPECT_GT(bodies, 2000);
    EXPECT_LT(darker, bodies / 100) << has_lamp;  // measured 0 of 12,421
  }
}

TEST(Renderer, LeavesOutBodiesAtBadPoses) {
  const Scene scene = three_shapes();
  Renderer renderer(scene, small_picture);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), 1e300}) {
    std::vector<Coordinates> poses = start_of(scene);
    poses[1].linear.y() = bad;
    poses[2].angular.x() = infinity;
    const std::map<int, int> count = pixels_per_body(renderer.draw_bodies(poses));
    EXPECT_EQ(count.count(1), 0u);
    EXPECT_EQ(count.count(2), 0u);
    EXPECT_EQ(count.count(3), 1u);
    EXPECT_EQ(renderer.draw(poses).rgb, renderer.draw(poses).rgb);
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
  Renderer renderer(scene, small_picture);
  const Image colors = renderer.draw_bodies(start_of(scene));
  const Image image = renderer.draw(start_of(scene));
  const int triangle = pixels_per_body(colors).at(1);
  EXPECT_GT(triangle, 40);  // measured 112
  EXPECT_LT(triangle, 400);
  const int green = count_pixels(image, [&](int x, int y) {
    const std::uint8_t* p = image.pixel(x, y);
    return body_at(colors, x, y) == 1 && p[1] > p[0] + 40 && p[1] > p[2] + 40;
  });
  EXPECT_GT(green, triangle * 8 / 10);
}

TEST(Renderer, RefusesImpossibleSizes) {
  const Scene scene = three_shapes();
  EXPECT_THROW(Renderer(scene, {.width = 0}), Error);
  EXPECT_THROW(Renderer(scene, {.width = 100000, .antialiasing = false}), Error);
  // The picture alone would take 3 GiB.
  EXPECT_THROW(check({.width = 32768, .height = 32768}), Error);
  EXPECT_NO_THROW(check({.width = 16384, .height = 16384}));
}

}  // namespace
}  // namespace substep::render
