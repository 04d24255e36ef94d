// Tables of the behaviour of runs: limits, orders, energy, springs, and values that miss known ones.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "render/report/report_tables.h"
#include "sim/measure/validity_maps.h"
#include "sim/model/settings_fields.h"
#include "sim/study/sweep_results.h"

namespace substep::report {
namespace {

/// Returns a stability limit: "n = 4", "m = 5", "n > 64", "h", "h/8" or "below h/64".
std::string limit_text(const SweepRecord& record) {
  const StabilityLimit& limit = *record.limit;
  const bool divides_step = record.settings.algorithm < Algorithm::a3;
  const char* const count = record.settings.algorithm == Algorithm::avbd ? "m" : "n";
  if (limit.divisions == 0)
    return divides_step ? fmt::format("below h/{}", limit.most) : fmt::format("{} > {}", count, limit.most);
  if (!divides_step) return fmt::format("{} = {}", count, limit.divisions);
  return limit.divisions == 1 ? "h" : fmt::format("h/{}", limit.divisions);
}

/// Returns our families of one scene's records, without other engines.
std::vector<RunFamily> own_families(const std::vector<SweepRecord>& records) {
  std::vector<RunFamily> families = families_of(records);
  std::erase_if(families, [](const RunFamily& family) { return !family.runs.front().engine.empty(); });
  return families;
}

/// Returns the run of each family of ours with the most row solves, up to 1.05 times those of A3 to A5 with
/// 16 sub-steps (or with the most below 16).
std::vector<std::pair<std::string, SweepRecord>> at_equal_rows(const std::vector<SweepRecord>& own) {
  const std::vector<RunFamily> families = own_families(own);
  std::int64_t most = 0;
  for (const RunFamily& family : families) {
    for (const SweepRecord& run : family.runs) {
      const Settings& s = run.settings;
      if (s.algorithm >= Algorithm::a3 && is_of_report(s.algorithm) && s.substeps <= 16)
        most = std::max(most, run.metrics->row_solves);
    }
  }
  std::vector<std::pair<std::string, SweepRecord>> chosen;
  for (const RunFamily& family : families) {
    const SweepRecord* best = nullptr;
    for (const SweepRecord& run : family.runs) {
      // Allow a twentieth more: contacts differ from run to run by a few rows.
      if (static_cast<double>(run.metrics->row_solves) > 1.05 * static_cast<double>(most)) continue;
      if (!best || run.metrics->row_solves > best->metrics->row_solves) best = &run;
    }
    if (best) chosen.emplace_back(family.title, *best);
  }
  return chosen;
}

/// Returns the cell of a row under a title, which is added to the head when it is new.
std::string& cell(TextTable& table, std::vector<std::string>& row, const std::string& title) {
  auto found = std::ranges::find(table.head, title);
  if (found == table.head.end()) found = table.head.insert(table.head.end(), title);
  row.resize(std::max(row.size(), table.head.size()));
  return row[static_cast<std::size_t>(found - table.head.begin())];
}

/// Makes all rows as long as the head.
void fill(TextTable& table) {
  for (auto& row : table.rows) row.resize(table.head.size());
}

bool is_judged(const SweepRecord& record) {
  return is_own_run(record) && !record.metrics->expected.empty();
}

}  // namespace

TextTable limits_table(const std::vector<SweepRecord>& records, bool contacts) {
  TextTable table{{"scene"}, {}};
  const auto title = [](const SweepRecord& record) {
    const Settings& s = record.settings;
    std::string text(title_of(s.algorithm));
    const std::string_view searched = s.algorithm == Algorithm::avbd ? "iterations" : "substeps";
    for (const SettingsPart& part : parts_of(s)) {
      if (part.field->name != searched && part.field->name != "step") text += " " + part.text;
    }
    return text;
  };
  std::map<std::string, std::map<std::string, std::string>> cells;
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    if (has_contacts(own) != contacts) continue;
    for (const SweepRecord& record : own) {
      if (!record.limit) continue;
      if (std::ranges::find(table.head, title(record)) == table.head.end())
        table.head.push_back(title(record));
      cells[scene][title(record)] = limit_text(record);
    }
  }
  std::sort(table.head.begin() + 1, table.head.end());
  for (auto& [scene, by_title] : cells) {
    std::vector<std::string> row{scene};
    for (std::size_t i = 1; i < table.head.size(); ++i) row.push_back(by_title[table.head[i]]);
    table.rows.push_back(std::move(row));
  }
  return table;
}

TextTable orders_table(const std::vector<SweepRecord>& records) {
  TextTable table{{"scene"}, {}};
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    if (has_contacts(own)) continue;
    std::vector<std::string> row{scene};
    for (const RunFamily& family : own_families(own)) {
      const auto order = measured_order(family.runs);
      cell(table, row, family.title) = order ? fmt::format("{:.2f}", *order) : "";
    }
    const auto is_filled = [](const std::string& text) { return !text.empty(); };
    if (std::any_of(row.begin() + 1, row.end(), is_filled)) table.rows.push_back(std::move(row));
  }
  fill(table);
  return table;
}

