#include "render/image.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "sim/error.h"
#include "sim/math/fnv1a.h"
#include "tests/error_message.h"
#include "tests/temporary_folder.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

class Images : public testing::Test {
 protected:
  static Image pattern(int width, int height) {
    Image image(width, height);
    std::uint32_t state = 12345;
    for (std::uint8_t& byte : image.rgb) {
      state = state * 1664525u + 1013904223u;
      byte = static_cast<std::uint8_t>(state >> 24);
    }
    return image;
  }

  static std::string refusal(const fs::path& file) {
    return test::message_of([&] { read_png(file); });
  }

  test::TemporaryFolder place_;
  fs::path folder_ = place_.path();
};

TEST_F(Images, PngGivesBackThePixels) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {64, 48}, {3, 200}}) {
    const Image image = pattern(width, height);
    write_png(image, folder_ / "image.png");
    const Image back = read_png(folder_ / "image.png");
    EXPECT_EQ(back.width, width);
    EXPECT_EQ(back.height, height);
    EXPECT_EQ(back.rgb, image.rgb);
  }
}

TEST_F(Images, SmallPngGivesBackThePixelsOfEveryFilter) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {64, 48}, {3, 200}}) {
    const Image image = pattern(width, height);
    EXPECT_EQ(from_png(to_small_png(image), "small").rgb, image.rgb);
  }
  // Rows that a filter each suits best: noise repeated from above, steps to the right, a slope, flat.
  Image image(96, 40);
  std::uint32_t random = 1;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        random = random * 1664525 + 1013904223;
        const std::array<std::uint32_t, 5> values{
            random >> 24, static_cast<std::uint32_t>(x * (7 + channel)),
            static_cast<std::uint32_t>(3 * x + 5 * y), 40,
            y > 0 ? image.pixel(x, y - 1)[channel] + (random >> 30) : 0};
        image.pixel(x, y)[channel] = static_cast<std::uint8_t>(values[static_cast<std::size_t>(y / 2) % 5]);
      }
    }
  }
  const std::string png = to_small_png(image);
  EXPECT_EQ(from_png(png, "small").rgb, image.rgb);
  EXPECT_LT(png.size(), to_png(image).size());  // measured 3872 and 3987
}

TEST_F(Images, HashIsFnvOfSizeAndPixels) {
  EXPECT_EQ(hash(Image()), fnv1a(std::string(8, '\0')));
  Image image = pattern(8, 4);
  const std::uint64_t before = hash(image);
  EXPECT_EQ(hash(pattern(8, 4)), before);
  image.rgb.back() ^= 1;
  EXPECT_NE(hash(image), before);
  // The same bytes in another shape are another picture.
  image = pattern(8, 4);
  std::swap(image.width, image.height);
  EXPECT_NE(hash(image), before);
}

TEST_F(Images, WhatIsNoPngIsRefusedByName) {
  EXPECT_NE(refusal(folder_ / "missing.png").find("missing.png"), std::string::npos);
  EXPECT_NE(refusal(folder_), "");
  std::ofstream(folder_ / "text.png") << "not a picture";
  EXPECT_NE(refusal(folder_ / "text.png").find("text.png"), std::string::npos);
  std::ofstream(folder_ / "empty.png").close();
  EXPECT_NE(refusal(folder_ / "empty.png"), "");
  const std::string png = to_png(pattern(64, 48));
  for (const std::size_t length : {std::size_t{8}, std::size_t{40}, png.size() / 2}) {
    std::ofstream(folder_ / "cut.png", std::ios::binary) << png.substr(0, length);
    EXPECT_NE(refusal(folder_ / "cut.png"), "") << length;
  }
}

TEST_F(Images, WritingToNoFolderLeavesNothing) {
  EXPECT_THROW(write_png(pattern(4, 4), folder_ / "none" / "image.png"), Error);
  EXPECT_TRUE(fs::is_empty(folder_));
  EXPECT_THROW(write_png(Image(), folder_ / "image.png"), Error);
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace substep::render
