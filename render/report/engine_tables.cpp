#include <fmt/format.h>

#include <algorithm>

#include "render/report/report_tables.h"
#include "sim/study/engines/engines.h"
#include "sim/study/sweep_results.h"

namespace substep::report {
namespace {

/// Returns the cheapest run within so many metres of the reference, or null.
const SweepRecord* cheapest_within(const std::vector<SweepRecord>& records, double metres,
                                   bool (*is_of)(const SweepRecord& record)) {
  const SweepRecord* best = nullptr;
  for (const SweepRecord& record : records) {
    if (!is_of(record) || !record.metrics || !record.times || !record.metrics->bounded) continue;
    if (!(record.metrics->error.position.rms <= metres)) continue;
    if (!best || record.times->median < best->times->median) best = &record;
  }
  return best;
}

/// Returns which of two runs is cheaper, and the ratio of their times.
std::string ahead_of(const SweepRecord* ours, const SweepRecord* theirs) {
  if (!ours) return "the other: ours are not there";
  if (!theirs) return "ours: no other is there";
  const double ratio = theirs->times->median / ours->times->median;
  return ratio >= 1 ? fmt::format("ours, {:.2g} times", ratio)
                    : fmt::format("the other, {:.2g} times", 1 / ratio);
}

}  // namespace

TextTable engines_table(const std::vector<SweepRecord>& records) {
  TextTable table{{"engine", "settings"}, {}};
  for (const Engine& engine : engines()) {
    const bool ran = std::ranges::any_of(
        records, [&](const SweepRecord& record) { return record.engine == engine.name && record.metrics; });
    if (ran) table.rows.push_back({engine.label, engine.settings});
  }
  return table;
}

TextTable ahead_table(const std::vector<SweepRecord>& records) {
  TextTable table{{"scene", "within", "cheapest of A1 to A5", "ms a simulated s", "cheapest other",
                   "ms a simulated s", "ahead"},
                  {}};
  const auto is_ours = [](const SweepRecord& record) { return record.engine.empty(); };
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    for (const double millimetres : {100.0, 30.0, 10.0, 3.0, 1.0}) {
      const SweepRecord* const ours = cheapest_within(own, 1e-3 * millimetres, is_ours);
      const SweepRecord* const theirs = cheapest_within(own, 1e-3 * millimetres, is_other_engine);
      const bool ran =
          std::ranges::any_of(own, [](const SweepRecord& r) { return is_other_engine(r) && r.metrics; });
      if (!ran || (!ours && !theirs)) continue;
      table.rows.push_back({scene, fmt::format("{:g} mm", millimetres), ours ? ours->label : "none",
                            ours ? milliseconds(*ours) : "", theirs ? theirs->label : "none",
                            theirs ? milliseconds(*theirs) : "", ahead_of(ours, theirs)});
    }
  }
  return table;
}

TextTable omitted_table(const std::vector<SweepRecord>& records, const std::vector<LeftOut>& left_out) {
  TextTable table{{"scene", "series", "why"}, {}};
  // Once, not for each step or figure
  const auto add = [&table](std::vector<std::string> row) {
    if (std::ranges::find(table.rows, row) == table.rows.end()) table.rows.push_back(std::move(row));
  };
  for (const SweepRecord& record : records) {
    if (!record.omitted.empty()) add({record.scene, record.engine, record.omitted});
  }
  for (const LeftOut& one : left_out) add({one.scene, one.series, one.reason});
  return table;
}

}  // namespace substep::report
