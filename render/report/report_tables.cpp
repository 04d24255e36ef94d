#include "render/report/report_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "sim/measure/validity_maps.h"
#include "sim/study/advice.h"
#include "sim/study/sweep_results.h"

namespace substep::report {
namespace {

double rows_a_second(const SweepRecord& record) {
  return static_cast<double>(record.metrics->row_solves) / record.duration;
}

/// In milliseconds, or in rows where there are no times.
std::string price(const SweepRecord& record) {
  return record.times ? milliseconds(record) : short_number(rows_a_second(record));
}

/// The settings without the algorithm's name.
std::string settings_text(const SweepRecord& record, bool joints) {
  constexpr std::string_view with = " with ";
  const std::string text = spoken(record, joints);
  return text.substr(text.find(with) + with.size());
}

/// Of each family of ours the run whose row solves come closest to those of A3 to A5 with 16 sub-steps (or as
/// many as there are below), and are not more.
std::vector<std::pair<std::string, SweepRecord>> at_equal_rows(const std::vector<SweepRecord>& own) {
  const std::vector<RunFamily> families = families_of(own);
  std::int64_t most = 0;
  for (const RunFamily& family : families) {
    for (const SweepRecord& run : family.runs) {
      const Settings& s = run.settings;
      if (run.engine.empty() && s.algorithm >= Algorithm::a3 && s.substeps <= 16)
        most = std::max(most, run.metrics->row_solves);
    }
  }
  std::vector<std::pair<std::string, SweepRecord>> chosen;
  for (const RunFamily& family : families) {
    const SweepRecord* best = nullptr;
    for (const SweepRecord& run : family.runs) {
      // Contacts that are found elsewhere are a few rows more or less.
      if (!run.engine.empty() ||
          static_cast<double>(run.metrics->row_solves) > 1.05 * static_cast<double>(most))
        continue;
      if (!best || run.metrics->row_solves > best->metrics->row_solves) best = &run;
    }
    if (best) chosen.emplace_back(family.title, *best);
  }
  return chosen;
}

/// The cell of a row under a title that is added to the head when it is new.
std::string& cell(TextTable& table, std::vector<std::string>& row, const std::string& title) {
  auto found = std::ranges::find(table.head, title);
  if (found == table.head.end()) found = table.head.insert(table.head.end(), title);
  row.resize(std::max(row.size(), table.head.size()));
  return row[static_cast<std::size_t>(found - table.head.begin())];
}

/// Rows as long as the head.
void fill(TextTable& table) {
  for (auto& row : table.rows) row.resize(table.head.size());
}

}  // namespace

std::string milliseconds(const SweepRecord& record) {
  if (!record.times) return "";
  const RunTimes& t = *record.times;
  const double spread = (t.largest - t.smallest) / 2 / std::max(t.median, 1e-12);
  return fmt::format("{:.3g} ± {:.0f} %", 1000 * cost_of(record), 100 * spread);
}

bool has_times(const std::vector<SweepRecord>& records) {
  return std::ranges::any_of(records, [](const SweepRecord& record) { return record.times.has_value(); });
}

std::string cost_title(const std::vector<SweepRecord>& records) {
  return has_times(records) ? "ms of CPU a simulated second" : "rows a simulated second";
}

TextTable choices_table(const std::vector<SweepRecord>& records) {
  const std::string unit = cost_title(records);
  TextTable table{{"scene", "for 1 % of its size", unit, "for 0.1 %", unit}, {}};
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    if (std::ranges::none_of(own, is_own_run)) continue;
    std::vector<std::string> row{scene};
    for (const double tolerance : {0.01, 0.001}) {
      const auto run = cheapest(own, tolerance);
      row.push_back(run ? spoken(*run, has_joints(own)) : "none");
      row.push_back(run ? price(*run) : "");
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

TextTable choice_table(const std::vector<SweepRecord>& own) {
  TextTable table{{"for", "take", has_times(own) ? "CPU, ms" : "rows", miss_title(own)}, {}};
  for (const double tolerance : choice_tolerances) {
    const auto run = cheapest(own, tolerance);
    table.rows.push_back({fmt::format("{:g} %", 100 * tolerance),
                          run ? spoken(*run, has_joints(own)) : "none of those measured",
                          run ? price(*run) : "", run ? percent(miss_of(*run)) : ""});
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
        {scene, first.reference, fmt::format("{:.3g}", first.horizon),
         first.divergence_point.empty() ? "as asked" : fmt::format("{} parts", first.divergence_point),
         short_number(first.uncertainty), short_number(first.turn_uncertainty), short_number(smallest),
         short_number(first.size)});
  }
  return table;
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

TextTable equal_cost_table(const std::vector<SweepRecord>& records) {
  TextTable table{{"scene", "", "A1", "A2", "A3", "A4", "A5"}, {}};
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    const auto cheap = cheapest(own, 0.01);
    if (!cheap) continue;
    const double most = equal_cost_factor * time_or_rows(*cheap);
    table.head[1] = cheap->times ? "at most, ms a simulated second" : "at most, rows a simulated second";
    std::array<const SweepRecord*, 5> best{};
    std::array<bool, 5> ran{};
    std::array<bool, 5> affordable{};
    for (const SweepRecord& record : own) {
      if (!is_own_run(record) || !is_of_report(record.settings.algorithm)) continue;
      const auto i = static_cast<std::size_t>(record.settings.algorithm);
      ran[i] = true;
      if (time_or_rows(record) > most) continue;
      affordable[i] = true;
      if (record.metrics->bounded && (!best[i] || miss_of(record) < miss_of(*best[i]))) best[i] = &record;
    }
    const SweepRecord* winner = nullptr;
    for (const SweepRecord* const run : best) {
      if (run && (!winner || miss_of(*run) < miss_of(*winner))) winner = run;
    }
    const double shown = cheap->times ? 1000 * most : equal_cost_factor * rows_a_second(*cheap);
    std::vector<std::string> row{scene, short_number(shown)};
    for (std::size_t i = 0; i < best.size(); ++i) {
      if (!best[i]) {
        row.push_back(!ran[i] ? "not run" : affordable[i] ? "lost" : "costs more");
        continue;
      }
      const std::string text =
          fmt::format("{}, {}", percent(miss_of(*best[i])), settings_text(*best[i], has_joints(own)));
      // What is as good but for a twentieth wins as well.
      row.push_back(miss_of(*best[i]) <= 1.05 * miss_of(*winner) ? fmt::format("**{}**", text) : text);
    }
    table.rows.push_back(std::move(row));
  }
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
      const SweepRecord& own_run = run;
      // τ changes little here: where there is a run without it, that stands for both.
      const bool is_twin = own_run.settings.tau != 1 && std::ranges::any_of(runs, [&](const auto& other) {
                             const Settings& s = other.second.settings;
                             return s.tau == 1 && s.joints == own_run.settings.joints &&
                                    s.algorithm == own_run.settings.algorithm;
                           });
      if (!(x.energy_scale > 0) || is_twin) continue;
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

TextTable sliding_table(const std::vector<SweepRecord>& records) {
  TextTable table{{"scene", "known", "expected"}, {}};
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    if (own.front().contacts != ContactKind::moving) continue;
    const auto runs = at_equal_rows(own);
    if (runs.empty()) continue;
    for (std::size_t i = 0; i < runs.front().second.metrics->expected.size(); ++i) {
      const ExpectedFigure& known = runs.front().second.metrics->expected[i];
      // What is only bounded says nothing of by how much friction is off.
      if (known.bound != Bound::equal || known.expected == 0) continue;
      double largest = 0;
      std::vector<std::string> row{scene, known.name,
                                   fmt::format("{} {}", short_number(known.expected), known.unit)};
      for (const auto& [title, run] : runs) {
        if (i >= run.metrics->expected.size()) continue;
        const double error = run.metrics->expected[i].measured / known.expected - 1;
        largest = std::max(largest, std::isfinite(error) ? std::abs(error) : 0);
        cell(table, row, title) = !std::isfinite(error)    ? "never"
                                  : std::abs(error) < 1e-9 ? "exact"
                                                           : fmt::format("{:+.2g} %", 100 * error);
      }
      // What all have to a thousandth tells nobody apart.
      if (largest >= 1e-3) table.rows.push_back(std::move(row));
    }
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
    // Stiffer ones have nothing left.
    if (std::abs(point.step * 60 - 1) > 1e-9 || point.stiffness > 1e4) continue;
    const double angle = point.step * std::sqrt(point.stiffness);
    std::vector<std::string> row{short_number(point.stiffness), short_number(angle)};
    for (std::size_t k = 0; k < maps.size(); ++k) {
      const double n = k == 0 ? 1 : Settings{}.substeps;
      // An implicit step takes 1 + (h ω)² off the energy.
      const double closed = std::pow(1 + angle * angle / n / n, -60 * n);
      row.push_back(percent(maps[k][i].energy));
      row.push_back(percent(closed));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

TextTable runs_table(const std::vector<SweepRecord>& runs) {
  TextTable table{{"", "RMS error", "largest, m", "joint gap, m", "overlap, m", "energy, J: end − start",
                   "rows a simulated s", "ms a simulated s"},
                  {}};
  for (const SweepRecord& run : runs) {
    const Metrics& x = *run.metrics;
    table.rows.push_back({run.label, (is_sure(run) ? "" : "≈") + percent(miss_of(run)),
                          short_number(x.error.position.largest), short_number(x.joint_gap),
                          short_number(x.penetration), short_number(x.energy_change),
                          short_number(static_cast<double>(x.row_solves) / run.duration), milliseconds(run)});
  }
  return table;
}

}  // namespace substep::report
