// Materials of a file, against closed forms: a square seen head-on fills the picture.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "render/image.h"
#include "test_scenes.h"
#include "tests/error_message.h"

namespace substep::render {
namespace {

using Color = std::array<int, 3>;

/// Returns a scene with a camera alone, 1 m above the plane z = 0, of which it sees a square of 2 m.
Scene facing_scene() {
  Scene scene = empty_scene(false);
  Camera& camera = scene.camera.emplace();
  camera.pose.position = {0, 0, 1};
  camera.vertical_field_of_view = std::numbers::pi / 2;
  return scene;
}

Surface unlit(double red, double green, double blue) {
  Surface surface;
  surface.base_color = {red, green, blue};
  surface.is_unlit = true;
  return surface;
}

Surface with_opacity(Surface surface, Surface::Opacity opacity, double alpha = 1) {
  surface.opacity = opacity;
  surface.alpha = alpha;
  return surface;
}

/// Adds a square of ±`half` at this height towards the camera; texture coordinates 0–1 from its upper left
/// corner.
Mesh& add_square(Scene& scene, const Surface& surface, double z = 0, double half = 1) {
  Mesh& mesh = scene.meshes.emplace_back();
  mesh.positions = {{-half, half, z}, {-half, -half, z}, {half, -half, z}, {half, half, z}};
  mesh.normals.assign(4, Vector3::UnitZ());
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.attributes.texture_coordinates[0] = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
  mesh.surface = static_cast<int>(scene.surfaces.size());
  scene.surfaces.push_back(surface);
  Visual& visual = scene.visuals.emplace_back();
  visual.mesh = static_cast<int>(scene.meshes.size()) - 1;
  return mesh;
}

Image drawn(const Scene& scene, int size = 64) {
  return picture_of(scene, {.width = size, .height = size});
}

Color at(const Image& image, double x = 0.5, double y = 0.5) {
  const std::uint8_t* p = image.pixel(static_cast<int>(x * image.width), static_cast<int>(y * image.height));
  return {p[0], p[1], p[2]};
}

int code_of(double linear) {
  return static_cast<int>(
      std::lround(255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055)));
}

/// Returns the code of a radiance by the renderer's filmic curve.
int displayed(double radiance) {
  const double x = 0.72 * radiance;
  return code_of(std::clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0));
}

void expect_near(const Color& color, const Color& expected) {
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(color[c], expected[c], 1) << c;
}

int add_image(Scene& scene, const Image& image) {
  scene.images.push_back({"test: /images/0", std::make_shared<const std::string>(to_png(image))});
  return static_cast<int>(scene.images.size()) - 1;
}

constexpr std::array<Color, 4> quarters{{{200, 30, 40}, {20, 180, 60}, {70, 80, 220}, {250, 240, 10}}};

/// Returns a square that shows the quarters, without filtering.
Scene scene_of_quarters() {
  Image image(2, 2);
  for (std::size_t i = 0; i < 12; ++i) image.rgb[i] = static_cast<std::uint8_t>(quarters[i / 3][i % 3]);
  Scene scene = facing_scene();
  Surface surface = unlit(1, 1, 1);
  surface.textures[Surface::color_texture].image = add_image(scene, image);
  surface.textures[Surface::color_texture].is_sharp_near = true;
  add_square(scene, surface);
  return scene;
}

/// Expects the four quarters of the picture to show these of the image.
void expect_quarters(const Scene& scene, const std::array<std::size_t, 4>& expected) {
  const Image image = drawn(scene);
  for (std::size_t i = 0; i < 4; ++i) {
    expect_near(at(image, i % 2 == 0 ? 0.25 : 0.75, i < 2 ? 0.25 : 0.75), quarters[expected[i]]);
  }
}

TEST(Surfaces, TextureTurnsAndMoves) {
  Scene scene = scene_of_quarters();
  expect_quarters(scene, {0, 1, 2, 3});
  Texture& texture = scene.surfaces[0].textures[Surface::color_texture];
  texture.uv_matrix << 0, 1, -1, 0;  // a quarter turn
  texture.offset = {0, 1};
  // (u, v) shows the image at (v, 1 − u).
  expect_quarters(scene, {2, 0, 3, 1});
}

