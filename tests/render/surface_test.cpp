// Materials of a file, against closed forms: a square seen head-on fills the picture.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "render/image.h"
#include "render/renderer.h"
#include "render/resolve.h"
#include "test_scenes.h"
#include "tests/error_message.h"

namespace substep::render {
namespace {

using Color = std::array<int, 3>;

/// Returns a scene with a camera alone, 1 m above the plane z = 0, of which it sees 2 m each way.
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

/// A square of ±`half` at this height towards the camera; texture coordinates 0–1 from its upper left corner.
Mesh& add_square(Scene& scene, const Surface& surface, double z = 0, double half = 1) {
  Mesh& mesh = scene.meshes.emplace_back();
  mesh.positions = {{-half, half, z}, {-half, -half, z}, {half, -half, z}, {half, half, z}};
  mesh.normals.assign(4, Vector3::UnitZ());
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.looks.texture_coordinates[0] = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
  mesh.surface = static_cast<int>(scene.surfaces.size());
  scene.surfaces.push_back(surface);
  Visual& visual = scene.visuals.emplace_back();
  visual.mesh = static_cast<int>(scene.meshes.size()) - 1;
  return mesh;
}

Image drawn(const Scene& scene, int size = 64) {
  RenderSettings settings;
  settings.width = size;
  settings.height = size;
  return Renderer(scene, settings).draw(initial_state(scene).q);
}

Color at(const Image& image, double x, double y) {
  const std::uint8_t* p = image.pixel(static_cast<int>(x * image.width), static_cast<int>(y * image.height));
  return {p[0], p[1], p[2]};
}

int code_of(double linear) {
  return static_cast<int>(
      std::lround(255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055)));
}

/// The picture's filmic curve.
int displayed(double radiance) {
  const double x = 0.72 * radiance;
  return code_of(std::clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0));
}

void expect_near(const Color& color, const Color& expected, int within = 1) {
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(color[c], expected[c], within) << c;
}

int add_image(Scene& scene, const Image& image) {
  scene.images.push_back({"test: /images/0", std::make_shared<const std::string>(to_png(image))});
  return static_cast<int>(scene.images.size()) - 1;
}

Image two_by_two(const std::array<Color, 4>& colors) {
  Image image(2, 2);
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t c = 0; c < 3; ++c) image.rgb[3 * i + c] = static_cast<std::uint8_t>(colors[i][c]);
  }
  return image;
}

constexpr std::array<Color, 4> quarters{{{200, 30, 40}, {20, 180, 60}, {70, 80, 220}, {250, 240, 10}}};

/// A square that shows the quarters, sharp.
Scene scene_of_quarters() {
  Scene scene = facing_scene();
  Surface surface = unlit(1, 1, 1);
  surface.textures[Surface::color_texture].image = add_image(scene, two_by_two(quarters));
  surface.textures[Surface::color_texture].is_sharp_near = true;
  add_square(scene, surface);
  return scene;
}

TEST(Surfaces, ATexturedSquareShowsItsTexels) {
  const Image image = drawn(scene_of_quarters());
  expect_near(at(image, 0.25, 0.25), quarters[0]);
  expect_near(at(image, 0.75, 0.25), quarters[1]);
  expect_near(at(image, 0.25, 0.75), quarters[2]);
  expect_near(at(image, 0.75, 0.75), quarters[3]);
}

TEST(Surfaces, ATextureRepeatsIsMirroredOrEnds) {
  for (const Texture::Wrap wrap : {Texture::Wrap::repeat, Texture::Wrap::mirrored, Texture::Wrap::clamped}) {
    Scene scene = scene_of_quarters();
    Texture& texture = scene.surfaces[0].textures[Surface::color_texture];
    texture.wrap = {wrap, wrap};
    texture.turn = 2 * Eigen::Matrix2d::Identity();
    const Image image = drawn(scene);
    expect_near(at(image, 0.1, 0.1), quarters[0]);
    // Right of the first copy and below it: its first texel, its last, or its last for ever.
    const std::size_t beyond = wrap == Texture::Wrap::repeat ? 0 : 3;
    expect_near(at(image, 0.6, 0.6), quarters[beyond]);
    expect_near(at(image, 0.9, 0.9), quarters[wrap == Texture::Wrap::mirrored ? 0 : 3]);
  }
}

