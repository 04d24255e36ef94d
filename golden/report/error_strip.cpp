#include "golden/report/report_case.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string_view>

namespace substep::golden {
namespace {

using Json = nlohmann::ordered_json;

constexpr double width = 900;
constexpr double left = 56;
constexpr double right = 860;
constexpr double top = 40;
constexpr double bottom = 170;
constexpr int lowest = -6;  // decades: 1e-6 px or m
constexpr int highest = 4;

struct Axes {
  double first;
  double last;

  double x(double frame) const {
    return left + (right - left) * (frame - first) / std::max(last - first, 1.0);
  }
  static double y(double value) {
    const double decade = std::clamp(std::log10(std::max(value, 1e-300)), double{lowest}, double{highest});
    return bottom - (bottom - top) * (decade - lowest) / (highest - lowest);
  }
};

/// Column 1 of the errors is metres, 2 pixels.
std::string curve(const Json& errors, std::size_t column, const Axes& axes, std::string_view style) {
  std::string points;
  for (const Json& error : errors) {
    // JSON has no number here: the run had diverged.
    const double value = error.at(column).is_null() ? 1e9 : error.at(column).get<double>();
    if (value <= 0) continue;
    fmt::format_to(std::back_inserter(points), "{:.1f},{:.1f} ", axes.x(error.at(0).get<double>()),
                   Axes::y(value));
  }
  if (points.empty()) return {};
  return fmt::format("<polyline class=\"{}\" points=\"{}\"/>\n", style, points);
}

std::string grid(const Axes& axes) {
  std::string svg;
  for (int decade = lowest; decade <= highest; decade += 2) {
    const double y = Axes::y(std::pow(10.0, decade));
    fmt::format_to(std::back_inserter(svg),
                   "<line class=\"grid\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>"
                   "<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">1e{}</text>\n",
                   left, right, y, y, left - 6, y + 4, decade);
  }
  const double half = Axes::y(0.5);
  fmt::format_to(std::back_inserter(svg),
                 "<line class=\"grid\" stroke-dasharray=\"2 3\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" "
                 "y2=\"{:.1f}\"/><text x=\"{}\" y=\"{:.1f}\">½ px</text>\n",
                 left, right, half, half, right + 4, half + 4);
  for (int i = 0; i <= 4; ++i) {
    const double frame = std::round(axes.first + (axes.last - axes.first) * i / 4);
    fmt::format_to(std::back_inserter(svg), "<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n",
                   axes.x(frame), bottom + 16, frame);
  }
  return svg;
}

struct Marker {
  int frame;
  std::string_view style;
  std::string_view text;
};

}  // namespace

std::string error_strip(const Json& poses) {
  if (!poses.contains("motion") || poses.at("motion").at("errors").empty()) return {};
  const Json& motion = poses.at("motion");
  const Json& errors = motion.at("errors");
  const Axes axes{errors.front().at(0).get<double>(), errors.back().at(0).get<double>()};
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {} 208\" width=\"{}\" role=\"img\" style=\"max-width:100%;height:auto\" "
      "aria-label=\"Error over frames, with the first difference, the half-pixel prediction and the first "
      "visible frame\">\n",
      width, width);
  svg += grid(axes);
  svg += curve(errors, 1, axes, "metres");
  svg += curve(errors, 2, axes, "pixels");
  const std::array<Marker, 3> markers{{{motion.at("first_frame"), "first", "first difference"},
                                       {motion.at("predicted_frame"), "predicted", "half a pixel, predicted"},
                                       {poses.at("visible_frame"), "visible", "first other picture, drawn"}}};
  double row = 12;
  for (const Marker& marker : markers) {
    if (marker.frame < 0) continue;
    const double x = axes.x(marker.frame);
    const bool is_left = x > (left + right) / 2;
    fmt::format_to(std::back_inserter(svg),
                   "<line class=\"marker {}\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{}\" y2=\"{}\"/>"
                   "<text class=\"{}\" x=\"{:.1f}\" y=\"{}\" text-anchor=\"{}\">{}: frame {}</text>\n",
                   marker.style, x, x, row - 8, bottom, marker.style, x + (is_left ? -5 : 5), row,
                   is_left ? "end" : "start", marker.text, marker.frame);
    row += 13;
  }
  svg += fmt::format(
      "<line class=\"pixels\" x1=\"{0}\" x2=\"{1}\" y1=\"200\" y2=\"200\"/><text x=\"{2}\" y=\"204\">largest "
      "shift of a body in the picture (px)</text>\n"
      "<line class=\"metres\" x1=\"{3}\" x2=\"{4}\" y1=\"200\" y2=\"200\"/><text x=\"{5}\" y=\"204\">largest "
      "error of a body's position (m)</text>\n<text x=\"{6}\" y=\"204\" "
      "text-anchor=\"end\">frame</text></svg>\n",
      left, left + 24, left + 30, left + 270, left + 294, left + 300, right);
  return svg;
}

}  // namespace substep::golden
