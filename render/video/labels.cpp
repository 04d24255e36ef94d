#include "render/video/labels.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>

#include "render/video/titles.h"

namespace substep::render {
namespace {

struct Unit {
  double size;
  std::string_view name;
};

/// Returns three digits of `value` in the first unit that it reaches, of units in falling order; ""
/// below all units.
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

/// Returns why a run ended early and its number of unsolved steps; "" for a whole run.
std::string end_of(const Run& run) {
  std::string text = run.refusal;
  if (run.diverged) text = fmt::format("diverged at t = {:.2f} s", *run.diverged);
  if (run.unsolved > 0) {
    text += fmt::format("{}{} steps not solved to the accuracy asked for", text.empty() ? "" : "; ",
                        run.unsolved);
  }
  return text;
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

std::string energy_label(double joules) {
  constexpr std::array<Unit, 5> units{{{1e6, "MJ"}, {1e3, "kJ"}, {1, "J"}, {1e-3, "mJ"}, {1e-6, "µJ"}}};
  if (!(std::abs(joules) < 1e9)) return joules > 0 ? "> 1000 MJ" : "< −1000 MJ";
  const std::string text = in_units(std::abs(joules), units);
  return text.empty() ? "0 J" : fmt::format("{}{}", joules < 0 ? "−" : "+", text);
}

TextTable table_of(const Comparison& comparison, bool with_times) {
  TextTable table{{"", "RMS error", "at the end", "row solves"}, {}};
  if (with_times) table.head.emplace_back("CPU, ms a simulated second");
  const bool has_ends =
      std::ranges::any_of(comparison.runs, [](const Run& run) { return !end_of(run).empty(); });
  if (has_ends) table.head.emplace_back();
  for (const Run& run : comparison.runs) {
    if (run.is_reference()) continue;
    const bool has_errors = !run.errors.empty();
    std::string title = fmt::format("{}  {}", name_of(run.panel), settings_of(run.panel));
    if (!run.panel.title.empty()) title += "  " + run.panel.title;
    std::vector<std::string>& cells = table.rows.emplace_back();
    cells = {title, has_errors ? length_label(run.rms_error) : "–",
             has_errors ? length_label(run.errors.back()) : "–",
             run.row_solves > 0 ? fmt::format("{}", run.row_solves) : "–"};
    if (with_times) {
      cells.push_back(run.simulated > 0 ? fmt::format("~{:.2g}", 1000 * run.cpu_time / run.simulated) : "–");
    }
    if (has_ends) cells.push_back(end_of(run));
  }
  return table;
}

std::string words_on_reference(const Comparison& comparison) {
  if (!comparison.reference) return "";
  const ReferenceRun& reference = *comparison.reference;
  std::string text =
      fmt::format("Errors are RMS distances of the bodies’ points from the reference: {}", reference.method);
  if (reference.is_a1) text += "; that of A1 is from its own smaller steps";
  if (!reference.uncertainty.empty()) {
    const double uncertain = std::ranges::max(reference.uncertainty);
    text += fmt::format("; known to {}", uncertain > 0 ? length_label(uncertain) : "< 1 µm");
  }
  if (reference.known == 0) return text + fmt::format("; {}: there are none.", reference.fate);
  if (reference.fate.empty()) return text + ".";
  return text + fmt::format("; {}: they are those up to {:.2f} s.", reference.fate,
                            comparison.times[reference.known - 1]);
}

}  // namespace substep::render
