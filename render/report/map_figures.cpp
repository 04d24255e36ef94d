#include "render/report/map_figures.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "render/report/looks.h"
#include "sim/study/advice.h"
#include "sim/study/sweep_results.h"

namespace substep::report {
namespace {

using Axes = std::array<double, 2> (*)(const Settings& settings);

/// The runs of a scene that differ in two settings alone.
struct MappedRuns {
  std::vector<SweepRecord> runs;
  std::array<std::set<double>, 2> values;
};

/// `without`: the settings with those two as in all others. Groups with fewer than `least` values are left
/// out.
std::vector<MappedRuns> mapped_runs(const std::vector<SweepRecord>& records, Axes axes,
                                    Settings (*without)(Settings settings), std::size_t least) {
  std::vector<MappedRuns> maps;
  std::map<std::string, std::size_t> index;
  for (const SweepRecord& record : records) {
    const Settings& s = record.settings;
    if (!is_own_run(record) || s.algorithm < Algorithm::a3 || !is_of_report(s.algorithm)) continue;
    const auto [at, is_new] = index.try_emplace(record.scene + label(without(s)), maps.size());
    if (is_new) maps.emplace_back();
    MappedRuns& map = maps[at->second];
    map.runs.push_back(record);
    for (std::size_t i = 0; i < 2; ++i) map.values[i].insert(axes(s)[i]);
  }
  std::erase_if(maps, [least](const MappedRuns& map) {
    return map.values[0].size() < least || map.values[1].size() < least;
  });
  return maps;
}

Panel panel_of(const MappedRuns& map, Axes axes) {
  Series good{"error below 1 % of the size", good_mark, {}};
  Series fair{"bounded", fair_mark, {}};
  Series lost{"not bounded", lost_mark, {}};
  for (const SweepRecord& run : map.runs) {
    const double miss = miss_of(run);
    Series& series = !run.metrics->bounded ? lost : miss < 0.01 ? good : fair;
    series.points.push_back(axes(run.settings));
    series.values.push_back(miss);
  }
  Panel panel;
  for (Series* const series : {&good, &fair, &lost}) {
    if (!series->points.empty()) panel.series.push_back(std::move(*series));
  }
  return panel;
}

/// A range around the values, and gnuplot's tics at them.
void set_values(Axis& axis, const std::set<double>& values, std::string (*text)(double value)) {
  std::vector<std::string> tics;
  for (const double value : values) tics.push_back(fmt::format("\"{}\" {:.12g}", text(value), value));
  axis.tics = fmt::format("({})", fmt::join(tics, ", "));
  const double low = *values.begin();
  const double high = *values.rbegin();
  const double margin = axis.logarithmic ? std::pow(high / low, 0.1) : 0.1 * (high - low);
  axis.range =
      axis.logarithmic ? std::array{low / margin, high * margin} : std::array{low - margin, high + margin};
}

constexpr const char* caption =
    "Error: RMS over the scene's size while the reference lasts; where it diverges at once, the largest "
    "joint gap or "
    "overlap. Bounded: see 'What stays bounded'. The .csv has each run's error as its value.";

}  // namespace

Sheet step_map_sheet(const FigureSource& source) {
  const Axes axes = [](const Settings& s) { return std::array{static_cast<double>(s.substeps), s.step}; };
  const auto without = [](Settings s) {
    s.substeps = 1;
    s.step = 1;
    return s;
  };
  Sheet sheet;
  sheet.title = "Sub-steps n against the step h";
  for (const MappedRuns& map : mapped_runs(source.records, axes, without, 2)) {
    const SweepRecord& first = map.runs.front();
    Panel panel = panel_of(map, axes);
    panel.title = fmt::format("{}: {}", first.scene, title_of(first.settings.algorithm));
    panel.x = {"n", true, {}, {}};
    panel.y = {"h, s", true, {}, {}};
    set_values(panel.x, map.values[0], [](double n) { return fmt::format("{:g}", n); });
    set_values(panel.y, map.values[1], [](double h) { return fmt::format("1/{:.6g}", 1 / h); });
    sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {caption};
  return sheet;
}

Sheet factor_map_sheet(const FigureSource& source) {
  const Axes axes = [](const Settings& s) { return std::array{s.kappa, s.tau}; };
  const auto without = [](Settings s) {
    if (s.contact_tau == 0 && s.contact_kappa == 0) s.tau = s.kappa = 1;
    return s;
  };
  Sheet sheet;
  sheet.title = "τ against κ, of joints and contacts alike";
  for (const MappedRuns& map : mapped_runs(source.records, axes, without, 3)) {
    const SweepRecord& first = map.runs.front();
    Panel panel = panel_of(map, axes);
    panel.title =
        fmt::format("{}: {}, n = {}, h = 1/{:.6g} s", first.scene, title_of(first.settings.algorithm),
                    first.settings.substeps, 1 / first.settings.step);
    panel.x = {"κ", false, {}, {}};
    panel.y = {"τ", false, {}, {}};
    const auto text = [](double value) { return fmt::format("{:g}", value); };
    set_values(panel.x, map.values[0], text);
    set_values(panel.y, map.values[1], text);
    sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {caption};
  return sheet;
}

}  // namespace substep::report
