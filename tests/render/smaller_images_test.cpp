// Images that a page holds: small, of few bytes, and of the same colour.

#include "render/smaller_images.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>

#include "render/image.h"
#include "render/resolve.h"

namespace substep::render {
namespace {

/// Returns noise, which no file format makes small.
Texels noise(int width, int height, std::uint32_t seed) {
  Texels texels{width, height, {}};
  texels.rgba.resize(std::size_t{4} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (std::uint8_t& byte : texels.rgba) {
    seed = seed * 1664525 + 1013904223;
    byte = static_cast<std::uint8_t>(seed >> 24);
  }
  return texels;
}

void add_image(Scene& scene, const std::string& file, Surface::Role role = Surface::color_texture) {
  Surface& surface = scene.surfaces.emplace_back();
  surface.textures[role].image = static_cast<int>(scene.images.size());
  scene.images.push_back({"test: /images", std::make_shared<const std::string>(file)});
}

Texels image_of(const Scene& scene, std::size_t index) {
  return decode_texels(*scene.images[index].bytes, "test");
}

/// A chessboard of two grey codes, opaque.
Texels chessboard(int side, std::uint8_t dark, std::uint8_t bright) {
  Texels texels{side, side, {}};
  for (int i = 0; i < side * side; ++i) {
    const std::uint8_t code = (i + i / side) % 2 == 0 ? dark : bright;
    texels.rgba.insert(texels.rgba.end(), {code, code, code, 255});
  }
  return texels;
}

TEST(SmallerImages, HaveAtMostSoManyPixelsASide) {
  Scene scene;
  add_image(scene, to_png(noise(2048, 512, 1)));
  const Scene smaller = with_smaller_images(scene, scene.surfaces, {512, 10000000});
  EXPECT_EQ(image_of(smaller, 0).width, 512);
  EXPECT_EQ(image_of(smaller, 0).height, 128);
}

TEST(SmallerImages, HaveAtMostSoManyBytesTogether) {
  Scene scene;
  for (std::uint32_t seed = 0; seed < 6; ++seed) add_image(scene, to_png(noise(512, 512, seed)));
  std::size_t before = 0;
  for (const SceneImage& image : scene.images) before += image.bytes->size();
  const ImageLimits limits;
  ASSERT_GT(before, 3 * limits.bytes);
  const Scene smaller = with_smaller_images(scene, scene.surfaces, limits);
  std::size_t bytes = 0;
  for (const SceneImage& image : smaller.images) bytes += image.bytes->size();
  EXPECT_LE(bytes, limits.bytes);
  EXPECT_EQ(image_of(smaller, 5).width, 256) << "no smaller than they have to be";
}

TEST(SmallerImages, KeepTheLightOfColorsAndTheNumbersOfOthers) {
  Scene scene;
  add_image(scene, to_png(chessboard(64, 0, 255)));
  add_image(scene, to_png(chessboard(64, 0, 255)), Surface::normal_texture);
  const Scene smaller = with_smaller_images(scene, scene.surfaces, {32, 10000000});
  // Half the light has sRGB's code 188.
  EXPECT_EQ(image_of(smaller, 0).rgba[0], 188);
  EXPECT_EQ(image_of(smaller, 1).rgba[0], 128);
  EXPECT_EQ(image_of(smaller, 1).rgba[3], 255);
}

TEST(SmallerImages, StayTheirFilesWhereTheyAreSmall) {
  Scene scene;
  add_image(scene, to_png(noise(64, 64, 1)));
  add_image(scene, to_png(noise(64, 64, 2)) + "Exif");  // a browser may turn it by what comes then
  const Scene smaller = with_smaller_images(scene, scene.surfaces, {});
  EXPECT_EQ(smaller.images[0].bytes, scene.images[0].bytes);
  EXPECT_EQ(smaller.images[1].bytes->find("Exif"), std::string::npos);
  EXPECT_EQ(image_of(smaller, 1).rgba, image_of(scene, 1).rgba);
}

TEST(NearestCode, IsTheInverseOfLinearLight) {
  for (int code = 0; code < 256; ++code) {
    EXPECT_EQ(nearest_code(linear_light(static_cast<std::uint8_t>(code))), code);
  }
}

}  // namespace
}  // namespace substep::render
