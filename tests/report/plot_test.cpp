// Tests figures as gnuplot draws them: text, sizes, layout and colours.

#include "render/report/plot.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <regex>
#include <string>
#include <vector>

#include "render/image.h"
#include "render/inks.h"
#include "render/report/plot_layout.h"
#include "sim/error.h"
#include "sim/math/vector.h"
#include "tests/error_message.h"

namespace substep::report {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

Sheet two_panels(std::vector<std::array<double, 2>> points = {{1, 1}, {10, 0.1}}) {
  const Panel panel{.title = "under_score",
                    .x = {"x", true},
                    .y = {"y", true},
                    .series = {{"one", {2, 7}, std::move(points)}},
                    .triangle = std::array{1.0, 1.0}};
  return {.title = "title's", .caption = {"a caption"}, .panels = {panel, panel}};
}

std::string svg_of(const Sheet& sheet) {
  return draw(sheet, PictureFormat::svg);
}

TEST(Plot, ShowsItsText) {
  for (const char* const text : {"title's", "under_score", "a caption", "one"})
    EXPECT_THAT(svg_of(two_panels()), HasSubstr(text));
  EXPECT_THAT(svg_of(two_panels({})), HasSubstr("under_score"));
}

TEST(Plot, LeavesOutPointsOffTheAxes) {
  const std::string svg = svg_of(two_panels({{1, 1}, {10, 0.1}, {5, NAN}, {0, 1}, {3, -1}}));
  EXPECT_EQ(svg, svg_of(two_panels()));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

/// Returns the number that follows `name` in the text.
double number_after(const std::string& text, const std::string& name) {
  const std::size_t at = text.find(name);
  return at == std::string::npos ? NAN : std::stod(text.substr(at + name.size()));
}

TEST(Plot, HasTheWidthAndTextSizeForPrint) {
  Sheet sheet = two_panels();
  sheet.panels.resize(5, sheet.panels[0]);
  for (const double width : {85.0, 178.0}) {
    const FigureStyle style{.width = width, .text = width < 100 ? 7.0 : 9.0, .dpi = 200};
    const std::string svg = draw(sheet, PictureFormat::svg, style);
    EXPECT_DOUBLE_EQ(number_after(svg, " width=\""), width);
    // Text of 12 units has the requested size.
    const double units = number_after(svg, "viewBox=\"0 0 ");
    EXPECT_NEAR(12 * width / 25.4 * 72 / units, style.text, 0.02);
    EXPECT_THAT(svg, HasSubstr("font-size=\"12.00\""));
    EXPECT_THAT(svg, Not(HasSubstr("prefers-color-scheme")));
    const std::string pdf = draw(sheet, PictureFormat::pdf, style);
    EXPECT_NEAR(number_after(pdf, "/MediaBox [ 0 0 "), width / 25.4 * 72, 1);
    const std::string png = draw(sheet, PictureFormat::png, style);
    EXPECT_NEAR(render::from_png(png, "figure").width, width / 25.4 * 200, 1);
  }
}

TEST(Plot, UsesRequestedFont) {
  // On screens a rule of the style sheet decides, not the attributes that gnuplot writes.
  EXPECT_THAT(draw(two_panels(), PictureFormat::svg, {.font = "Liberation Sans"}),
              AllOf(HasSubstr("text{font-family:'Liberation Sans',"), Not(HasSubstr("DejaVu Sans"))));
}

TEST(Plot, OmitsTitleCaptionAndBackground) {
  FigureStyle style{.width = 85, .title = false, .caption = false, .transparent = true};
  const std::string svg = draw(two_panels(), PictureFormat::svg, style);
  for (const char* const text : {"title's", "a caption", "fill=\"#ffffff\""}) {
    EXPECT_THAT(svg, Not(HasSubstr(text)));
    EXPECT_THAT(svg_of(two_panels()), HasSubstr(text));
  }
  // Byte 25 of a PNG is its colour type: 6 with alpha, 2 without.
  EXPECT_EQ(draw(two_panels(), PictureFormat::png, style)[25], 6);
  style.transparent = false;
  EXPECT_EQ(draw(two_panels(), PictureFormat::png, style)[25], 2);
}

TEST(Plot, ShowsTheChosenPanelsAndSeries) {
  Sheet sheet = two_panels();
  sheet.panels[0].series.push_back({"two", {3, 5}, {{2, 2}}});
  sheet.panels[0].notes = {{1, 1, "of one"}, {2, 2, "of two"}};
  sheet.panels[1].title = "other";
  const Sheet chosen = with_choice(sheet, {"under"}, {"tw"});
  ASSERT_EQ(chosen.panels.size(), 1u);
  ASSERT_EQ(chosen.panels[0].series.size(), 1u);
  EXPECT_EQ(chosen.panels[0].series[0].title, "two");
  EXPECT_EQ(chosen.panels[0].notes.at(0).text, "of two");
  EXPECT_EQ(test::message_of([&] { with_choice(sheet, {"over"}, {}); }),
            "the figure has no panel 'over': it has under_score; other");
  EXPECT_EQ(test::message_of([&] {
              with_choice(sheet, {}, {"one", "three"});
            }),
            "the figure has no series 'three': it has one; two");
}

TEST(Plot, UsesRequestedRange) {
  EXPECT_THAT(svg_of(with_ranges(two_panels(), std::array<double, 2>{1e-8, 1e4}, {})),
              HasSubstr("-8</tspan>"));
  EXPECT_THAT(svg_of(with_ranges(two_panels(), {}, {})), Not(HasSubstr("-8</tspan>")));
  const Sheet thousands = two_panels({{1000, 1}, {3000, 0.1}});
  const std::string svg = svg_of(with_ranges(thousands, std::array<double, 2>{200, 20000}, {}));
  EXPECT_THAT(svg, AllOf(HasSubstr(">4</tspan>"), HasSubstr(">3</tspan>"), Not(HasSubstr(">2</tspan>"))));
  EXPECT_THAT(svg_of(with_ranges(thousands, std::array<double, 2>{2000, 8000}, {})),
              AllOf(HasSubstr(">2000</tspan>"), HasSubstr(">8000</tspan>")));
  EXPECT_THROW(with_ranges(two_panels(), {}, std::array<double, 2>{0, 1}), Error);
  EXPECT_EQ(test::message_of([] {
              with_ranges(two_panels(), std::array<double, 2>{2, 9}, {});
            }),
            "no point of the panel 'under_score' lies in the range");
}

struct Box {
  std::string text;
  double left, right, top, bottom;
};

double overlap(const Box& a, const Box& b) {
  const double x = std::min(a.right, b.right) - std::max(a.left, b.left);
  const double y = std::min(a.bottom, b.bottom) - std::max(a.top, b.top);
  return x > 0 && y > 0 ? std::min(x, y) : 0;
}

/// Returns the boxes of an SVG's texts, from the top of a capital letter to the baseline.
std::vector<Box> texts_of(const std::string& svg) {
  static const std::regex group(
      R"re(<g transform="translate\(([0-9.-]+),([0-9.-]+)\)( rotate\(-90[.0-9]*\))?"[^>]*font-size="([0-9.]+)"[^>]*text-anchor="(\w+)">\s*<text>(.*?)</text>)re");
  static const std::regex span(R"re(<tspan([^>]*)>([^<]*)</tspan>)re");
  static const std::regex own_size(R"re(font-size="([0-9.]+))re");
  std::vector<Box> boxes;
  for (std::sregex_iterator at(svg.begin(), svg.end(), group), end; at != end; ++at) {
    const std::smatch& match = *at;
    Box box{};
    double width = 0;
    double height = 0;
    // Measure each span: a tic's exponent is a smaller span of its own.
    const std::string spans = match[6];
    for (std::sregex_iterator part(spans.begin(), spans.end(), span); part != end; ++part) {
      const std::string attributes = (*part)[1];
      std::smatch found;
      const double size = std::stod(std::regex_search(attributes, found, own_size) ? found[1] : match[4]);
      width += width_of((*part)[2], size);
      height = std::max(height, size);
      box.text += (*part)[2];
    }
    if (box.text.empty()) continue;
    height *= 0.73;  // of a capital letter
    const std::string anchor = match[5];
    const double before = anchor == "middle" ? 0.5 * width : anchor == "end" ? width : 0;
    const double x = std::stod(match[1]);
    const double y = std::stod(match[2]);
    if (match[3].matched) {
      box.left = x - height, box.right = x, box.top = y - width + before, box.bottom = y + before;
    } else {
      box.left = x - before, box.right = x - before + width, box.top = y - height, box.bottom = y;
    }
    boxes.push_back(std::move(box));
  }
  return boxes;
}

Sheet sheet_of(int series, int panels) {
  Sheet sheet{.title = "Error against rows solved",
              .caption = {"A1: h divided by 1, 2, 4, 8. A2: m = 1, 2, 5, 10, 20, 40, step h. A3, A4, A5: n = "
                          "1, 2, 5, 10, 20, 40.",
                          "Down and to the left is better."}};
  for (int i = 0; i < panels; ++i) {
    Panel& panel = sheet.panels.emplace_back();
    panel.title = fmt::format("scene_{}, 2 s", i);
    panel.x = {"rows solved in a simulated second", true};
    panel.y = {"RMS error / size", true};
    for (int k = 0; k < series; ++k) {
      panel.series.push_back({fmt::format("A{} stable τ=0.6/0.9 κ=1/0.7", k),
                              {k % 8, 4 + k, k % 2 == 1},
                              {{std::pow(10, k), 1e-3}, {1e4, 1e-7 * (k + 1)}, {1e6, 1e-10}}});
    }
  }
  return sheet;
}

/// Returns the style for print of this width, mm; for width 0 the style for screens.
FigureStyle style_for(double width) {
  FigureStyle style;
  if (width > 0) style.width = width;
  return style;
}

/// Expects that no two texts of the figure overlap, none lies in a plot or leaves the picture, and that the
/// legend is complete.
void expect_separate(const Sheet& sheet, const FigureStyle& style) {
  const std::string svg = draw(sheet, PictureFormat::svg, style);
  const double units = style.width ? *style.width / 25.4 * 72 / (style.text / 12) : 0;
  const Layout layout = layout_of(sheet, style, units);
  SCOPED_TRACE(fmt::format("{} series, {} panels, {:g} mm", sheet.panels[0].series.size(),
                           sheet.panels.size(), style.width.value_or(0)));
  const std::vector<Box> texts = texts_of(svg);
  ASSERT_GT(texts.size(), layout.legend.size() + layout.caption.size());
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const Box& one = texts[i];
    SCOPED_TRACE(one.text);
    EXPECT_GE(one.left, -0.5);
    EXPECT_LE(one.right, layout.width + 0.5);
    EXPECT_LE(one.bottom, layout.height + 0.5);
    for (std::size_t k = 0; k < i; ++k) EXPECT_LT(overlap(one, texts[k]), 0.5) << texts[k].text;
    for (std::size_t panel = 0; panel < sheet.panels.size(); ++panel) {
      const Box plot{"plot", layout.left(panel), layout.right(panel), layout.top(panel),
                     layout.bottom(panel)};
      EXPECT_LT(overlap(one, plot), 0.5) << "in plot " << panel;
    }
  }
  for (const LegendEntry& entry : layout.legend)
    EXPECT_TRUE(std::ranges::count(texts, entry.lines[0], &Box::text) > 0) << entry.lines[0];
}

TEST(PlotLayout, SeparatesTexts) {
  for (const double width : {0.0, 85.0, 178.0}) {
    for (int series = 1; series <= 12; ++series) {
      for (const int panels : {1, 2, 3, 5}) expect_separate(sheet_of(series, panels), style_for(width));
    }
  }
}

TEST(PlotLayout, LeavesRoomForLongNamesOfTics) {
  Sheet sheet = sheet_of(2, 2);
  for (Panel& panel : sheet.panels)
    panel.y = {"", false, std::array{0.0, 3.0}, "(\"an option of contacts switched off\" 1, \"another\" 2)"};
  for (const double width : {0.0, 178.0}) expect_separate(sheet, style_for(width));
}

TEST(PlotLayout, GivesOnePanelTheWholeWidth) {
  const Layout one = layout_of(sheet_of(3, 1), {}, 0);
  EXPECT_EQ(one.width, 1200);
  EXPECT_GT(one.right(0) - one.left(0), 0.9 * one.width);
  EXPECT_EQ(layout_of(sheet_of(3, 3), {}, 0).width, 1200);
}

TEST(PlotLayout, KeepsTheCaptionShorterThanThePlotInOneColumn) {
  const Layout layout = layout_of(sheet_of(5, 1), style_for(85), 85 / 25.4 * 72 / (8.0 / 12));
  EXPECT_LT(layout.height - layout.caption_top, layout.bottom(0) - layout.top(0));
  // The legend alone lies between axis and caption.
  const double legend = layout.legend.back().y - layout.legend.front().y + line_height;
  EXPECT_LT(layout.caption_top - layout.bottom(0) - layout.bottom_margin - legend, 1.5 * line_height);
}

/// Returns the linear light of "#rrggbb".
Vector3 linear(const std::string& hex) {
  Vector3 result;
  for (int i = 0; i < 3; ++i) {
    const double c = std::stoi(hex.substr(1 + 2 * static_cast<std::size_t>(i), 2), nullptr, 16) / 255.0;
    result[i] = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  }
  return result;
}

/// Returns CIE L*a*b* under D65.
Vector3 lab(const Vector3& light) {
  Matrix3 xyz_of_rgb;
  xyz_of_rgb << 0.4125, 0.3576, 0.1804, 0.2127, 0.7152, 0.0722, 0.0193, 0.1192, 0.9503;
  const Vector3 white(0.9505, 1, 1.0888);
  const Vector3 xyz = (xyz_of_rgb * light.cwiseMax(0).cwiseMin(1)).cwiseQuotient(white);
  const Vector3 t =
      xyz.unaryExpr([](double x) { return x > 0.008856 ? std::cbrt(x) : 7.787 * x + 16.0 / 116; });
  return {116 * t[1] - 16, 500 * (t[0] - t[1]), 200 * (t[1] - t[2])};
}

/// Returns the smallest difference of two of render::inks, in L*a*b*, as seen with normal sight, protanopia
/// and deuteranopia (Machado, Oliveira and Fernandes 2009).
double distance(int a, int b) {
  Matrix3 protanopia;
  protanopia << 0.1523, 1.0526, -0.2049, 0.1145, 0.7863, 0.0992, -0.0039, -0.0481, 1.0520;
  Matrix3 deuteranopia;
  deuteranopia << 0.3673, 0.8606, -0.2280, 0.2801, 0.6725, 0.0474, -0.0118, 0.0429, 0.9689;
  const Vector3 one = linear(render::inks.at(static_cast<std::size_t>(a)).light);
  const Vector3 other = linear(render::inks.at(static_cast<std::size_t>(b)).light);
  const auto seen_with = [&](const Matrix3& eye) { return (lab(eye * one) - lab(eye * other)).norm(); };
  return std::min({seen_with(Matrix3::Identity()), seen_with(protanopia), seen_with(deuteranopia)});
}

TEST(Inks, DifferForColourBlindness) {
  std::map<std::string, int> hues;
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a3, Algorithm::a5})
    hues[std::string(title_of(algorithm))] = render::hue_of(algorithm);
  for (const char* const engine : {"ode-step", "mujoco-euler", "bullet-si", "rapier", "jolt", "mujoco3"})
    hues[engine] = render::hue_of_engine(engine);
  for (auto a = hues.begin(); a != hues.end(); ++a) {
    for (auto b = hues.begin(); b != a; ++b) {
      // Measured: A5 and Jolt 18.3, A3 and ODE 24.8, all others more.
      EXPECT_GT(distance(a->second, b->second), 18) << a->first << " " << b->first;
    }
  }
}

}  // namespace
}  // namespace substep::report
