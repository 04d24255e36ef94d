#include "render/text.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

namespace substep::render {
namespace {

Image written(std::string_view text, const TextStyle& style = {}) {
  Image image(240, 40);
  draw_text(image, 4.3, 28, text, style);
  return image;
}

Image cut_out(const Image& image, int x, int y, int width, int height) {
  Image part(width, height);
  paste(part, image, -x, -y);
  return part;
}

TEST(Text, HasTheSamePixelsEverywhere) {
  // Expect the pixels of the vendored fonts: a change of font, rasteriser or layout changes every label.
  EXPECT_EQ(hash(written("A3 Ω = 1.25 rad/s")), 3386423381851505922u);
  TextStyle bold;
  bold.bold = true;
  bold.size = 23.5;
  bold.color = {250, 180, 20};
  EXPECT_EQ(hash(written("Sub-stepping", bold)), 12008293497659063488u);
}

TEST(Text, HasGreekAndSymbolsInBothFonts) {
  const std::vector<std::string> needed{"α", "τ", "κ", "λ", "ω", "Γ", "Δ", "Σ", "°", "×",
                                        "→", "−", "≤", "±", "²", "³", "·", "–", "…", "µ"};
  for (const bool bold : {false, true}) {
    TextStyle style;
    style.bold = bold;
    const std::uint64_t nothing = hash(written("", style));
    const std::uint64_t missing = hash(written("\U000F0000", style));
    for (const std::string& letter : needed) {
      EXPECT_NE(hash(written(letter, style)), nothing) << letter;
      EXPECT_NE(hash(written(letter, style)), missing) << letter;
    }
  }
}

TEST(Text, DrawsBrokenUtf8AsReplacements) {
  const std::uint64_t replacement = hash(written("\uFFFD"));
  EXPECT_EQ(hash(written("\xff")), replacement);
  EXPECT_EQ(hash(written("\xce")), replacement);
  EXPECT_EQ(hash(written("\xc0\xaf")), hash(written("\uFFFD\uFFFD")));
  EXPECT_GT(text_width(std::string_view("a\0b", 3), {}), text_width("ab", {}));
}

/// Expects drawing in a small image to give the cut-out of drawing in a large one.
template <typename Draw>
void expect_clipped(const Draw& draw) {
  constexpr int margin = 60;
  constexpr int width = 50;
  constexpr int height = 30;
  for (const int x : {-40, -9, 0, 20, 45}) {
    for (const int y : {-20, -3, 0, 15, 29, 40}) {
      Image small(width, height);
      draw(small, x, y);
      Image large(width + 2 * margin, height + 2 * margin);
      draw(large, x + margin, y + margin);
      EXPECT_EQ(small.rgb, cut_out(large, margin, margin, width, height).rgb) << x << ' ' << y;
    }
  }
}

TEST(Text, NotesMissingLettersOnce) {
  testing::internal::CaptureStderr();
  for (int i = 0; i < 2; ++i) written("塔 a");
  written("b");
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "substep: note: the font has not all letters of '塔 a': boxes stand for the others\n");
}

TEST(Text, ClipsAtBorder) {
  expect_clipped([](Image& image, double x, double y) { draw_text(image, x, y, "Wgj½", {}); });
  expect_clipped([](Image& image, int x, int y) {
    fill_rectangle(image, x, y, 30, 12, {200, 100, 50}, 0.7);
  });
  expect_clipped([](Image& image, double x, double y) {
    draw_line(image, x, y, x + 37.5, y + 18.25, 3, {255, 255, 255}, 0.8);
  });
  Image stamp(20, 10);
  for (std::size_t i = 0; i < stamp.rgb.size(); ++i) stamp.rgb[i] = static_cast<std::uint8_t>(i + 1);
  expect_clipped([&stamp](Image& image, int x, int y) { paste(image, stamp, x, y); });
}

TEST(Text, IgnoresFarAndNonFinitePositions) {
  const Image empty(50, 30);
  Image image = empty;
  using Limits = std::numeric_limits<double>;
  for (const double far : {Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity(), 1e300, -1e18, 3e9}) {
    draw_text(image, far, 10, "text", {});
    draw_text(image, 10, far, "text", {});
    draw_line(image, far, 5, far, 6, 2, {255, 255, 255});
  }
  const int most = std::numeric_limits<int>::max();
  fill_rectangle(image, most, most, most, most, {255, 255, 255});
  fill_rectangle(image, -most, -most, most, most, {255, 255, 255});
  fill_rectangle(image, 5, 5, -3, 4, {255, 255, 255});
  EXPECT_EQ(image.rgb, empty.rgb);
}

}  // namespace
}  // namespace substep::render
