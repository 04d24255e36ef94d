#include "render/report/report_tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "sim/study/advice.h"
#include "sim/study/engines/engines.h"
#include "sim/study/sweep_results.h"

namespace substep {
namespace {

std::string percent(double share) {
  if (!std::isfinite(share)) return "lost";
  if (share < 1e-11) return "rounding";
  return fmt::format("{:.2g} %", 100 * share);
}

std::string milliseconds(const SweepRecord& record) {
  if (!record.times) return "";
  const RunTimes& t = *record.times;
  const double spread = (t.largest - t.smallest) / 2 / std::max(t.median, 1e-12);
  return fmt::format("{:.3g} ± {:.0f} %", 1000 * cost_of(record), 100 * spread);
}

/// "n = 4", "h/8", "1" …
std::string limit_text(const SweepRecord& record) {
  const StabilityLimit& limit = *record.limit;
  const bool by_substeps = record.settings.algorithm >= Algorithm::a3;
  if (limit.divisions == 0)
    return by_substeps ? fmt::format("n > {}", limit.most) : fmt::format("h < h/{}", limit.most);
  if (by_substeps) return fmt::format("n = {}", limit.divisions);
  return limit.divisions == 1 ? "h" : fmt::format("h/{}", limit.divisions);
}

}  // namespace

TextTable choices_table(const std::vector<SweepRecord>& records) {
  TextTable table{
      {"scene", "for 1 % of its size", "ms a simulated second", "for 0.1 %", "ms a simulated second"}, {}};
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    std::vector<std::string> row{scene};
    for (const double tolerance : {0.01, 0.001}) {
      const auto run = cheapest(own, tolerance);
      row.push_back(run ? run->label : "none");
      row.push_back(run ? milliseconds(*run) : "");
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

TextTable references_table(const std::vector<SweepRecord>& records) {
  TextTable table{{"scene", "reference", "until, s", "where it ends", "its uncertainty, m", "rad",
                   "smallest error, m", "size, m"},
                  {}};
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    double smallest = INFINITY;
    for (const SweepRecord& record : own) {
      // Exact but for rounding is no error that a reference could be held to.
      if (record.metrics && record.metrics->error.position.rms > smallest_plotted_error * record.size &&
          is_sure(record)) {
        smallest = std::min(smallest, record.metrics->error.position.rms);
      }
    }
    const SweepRecord& first = own.front();
    table.rows.push_back(
        {scene, first.reference, fmt::format("{:g}", first.horizon),
         first.divergence_point.empty() ? "as asked" : fmt::format("{} parts", first.divergence_point),
         short_number(first.uncertainty), short_number(first.turn_uncertainty), short_number(smallest),
         short_number(first.size)});
  }
  return table;
}

TextTable limits_table(const std::vector<SweepRecord>& records, bool contacts) {
  TextTable table{{"scene"}, {}};
  const auto title = [&](const SweepRecord& record) {
    const Settings& s = record.settings;
    std::string text(title_of(s.algorithm));
    if (s.algorithm >= Algorithm::a3 && !contacts) text += fmt::format(" {}", name(s.joints));
    if (s.algorithm >= Algorithm::a2) text += fmt::format(" m={}", s.iterations);
    if (s.algorithm >= Algorithm::a3 && s.tau != 1) text += fmt::format(" τ={:g}", s.tau);
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

TextTable slopes_table(const std::vector<SweepRecord>& records) {
  TextTable table{{"h/n, s"}, {}};
  std::map<double, std::size_t, std::greater<>> columns;
  std::vector<RunFamily> families = families_of(records);
  std::erase_if(families, [](const RunFamily& family) { return !family.runs.front().engine.empty(); });
  for (const RunFamily& family : families) {
    for (const auto& [middle, slope] : local_orders(family.runs)) columns[middle] = 0;
  }
  for (auto& [middle, column] : columns) {
    column = table.head.size();
    table.head.push_back(
        fmt::format("1/{:.0f} → 1/{:.0f}", 1 / (middle * std::sqrt(2.0)), std::sqrt(2.0) / middle));
  }
  for (const RunFamily& family : families) {
    std::vector<std::string> row(table.head.size());
    row[0] = family.title;
    for (const auto& [middle, slope] : local_orders(family.runs))
      row[columns.at(middle)] = fmt::format("{:.2f}", slope);
    table.rows.push_back(std::move(row));
  }
  return table;
}

TextTable orders_table(const std::vector<SweepRecord>& records) {
  TextTable table{{"scene"}, {}};
  std::vector<std::string> scenes;
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    if (has_contacts(own)) continue;
    scenes.push_back(scene);
    for (const RunFamily& family : families_of(own)) {
      if (!family.runs.front().engine.empty()) continue;
      if (std::ranges::find(table.head, family.title) == table.head.end()) table.head.push_back(family.title);
    }
  }
  for (const std::string& scene : scenes) {
    std::vector<std::string> row(table.head.size());
    row[0] = scene;
    for (const RunFamily& family : families_of(of_scene(records, scene))) {
      if (!family.runs.front().engine.empty()) continue;
      const auto column = std::ranges::find(table.head, family.title) - table.head.begin();
      const auto order = measured_order(family.runs);
      row[static_cast<std::size_t>(column)] = order ? fmt::format("{:.2f}", *order) : "";
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string order_ranges(const TextTable& table) {
  std::vector<std::string> ranges;
  for (std::size_t column = 1; column < table.head.size(); ++column) {
    double least = INFINITY;
    double most = -INFINITY;
    for (const auto& row : table.rows) {
      if (row[column].empty()) continue;
      least = std::min(least, std::stod(row[column]));
      most = std::max(most, std::stod(row[column]));
    }
    if (least <= most) ranges.push_back(fmt::format("{} {:.2f} to {:.2f}", table.head[column], least, most));
  }
  return fmt::format("{}", fmt::join(ranges, ", "));
}

EqualRows equal_rows(const std::vector<SweepRecord>& records) {
  EqualRows result;
  for (const std::string& scene : scenes_of(records)) {
    std::map<int, std::array<double, 2>> errors;
    std::map<int, int> found;
    for (const SweepRecord& record : equal_row_runs(records, scene)) {
      const bool is_a3 = record.settings.algorithm == Algorithm::a3;
      const int n = is_a3 ? record.settings.substeps : record.settings.iterations;
      errors[n].at(is_a3 ? 0 : 1) = error_of(record);
      ++found[n];
    }
    bool holds = true;
    bool has_any = false;
    for (const auto& [n, pair] : errors) {
      if (n == 1 || found[n] != 2) continue;
      has_any = true;
      holds = holds && pair[0] < pair[1];
      const bool both = std::isfinite(pair[0]) && std::isfinite(pair[1]);
      result.table.rows.push_back({scene, std::to_string(n), percent(pair[0]), percent(pair[1]),
                                   both ? fmt::format("{:.2g}", pair[0] / pair[1]) : ""});
    }
    if (has_any) (holds ? result.holding : result.failing).push_back(scene);
  }
  return result;
}

TextTable runs_table(const std::vector<SweepRecord>& runs) {
  TextTable table{{"", "RMS error", "largest, m", "joint gap, m", "overlap, m", "energy, J: end − start",
                   "rows a simulated s", "ms a simulated s"},
                  {}};
  for (const SweepRecord& run : runs) {
    const Metrics& x = *run.metrics;
    table.rows.push_back({run.label, (is_sure(run) ? "" : "≈") + percent(error_of(run)),
                          short_number(x.error.position.largest), short_number(x.joint_gap),
                          short_number(x.penetration), short_number(x.energy_change),
                          short_number(static_cast<double>(x.row_solves) / run.duration), milliseconds(run)});
  }
  return table;
}

TextTable engines_table(const std::vector<SweepRecord>& records) {
  TextTable table{{"engine", "settings"}, {}};
  for (const Engine& engine : engines()) {
    const bool ran = std::ranges::any_of(
        records, [&](const SweepRecord& record) { return record.engine == engine.name && record.metrics; });
    if (ran) table.rows.push_back({engine.label, engine.settings});
  }
  return table;
}

TextTable omitted_table(const std::vector<SweepRecord>& records) {
  TextTable table{{"scene", "engine", "why"}, {}};
  for (const SweepRecord& record : records) {
    // Once, not for each step.
    const std::vector<std::string> row{record.scene, record.engine, record.omitted};
    if (!record.omitted.empty() && (table.rows.empty() || table.rows.back() != row))
      table.rows.push_back(row);
  }
  return table;
}

TextTable contact_ablation_table(const std::vector<ContactAblationCosts>& ablation) {
  TextTable table{{"taken out"}, {}};
  for (const ContactAblationCosts& column : ablation) table.head.push_back(column_title(column));
  for (std::size_t i = 0; i < contact_ablations.size(); ++i) {
    std::vector<std::string> row{row_title(contact_ablations[i])};
    for (const ContactAblationCosts& column : ablation) row.push_back(short_number(column.costs[i]));
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace substep
