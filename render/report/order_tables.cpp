#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "render/report/report_tables.h"
#include "sim/study/advice.h"
#include "sim/study/sweep_results.h"

namespace substep::report {
namespace {

/// "n = 4", "m = 5", "h/8", "1" …
std::string limit_text(const SweepRecord& record) {
  const StabilityLimit& limit = *record.limit;
  const bool by_parts = record.settings.algorithm < Algorithm::a3;
  const char* const count = record.settings.algorithm == Algorithm::avbd ? "m" : "n";
  if (limit.divisions == 0)
    return by_parts ? fmt::format("h < h/{}", limit.most) : fmt::format("{} > {}", count, limit.most);
  if (!by_parts) return fmt::format("{} = {}", count, limit.divisions);
  return limit.divisions == 1 ? "h" : fmt::format("h/{}", limit.divisions);
}

}  // namespace

TextTable limits_table(const std::vector<SweepRecord>& records, bool contacts) {
  TextTable table{{"scene"}, {}};
  const auto title = [&](const SweepRecord& record) {
    const Settings& s = record.settings;
    std::string text(title_of(s.algorithm));
    if (s.algorithm >= Algorithm::a3 && !contacts) text += fmt::format(" {}", name(s.joints));
    if (s.algorithm >= Algorithm::a2) text += fmt::format(" m={}", s.iterations);
    if (s.algorithm >= Algorithm::a3 && tau_text(s) != "1") text += fmt::format(" τ={}", tau_text(s));
    if (s.algorithm >= Algorithm::a3 && kappa_text(s) != "1") text += fmt::format(" κ={}", kappa_text(s));
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
    const auto orders = local_orders(family.runs);
    for (const auto& [middle, slope] : orders) row[columns.at(middle)] = fmt::format("{:.2f}", slope);
    if (!orders.empty()) table.rows.push_back(std::move(row));
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
    const auto is_empty = [](const std::string& text) { return text.empty(); };
    if (!std::all_of(row.begin() + 1, row.end(), is_empty)) table.rows.push_back(std::move(row));
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
    if (least > most) continue;
    std::string range = fmt::format("{} {:.2f}", table.head[column], least);
    if (least < most) range += fmt::format(" to {:.2f}", most);
    ranges.push_back(std::move(range));
  }
  return fmt::format("{}", fmt::join(ranges, ", "));
}

}  // namespace substep::report
