#include "render/video/strips.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "render/text.h"
#include "render/video/titles.h"
#include "sim/error.h"

namespace substep::render {

using namespace film_colors;

namespace {

struct StripKind {
  const char* name;
  const char* about;
  std::vector<double> FrameQuantities::*values;
};

/// Returns the kind of a strip. Errors are not among a run's quantities.
const StripKind& kind_of(Strip strip) {
  static constexpr std::array<StripKind, 5> kinds{
      {{"error", "", nullptr},
       {"gap", "largest gap of a joint", &FrameQuantities::gaps},
       {"energy", "energy since the start", &FrameQuantities::energies},
       {"depth", "deepest penetration", &FrameQuantities::deepest},
       {"expected", "", &FrameQuantities::expected}}};
  return kinds.at(static_cast<std::size_t>(strip));
}

/// Returns an axis of decades that hold the values, without the smallest 5 % and those above 100 m.
StripAxis logarithmic_axis(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !(value > 0); });
  StripAxis scale;
  if (values.empty()) return scale;
  std::sort(values.begin(), values.end());
  // A run that explodes, and the first instants in which all agree, would press the rest into a line.
  const double high = std::min(values.back(), 100.0);
  const double low = std::max(values[values.size() / 20], 1e-6);
  scale.upper = std::max(static_cast<int>(std::ceil(std::log10(high) - 1e-9)), -4);
  scale.lower =
      std::clamp(static_cast<int>(std::floor(std::log10(low) + 1e-9)), scale.upper - 5, scale.upper - 2);
  return scale;
}

/// Returns whether the expected value is a distance that should be 0, which decades show.
bool is_deviation(const Expectation& expectation) {
  return expectation.value == 0 &&
         (expectation.quantity == Quantity::displacement || expectation.quantity == Quantity::joint_gap);
}

double plot_x(const StripPainter& painter, const StripBox& strip, std::size_t k) {
  const std::size_t last = std::max<std::size_t>(1, painter.comparison.times.size() - 1);
  return strip.plot.x + static_cast<double>(k) / static_cast<double>(last) * strip.plot.width;
}

double plot_y(const StripBox& strip, double value) {
  return strip.plot.y + strip.plot.height * (1 - std::max(0.0, strip.axis.height(value)));
}

/// Draws the lines of the axis with their labels, and the strip's name.
void draw_grid(const StripPainter& painter, Image& image, const StripBox& strip) {
  const Box& plot = strip.plot;
  const double scale = painter.scale;
  const TextStyle style{.size = painter.text_size(14), .color = quiet};
  const auto draw_level = [&](double y, const Color& color, const std::string& label, double offset) {
    draw_line(image, plot.x, y, plot.x + plot.width, y, 1, color);
    if (!painter.has_axis || label.empty()) return;
    draw_text(image, plot.x - std::max(3.0, 5 * scale) - text_width(label, style),
              y + 0.31 * style.size + offset, label, style);
  };
  const StripAxis& axis = strip.axis;
  if (!axis.is_logarithmic) {
    for (const double value : {axis.low, axis.high, axis.mark}) {
      const double y = plot_y(strip, value);
      // Label the mark alone where it is near an end: curves are read against the mark.
      const bool is_labelled = value == axis.mark || std::abs(y - plot_y(strip, axis.mark)) > style.size;
      draw_level(y, value == axis.mark ? quiet : grid, is_labelled ? axis.label(value) : "", 0);
    }
  } else {
    const int decades = axis.upper - axis.lower;
    for (int decade = 0; decade <= decades; ++decade) {
      constexpr std::array<const char*, 10> names{"1 µm",  "10 µm", "0.1 mm", "1 mm",  "1 cm",
                                                  "10 cm", "1 m",   "10 m",   "100 m", "1 km"};
      // Label the top and the bottom alone, for want of room.
      const bool is_end = decade == 0 || decade == decades;
      draw_level(plot.y + plot.height * (1 - static_cast<double>(decade) / decades), grid,
                 is_end ? names.at(static_cast<std::size_t>(axis.lower + decade + 6)) : "",
                 decade == 0 ? -1 * scale : scale);
    }
  }
  if (!painter.has_names) return;
  const std::string name = name_of(strip.kind);
  draw_text(image, strip.strip.x + strip.strip.width - 6 * scale - text_width(name, style),
            strip.strip.y + 1.05 * style.size, name, style);
}

