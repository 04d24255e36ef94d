#include "render/video/strip_axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "sim/error.h"

namespace substep::render {

namespace {

struct Unit {
  double size;
  std::string_view name;
};

/// Returns three digits of `value` in the largest of the units, which fall, that it reaches; "" below all.
std::string in_units(double value, std::span<const Unit> units) {
  for (const Unit& unit : units) {
    const double count = value / unit.size;
    // 0.9995 would print as 1.00 of this unit; below, the next smaller unit serves.
    if (count >= 0.9995) {
      return fmt::format("{:.{}f} {}", count, count < 9.995 ? 2 : count < 99.95 ? 1 : 0, unit.name);
    }
  }
  return "";
}

}  // namespace

std::string length_label(double metres) {
  constexpr std::array<Unit, 4> units{{{1e3, "km"}, {1, "m"}, {1e-3, "mm"}, {1e-6, "µm"}}};
  if (metres >= 1e6) return "> 1000 km";
  const std::string text = in_units(metres, units);
  return !text.empty() ? text : metres > 0 ? "< 1 µm" : "0";
}

std::string error_label(double metres, double certain) {
  if (metres >= certain) return length_label(metres);
  const std::string bound = length_label(certain);
  return bound.starts_with('<') ? bound : "≤ " + bound;
}

double ErrorScale::height(double metres) const {
  const double smallest = std::pow(10.0, lower);
  const double decades = std::log10(std::max(metres, smallest)) - lower;
  return std::min(1.0, decades / (upper - lower));
}

namespace {

/// Decades that hold the values but for the smallest few and what has exploded.
ErrorScale decades_of(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !(value > 0); });
  ErrorScale scale;
  if (values.empty()) return scale;
  std::sort(values.begin(), values.end());
  // A run that explodes, and the first instants in which all agree, would press the rest into a line.
  const double high = std::min(values.back(), 100.0);
  const double low = std::max(values[values.size() / 20], 1e-6);
  scale.upper = static_cast<int>(std::ceil(std::log10(high) - 1e-9));
  scale.upper = std::max(scale.upper, -4);
  scale.lower =
      std::clamp(static_cast<int>(std::floor(std::log10(low) + 1e-9)), scale.upper - 5, scale.upper - 2);
  return scale;
}

/// The next of 1, 2, 5, 10, … away from 0.
double rounded_out(double value) {
  if (value == 0) return 0;
  const double ten = std::pow(10.0, std::floor(std::log10(std::abs(value)) + 1e-9));
  for (const double step : {1.0, 2.0, 5.0, 10.0}) {
    if (std::abs(value) <= step * ten * (1 + 1e-9)) return std::copysign(step * ten, value);
  }
  return value;
}

}  // namespace

ErrorScale error_scale(const Comparison& comparison) {
  std::vector<double> errors;
  for (const Run& run : comparison.runs) errors.insert(errors.end(), run.errors.begin(), run.errors.end());
  return decades_of(std::move(errors));
}

std::string energy_label(double joules) {
  constexpr std::array<Unit, 5> units{{{1e6, "MJ"}, {1e3, "kJ"}, {1, "J"}, {1e-3, "mJ"}, {1e-6, "µJ"}}};
  if (!(std::abs(joules) < 1e9)) return joules > 0 ? "> 1000 MJ" : "< −1000 MJ";
  const std::string text = in_units(std::abs(joules), units);
  return text.empty() ? "0 J" : fmt::format("{}{}", joules < 0 ? "−" : "+", text);
}

double StripAxis::height(double value) const {
  if (is_logarithmic) return decades.height(value);
  return std::clamp((value - low) / (high - low), 0.0, 1.0);
}

StripAxis axis_of(const Comparison& comparison, Strip strip) {
  StripAxis axis;
  std::vector<double> values;
  for (const Run& run : comparison.runs) {
    const std::vector<double>& of = strip == Strip::error ? run.errors
                                    : strip == Strip::gap ? run.readings.gaps
                                                          : run.readings.energies;
    values.insert(values.end(), of.begin(), of.end());
  }
  if (strip != Strip::energy) {
    axis.decades = decades_of(std::move(values));
    return axis;
  }
  axis.is_logarithmic = false;
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  std::sort(values.begin(), values.end());
  // One run that explodes must not press the rest into a line: it is clipped where it leaves the most that
  // nine tenths of the values need.
  const double calm =
      values.empty() ? 1 : std::max(values[values.size() * 9 / 10], -values[values.size() / 10]);
  const double most = 5 * std::max(calm, 1e-9);
  axis.low = values.empty() ? -1 : rounded_out(std::clamp(values.front(), -most, 0.0));
  axis.high = values.empty() ? 1 : rounded_out(std::clamp(values.back(), 0.0, most));
  // Room for the line of the start.
  const double span = axis.high - axis.low;
  if (!(span > 0)) return {false, {}, -1, 1};
  if (axis.high == 0) axis.high = 0.1 * span;
  if (axis.low == 0) axis.low = -0.1 * span;
  return axis;
}

std::vector<Strip> strips_named(const std::vector<std::string>& names) {
  std::vector<Strip> strips;
  for (const std::string& name : names) {
    const Strip strip = name == "error" ? Strip::error
                        : name == "gap" ? Strip::gap
                        : name == "energy"
                            ? Strip::energy
                            : throw Error(fmt::format("--strip '{}': give some of error, gap, energy", name));
    if (std::ranges::find(strips, strip) == strips.end()) strips.push_back(strip);
  }
  return strips;
}

}  // namespace substep::render