TEST(Surfaces, ATransformTurnsAndMovesATexture) {
  Scene scene = scene_of_quarters();
  Texture& texture = scene.surfaces[0].textures[Surface::color_texture];
  texture.turn << 0, 1, -1, 0;  // a quarter turn
  texture.offset = {0, 1};
  const Image image = drawn(scene);
  // Place (u, v) shows the image at (v, 1 − u).
  expect_near(at(image, 0.25, 0.25), quarters[2]);
  expect_near(at(image, 0.75, 0.25), quarters[0]);
  expect_near(at(image, 0.25, 0.75), quarters[3]);
}

TEST(Surfaces, AFarTextureIsTheMeanOfItsLight) {
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

TEST(Surfaces, VertexColoursMultiply) {
  Scene scene = facing_scene();
  Mesh& mesh = add_square(scene, unlit(1, 0.5, 0.25));
  mesh.looks.colors.assign(4, {0.5F, 0.5F, 1, 1});
  expect_near(at(drawn(scene), 0.5, 0.5), {code_of(0.5), code_of(0.25), code_of(0.25)});
}

TEST(Surfaces, AMaskCutsWhereAlphaIsBelowTheCutOff) {
  Scene scene = facing_scene();
  add_square(scene, unlit(0, 0, 1), -0.5, 2);
  Surface surface = unlit(1, 0, 0);
  surface.opacity = Surface::Opacity::cut;
  surface.cut_off = 0.25;
  Mesh& mesh = add_square(scene, surface);
  mesh.looks.colors = {{1, 1, 1, 0}, {1, 1, 1, 0}, {1, 1, 1, 1}, {1, 1, 1, 1}};  // from left to right
  const Image image = drawn(scene, 128);
  expect_near(at(image, 0.23, 0.5), {0, 0, 255});
  expect_near(at(image, 0.27, 0.5), {255, 0, 0});
}

TEST(Surfaces, ABlendedSurfaceIsLaidOverWhatIsBehindIt) {
  Scene scene = facing_scene();
  add_square(scene, unlit(0.1, 0.2, 0.8), -0.5, 2);
  Surface pane = unlit(0.9, 0.5, 0);
  pane.opacity = Surface::Opacity::blended;
  pane.alpha = 0.25;
  add_square(scene, pane, 0, 2);
  Surface other = unlit(0, 1, 0.3);
  other.opacity = Surface::Opacity::blended;
  other.alpha = 0.5;
  add_square(scene, other, 0.2, 2);
  Color expected{};
  const std::array<std::array<double, 3>, 3> colors{{{0.1, 0.2, 0.8}, {0.9, 0.5, 0}, {0, 1, 0.3}}};
  for (std::size_t c = 0; c < 3; ++c) {
    const double behind = 0.75 * colors[0][c] + 0.25 * colors[1][c];
    expected[c] = code_of(0.5 * behind + 0.5 * colors[2][c]);
  }
  const Image image = drawn(scene);
  expect_near(at(image, 0.5, 0.5), expected);
  // Whatever the order in which they are drawn.
  std::swap(scene.visuals[1], scene.visuals[2]);
  EXPECT_EQ(drawn(scene).rgb, image.rgb);
}

TEST(Surfaces, NothingIsSeenThroughASurfaceInFront) {
  Scene scene = facing_scene();
  add_square(scene, unlit(0.1, 0.2, 0.8), 0.2, 2);
  Surface pane = unlit(0.9, 0.5, 0);
  pane.opacity = Surface::Opacity::blended;
  pane.alpha = 0.5;
  add_square(scene, pane, 0, 2);
  expect_near(at(drawn(scene), 0.5, 0.5), {code_of(0.1), code_of(0.2), code_of(0.8)});
}

TEST(Surfaces, EmissionIsSeenInTheDark) {
  Scene scene = facing_scene();
  scene.lights.emplace_back().intensity = 0;  // in place of the sun that shines where a file has no light
  Surface surface;
  surface.base_color = {0, 0, 0};
  surface.roughness = 1;
  surface.metallic = 1;  // reflects its base colour: nothing but a rim
  surface.emission = {0.5, 0.05, 0};
  add_square(scene, surface);
  expect_near(at(drawn(scene), 0.5, 0.5), {displayed(0.5), displayed(0.05), 0});
  scene.surfaces[0].emission = {};
  expect_near(at(drawn(scene), 0.5, 0.5), {0, 0, 0});
}

/// A grey square in light from the right and above, of which its normals may be turned.
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

/// Returns the colour of its centre, with all normals turned by a texture whose texels are this vector.
Color with_normal_map(const Vector3& normal) {
  Scene scene = scene_in_light();
  Image map(1, 1);
  for (int i = 0; i < 3; ++i) {
    map.rgb[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(std::lround((normal[i] + 1) * 127.5));
  }
  scene.surfaces[0].textures[Surface::normal_texture].image = add_image(scene, map);
  return at(drawn(scene), 0.5, 0.5);
}

Color with_normals(const Vector3& normal) {
  Scene scene = scene_in_light();
  scene.meshes[0].normals.assign(4, normal);
  return at(drawn(scene), 0.5, 0.5);
}

TEST(Surfaces, ANormalMapTurnsTheNormals) {
  // Right on the texture is right on the square, up is up: towards the light or away from it.
  for (const Vector3& tilt :
       {Vector3(0.5, 0, 1), Vector3(-0.5, 0, 1), Vector3(0, 0.5, 1), Vector3(0, -0.5, 1)}) {
    const Vector3 normal = tilt.normalized();
    expect_near(with_normal_map(normal), with_normals(normal));
  }
  EXPECT_GT(with_normal_map(Vector3(0.5, 0, 1).normalized())[0],
            with_normal_map(Vector3(-0.5, 0, 1).normalized())[0] + 20);
}

TEST(Surfaces, MetalAndRoughnessComeFromTheirChannels) {
  Scene textured = scene_in_light();
  textured.surfaces[0].metallic = 1;
  textured.surfaces[0].roughness = 1;
  Image finish(1, 1);
  finish.rgb = {17, 102, 51};  // occlusion's channel is not looked at
  textured.surfaces[0].textures[Surface::finish_texture].image = add_image(textured, finish);
  Scene plain = scene_in_light();
  plain.surfaces[0].metallic = 0.2;
  plain.surfaces[0].roughness = 0.4;
  expect_near(at(drawn(textured), 0.5, 0.5), at(drawn(plain), 0.5, 0.5));
}

TEST(Surfaces, APointLightFallsOffWithTheSquareOfItsDistance) {
  Scene near = scene_in_light();
  near.lights[0].kind = Light::Kind::point;
  near.lights[0].position = {0, 0, 2};
  near.lights[0].intensity = 3 * 4;
  Scene far = scene_in_light();
  far.lights[0].direction = {0, 0, -1};
  expect_near(at(drawn(near), 0.5, 0.5), at(drawn(far), 0.5, 0.5));
  // At 1.5 m beside the centre the way is 1.25 times as long: (4/5)² of the light at a cosine of 4/5.
  Scene beside = far;
  beside.lights[0].intensity = 3 * 0.8 * 0.8;
  beside.lights[0].direction = Vector3(-1.5, 0, -2).normalized();
  near.lights[0].position = {1.5, 0, 2};
  expect_near(at(drawn(near), 0.5, 0.5), at(drawn(beside), 0.5, 0.5));
}

TEST(Surfaces, ASpotEndsAtItsConeAndALightAtItsRange) {
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
  EXPECT_GT(at(lit, 0.5, 0.5)[0], at(dark, 0.5, 0.5)[0] + 40);
  EXPECT_EQ(at(lit, 0.8, 0.5), at(dark, 0.8, 0.5));
  light.intensity = 3;
  light.kind = Light::Kind::point;
  light.range = 1.2;
  const Image ranged = drawn(scene);
  EXPECT_GT(at(ranged, 0.5, 0.5)[0], at(dark, 0.5, 0.5)[0] + 20);
  EXPECT_EQ(at(ranged, 0.95, 0.5), at(dark, 0.95, 0.5));
}

TEST(Surfaces, ASurfaceWithoutABackIsNotSeenFromBehind) {
  Scene scene = facing_scene();
  add_square(scene, unlit(0, 1, 0), -0.5, 2);
  Surface surface = unlit(1, 0, 0);
  surface.has_back = false;
  Mesh& mesh = add_square(scene, surface);
  expect_near(at(drawn(scene), 0.5, 0.5), {255, 0, 0});
  mesh.normals.assign(4, -Vector3::UnitZ());
  expect_near(at(drawn(scene), 0.5, 0.5), {0, 255, 0});
  scene.surfaces[1].has_back = true;
  expect_near(at(drawn(scene), 0.5, 0.5), {255, 0, 0});
}

TEST(Surfaces, BodiesAreToldApartThroughWhatIsCutAway) {
  Scene scene = facing_scene();
  Body& body = scene.bodies.emplace_back();
  body.inverse_mass = 1;
  Surface surface = unlit(1, 0, 0);
  surface.opacity = Surface::Opacity::cut;
  Mesh& mesh = add_square(scene, surface, 0.1, 0.5);
  mesh.looks.colors = {{1, 1, 1, 0}, {1, 1, 1, 0}, {1, 1, 1, 1}, {1, 1, 1, 1}};
  scene.visuals.back().body = 1;
  RenderSettings settings;
  settings.width = settings.height = 64;
  const Image codes = Renderer(scene, settings).draw_bodies(initial_state(scene).q);
  EXPECT_EQ(at(codes, 0.6, 0.5), (Color{2, 0, 0}));
  EXPECT_NE(at(codes, 0.4, 0.5), (Color{2, 0, 0}));
}

TEST(Surfaces, KeptOnesOfTheWorldEqualThoseDrawnAnew) {
  Scene scene = scene_in_light();
  scene.bodies.emplace_back().inverse_mass = 1;
  add_square(scene, unlit(1, 0, 0), 0.2, 0.3);
  scene.visuals.back().body = 1;
  RenderSettings settings;
  settings.width = settings.height = 64;
  Renderer renderer(scene, settings);
  std::vector<Coordinates> poses = initial_state(scene).q;
  for (const double x : {0.0, -0.5, 0.4, 0.4, 3.0, 0.0}) {
    poses[1].linear.x() = x;
    EXPECT_EQ(renderer.draw(poses).rgb, Renderer(scene, settings).draw(poses).rgb) << x;
  }
}

/// Returns the warning of drawing a scene with this image.
std::string complaint(const std::string& bytes) {
  Scene scene = scene_of_quarters();
  scene.images[0].bytes = std::make_shared<const std::string>(bytes);
  return test::message_of([&] { drawn(scene); });
}

TEST(Surfaces, ADamagedImageIsNamed) {
  std::string png = to_png(Image(64, 64));
  EXPECT_EQ(complaint(png), "");
  EXPECT_EQ(complaint(png.substr(0, 40)).rfind("test: /images/0: is no whole PNG or JPEG image", 0), 0U);
  EXPECT_NE(complaint("GIF89a"), "");
  EXPECT_NE(complaint(""), "");
  // Its header says 16448 pixels: refused before any memory is taken.
  png[18] = '\x40';
  EXPECT_NE(complaint(png).find("have at most 8192 each way"), std::string::npos) << complaint(png);
}

}  // namespace
}  // namespace substep::render
