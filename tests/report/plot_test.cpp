#include "render/report/plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "sim/error.h"
#include "tests/error_message.h"

namespace substep::report {
namespace {

using testing::HasSubstr;
using testing::Not;

Sheet sheet_of(std::vector<std::array<double, 2>> points) {
  Sheet sheet;
  sheet.title = "title's";
  sheet.caption = {"a caption"};
  Panel panel;
  panel.title = "under_score";
  panel.x = {"x", true, {}, {}};
  panel.y = {"y", true, {}, {}};
  panel.series = {{"one", {2, 7, false, true, true}, std::move(points)}};
  panel.triangles = {{1, 1, 3, 1}};
  sheet.panels = {panel, panel};
  return sheet;
}

TEST(Plot, HasItsWords) {
  const std::string svg = draw(sheet_of({{1, 1}, {10, 0.1}}), PictureFormat::svg);
  for (const char* const text : {"title's", "under_score", "a caption", "one"})
    EXPECT_THAT(svg, HasSubstr(text));
}

TEST(Plot, LeavesOutWhatAnAxisCannotShow) {
  const std::string with = draw(sheet_of({{1, 1}, {10, 0.1}, {5, NAN}, {0, 1}, {3, -1}}), PictureFormat::svg);
  EXPECT_EQ(with, draw(sheet_of({{1, 1}, {10, 0.1}}), PictureFormat::svg));
  EXPECT_THAT(with, Not(HasSubstr("nan")));
}

TEST(Plot, DrawsAPanelWithoutPoints) {
  EXPECT_THAT(draw(sheet_of({}), PictureFormat::svg), HasSubstr("under_score"));
}

/// Returns the number that follows `name` in the text.
double number_after(const std::string& text, const std::string& name) {
  const std::size_t at = text.find(name);
  return at == std::string::npos ? NAN : std::stod(text.substr(at + name.size()));
}

std::uint32_t number_in_png(const std::string& png, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = (value << 8) | static_cast<unsigned char>(png[at + i]);
  return value;
}

TEST(Plot, IsAsWideInPrintAsItIsAskedToBe) {
  Sheet sheet = sheet_of({{1, 1}, {10, 0.1}});
  sheet.panels.resize(5, sheet.panels[0]);
  FigureStyle style;
  for (const double width : {85.0, 178.0}) {
    style.width = width;
    style.text = width < 100 ? 7 : 9;
    const std::string svg = draw(sheet, PictureFormat::svg, style);
    EXPECT_DOUBLE_EQ(number_after(svg, " width=\""), width);
    // Text of 12 units has the size asked for.
    const double units = number_after(svg, "viewBox=\"0 0 ");
    EXPECT_NEAR(12 * width / 25.4 * 72 / units, style.text, 0.02);
    EXPECT_THAT(svg, HasSubstr("font-size=\"12.00\""));
    EXPECT_THAT(svg, Not(HasSubstr("prefers-color-scheme")));
    const std::string pdf = draw(sheet, PictureFormat::pdf, style);
    EXPECT_NEAR(number_after(pdf, "/MediaBox [ 0 0 "), width / 25.4 * 72, 1);
    style.dpi = 200;
    const std::string png = draw(sheet, PictureFormat::png, style);
    EXPECT_EQ(png.substr(1, 3), "PNG");
    EXPECT_NEAR(number_in_png(png, 16), width / 25.4 * 200, 1);
  }
}

TEST(Plot, LeavesOutTitleCaptionAndGround) {
  FigureStyle style;
  style.width = 85;
  style.title = false;
  style.caption = false;
  style.transparent = true;
  const Sheet sheet = sheet_of({{1, 1}, {10, 0.1}});
  const std::string svg = draw(sheet, PictureFormat::svg, style);
  for (const char* const text : {"title's", "a caption", "fill=\"#ffffff\""}) {
    EXPECT_THAT(svg, Not(HasSubstr(text)));
    EXPECT_THAT(draw(sheet, PictureFormat::svg), HasSubstr(text));
  }
  // A PNG of colours with an alpha.
  EXPECT_EQ(draw(sheet, PictureFormat::png, style)[25], 6);
  style.transparent = false;
  EXPECT_EQ(draw(sheet, PictureFormat::png, style)[25], 2);
}

TEST(Plot, ShowsTheSeriesChosen) {
  Sheet sheet = sheet_of({{1, 1}, {10, 0.1}});
  sheet.panels[0].series.push_back({"two", {3, 5, false, true, true}, {{2, 2}}});
  sheet.panels[1].title = "other";
  const Sheet chosen = with_choice(sheet, {"under"}, {"tw"});
  ASSERT_EQ(chosen.panels.size(), 1u);
  ASSERT_EQ(chosen.panels[0].series.size(), 1u);
  EXPECT_EQ(chosen.panels[0].series[0].title, "two");
  const auto message_of = [&](const std::vector<std::string>& panels,
                              const std::vector<std::string>& series) {
    return test::message_of([&] { with_choice(sheet, panels, series); });
  };
  EXPECT_EQ(message_of({"over"}, {}), "the figure has no panel 'over': it has under_score; other");
  EXPECT_EQ(message_of({}, {"one", "three"}), "the figure has no series 'three': it has one; two");
}

TEST(Plot, HasTheRangeAskedFor) {
  const Sheet sheet = sheet_of({{1, 1}, {10, 0.1}});
  const auto has_tic = [](const Sheet& drawn) {
    return draw(drawn, PictureFormat::svg).find("-8</tspan>") != std::string::npos;
  };
  EXPECT_TRUE(has_tic(with_ranges(sheet, std::array<double, 2>{1e-8, 1e4}, {})));
  EXPECT_FALSE(has_tic(with_ranges(sheet, {}, {})));
  EXPECT_THROW(with_ranges(sheet, {}, std::array<double, 2>{0, 1}), Error);
}

}  // namespace
}  // namespace substep::report
