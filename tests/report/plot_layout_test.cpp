// Measures in the SVG that gnuplot writes whether texts, and texts and plots, cover each other.

#include "render/report/plot_layout.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>
#include <string>
#include <vector>

namespace substep::report {
namespace {

struct Box {
  std::string text;
  double left, right, top, bottom;
};

double overlap(const Box& a, const Box& b) {
  const double x = std::min(a.right, b.right) - std::max(a.left, b.left);
  const double y = std::min(a.bottom, b.bottom) - std::max(a.top, b.top);
  return x > 0 && y > 0 ? std::min(x, y) : 0;
}

/// Returns the boxes of an SVG's texts, from the ascender of small letters to the baseline.
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
    // A tic's exponent is a span of its own, smaller
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
  Sheet sheet;
  sheet.title = "Error against rows solved";
  sheet.caption = {
      "A1: h divided by 1, 2, 4, 8. A2: m = 1, 2, 5, 10, 20, 40, step h. A3, A4, A5: n = 1, 2, 5, 10, 20, "
      "40.",
      "Down and to the left is better."};
  for (int i = 0; i < panels; ++i) {
    Panel panel{fmt::format("scene_{}, 2 s", i),
                {"rows solved in a simulated second", true, {}, {}},
                {"RMS error / size", true, {}, {}},
                {},
                {},
                {}};
    for (int k = 0; k < series; ++k) {
      panel.series.push_back({fmt::format("A{} stable τ=0.6/0.9 κ=1/0.7", k),
                              {k % 8, 4 + k, k % 2 == 1, true, true},
                              {{std::pow(10, k), 1e-3}, {1e4, 1e-7 * (k + 1)}, {1e6, 1e-10}}});
    }
    sheet.panels.push_back(std::move(panel));
  }
  return sheet;
}

/// Expects that no two texts of the figure overlap, none lies in a plot or leaves the picture, and that the
/// legend is complete.
void expect_separate(const Sheet& sheet, const FigureStyle& style) {
  const std::string svg = draw(sheet, PictureFormat::svg, style);
  const double units = style.width ? *style.width / 25.4 * 72 / (style.text / 12) : 0;
  const Layout layout = layout_of(sheet, style, units);
  const std::string where = fmt::format("{} series, {} panels, {:g} mm", sheet.panels[0].series.size(),
                                        sheet.panels.size(), style.width.value_or(0));
  const std::vector<Box> texts = texts_of(svg);
  ASSERT_GT(texts.size(), layout.legend.size() + layout.caption.size()) << where;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const Box& one = texts[i];
    EXPECT_GE(one.left, -0.5) << where << ": " << one.text;
    EXPECT_LE(one.right, layout.width + 0.5) << where << ": " << one.text;
    EXPECT_LE(one.bottom, layout.height + 0.5) << where << ": " << one.text;
    for (std::size_t k = 0; k < i; ++k)
      EXPECT_LT(overlap(one, texts[k]), 0.5)
          << where << ": '" << one.text << "' on '" << texts[k].text << "'";
    for (std::size_t panel = 0; panel < sheet.panels.size(); ++panel) {
      const Box plot{"plot", layout.left(panel), layout.right(panel), layout.top(panel),
                     layout.bottom(panel)};
      EXPECT_LT(overlap(one, plot), 0.5) << where << ": '" << one.text << "' in a plot";
    }
  }
  for (const LegendEntry& entry : layout.legend) {
    EXPECT_TRUE(std::ranges::any_of(texts, [&](const Box& box) { return box.text == entry.lines[0]; }))
        << where << ": " << entry.lines[0];
  }
}

TEST(PlotLayout, TextsNeverCollide) {
  for (const double width : {0.0, 85.0, 178.0}) {
    FigureStyle style;
    if (width > 0) style.width = width;
    for (int series = 1; series <= 12; ++series) {
      for (const int panels : {1, 2, 3, 5}) expect_separate(sheet_of(series, panels), style);
    }
  }
}

TEST(PlotLayout, LongNamesOfTicsHaveTheirRoom) {
  Sheet sheet = sheet_of(2, 2);
  for (Panel& panel : sheet.panels)
    panel.y = {"", false, std::array{0.0, 3.0}, "(\"an option of contacts switched off\" 1, \"another\" 2)"};
  for (const double width : {0.0, 178.0}) {
    FigureStyle style;
    if (width > 0) style.width = width;
    expect_separate(sheet, style);
  }
}

TEST(PlotLayout, OnePanelTakesTheWholeWidth) {
  const Layout one = layout_of(sheet_of(3, 1), {}, 0);
  EXPECT_EQ(one.width, 1200);
  EXPECT_GT(one.right(0) - one.left(0), 0.9 * one.width);
  EXPECT_EQ(layout_of(sheet_of(3, 3), {}, 0).width, 1200);
}

TEST(PlotLayout, CaptionIsLowerThanThePlotInOneColumn) {
  FigureStyle style;
  style.width = 85;
  const Layout layout = layout_of(sheet_of(5, 1), style, 85 / 25.4 * 72 / (8.0 / 12));
  EXPECT_LT(layout.height - layout.caption_top, layout.bottom(0) - layout.top(0));
  // Nothing but the legend lies between axis and caption
  const double legend = layout.legend.back().y - layout.legend.front().y + line_height;
  EXPECT_LT(layout.caption_top - layout.bottom(0) - layout.bottom_margin - legend, 1.5 * line_height);
}

}  // namespace
}  // namespace substep::report