/// Shades the errors below the reference's own uncertainty, and marks the reference's end.
void draw_certainty(const StripPainter& painter, Image& image, const StripBox& strip) {
  const ReferenceRun& reference = *painter.comparison.reference;
  const Box& plot = strip.plot;
  const double bottom = plot.y + plot.height;
  for (std::size_t k = 0; k + 1 < reference.known; ++k) {
    const int left = static_cast<int>(std::lround(plot_x(painter, strip, k)));
    const int right = static_cast<int>(std::lround(plot_x(painter, strip, k + 1)));
    const double error = std::max(reference.uncertainty[k], reference.uncertainty[k + 1]);
    const int top = static_cast<int>(std::lround(plot_y(strip, error)));
    fill_rectangle(image, left, top, right - left, static_cast<int>(bottom) - top, quiet, 0.25);
  }
  if (reference.known == painter.comparison.times.size()) return;
  const double end = plot_x(painter, strip, reference.known);
  draw_line(image, end, plot.y, end, bottom, std::max(1.5, 2 * painter.scale), alarm);
  const TextStyle style{.size = painter.text_size(14), .color = quiet};
  const std::string text = "reference ends";
  if (text_width(text, style) + 8 * painter.scale > plot.x + plot.width - end) return;
  draw_text(image, end + 5 * painter.scale, baseline(plot.y, plot.height, style.size), text, style);
}

/// Draws the names of the curves in the reference's strip, in as many lines as there is room for, and as
/// large as fits or as small as can be read.
void draw_key(const StripPainter& painter, Image& image, const StripBox& strip) {
  const Box& box = strip.strip;
  std::vector<std::pair<std::string, Color>> names;
  for (const Run& run : painter.comparison.runs) {
    std::pair<std::string, Color> entry{curve_name(painter.comparison.runs, run.panel), accent(run.panel)};
    if (!run.is_reference() && std::ranges::find(names, entry) == names.end()) names.push_back(entry);
  }
  TextStyle style{.size = std::max(9.0, 12 * painter.scale), .bold = true};
  const double right = box.x + box.width;
  std::size_t lines = 1;
  std::vector<double> lefts;
  const auto fits = [&] {
    lines = std::max<std::size_t>(1, static_cast<std::size_t>(box.height / style.size));
    lefts.clear();
    double x = strip.plot.x + strip.plot.width + 8 * painter.scale;
    double column = 0;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (i > 0 && i % lines == 0) x += std::exchange(column, 0) + 6 * painter.scale;
      lefts.push_back(x);
      column = std::max(column, text_width(names[i].first, style));
    }
    return x + column <= right;
  };
  while (!fits() && style.size > 9) style.size *= 0.97;
  const double pitch = static_cast<double>(box.height) / static_cast<double>(lines);
  for (std::size_t i = 0; i < names.size(); ++i) {
    style.color = names[i].second;
    draw_text(image, lefts[i], baseline(box.y + static_cast<double>(i % lines) * pitch, pitch, style.size),
              cut(names[i].first, style, right - lefts[i]), style);
  }
}

