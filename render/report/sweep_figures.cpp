#include "render/report/sweep_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "render/report/looks.h"
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

std::string error_title(const std::vector<SweepRecord>& records) {
  return turns_in_place(records) ? "RMS turn, rad" : "RMS error / size";
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

/// Other engines, and of ours those that differ most.
bool stands_beside_engines(const RunFamily& family) {
  const Settings& s = family.runs.front().settings;
  const double tau = has_contacts(family.runs) ? default_settings(Algorithm::a5).tau : 1;
  return !is_ours(family) || s.algorithm == Algorithm::a1 ||
         (s.algorithm == Algorithm::a3 && s.joints == Joints::plain && s.tau == tau) ||
         (s.algorithm == Algorithm::a5 && s.tau == tau);
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

/// One panel a scene: families of runs, by some measure of their work.
Sheet work_sheet(const FigureSource& source, bool contacts, const std::string& title,
                 const std::string& x_title, Chosen chosen,
                 const std::function<double(const SweepRecord&)>& work) {
  Sheet sheet;
  sheet.title = title;
  sheet.columns = 3;
  sheet.panel_width = 400;
  sheet.legend_columns = 5;
  for (const std::string& scene : plotted_scenes(source, contacts)) {
    const std::vector<SweepRecord> records = of_scene(source.records, scene);
    Panel panel;
    panel.title = fmt::format("{}, {:g} s", scene, records.front().horizon);
    panel.x = {x_title, true, {}, {}};
    panel.y = {error_title(records), true, {}, {}};
    const std::vector<RunFamily> families = families_of(records);
    for (const RunFamily& family : families) {
      if (!chosen(family) || has_plainest_twin(family, families)) continue;
      Series series{family.title, look_of(family, has_contacts(records)), {}};
      for (const SweepRecord& record : family.runs) {
        const double error = error_of(record);
        const double spent = work(record);
        if (!(spent > 0)) continue;
        // Beyond the scene's own size an error says no more than that it is gone.
        if (error < 3 && is_sure(record))
          series.points.push_back({spent, std::max(error, smallest_plotted_error)});
      }
      std::ranges::sort(series.points);
      if (!series.points.empty()) panel.series.push_back(std::move(series));
    }
    // A scene without rows has no place on an axis of rows.
    if (!panel.series.empty()) sheet.panels.push_back(std::move(panel));
  }
  return sheet;
}

/// Removes panels of scenes that no other engine ran.
void keep_panels_with_engines(const FigureSource& source, Sheet& sheet) {
  std::erase_if(sheet.panels, [&](const Panel& panel) {
    const std::string scene = panel.title.substr(0, panel.title.find(','));
    return std::ranges::none_of(source.records, [&](const SweepRecord& record) {
      return record.scene == scene && record.metrics && is_other_engine(record);
    });
  });
}

}  // namespace

Sheet work_rows_sheet(const FigureSource& source, bool contacts) {
  Sheet sheet = work_sheet(
      source, contacts,
      contacts ? "Error against rows solved: contacts" : "Error against rows solved: joints and spin",
      "rows solved in a simulated second", is_ours, [](const SweepRecord& record) {
        return static_cast<double>(record.metrics->row_solves) / record.duration;
      });
  sheet.caption = {
      "A1 and A2: steps of h, h/2, h/4 … (A2 with contacts: m = 1, 4, 16, 64 at h); A3 to A5: n = 1, 2, 4 … "
      "sub-steps of one iteration at the scene's h, without contacts with τ = κ = 1. A direct solve counts "
      "each row once a pivot.",
      "Down and to the left is better. Not drawn: runs that are lost (error above three times the scene's "
      "size), and "
      "errors below a hundred times the reference's own uncertainty."};
  return sheet;
}

Sheet work_time_sheet(const FigureSource& source, bool contacts) {
  Sheet sheet = work_sheet(
      source, contacts,
      contacts ? "Error against CPU time: contacts" : "Error against CPU time: joints and spin",
      "CPU time of a simulated second, s", is_ours_or_accurate,
      [](const SweepRecord& record) { return record.times ? record.times->median / record.duration : NAN; });
  sheet.caption = {
      "One core, medians of the sweep's repetitions. Own, order 4 and 8: the accurate mode beside the five, "
      "h, h/2, h/4 …. A1 and A2: steps of h, h/2, h/4 … (A2 with contacts: m "
      "= 1, 4, 16, 64 at h); A3 to A5: n = 1, 2, 4 … sub-steps of one iteration at the scene's h, without "
      "contacts with τ = κ = 1.",
      "Down and to the left is better. Not drawn: runs that are lost (error above three times the scene's "
      "size), and "
      "errors below a hundred times the reference's own uncertainty."};
  return sheet;
}

Sheet engines_sheet(const FigureSource& source, bool contacts) {
  Sheet sheet = work_sheet(
      source, contacts, contacts ? "Beside other engines: contacts" : "Beside other engines: joints and spin",
      "CPU time of a simulated second, s", stands_beside_engines,
      [](const SweepRecord& record) { return record.times ? record.times->median / record.duration : NAN; });
  keep_panels_with_engines(source, sheet);
  sheet.caption = {
      "The same scene files, one core. The engines and A1: steps of h, h/2, h/4 …; A3 and A5: n = 1, 2, 4 … "
      "sub-steps of one "
      "iteration at the scene's h; the default τ and κ with contacts, else 1.",
      "Down and to the left is better. Against the same reference: for contacts it is our A1 at a small "
      "step."};
  return sheet;
}

Sheet engine_steps_sheet(const FigureSource& source, bool contacts) {
  Sheet sheet = work_sheet(
      source, contacts,
      contacts ? "Beside other engines, by step: contacts" : "Beside other engines, by step: joints and spin",
      "h / n, s", stands_beside_engines,
      [](const SweepRecord& record) { return sub_step_of(record.settings); });
  keep_panels_with_engines(source, sheet);
  sheet.caption = {
      "The same scene files. The engines and A1: steps of h, h/2, h/4 …, ten iterations where an engine has "
      "that number; A3 and A5: n = 1, 2, 4 … sub-steps of one iteration at the scene's h; the default τ and "
      "κ "
      "with contacts, else 1.",
      "Nothing was tuned: each engine has the settings that it ships with, which its table lists."};
  return sheet;
}

Sheet order_sheet(const FigureSource& source) {
  Sheet sheet = work_sheet(source, false, "Error against the (sub-)step: order", "h / n, s", is_ours,
                           [](const SweepRecord& record) { return sub_step_of(record.settings); });
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
  sheet.caption = {
      "Both axes logarithmic; the triangle has slope 1: half the step, half the error. A1 and A2: h halved; "
      "A3 to A5: n "
      "doubled at the scene's h.",
      "A1 and A3 take Jacobians anew for each h/n, A4 and A5 once an h (stable joints: at each solve). Where "
      "a line goes level, "
      "that is what is left."};
  return sheet;
}

Sheet slopes_sheet(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "Local order: where each leaves first order";
  sheet.columns = 3;
  sheet.panel_width = 400;
  sheet.legend_columns = 5;
  for (const std::string& scene : plotted_scenes(source, false)) {
    Panel panel;
    panel.title = scene;
    panel.x = {"h / n, s", true, {}, {}};
    panel.y = {"powers of two per halving", false, std::array{-1.0, 3.0}, {}};
    const std::vector<RunFamily> families = families_of(of_scene(source.records, scene));
    for (const RunFamily& family : families) {
      if (!is_ours(family) || has_plainest_twin(family, families)) continue;
      Series series{family.title, look_of(family, false), {}};
      for (const auto& [middle, slope] : local_orders(family.runs))
        series.points.push_back({middle, std::clamp(slope, -1.0, 3.0)});
      if (!series.points.empty()) panel.series.push_back(std::move(series));
    }
    if (!panel.series.empty()) sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {
      "The slope of 'error against the (sub-)step' from each run to the next, in the middle of the two; "
      "below −1 and above 3 "
      "at the border.",
      "1 is first order, 0 no gain. A4 and A5 go to 0 where what is left is the step h for which they take "
      "Jacobians."};
  return sheet;
}

Sheet equal_rows_sheet(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "At equal row solves: n sub-steps, or n iterations";
  sheet.columns = 3;
  sheet.panel_width = 400;
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