TextTable energy_table(const std::vector<SweepRecord>& records) {
  TextTable table{{"scene", "over, s"}, {}};
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    if (has_contacts(own)) continue;
    std::vector<std::string> row{scene, fmt::format("{:g}", own.front().duration)};
    const auto runs = at_equal_rows(own);
    for (const auto& [title, run] : runs) {
      const Metrics& x = *run.metrics;
      // Leave out a run whose twin with τ = 1 is there: τ changes little here.
      const Settings& s = run.settings;
      const bool has_twin = s.tau != 1 && std::ranges::any_of(runs, [&s](const auto& other) {
                              const Settings& t = other.second.settings;
                              return t.tau == 1 && t.joints == s.joints && t.algorithm == s.algorithm;
                            });
      if (!(x.energy_scale > 0) || has_twin) continue;
      const bool is_lost = !std::isfinite(x.energy_change) || !x.bounded;
      cell(table, row, title) = is_lost ? "lost"
                                        : fmt::format("{} / {}", percent(x.energy_change / x.energy_scale),
                                                      percent(x.energy_growth / x.energy_scale));
    }
    if (row.size() > 2) table.rows.push_back(std::move(row));
  }
  fill(table);
  return table;
}

TextTable springs_table() {
  TextTable table{{"stiffness under 1 kg, N/m", "h √(k/m)"}, {}};
  std::vector<std::vector<StiffnessPoint>> maps;
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a3, Algorithm::a5}) {
    Settings settings;
    settings.algorithm = algorithm;
    maps.push_back(stiffness_map(settings));
    const int n = algorithm == Algorithm::a1 ? 1 : settings.substeps;
    table.head.push_back(fmt::format("{}{}", title_of(algorithm), n > 1 ? fmt::format(", n = {}", n) : ""));
    table.head.push_back(fmt::format("closed form at {}", n > 1 ? fmt::format("h/{}", n) : "h"));
  }
  for (std::size_t i = 0; i < maps[0].size(); ++i) {
    const StiffnessPoint& point = maps[0][i];
    // Keep steps of 1/60 s and springs that have energy left.
    if (std::abs(point.step * 60 - 1) > 1e-9 || point.stiffness > 1e4) continue;
    const double angle = point.step * std::sqrt(point.stiffness);
    std::vector<std::string> row{short_number(point.stiffness), short_number(angle)};
    for (std::size_t k = 0; k < maps.size(); ++k) {
      const double n = k == 0 ? 1 : Settings{}.substeps;
      // An implicit step divides the energy by 1 + (h ω)².
      const double closed = std::pow(1 + angle * angle / n / n, -60 * n);
      row.push_back(percent(maps[k][i].energy));
      row.push_back(percent(closed));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::vector<BadFigure> bad_figures(const std::vector<SweepRecord>& records) {
  std::map<std::pair<std::string, Algorithm>, BadFigure> worst;
  for (const SweepRecord& record : records) {
    if (!is_judged(record)) continue;
    BadFigure& own = worst[{record.scene, record.settings.algorithm}];
    ++own.runs;
    own.bad += std::ranges::any_of(record.metrics->expected, &ExpectedFigure::is_bad) ? 1 : 0;
    for (const ExpectedFigure& figure : record.metrics->expected) {
      BadFigure candidate{record.scene, record.settings.algorithm, record.label, figure, own.bad, own.runs};
      if (own.scene.empty() || candidate.severity() > own.severity()) own = std::move(candidate);
    }
  }
  std::vector<BadFigure> result;
  for (auto& [scene_and_algorithm, figure] : worst) {
    if (figure.bad > 0) result.push_back(std::move(figure));
  }
  std::ranges::stable_sort(result, [](const BadFigure& a, const BadFigure& b) {
    if (a.severity() != b.severity()) return a.severity() > b.severity();
    return static_cast<double>(a.bad) / a.runs > static_cast<double>(b.bad) / b.runs;
  });
  return result;
}

TextTable bad_figures_table(const std::vector<BadFigure>& figures) {
  TextTable table{{"scene", "algorithm", "worst figure", "expected", "measured", "off by, in tolerances",
                   "with", "settings with a bad figure"},
                  {}};
  std::set<std::pair<std::string, std::string>> shown;
  for (const BadFigure& worst : figures) {
    const ExpectedFigure& x = worst.figure;
    // Give one line to all algorithms that miss a figure, with the numbers of the worst.
    if (!shown.emplace(worst.scene, x.name).second) continue;
    std::vector<std::string_view> algorithms;
    int bad = 0;
    int runs = 0;
    for (const BadFigure& other : figures) {
      if (other.scene != worst.scene || other.figure.name != x.name) continue;
      algorithms.push_back(title_of(other.algorithm));
      bad += other.bad;
      runs += other.runs;
    }
    const char* const sign = x.bound == Bound::at_most ? "≤ " : x.bound == Bound::at_least ? "≥ " : "";
    table.rows.push_back(
        {worst.scene, fmt::format("{}", fmt::join(algorithms, ", ")), x.name,
         fmt::format("{}{} {}", sign, short_number(x.expected), x.unit),
         std::isfinite(x.measured) ? fmt::format("{} {}", short_number(x.measured), x.unit)
         : x.unit == "s"           ? "never"
                                   : "diverged",
         std::isfinite(worst.severity()) ? fmt::format("{:.2g} times", worst.severity()) : "all", worst.label,
         fmt::format("{} of {}", bad, runs)});
  }
  return table;
}

int judged_runs(const std::vector<SweepRecord>& records) {
  return static_cast<int>(std::ranges::count_if(records, is_judged));
}

}  // namespace substep::report
