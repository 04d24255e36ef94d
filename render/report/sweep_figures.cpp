#include "render/report/sweep_figures.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <set>

#include "render/report/captioner.h"
#include "render/report/looks.h"
#include "render/report/report_tables.h"
#include "sim/study/advice.h"
#include "sim/study/engines/engines.h"
#include "sim/study/sweep_results.h"

namespace substep::report {
namespace {

/// The sweep's scenes that have contacts, or those that have none.
std::vector<std::string> plotted_scenes(const FigureSource& source, bool contacts) {
  std::vector<std::string> names;
  for (const std::string& scene : scenes_of(source.records)) {
    const std::vector<SweepRecord> records = of_scene(source.records, scene);
    if (has_contacts(records) == contacts) names.push_back(scene);
  }
  return names;
}

/// Those of them that another engine ran too.
std::vector<std::string> scenes_with_engines(const FigureSource& source, bool contacts) {
  std::vector<std::string> names = plotted_scenes(source, contacts);
  std::erase_if(names, [&](const std::string& scene) {
    return std::ranges::none_of(source.records, [&](const SweepRecord& record) {
      return record.scene == scene && record.metrics && is_other_engine(record);
    });
  });
  return names;
}

using Chosen = bool (*)(const RunFamily& family);

bool is_ours(const RunFamily& family) {
  return family.runs.front().engine.empty();
}

bool is_accurate_mode(const RunFamily& family) {
  const auto found = std::ranges::find(engines(), family.runs.front().engine, &Engine::name);
  return found != engines().end() && found->is_ours;
}

bool is_ours_or_accurate(const RunFamily& family) {
  return is_ours(family) || is_accurate_mode(family);
}

bool is_any(const RunFamily& /*family*/) {
  return true;
}

/// Without contacts a figure shows τ = κ = 1, the report's 'none', where it was measured: a line's look does
/// not tell one τ or κ from another.
bool has_plainest_twin(const RunFamily& family, const std::vector<RunFamily>& families) {
  const Settings& s = family.runs.front().settings;
  if (!is_ours(family) || (s.tau == 1 && s.kappa == 1) || has_contacts(family.runs)) return false;
  return std::ranges::any_of(families, [&](const RunFamily& other) {
    const Settings& t = other.runs.front().settings;
    return is_ours(other) && t.tau == 1 && t.kappa == 1 && t.algorithm == s.algorithm && t.joints == s.joints;
  });
}

/// Counts why runs of a line are not drawn.
class MissingPoints {
 public:
  /// Returns true where the run is drawn.
  bool is_drawn(const SweepRecord& record, double work) {
    const double error = miss_of(record);
    // Beyond three times the scene's size an error says no more than that the run is lost
    const char* const reason = !(error < 3)       ? "lost (error above three times the scene's size)"
                               : !is_sure(record) ? "below a hundred times the reference's uncertainty"
                               : !(work > 0)      ? "without a value on the x axis"
                                                  : nullptr;
    if (reason) ++counts_[reason];
    return reason == nullptr;
  }

  std::string text() const {
    std::vector<std::string> parts;
    for (const auto& [reason, count] : counts_)
      parts.push_back(fmt::format("{} {} {}", count, count == 1 ? "run" : "runs", reason));
    return fmt::format("{}", fmt::join(parts, ", "));
  }