TEST(Surfaces, TextureRepeatsMirrorsOrClamps) {
  for (const Texture::Wrap wrap : {Texture::Wrap::repeat, Texture::Wrap::mirrored, Texture::Wrap::clamped}) {
    Scene scene = scene_of_quarters();
    Texture& texture = scene.surfaces[0].textures[Surface::color_texture];
    texture.wrap = {wrap, wrap};
    texture.uv_matrix = 2 * Eigen::Matrix2d::Identity();
    const Image image = drawn(scene);
    expect_near(at(image, 0.1, 0.1), quarters[0]);
    // Beyond the first copy `repeat` shows the first texel, `mirrored` the last, and `clamped` the last
    // everywhere.
    expect_near(at(image, 0.6, 0.6), quarters[wrap == Texture::Wrap::repeat ? 0 : 3]);
    expect_near(at(image, 0.9, 0.9), quarters[wrap == Texture::Wrap::mirrored ? 0 : 3]);
  }
}

TEST(Surfaces, FarTextureAveragesLight) {
  Scene scene = facing_scene();
  Image checker(64, 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) std::fill_n(checker.pixel(x, y), 3, (x + y) % 2 == 0 ? 255 : 0);
  }
  Surface surface = unlit(1, 1, 1);
  surface.textures[Surface::color_texture].image = add_image(scene, checker);
  add_square(scene, surface);
  // Sixteen texels a pixel and more: half the light, not half the code.
  const Image image = drawn(scene, 16);
  for (const double place : {0.2, 0.5, 0.8}) expect_near(at(image, place, 0.4), Color{188, 188, 188});
}

TEST(Surfaces, VertexColorsMultiply) {
  Scene scene = facing_scene();
  add_square(scene, unlit(1, 0.5, 0.25)).attributes.colors.assign(4, {0.5F, 0.5F, 1, 1});
  expect_near(at(drawn(scene)), {code_of(0.5), code_of(0.25), code_of(0.25)});
}

/// Colours of a square's corners whose alpha grows from left to right.
const std::vector<std::array<float, 4>> from_left_to_right{
    {1, 1, 1, 0}, {1, 1, 1, 0}, {1, 1, 1, 1}, {1, 1, 1, 1}};

TEST(Surfaces, MaskCutsBelowCutOff) {
  Scene scene = facing_scene();
  add_square(scene, unlit(0, 0, 1), -0.5, 2);
  Surface surface = with_opacity(unlit(1, 0, 0), Surface::Opacity::cut);
  surface.cut_off = 0.25;
  add_square(scene, surface).attributes.colors = from_left_to_right;
  const Image image = drawn(scene, 128);
  expect_near(at(image, 0.23, 0.5), {0, 0, 255});
  expect_near(at(image, 0.27, 0.5), {255, 0, 0});
}

TEST(Surfaces, BlendedSurfacesCoverThoseBehind) {
  Scene scene = facing_scene();
  add_square(scene, unlit(0.1, 0.2, 0.8), -0.5, 2);
  add_square(scene, with_opacity(unlit(0.9, 0.5, 0), Surface::Opacity::blended, 0.25), 0, 2);
  add_square(scene, with_opacity(unlit(0, 1, 0.3), Surface::Opacity::blended, 0.5), 0.2, 2);
  Color expected{};
  const std::array<std::array<double, 3>, 3> colors{{{0.1, 0.2, 0.8}, {0.9, 0.5, 0}, {0, 1, 0.3}}};
  for (std::size_t c = 0; c < 3; ++c) {
    const double behind = 0.75 * colors[0][c] + 0.25 * colors[1][c];
    expected[c] = code_of(0.5 * behind + 0.5 * colors[2][c]);
  }
  const Image image = drawn(scene);
  expect_near(at(image), expected);
  // In any order of drawing.
  std::swap(scene.visuals[1], scene.visuals[2]);
  EXPECT_EQ(drawn(scene).rgb, image.rgb);
  // An opaque surface in front hides all.
  add_square(scene, unlit(0.3, 0.2, 0.1), 0.4, 2);
  expect_near(at(drawn(scene)), {code_of(0.3), code_of(0.2), code_of(0.1)});
}

