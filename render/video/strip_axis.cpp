#include "render/video/strip_axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
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

const std::vector<double>& series_of(const Run& run, Strip strip) {
  switch (strip) {
    case Strip::error:
      return run.errors;
    case Strip::gap:
      return run.readings.gaps;
    case Strip::energy:
      return run.readings.energies;
    case Strip::depth:
      return run.readings.deepest;
    case Strip::expected:
      break;
  }
  return run.readings.expected;
}

double StripAxis::height(double value) const {
  if (is_logarithmic) return decades.height(value);
  return std::clamp((value - low) / (high - low), 0.0, 1.0);
}

std::string StripAxis::label(double value) const {
  if (is_logarithmic) return length_label(value);
  if (unit == "J") return energy_label(value);
  if (!(std::abs(value) < 1e6)) return fmt::format("{}10⁶ {}", value > 0 ? "> " : "< −", unit);
  return fmt::format("{}{:.3g} {}", value < 0 ? "−" : "", std::abs(value), unit);
}

namespace {

/// Returns whether what is expected is a distance that should be 0: decades show it.
bool is_deviation(const Expectation& expectation) {
  return expectation.value == 0 &&
         (expectation.quantity == Quantity::displacement || expectation.quantity == Quantity::joint_gap);
}

}  // namespace

StripAxis axis_of(const Comparison& comparison, Strip strip) {
  StripAxis axis;
  std::vector<double> values;
  for (const Run& run : comparison.runs) {
    const std::vector<double>& of = series_of(run, strip);
    values.insert(values.end(), of.begin(), of.end());
  }
  const bool is_linear = strip == Strip::energy || (strip == Strip::expected && comparison.expected &&
                                                    !is_deviation(*comparison.expected));
  if (!is_linear) {
    axis.decades = decades_of(std::move(values));
    return axis;
  }
  axis.is_logarithmic = false;
  axis.unit = "J";
  if (strip == Strip::expected) {
    const Expectation& expectation = *comparison.expected;
    axis.mark = expectation.value;
    axis.unit = unit_of(expectation);
  }
  for (double& value : values) value -= axis.mark;
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  std::sort(values.begin(), values.end());
  // One run that explodes must not press the rest into a line: it is clipped where it leaves the most that
  // nine tenths of the values need.
  const double calm =
      values.empty() ? 1 : std::max(values[values.size() * 9 / 10], -values[values.size() / 10]);
  const double most = 5 * std::max(calm, 1e-9);
  double low = values.empty() ? -1 : rounded_out(std::clamp(values.front(), -most, 0.0));
  double high = values.empty() ? 1 : rounded_out(std::clamp(values.back(), 0.0, most));
  // Room for the line of the mark.
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

std::string name_of(Strip strip) {
  constexpr std::array<const char*, 5> names{"error", "gap", "energy", "depth", "expected"};
  return names[static_cast<std::size_t>(strip)];
}

std::string words_of(const Comparison& comparison, Strip strip) {
  switch (strip) {
    case Strip::error:
      return fmt::format("RMS distance from the reference ({})", comparison.reference->method);
    case Strip::gap:
      return "largest gap of a joint";
    case Strip::energy:
      return "energy since the start";
    case Strip::depth:
      return "deepest penetration";
    case Strip::expected:
      break;
  }
  const Expectation& expectation = *comparison.expected;
  const char* const bound = expectation.bound == Bound::at_most    ? "at most "
                            : expectation.bound == Bound::at_least ? "at least "
                                                                   : "";
  return fmt::format("{} (expected: {}{:.3g} {})", expectation.name, bound, expectation.value,
                     unit_of(expectation));
}

std::vector<Strip> strips_named(const std::vector<std::string>& names) {
  std::vector<Strip> strips;
  for (const std::string& name : names) {
    std::optional<Strip> found;
    for (const Strip each : {Strip::error, Strip::gap, Strip::energy, Strip::depth, Strip::expected}) {
      if (name == name_of(each)) found = each;
    }
    if (!found)
      throw Error(fmt::format("--strip '{}': give some of error, gap, energy, depth, expected", name));
    const Strip strip = *found;
    if (std::ranges::find(strips, strip) == strips.end()) strips.push_back(strip);
  }
  return strips;
}

}  // namespace substep::render