/// Draws a run's curve up to frame `end`.
void draw_curve(const StripPainter& painter, Image& image, const StripBox& strip, std::size_t run,
                std::size_t end, const Color& color, bool dashed) {
  const std::vector<double>& values = series_of(painter.comparison.runs[run], strip.kind);
  const double width = std::max(1.2, 1.8 * painter.scale);
  const Dash dash = dash_of(dashed ? run : 0);
  const double period = (dash.drawn + dash.left_out) * std::max(0.6, painter.scale);
  const double drawn = dash.drawn * std::max(0.6, painter.scale);
  double from = 0;  // along the curve, since its beginning
  for (std::size_t k = 1; k < std::min(end + 1, values.size()); ++k) {
    const double x0 = plot_x(painter, strip, k - 1);
    const double y0 = plot_y(strip, values[k - 1]);
    const double dx = plot_x(painter, strip, k) - x0;
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

/// Draws triangles at the top where the curve continues above it, and at the bottom where below.
void draw_clipped(const StripPainter& painter, Image& image, const StripBox& strip, std::size_t run,
                  std::size_t end) {
  const std::vector<double>& values = series_of(painter.comparison.runs[run], strip.kind);
  const StripAxis& axis = strip.axis;
  const double top = axis.is_logarithmic ? std::pow(10.0, axis.upper) : axis.high;
  const double bottom = axis.is_logarithmic ? 0 : axis.low;
  const double least = 1e-6 * (top - bottom);  // beyond an end that is rounded
  const TextStyle style{.size = std::max(8.0, 11 * painter.scale),
                        .color = accent(painter.comparison.runs[run].panel)};
  double last = -1e9;
  for (std::size_t k = 0; k < std::min(end + 1, values.size()); ++k) {
    const double x = plot_x(painter, strip, k);
    const bool is_above = values[k] > top + least;
    if ((!is_above && !(values[k] < bottom - least)) || x < last + 40 * painter.scale) continue;
    last = x;
    const char* const mark = is_above ? "▲" : "▼";
    const double y = is_above ? 0.1 * style.size : strip.plot.height + 0.55 * style.size;
    draw_text(image, last - text_width(mark, style) / 2, strip.plot.y + y, mark, style);
  }
}

}  // namespace

std::vector<Strip> strips_named(const std::vector<std::string>& names) {
  std::vector<Strip> strips;
  for (const std::string& name : names) {
    constexpr std::array all{Strip::error, Strip::gap, Strip::energy, Strip::depth, Strip::expected};
    const auto found = std::ranges::find_if(all, [&](Strip each) { return name == kind_of(each).name; });
    if (found == all.end())
      throw Error("--strip '{}': give some of error, gap, energy, depth, expected", name);
    if (std::ranges::find(strips, *found) == strips.end()) strips.push_back(*found);
  }
  return strips;
}

std::string words_of(const Comparison& comparison, Strip strip) {
  if (strip == Strip::error)
    return fmt::format("RMS distance from the reference ({})", comparison.reference->method);
  if (strip != Strip::expected) return kind_of(strip).about;
  const Expectation& expectation = *comparison.expected;
  const char* const bound = expectation.bound == Bound::at_most    ? "at most "
                            : expectation.bound == Bound::at_least ? "at least "
                                                                   : "";
  return fmt::format("{} (expected: {}{:.3g} {})", expectation.name, bound, expectation.value,
                     unit_of(expectation));
}

std::string name_of(Strip strip) {
  return kind_of(strip).name;
}

Dash dash_of(std::size_t run) {
  constexpr std::array<Dash, 5> dashes{{{1, 0}, {14, 3}, {9, 6}, {5, 8}, {2.5, 9}}};
  return dashes.at(run % dashes.size());
}

const std::vector<double>& series_of(const Run& run, Strip strip) {
  return strip == Strip::error ? run.errors : run.quantities.*kind_of(strip).values;
}

double rounded_out(double value) {
  if (value == 0) return 0;
  const double ten = std::pow(10.0, std::floor(std::log10(std::abs(value)) + 1e-9));
  for (const double step : {1.0, 2.0, 5.0, 10.0}) {
    if (std::abs(value) <= step * ten * (1 + 1e-9)) return std::copysign(step * ten, value);
  }
  return value;
}

double StripAxis::height(double value) const {
  if (!is_logarithmic) return std::clamp((value - low) / (high - low), 0.0, 1.0);
  const double decades = std::log10(std::max(value, std::pow(10.0, lower))) - lower;
  return std::min(1.0, decades / (upper - lower));
}

std::string StripAxis::label(double value) const {
  if (is_logarithmic) return length_label(value);
  if (unit == "J") return energy_label(value);
  const double size = std::abs(value);
  if (!(size < 1e6)) return fmt::format("{}10⁶ {}", value < 0 ? "< −" : "> ", unit);
  const std::string digits = size < 999.5 ? fmt::format("{:.3g}", size) : fmt::format("{:.0f}", size);
  return fmt::format("{}{} {}", value < 0 ? "−" : "", digits, unit);
}

StripAxis axis_of(const Comparison& comparison, Strip strip) {
  std::vector<double> values;
  for (const Run& run : comparison.runs) {
    const std::vector<double>& of_run = series_of(run, strip);
    values.insert(values.end(), of_run.begin(), of_run.end());
  }
  const bool is_linear = strip == Strip::energy || (strip == Strip::expected && comparison.expected &&
                                                    !is_deviation(*comparison.expected));
  if (!is_linear) return logarithmic_axis(std::move(values));
  StripAxis axis{.is_logarithmic = false, .unit = "J"};
  if (strip == Strip::expected) {
    axis.mark = comparison.expected->value;
    axis.unit = unit_of(*comparison.expected);
  }
  for (double& value : values) value -= axis.mark;
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  std::sort(values.begin(), values.end());
  // Clip at five times the range of nine tenths of the values, unless these are rounding alone: a run that
  // explodes would press the rest into a line.
  const double calm =
      values.empty() ? 1 : std::max(values[values.size() * 9 / 10], -values[values.size() / 10]);
  const double most = calm > 1e-6 ? 5 * calm : 1e9;
  double low = values.empty() ? -1 : rounded_out(std::clamp(values.front(), -most, 0.0));
  double high = values.empty() ? 1 : rounded_out(std::clamp(values.back(), 0.0, most));
  // Leave room for the line of the mark.
  const double span = high - low;
  if (!(span > 0)) {
    low = -1;
    high = 1;
  } else {
    if (high == 0) high = 0.1 * span;
    if (low == 0) low = -0.1 * span;
  }
  axis.low = axis.mark + low;
  axis.high = axis.mark + high;
  return axis;
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

void StripPainter::draw_ground(Image& image, const StripBox& strip, std::size_t run, bool has_key) const {
  const Box& box = strip.strip;
  fill_rectangle(image, box.x, box.y, box.width, box.height, surface);
  draw_grid(*this, image, strip);
  if (strip.kind == Strip::error) draw_certainty(*this, image, strip);
  if (comparison.runs[run].is_reference() && has_key) draw_key(*this, image, strip);
}

void StripPainter::draw(Image& image, const StripBox& strip, std::size_t run, std::size_t k) const {
  const Box& plot = strip.plot;
  const Run& shown = comparison.runs[run];
  const double cursor = plot_x(*this, strip, k);
  draw_line(image, cursor, plot.y, cursor, plot.y + plot.height, std::max(1.0, scale), bright, 0.45);
  // Compare all other runs in the reference's strip, which has no error.
  if (shown.is_reference()) {
    for (std::size_t other = 0; other < comparison.runs.size(); ++other) {
      draw_curve(*this, image, strip, other, k, accent(comparison.runs[other].panel), true);
      draw_clipped(*this, image, strip, other, k);
    }
    return;
  }
  const Color color = accent(shown.panel);
  const std::vector<double>& values = series_of(shown, strip.kind);
  draw_curve(*this, image, strip, run, values.size(), faded(color), false);
  draw_curve(*this, image, strip, run, k, color, false);
  draw_clipped(*this, image, strip, run, k);
  if (k >= values.size()) return;
  const int dot = std::max(2, static_cast<int>(std::lround(5 * scale)));
  fill_rectangle(image, static_cast<int>(std::lround(cursor - 0.5 * dot)),
                 static_cast<int>(std::lround(plot_y(strip, values[k]) - 0.5 * dot)), dot, dot, color);
  // Write the value, in the size at which the longest possible one fits: the same in all panels.
  const std::string value = strip.kind == Strip::error
                                ? error_label(values[k], comparison.reference->uncertainty[k])
                                : strip.axis.label(values[k]);
  TextStyle bold{.size = text_size(22), .color = color, .bold = true};
  const double right = strip.strip.x + strip.strip.width - 6 * scale;
  const double room = right - plot.x - plot.width - 10 * scale;
  const double widest =
      std::max(text_width("≤ 88.8 mm", bold),
               strip.axis.is_logarithmic ? 0 : text_width(fmt::format("−0.888 {}", strip.axis.unit), bold));
  if (widest > room) bold.size *= room / widest;
  draw_text(image, right - text_width(value, bold), baseline(strip.strip.y, strip.strip.height, bold.size),
            value, bold);
}

}  // namespace substep::render
