#include "render/image.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>

#include "render/textures.h"
#include "sim/error.h"
#include "tests/error_message.h"
#include "tests/temporary_folder.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

/// Returns noise, which no file format makes small.
std::vector<std::uint8_t> noise(std::size_t bytes, std::uint32_t seed = 12345) {
  std::vector<std::uint8_t> result(bytes);
  for (std::uint8_t& byte : result) {
    seed = seed * 1664525 + 1013904223;
    byte = static_cast<std::uint8_t>(seed >> 24);
  }
  return result;
}

Image pattern(int width, int height) {
  Image image(width, height);
  image.rgb = noise(image.rgb.size());
  return image;
}

class Png : public testing::Test {
 protected:
  static std::string refusal(const fs::path& file) {
    return test::message_of([&] { read_png(file); });
  }

  test::TemporaryFolder place_;
  fs::path folder_ = place_.path();
};

TEST_F(Png, RoundTripKeepsPixels) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {64, 48}, {3, 200}}) {
    const Image image = pattern(width, height);
    write_png(image, folder_ / "image.png");
    const Image back = read_png(folder_ / "image.png");
    EXPECT_EQ(back.width, width);
    EXPECT_EQ(back.height, height);
    EXPECT_EQ(back.rgb, image.rgb);
    EXPECT_EQ(from_png(to_small_png(image), "small").rgb, image.rgb);
  }
}

TEST_F(Png, SmallFileKeepsPixelsOfEveryFilter) {
  // Make rows that suit one filter each: noise, steps to the right, a slope, flat, noise repeated from above.
  Image image(96, 40);
  const std::vector<std::uint8_t> random = noise(image.rgb.size(), 1);
  for (std::size_t i = 0; i < random.size(); ++i) {
    const int y = static_cast<int>(i) / 288;
    const int x = static_cast<int>(i) / 3 % 96;
    const int channel = static_cast<int>(i) % 3;
    const int above = y > 0 ? image.pixel(x, y - 1)[channel] + random[i] / 64 : 0;
    const std::array<int, 5> values{random[i], x * (7 + channel), 3 * x + 5 * y, 40, above};
    image.rgb[i] = static_cast<std::uint8_t>(values[y / 2 % 5]);
  }
  const std::string png = to_small_png(image);
  EXPECT_EQ(from_png(png, "small").rgb, image.rgb);
  EXPECT_LT(png.size(), to_png(image).size());  // measured 3872 and 3987
}

TEST_F(Png, RefusesOtherFilesByName) {
  EXPECT_NE(refusal(folder_ / "missing.png").find("missing.png"), std::string::npos);
  EXPECT_NE(refusal(folder_), "");
  const std::string png = to_png(pattern(64, 48));
  for (const std::string& content : {std::string("not a picture"), std::string(), png.substr(0, 8),
                                     png.substr(0, 40), png.substr(0, png.size() / 2)}) {
    std::ofstream(folder_ / "bad.png", std::ios::binary) << content;
    EXPECT_NE(refusal(folder_ / "bad.png").find("bad.png"), std::string::npos) << content.size();
  }
}

TEST_F(Png, FailedWriteLeavesNothing) {
  EXPECT_THROW(write_png(pattern(4, 4), folder_ / "none" / "image.png"), Error);
  EXPECT_THROW(write_png(Image(), folder_ / "image.png"), Error);
  EXPECT_TRUE(fs::is_empty(folder_));
}

/// Returns a PNG of noise with alpha.
std::string noisy_file(int width, int height, std::uint32_t seed) {
  return to_png(Texels{width, height, noise(std::size_t{4} * width * height, seed)});
}

void add_image(Scene& scene, const std::string& file, Surface::Role role = Surface::color_texture) {
  Surface& surface = scene.surfaces.emplace_back();
  surface.textures[role].image = static_cast<int>(scene.images.size());
  scene.images.push_back({"test: /images", std::make_shared<const std::string>(file)});
}

Texels image_of(const Scene& scene, std::size_t index) {
  return decode_texels(*scene.images[index].bytes, "test");
}

std::size_t bytes_of_images(const Scene& scene) {
  std::size_t bytes = 0;
  for (const SceneImage& image : scene.images) bytes += image.bytes->size();
  return bytes;
}

TEST(SmallerImages, FitLongestSide) {
  Scene scene;
  add_image(scene, noisy_file(2048, 512, 1));
  const Scene smaller = with_smaller_images(scene, scene.surfaces, {512, 10000000});
  EXPECT_EQ(image_of(smaller, 0).width, 512);
  EXPECT_EQ(image_of(smaller, 0).height, 128);
}

TEST(SmallerImages, FitTotalBytes) {
  Scene scene;
  for (std::uint32_t seed = 0; seed < 6; ++seed) add_image(scene, noisy_file(512, 512, seed));
  const ImageLimits limits;
  ASSERT_GT(bytes_of_images(scene), 3 * limits.bytes);
  const Scene smaller = with_smaller_images(scene, scene.surfaces, limits);
  EXPECT_LE(bytes_of_images(smaller), limits.bytes);
  EXPECT_EQ(image_of(smaller, 5).width, 256) << "no smaller than they have to be";
}

TEST(SmallerImages, KeepTheLightOfColorsAndTheNumbersOfOthers) {
  // A chessboard of black and white, opaque.
  Texels chessboard{64, 64, {}};
  for (int i = 0; i < 64 * 64; ++i) {
    const std::uint8_t code = (i + i / 64) % 2 == 0 ? 0 : 255;
    chessboard.rgba.insert(chessboard.rgba.end(), {code, code, code, 255});
  }
  Scene scene;
  add_image(scene, to_png(chessboard));
  add_image(scene, to_png(chessboard), Surface::normal_texture);
  const Scene smaller = with_smaller_images(scene, scene.surfaces, {32, 10000000});
  // Half the light has sRGB's code 188.
  EXPECT_EQ(image_of(smaller, 0).rgba[0], 188);
  EXPECT_EQ(image_of(smaller, 1).rgba[0], 128);
  EXPECT_EQ(image_of(smaller, 1).rgba[3], 255);
}

TEST(SmallerImages, KeepSmallFilesExceptTurnedOnes) {
  Scene scene;
  add_image(scene, noisy_file(64, 64, 1));
  add_image(scene, noisy_file(64, 64, 2) + "Exif");  // a browser may rotate it by this data
  const Scene smaller = with_smaller_images(scene, scene.surfaces, {});
  EXPECT_EQ(smaller.images[0].bytes, scene.images[0].bytes);
  EXPECT_EQ(smaller.images[1].bytes->find("Exif"), std::string::npos);
  EXPECT_EQ(image_of(smaller, 1).rgba, image_of(scene, 1).rgba);
}

}  // namespace
}  // namespace substep::render
