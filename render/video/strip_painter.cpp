#include "render/video/strip_painter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "render/text.h"

namespace substep::render {

using namespace film_colors;

Dash dash_of(std::size_t run) {
  constexpr std::array<Dash, 5> dashes{{{1, 0}, {14, 3}, {9, 6}, {5, 8}, {2.5, 9}}};
  return dashes[run % dashes.size()];
}

double baseline(double y, double height, double size) {
  return y + height / 2 + 0.31 * size;
}

double StripPainter::text_size(double at_720) const {
  return std::max(10.0, at_720 * scale);
}

double StripPainter::axis_width(const StripAxis& axis) const {
  const TextStyle style{.size = text_size(14)};
  if (axis.is_logarithmic) return text_width("0.1 mm", style);
  double widest = 0;
  for (const double value : {axis.low, axis.high, axis.mark})
    widest = std::max(widest, text_width(axis.label(value), style));
  return widest;
}

double StripPainter::plot_x(const StripBox& strip, std::size_t k) const {
  const std::size_t last = std::max<std::size_t>(1, comparison.times.size() - 1);
  return strip.plot.x + static_cast<double>(k) / static_cast<double>(last) * strip.plot.width;
}

double StripPainter::plot_y(const StripBox& strip, double value) const {
  return strip.plot.y + strip.plot.height * (1 - std::max(0.0, strip.axis.height(value)));
}

void StripPainter::draw_ground(Image& image, const StripBox& strip, std::size_t run, bool has_key) const {
  const Box& box = strip.strip;
  fill_rectangle(image, box.x, box.y, box.width, box.height, surface);
  draw_grid(image, strip);
  if (strip.kind == Strip::error) draw_certainty(image, strip);
  if (comparison.runs[run].is_reference() && has_key) draw_key(image, strip);
}

void StripPainter::draw_grid(Image& image, const StripBox& strip) const {
  const Box& plot = strip.plot;
  const TextStyle style{.size = text_size(14), .color = quiet};
  const auto draw_label = [&](const std::string& text, double y, double offset) {
    if (!has_axis) return;
    draw_text(image, plot.x - std::max(3.0, 5 * scale) - text_width(text, style),
              y + 0.31 * style.size + offset, text, style);
  };
  if (!strip.axis.is_logarithmic) {
    for (const double value : {strip.axis.low, strip.axis.high, strip.axis.mark}) {
      const double y = plot_y(strip, value);
      const bool is_mark = value == strip.axis.mark;
      draw_line(image, plot.x, y, plot.x + plot.width, y, 1, is_mark ? quiet : grid);
      // Where the mark is near an end, it alone is named: that is what the curve is read against.
      const double room = std::abs(y - plot_y(strip, strip.axis.mark));
      if (is_mark || room > style.size) draw_label(strip.axis.label(value), y, 0);
    }
  } else {
    const int lower = strip.axis.decades.lower;
    const int decades = strip.axis.decades.upper - lower;
    for (int decade = 0; decade <= decades; ++decade) {
      const double y = plot.y + plot.height * (1 - static_cast<double>(decade) / decades);
      draw_line(image, plot.x, y, plot.x + plot.width, y, 1, grid);
      // The top and the bottom: between them there is no room for more.
      if (decade != 0 && decade != decades) continue;
      constexpr std::array<const char*, 10> names{"1 µm",  "10 µm", "0.1 mm", "1 mm",  "1 cm",
                                                  "10 cm", "1 m",   "10 m",   "100 m", "1 km"};
      draw_label(names[static_cast<std::size_t>(lower + decade + 6)], y, decade == 0 ? -1 * scale : scale);
    }
  }
  if (!has_names) return;
  // Name the strip, where there are several.
  const std::string name = name_of(strip.kind);
  draw_text(image, strip.strip.x + strip.strip.width - 6 * scale - text_width(name, style),
            strip.strip.y + 1.05 * style.size, name, style);
}

/// Shades what is below the reference's own uncertainty, and marks where the reference ends.
void StripPainter::draw_certainty(Image& image, const StripBox& strip) const {
  const ReferenceRun& reference = *comparison.reference;
  const Box& plot = strip.plot;
  const double bottom = plot.y + plot.height;
  for (std::size_t k = 0; k + 1 < reference.known; ++k) {
    const int left = static_cast<int>(std::lround(plot_x(strip, k)));
    const int right = static_cast<int>(std::lround(plot_x(strip, k + 1)));
    const double error = std::max(reference.uncertainty[k], reference.uncertainty[k + 1]);
    const int top = static_cast<int>(std::lround(plot_y(strip, error)));
    fill_rectangle(image, left, top, right - left, static_cast<int>(bottom) - top, quiet, 0.25);
  }
  if (reference.known == comparison.times.size()) return;
  const double end = plot_x(strip, reference.known);
  draw_line(image, end, plot.y, end, bottom, std::max(1.5, 2 * scale), alarm);
  const TextStyle style{.size = text_size(14), .color = quiet};
  const std::string text = "reference ends";
  if (text_width(text, style) + 8 * scale > plot.x + plot.width - end) return;
  draw_text(image, end + 5 * scale, baseline(plot.y, plot.height, style.size), text, style);
}

/// The names of the curves in the reference's strip, in as many lines as there is room for.
void StripPainter::draw_key(Image& image, const StripBox& strip) const {
  const Box& plot = strip.plot;
  std::vector<std::pair<std::string, Color>> names;
  for (const Run& run : comparison.runs) {
    std::pair<std::string, Color> entry{name_of(run.panel), accent(run.panel)};
    if (!run.is_reference() && std::ranges::find(names, entry) == names.end()) names.push_back(entry);
  }
  TextStyle style{.size = std::max(9.0, 12 * scale), .bold = true};
  const auto lines = std::max<std::size_t>(1, static_cast<std::size_t>(strip.strip.height / style.size));
  const double left = plot.x + plot.width + 8 * scale;
  double x = left;
  double column = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0 && i % lines == 0) {
      x += column + 6 * scale;
      column = 0;
    }
    style.color = names[i].second;
    const double wide = text_width(names[i].first, style);
    if (x + wide > strip.strip.x + strip.strip.width) break;
    column = std::max(column, wide);
    const double pitch = static_cast<double>(strip.strip.height) / static_cast<double>(lines);
    draw_text(image, x, baseline(strip.strip.y + static_cast<double>(i % lines) * pitch, pitch, style.size),
              names[i].first, style);
  }
}

