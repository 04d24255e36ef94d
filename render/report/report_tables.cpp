// Tables of the cost of runs: choices, equal cost, other engines.

#include "render/report/report_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include "sim/study/engines/engines.h"
#include "sim/study/sweep_results.h"

namespace substep::report {
namespace {

/// Returns a run's CPU time for a simulated second, with its spread; empty where it was not timed.
std::string milliseconds(const SweepRecord& record) {
  if (!record.times) return "";
  const RunTimes& t = *record.times;
  const double spread = (t.largest - t.smallest) / 2 / std::max(t.median, 1e-12);
  return fmt::format("{:.3g} ± {:.0f} %", 1000 * cpu_time_of(record), 100 * spread);
}

/// Returns the CPU time of a simulated second or, where the run was not timed, its row solves.
std::string price(const SweepRecord& record) {
  return record.times ? milliseconds(record) : short_number(row_rate(record));
}

/// Returns the settings without the algorithm's name.
std::string settings_text(const SweepRecord& record, bool joints) {
  constexpr std::string_view with = " with ";
  const std::string text = spoken(record, joints);
  return text.substr(text.find(with) + with.size());
}

/// Returns whether the run was timed and is of one side: of A1 to A5, or of another engine.
bool is_timed_side(const SweepRecord& record, bool is_ours) {
  if (!record.times || !record.metrics) return false;
  return is_ours ? is_own_run(record) && is_of_report(record.settings.algorithm) : is_other_engine(record);
}

/// Returns the cheapest run of one side within so many metres of the reference, or null.
const SweepRecord* cheapest_within(const std::vector<SweepRecord>& records, double metres, bool is_ours) {
  const SweepRecord* best = nullptr;
  for (const SweepRecord& record : records) {
    if (!is_timed_side(record, is_ours) || !record.metrics->bounded) continue;
    if (!(record.metrics->error.position.rms <= metres)) continue;
    if (!best || record.times->median < best->times->median) best = &record;
  }
  return best;
}

/// Returns which of two runs is cheaper, and the ratio of their times.
std::string ahead_of(const SweepRecord* ours, const SweepRecord* theirs) {
  if (!ours) return "the other alone";
  if (!theirs) return "ours alone";
  const double ratio = theirs->times->median / ours->times->median;
  return ratio >= 1 ? fmt::format("ours, {:.2g} times", ratio)
                    : fmt::format("the other, {:.2g} times", 1 / ratio);
}

}  // namespace

double row_rate(const SweepRecord& record) {
  return static_cast<double>(record.metrics->row_solves) / record.duration;
}

std::string counted(std::size_t number, const char* noun) {
  return fmt::format("{} {}{}", number, noun, number == 1 ? "" : "s");
}

bool has_times(const std::vector<SweepRecord>& records) {
  return std::ranges::any_of(records, [](const SweepRecord& record) { return record.times.has_value(); });
}

std::string cost_title(const std::vector<SweepRecord>& records) {
  return has_times(records) ? "ms of CPU a simulated second" : "rows solved in a simulated second";
}

TextTable choices_table(const std::vector<SweepRecord>& records) {
  const std::string unit = cost_title(records);
  TextTable table{{"scene"}, {}};
  for (const double tolerance : choice_tolerances)
    table.head.insert(table.head.end(), {fmt::format("for {:g} % of its size", 100 * tolerance), unit});
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    if (std::ranges::none_of(own, is_own_run)) continue;
    std::vector<std::string> row{scene};
    for (const double tolerance : choice_tolerances) {
      const auto run = cheapest(own, tolerance);
      row.push_back(run ? spoken(*run, has_joints(own)) : "none");
      row.push_back(run ? price(*run) : "");
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

TextTable choice_table(const std::vector<SweepRecord>& own) {
  TextTable table{{"for", "take", cost_title(own), error_or_gap_title(own)}, {}};
  for (const double tolerance : choice_tolerances) {
    const auto run = cheapest(own, tolerance);
    table.rows.push_back({fmt::format("{:g} %", 100 * tolerance),
                          run ? spoken(*run, has_joints(own)) : "none of those measured",
                          run ? price(*run) : "", run ? error_text(*run) : ""});
  }
  return table;
}

TextTable references_table(const std::vector<SweepRecord>& records) {
  TextTable table{
      {"scene", "reference", "valid to, s", "why it ends", "uncertainty, m", "uncertainty, rad", "size, m"},
      {}};
  for (const std::string& scene : scenes_of(records)) {
    const SweepRecord first = of_scene(records, scene).front();
    table.rows.push_back(
        {scene, first.reference, fmt::format("{:.3g}", first.horizon),
         first.divergence_point.empty() ? "as requested" : fmt::format("{} diverges", first.divergence_point),
         short_number(first.uncertainty), short_number(first.turn_uncertainty), short_number(first.size)});
  }
  return table;
}

EqualRows equal_rows(const std::vector<SweepRecord>& records) {
  EqualRows result;
  for (const std::string& scene : scenes_of(records)) {
    std::map<int, std::vector<const SweepRecord*>> pairs;  // of A3 and of A2
    const std::vector<EqualRowRun> runs = equal_row_runs(records, scene);
    for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a2}) {
      for (const EqualRowRun& run : runs) {
        if (run.record.settings.algorithm == algorithm) pairs[run.n].push_back(&run.record);
      }
    }
    bool holds = true;
    bool has_any = false;
    for (const auto& [n, pair] : pairs) {
      if (n == 1 || pair.size() != 2) continue;
      const double a3 = error_or_gap_of(*pair[0]);
      const double a2 = error_or_gap_of(*pair[1]);
      has_any = true;
      holds = holds && a3 < a2;
      result.table.rows.push_back(
          {scene, std::to_string(n), error_text(*pair[0]), error_text(*pair[1]),
           std::isfinite(a3) && std::isfinite(a2) ? fmt::format("{:.2g}", a3 / a2) : ""});
    }
    if (has_any) (holds ? result.won_on : result.not_won_on).push_back(scene);
  }
  return result;
}

TextTable equal_cost_table(const std::vector<SweepRecord>& records) {
  TextTable table{{"scene", "at most, " + cost_title(records), "A1", "A2", "A3", "A4", "A5"}, {}};
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    const auto cheap = cheapest(own, 0.01);
    if (!cheap) continue;
    const double most = equal_cost_factor * time_or_rows(*cheap);
    std::array<const SweepRecord*, 5> best{};
    std::array<bool, 5> ran{};
    std::array<bool, 5> affordable{};
    for (const SweepRecord& record : own) {
      if (!is_own_run(record) || !is_of_report(record.settings.algorithm)) continue;
      const auto i = static_cast<std::size_t>(record.settings.algorithm);
      ran[i] = true;
      if (time_or_rows(record) > most) continue;
      affordable[i] = true;
      if (record.metrics->bounded && (!best[i] || error_or_gap_of(record) < error_or_gap_of(*best[i])))
        best[i] = &record;
    }
    const SweepRecord* winner = nullptr;
    for (const SweepRecord* const run : best) {
      if (run && (!winner || error_or_gap_of(*run) < error_or_gap_of(*winner))) winner = run;
    }
    const double shown = cheap->times ? 1000 * most : equal_cost_factor * row_rate(*cheap);
    const bool has_other_unit = !cheap->times && has_times(records);
    std::vector<std::string> row{scene, short_number(shown) + (has_other_unit ? " rows" : "")};
    for (std::size_t i = 0; i < best.size(); ++i) {
      if (!best[i]) {
        row.push_back(!ran[i] ? "not run" : affordable[i] ? "not bounded" : "costs more");
        continue;
      }
      const std::string text =
          fmt::format("{}, {}", error_text(*best[i]), settings_text(*best[i], has_joints(own)));
      // Mark all errors within 5 % of the best.
      row.push_back(error_or_gap_of(*best[i]) <= 1.05 * error_or_gap_of(*winner) ? fmt::format("**{}**", text)
                                                                                 : text);
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

TextTable runs_table(const std::vector<SweepRecord>& runs) {
  TextTable table{{"", "RMS error", "joint gap, m", "overlap, m", "energy, J: end − start",
                   "rows a simulated s", "ms a simulated s"},
                  {}};
  for (const SweepRecord& run : runs) {
    const Metrics& x = *run.metrics;
    table.rows.push_back({run.label, (exceeds_uncertainty(run) ? "" : "≈") + error_text(run),
                          short_number(x.joint_gap), short_number(x.penetration),
                          short_number(x.energy_change), short_number(row_rate(run)), milliseconds(run)});
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

TextTable ahead_table(const std::vector<SweepRecord>& records) {
  TextTable table{{"scene", "within", "cheapest of A1 to A5", "ms a simulated s", "cheapest other",
                   "ms a simulated s", "ahead"},
                  {}};
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    const auto has_side = [&own](bool is_ours) {
      return std::ranges::any_of(own, [=](const SweepRecord& run) { return is_timed_side(run, is_ours); });
    };
    // Turns in place have no distance.
    if (turns_in_place(own) || !has_side(true) || !has_side(false)) continue;
    for (const double millimetres : {100.0, 30.0, 10.0, 3.0, 1.0}) {
      const SweepRecord* const ours = cheapest_within(own, 1e-3 * millimetres, true);
      const SweepRecord* const theirs = cheapest_within(own, 1e-3 * millimetres, false);
      if (!ours && !theirs) continue;
      table.rows.push_back({scene, fmt::format("{:g} mm", millimetres), ours ? ours->label : "none",
                            ours ? milliseconds(*ours) : "", theirs ? theirs->label : "none",
                            theirs ? milliseconds(*theirs) : "", ahead_of(ours, theirs)});
    }
  }
  return table;
}

TextTable omitted_table(const std::vector<SweepRecord>& records, const std::vector<LeftOut>& left_out) {
  TextTable table{{"scene", "series", "why"}, {}};
  // Add a row once, not for each step or figure.
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