TEST(Surfaces, EmissionShowsInDark) {
  Scene scene = facing_scene();
  scene.lights.emplace_back().intensity = 0;  // in place of the sun that shines where a file has no light
  Surface surface;
  surface.base_color = {0, 0, 0};
  surface.roughness = 1;
  surface.metallic = 1;  // reflects its base colour: nothing but a rim
  surface.emission = {0.5, 0.05, 0};
  add_square(scene, surface);
  expect_near(at(drawn(scene)), {displayed(0.5), displayed(0.05), 0});
  scene.surfaces[0].emission = {};
  expect_near(at(drawn(scene)), {0, 0, 0});
}

/// Returns a grey square in light from the upper right, whose normals a test can turn.
Scene scene_in_light() {
  Scene scene = facing_scene();
  Light& light = scene.lights.emplace_back();
  light.kind = Light::Kind::directional;
  light.direction = Vector3(-1, -0.5, -1).normalized();
  light.intensity = 3;
  Surface surface;
  surface.base_color = {0.5, 0.5, 0.5};
  surface.roughness = 1;
  add_square(scene, surface);
  return scene;
}

TEST(Surfaces, NormalMapTurnsNormals) {
  // The map's +x tilts the normal to the square's right, its +y up: towards the light or away from it.
  std::vector<int> reds;
  for (const Vector3& tilt :
       {Vector3(0.5, 0, 1), Vector3(-0.5, 0, 1), Vector3(0, 0.5, 1), Vector3(0, -0.5, 1)}) {
    const Vector3 normal = tilt.normalized();
    Scene mapped = scene_in_light();
    Image map(1, 1);
    for (int i = 0; i < 3; ++i) map.rgb[i] = static_cast<std::uint8_t>(std::lround((normal[i] + 1) * 127.5));
    mapped.surfaces[0].textures[Surface::normal_texture].image = add_image(mapped, map);
    Scene turned = scene_in_light();
    turned.meshes[0].normals.assign(4, normal);
    expect_near(at(drawn(mapped)), at(drawn(turned)));
    reds.push_back(at(drawn(mapped))[0]);
  }
  EXPECT_GT(reds[0], reds[1] + 20);
}

TEST(Surfaces, MetalAndRoughnessComeFromTheirChannels) {
  Scene textured = scene_in_light();
  textured.surfaces[0].metallic = 1;
  textured.surfaces[0].roughness = 1;
  Image finish(1, 1);
  finish.rgb = {17, 102, 51};  // the channel of occlusion has no effect
  textured.surfaces[0].textures[Surface::finish_texture].image = add_image(textured, finish);
  Scene plain = scene_in_light();
  plain.surfaces[0].metallic = 0.2;
  plain.surfaces[0].roughness = 0.4;
  expect_near(at(drawn(textured)), at(drawn(plain)));
}

TEST(Surfaces, PointLightFallsOffWithSquaredDistance) {
  Scene near = scene_in_light();
  near.lights[0].kind = Light::Kind::point;
  near.lights[0].position = {0, 0, 2};
  near.lights[0].intensity = 3 * 4;
  Scene far = scene_in_light();
  far.lights[0].direction = {0, 0, -1};
  expect_near(at(drawn(near)), at(drawn(far)));
  // With the lamp 1.5 m aside, it is 1.25 times as far: (4/5)² of the light at a cosine of 4/5.
  Scene beside = far;
  beside.lights[0].intensity = 3 * 0.8 * 0.8;
  beside.lights[0].direction = Vector3(-1.5, 0, -2).normalized();
  near.lights[0].position = {1.5, 0, 2};
  expect_near(at(drawn(near)), at(drawn(beside)));
}