 private:
  std::map<std::string, int> counts_;
};

/// Some measure of a run's work.
using Work = std::function<double(const SweepRecord&)>;

/// The series of a family; where none of its runs can be drawn, the sheet says why.
std::optional<Series> series_of(const RunFamily& family, bool contacts, const Work& work, Sheet& sheet) {
  Series series{family.title, look_of(family, contacts), {}};
  MissingPoints missing;
  for (const SweepRecord& record : family.runs) {
    const double spent = work(record);
    if (missing.is_drawn(record, spent))
      series.points.push_back({spent, std::max(miss_of(record), smallest_plotted_error)});
  }
  std::ranges::sort(series.points);
  if (!series.points.empty()) return series;
  sheet.left_out.push_back({family.runs.front().scene, family.title, missing.text()});
  return std::nullopt;
}

/// The families of a scene that the sheet shows. Notes the others on the sheet.
std::vector<RunFamily> chosen_families(const std::vector<SweepRecord>& records, Chosen chosen, Sheet& sheet) {
  const std::vector<RunFamily> all = families_of(records);
  std::vector<RunFamily> families;
  for (const RunFamily& family : all) {
    if (!chosen(family)) continue;
    if (has_plainest_twin(family, all)) {
      sheet.left_out.push_back({records.front().scene, family.title, "τ = κ = 1 stands for it"});
    } else {
      families.push_back(family);
    }
  }
  for (const RunsLeftOut& runs : left_out_of(records)) {
    sheet.left_out.push_back(
        {records.front().scene, runs.title,
         fmt::format("{} {}: {}", runs.count, runs.count == 1 ? "run" : "runs", runs.reason)});
  }
  return families;
}

/// One panel a scene: families of runs, by some measure of their work.
Sheet work_sheet(const FigureSource& source, const std::vector<std::string>& scenes, const std::string& title,
                 const std::string& x_title, Chosen chosen, const Work& work) {
  Sheet sheet;
  sheet.title = title;
  Captioner captioner;
  for (const std::string& scene : scenes) {
    const std::vector<SweepRecord> records = of_scene(source.records, scene);
    Panel panel;
    const double horizon = records.front().horizon;
    panel.title = horizon > 0 ? fmt::format("{}, {:.3g} s", scene, horizon) : scene;
    panel.x = {x_title, true, {}, {}};
    panel.y = {miss_title(records), true, {}, {}};
    for (const RunFamily& family : chosen_families(records, chosen, sheet)) {
      if (std::optional<Series> series = series_of(family, has_contacts(records), work, sheet)) {
        panel.series.push_back(std::move(*series));
        captioner.add(family);
      }
    }
    // A scene without rows has no place on an axis of rows.
    if (!panel.series.empty()) sheet.panels.push_back(std::move(panel));
  }
  captioner.finish(sheet);
  return sheet;
}

constexpr const char* not_drawn =
    "Down and to the left is better. Not drawn: runs that are lost (error above three times the scene's "
    "size), "
    "and errors below a hundred times the reference's uncertainty.";

bool has_series(const Sheet& sheet, const std::string& title) {
  return std::ranges::any_of(sheet.panels, [&](const Panel& panel) {
    return std::ranges::find(panel.series, title, &Series::title) != panel.series.end();
  });
}

}  // namespace

Sheet work_rows_sheet(const FigureSource& source, bool contacts) {
  Sheet sheet = work_sheet(
      source, plotted_scenes(source, contacts),
      contacts ? "Error against rows solved: contacts" : "Error against rows solved: joints and spin",
      "rows solved in a simulated second", is_ours, [](const SweepRecord& record) {
        return static_cast<double>(record.metrics->row_solves) / record.duration;
      });
  if (has_series(sheet, "A1")) sheet.caption.emplace_back("A direct solve counts each row once a pivot.");
  sheet.caption.emplace_back(not_drawn);
  return sheet;
}

Sheet work_time_sheet(const FigureSource& source, bool contacts) {
  Sheet sheet = work_sheet(
      source, plotted_scenes(source, contacts),
      contacts ? "Error against CPU time: contacts" : "Error against CPU time: joints and spin",
      "CPU time of a simulated second, s", is_ours_or_accurate,
      [](const SweepRecord& record) { return record.times ? record.times->median / record.duration : NAN; });
  sheet.caption.emplace_back("One core, medians of the sweep's repetitions.");
  sheet.caption.emplace_back(not_drawn);
  return sheet;
}

Sheet engines_sheet(const FigureSource& source, bool contacts) {
  Sheet sheet = work_sheet(
      source, scenes_with_engines(source, contacts),
      contacts ? "Beside other engines: contacts" : "Beside other engines: joints and spin",
      "CPU time of a simulated second, s", is_any,
      [](const SweepRecord& record) { return record.times ? record.times->median / record.duration : NAN; });
  sheet.caption.emplace_back("The same scene files, one core. Down and to the left is better.");
  return sheet;
}

Sheet engine_steps_sheet(const FigureSource& source, bool contacts) {
  Sheet sheet = work_sheet(
      source, scenes_with_engines(source, contacts),
      contacts ? "Beside other engines, by step: contacts" : "Beside other engines, by step: joints and spin",
      "h / n, s", is_any, [](const SweepRecord& record) { return sub_step_of(record.settings); });
  sheet.caption.emplace_back(
      "Nothing was tuned: each engine has the settings that it ships with, which its table lists.");
  return sheet;
}

Sheet choice_sheet(const std::vector<SweepRecord>& own) {
  const bool is_timed = has_times(own);
  const auto cost = [is_timed](const SweepRecord& record) {
    return is_timed ? 1000 * cost_of(record)
                    : static_cast<double>(record.metrics->row_solves) / record.duration;
  };
  FigureSource source;
  source.records = own;
  Sheet sheet = work_sheet(source, {own.front().scene}, own.front().scene, cost_title(own), is_ours, cost);
  if (sheet.panels.empty()) return sheet;
  sheet.columns = 1;
  sheet.width = 560;
  sheet.panel_height = 220;
  Panel& panel = sheet.panels.front();
  panel.title.clear();
  Series chosen{"chosen", {0, 6, false, false, true, 2}, {}};
  for (const double tolerance : choice_tolerances) {
    const auto run = cheapest(own, tolerance);
    if (!run) continue;
    chosen.points.push_back({cost(*run), std::max(miss_of(*run), smallest_plotted_error)});
    const std::string text = fmt::format("{:g} %", 100 * tolerance);
    const bool is_same = chosen.points.size() > 1 && chosen.points.back() == chosen.points.front();
    if (is_same) {
      panel.notes.back().text += ", " + text;
      chosen.points.pop_back();
    } else {
      // No run is cheaper and better: there are no curves to the left and below.
      panel.notes.push_back({chosen.points.back()[0], chosen.points.back()[1], text, true, true});
    }
  }
  if (!chosen.points.empty()) panel.series.push_back(std::move(chosen));
  return sheet;
}

Sheet order_sheet(const FigureSource& source) {
  Sheet sheet =
      work_sheet(source, plotted_scenes(source, false), "Error against the (sub-)step: order", "h / n, s",
                 is_ours, [](const SweepRecord& record) { return sub_step_of(record.settings); });
  for (Panel& panel : sheet.panels) {
    // Below the line of A1, or of the first family there is.
    if (panel.series.empty() || panel.series.front().points.size() < 2) continue;
    const auto& points = panel.series.front().points;
    const auto& anchor = points[points.size() / 2];
    panel.triangles = {{anchor[0] * 1.3, anchor[1] * 0.12, 3, 1}};
    // Whole decades that hold the lines and the triangle.
    double least = panel.triangles[0].y;
    double most = least;
    for (const Series& series : panel.series) {
      for (const auto& point : series.points) {
        least = std::min(least, point[1]);
        most = std::max(most, point[1]);
      }
    }
    panel.y.range =
        std::array{std::pow(10, std::floor(std::log10(least))), std::pow(10, std::ceil(std::log10(most)))};
  }
  sheet.caption.emplace_back(
      "Both axes logarithmic; the triangle has slope 1: half the step, half the error. Where a line goes "
      "level, "
      "Jacobians of the step's start (A4, A5) or few iterations (A2) dominate.");
  return sheet;
}

Sheet slopes_sheet(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "Local order: where each leaves first order";
  for (const std::string& scene : plotted_scenes(source, false)) {
    Panel panel;
    panel.title = scene;
    panel.x = {"h / n, s", true, {}, {}};
    panel.y = {"powers of two per halving", false, std::array{-1.0, 3.0}, {}};
    for (const RunFamily& family : chosen_families(of_scene(source.records, scene), is_ours, sheet)) {
      Series series{family.title, look_of(family, false), {}};
      for (const auto& [middle, slope] : local_orders(family.runs))
        series.points.push_back({middle, std::clamp(slope, -1.0, 3.0)});
      if (series.points.empty()) {
        sheet.left_out.push_back(
            {scene, family.title, "no two runs with h/n halved that are bounded and sure"});
      } else {
        panel.series.push_back(std::move(series));
      }
    }
    if (!panel.series.empty()) sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {
      "The slope of 'error against the (sub-)step' from each run to the next, in the middle of the two; "
      "below −1 and above 3 at the border. 1 is first order, 0 no gain."};
  return sheet;
}

Sheet equal_rows_sheet(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "At equal row solves: n sub-steps, or n iterations";
  sheet.panel_height = 280;
  for (const std::string& scene : scenes_of(source.records)) {
    Series substeps{"A3: n sub-steps, one iteration each", {2, 7, false, true, true}, {}};
    Series iterations{"A2: one step, n iterations", {1, 5, true, true, true}, {}};
    for (const SweepRecord& record : equal_row_runs(source.records, scene)) {
      const bool is_a3 = record.settings.algorithm == Algorithm::a3;
      Series& series = is_a3 ? substeps : iterations;
      series.points.push_back(
          {static_cast<double>(is_a3 ? record.settings.substeps : record.settings.iterations),
           error_of(record)});
    }
    if (substeps.points.size() < 2 || iterations.points.size() < 2) continue;
    Panel panel;
    panel.title = scene;
    panel.x = {"n", true, std::array{0.8, 80.0}, "(1, 4, 16, 64)"};
    panel.y = {"RMS error / size", true, {}, {}};
    std::ranges::sort(substeps.points);
    std::ranges::sort(iterations.points);
    panel.series = {std::move(substeps), std::move(iterations)};
    sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {
      "The scene's step, single rows, τ = κ = 1: both solve each row n times a step (claim 3 of the "
      "report)."};
  return sheet;
}

}  // namespace substep::report