void StripPainter::draw_curve(Image& image, const StripBox& strip, std::size_t run, std::size_t end,
                              const Color& color, bool dashed) const {
  const std::vector<double>& values = series_of(comparison.runs[run], strip.kind);
  const double width = std::max(1.2, 1.8 * scale);
  const Dash dash = dashed ? dash_of(run) : Dash{1, 0};
  const double period = (dash.drawn + dash.left_out) * std::max(0.6, scale);
  const double drawn = dash.drawn * std::max(0.6, scale);
  double from = 0;  // along the curve, since its beginning
  for (std::size_t k = 1; k < std::min(end + 1, values.size()); ++k) {
    const double x0 = plot_x(strip, k - 1);
    const double y0 = plot_y(strip, values[k - 1]);
    const double dx = plot_x(strip, k) - x0;
    const double dy = plot_y(strip, values[k]) - y0;
    const double length = std::hypot(dx, dy);
    if (dash.left_out == 0) {
      draw_line(image, x0, y0, x0 + dx, y0 + dy, width, color);
      continue;
    }
    for (double at = 0; length > 0 && at < length;) {
      const double phase = std::fmod(from + at, period);
      const bool on = phase < drawn;
      const double next = std::min(length, at + std::max((on ? drawn : period) - phase, 1e-6));
      if (on) {
        draw_line(image, x0 + dx * at / length, y0 + dy * at / length, x0 + dx * next / length,
                  y0 + dy * next / length, width, color);
      }
      at = next;
    }
    from += length;
  }
}

/// Triangles at the top where the curve goes on above it.
void StripPainter::draw_clipped(Image& image, const StripBox& strip, std::size_t run, std::size_t end) const {
  const std::vector<double>& values = series_of(comparison.runs[run], strip.kind);
  const double top = strip.axis.is_logarithmic ? std::pow(10.0, strip.axis.decades.upper) : strip.axis.high;
  const TextStyle style{.size = std::max(8.0, 11 * scale), .color = accent(comparison.runs[run].panel)};
  const double apart = 40 * scale;
  double last = -1e9;
  for (std::size_t k = 0; k < std::min(end + 1, values.size()); ++k) {
    if (!(values[k] > top) || plot_x(strip, k) < last + apart) continue;
    last = plot_x(strip, k);
    draw_text(image, last - text_width("▲", style) / 2, strip.plot.y + 0.1 * style.size, "▲", style);
  }
}

std::string StripPainter::value_label(const StripBox& strip, std::size_t run, std::size_t k) const {
  const double value = series_of(comparison.runs[run], strip.kind)[k];
  if (strip.kind == Strip::error) return error_label(value, comparison.reference->uncertainty[k]);
  return strip.axis.label(value);
}

void StripPainter::draw(Image& image, const StripBox& strip, std::size_t run, std::size_t k) const {
  const Box& plot = strip.plot;
  const Run& r = comparison.runs[run];
  const double cursor = plot_x(strip, k);
  draw_line(image, cursor, plot.y, cursor, plot.y + plot.height, std::max(1.0, scale), bright, 0.45);
  if (r.is_reference()) {
    // It has no error of its own: the strip shows all the others', to compare.
    for (std::size_t other = 0; other < comparison.runs.size(); ++other) {
      draw_curve(image, strip, other, k, accent(comparison.runs[other].panel), true);
      draw_clipped(image, strip, other, k);
    }
    return;
  }
  const Color color = accent(r.panel);
  draw_curve(image, strip, run, series_of(comparison.runs[run], strip.kind).size(), faded(color), false);
  draw_curve(image, strip, run, k, color, false);
  draw_clipped(image, strip, run, k);
  if (k >= series_of(comparison.runs[run], strip.kind).size()) return;
  const int dot = std::max(2, static_cast<int>(std::lround(5 * scale)));
  fill_rectangle(image, static_cast<int>(std::lround(cursor - 0.5 * dot)),
                 static_cast<int>(
                     std::lround(plot_y(strip, series_of(comparison.runs[run], strip.kind)[k]) - 0.5 * dot)),
                 dot, dot, color);
  const std::string value = value_label(strip, run, k);
  TextStyle bold{.size = text_size(22), .color = color, .bold = true};
  const double right = strip.strip.x + strip.strip.width - 6 * scale;
  const double room = right - plot.x - plot.width - 10 * scale;
  // By the longest there can be, so that all panels' are of one size.
  const double widest =
      std::max(text_width("≤ 88.8 mm", bold),
               strip.axis.is_logarithmic ? 0 : text_width(fmt::format("−0.888 {}", strip.axis.unit), bold));
  if (widest > room) bold.size *= room / widest;
  draw_text(image, right - text_width(value, bold), baseline(strip.strip.y, strip.strip.height, bold.size),
            value, bold);
}

}  // namespace substep::render