TEST(Surfaces, SpotEndsAtConeAndLightAtRange) {
  Scene scene = scene_in_light();
  Light& light = scene.lights[0];
  light.kind = Light::Kind::spot;
  light.position = {0, 0, 1};
  light.direction = {0, 0, -1};
  light.inner_angle = 0.4;
  light.outer_angle = 0.5;  // 0.55 m from the centre
  const Image lit = drawn(scene);
  light.intensity = 0;
  const Image dark = drawn(scene);
  EXPECT_GT(at(lit)[0], at(dark)[0] + 40);
  EXPECT_EQ(at(lit, 0.8, 0.5), at(dark, 0.8, 0.5));
  light.intensity = 3;
  light.kind = Light::Kind::point;
  light.range = 1.2;
  const Image ranged = drawn(scene);
  EXPECT_GT(at(ranged)[0], at(dark)[0] + 20);
  EXPECT_EQ(at(ranged, 0.95, 0.5), at(dark, 0.95, 0.5));
}

TEST(Surfaces, AreInvisibleFromBehindIfSingleSided) {
  Scene scene = facing_scene();
  add_square(scene, unlit(0, 1, 0), -0.5, 2);
  Surface surface = unlit(1, 0, 0);
  surface.is_double_sided = false;
  Mesh& mesh = add_square(scene, surface);
  expect_near(at(drawn(scene)), {255, 0, 0});
  mesh.normals.assign(4, -Vector3::UnitZ());
  expect_near(at(drawn(scene)), {0, 255, 0});
  scene.surfaces[1].is_double_sided = true;
  expect_near(at(drawn(scene)), {255, 0, 0});
}

TEST(Surfaces, LeaveCutOutPartsOutOfTheBodyImage) {
  Scene scene = facing_scene();
  scene.bodies.emplace_back().inverse_mass = 1;
  add_square(scene, with_opacity(unlit(1, 0, 0), Surface::Opacity::cut), 0.1, 0.5).attributes.colors =
      from_left_to_right;
  scene.visuals.back().body = 1;
  const Image codes = Renderer(scene, {.width = 64, .height = 64}).draw_bodies(start_of(scene));
  EXPECT_EQ(at(codes, 0.6, 0.5), (Color{2, 0, 0}));
  EXPECT_NE(at(codes, 0.4, 0.5), (Color{2, 0, 0}));
}

TEST(Surfaces, ReusedRendererDrawsLikeANewOne) {
  Scene scene = scene_in_light();
  scene.bodies.emplace_back().inverse_mass = 1;
  add_square(scene, unlit(1, 0, 0), 0.2, 0.3);
  scene.visuals.back().body = 1;
  constexpr RenderSettings settings{.width = 64, .height = 64};
  Renderer renderer(scene, settings);
  std::vector<Coordinates> poses = start_of(scene);
  for (const double x : {0.0, -0.5, 0.4, 0.4, 3.0, 0.0}) {
    poses[1].linear.x() = x;
    EXPECT_EQ(renderer.draw(poses).rgb, Renderer(scene, settings).draw(poses).rgb) << x;
  }
}

/// Returns the error of drawing a scene with this image.
std::string complaint(const std::string& bytes) {
  Scene scene = scene_of_quarters();
  scene.images[0].bytes = std::make_shared<const std::string>(bytes);
  return test::message_of([&] { drawn(scene); });
}

TEST(Surfaces, NameDamagedImage) {
  std::string png = to_png(Image(64, 64));
  EXPECT_EQ(complaint(png), "");
  EXPECT_EQ(complaint(png.substr(0, 40)).rfind("test: /images/0: is not a complete PNG or JPEG image", 0),
            0U);
  EXPECT_NE(complaint("GIF89a"), "");
  EXPECT_NE(complaint(""), "");
  // Its header says a width of 16448 pixels: refused before any memory is taken.
  png[18] = '\x40';
  EXPECT_NE(complaint(png).find("have at most 8192 each way"), std::string::npos) << complaint(png);
}

}  // namespace
}  // namespace substep::render
