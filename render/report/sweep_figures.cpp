// Figures of what a sweep measured: errors against work, and orders.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "render/inks.h"
#include "render/report/figures.h"
#include "render/report/report_tables.h"
#include "sim/model/settings_fields.h"
#include "sim/study/engines/engines.h"
#include "sim/study/sweep_results.h"

namespace substep::report {
namespace {

/// Returns the sweep's scenes that have contacts, or those that have none.
std::vector<std::string> plotted_scenes(const FigureSource& source, bool contacts) {
  std::vector<std::string> names = scenes_of(source.records);
  std::erase_if(names, [&](const std::string& scene) {
    return has_contacts(of_scene(source.records, scene)) != contacts;
  });
  return names;
}

/// Returns whether another engine ran the scene.
bool has_engines(const FigureSource& source, const std::string& scene) {
  return std::ranges::any_of(source.records, [&](const SweepRecord& record) {
    return record.scene == scene && record.metrics && is_other_engine(record);
  });
}

using Chosen = bool (*)(const RunFamily& family);

bool is_ours(const RunFamily& family) {
  return family.runs.front().engine.empty();
}

/// Returns whether the family is of A1 to A5 or of the reference integrator.
bool is_ours_or_accurate(const RunFamily& family) {
  const Engine* const engine = find_engine(family.runs.front().engine);
  return is_ours(family) || (engine && engine->is_ours);
}

/// Returns whether, in a scene without contacts, a twin of the family with τ = κ = 1 was measured. The figure
/// then shows the twin alone: line styles do not distinguish τ or κ.
bool has_plainest_twin(const RunFamily& family, const std::vector<RunFamily>& families) {
  const Settings& s = family.runs.front().settings;
  if (!is_ours(family) || (s.tau == 1 && s.kappa == 1) || has_contacts(family.runs)) return false;
  return std::ranges::any_of(families, [&](const RunFamily& other) {
    const Settings& t = other.runs.front().settings;
    return is_ours(other) && t.tau == 1 && t.kappa == 1 && t.algorithm == s.algorithm && t.joints == s.joints;
  });
}

/// Returns a line's style: dashed for stable joints, hollow for τ other than 1 and few iterations of A2.
SeriesStyle family_style(const RunFamily& family, bool contacts) {
  const SweepRecord& record = family.runs.front();
  if (!record.engine.empty()) {
    SeriesStyle style{5, 4};
    const Engine* const found = find_engine(record.engine);
    if (!found) return style;
    constexpr std::array shapes{4, 8, 10, 12, 1, 3, 6, 2};
    style.hue = render::hue_of_engine(record.engine);
    style.shape = shapes.at(static_cast<std::size_t>(found - engines().data()) % shapes.size());
    return style;
  }
  SeriesStyle style = style_of(record.settings.algorithm);
  const Settings& s = record.settings;
  style.dashed = s.joints == Joints::stable;
  // gnuplot numbers an empty disc, square or triangle one below the filled one.
  if (s.tau != 1 || (s.algorithm == Algorithm::a2 && !contacts && s.iterations < 16)) style.shape -= 1;
  return style;
}

/// The settings of a line's runs.
struct LineValues {
  std::string name;  ///< "A3", or the engine's
  std::set<int> substeps, iterations, divisions;
};

/// Returns up to six values, or the first three and the last of more.
std::string shortened(const std::set<int>& values) {
  if (values.size() <= 6) return fmt::format("{}", fmt::join(values, ", "));
  const std::vector<int> all(values.begin(), values.end());
  return fmt::format("{}, {}, {} … {}", all[0], all[1], all[2], all.back());
}

/// Returns "n = 1, 2, 4 … 64, m = 1, step h".
std::string text_of(const LineValues& line) {
  std::string text;
  if (!line.substeps.empty()) text = fmt::format("n = {}, ", shortened(line.substeps));
  const std::size_t least = line.substeps.empty() ? 2 : 1;
  if (line.iterations.size() >= least) text += fmt::format("m = {}, ", shortened(line.iterations));
  const bool is_divided = line.divisions.size() > 1 || *line.divisions.begin() > 1;
  return text + (is_divided ? fmt::format("h divided by {}", shortened(line.divisions)) : "step h");
}

/// Collects the settings of a sheet's lines, for its caption and for shorter titles.
class Captioner {
 public:
  void add(const RunFamily& family) {
    const SweepRecord& first = family.runs.front();
    const bool is_own = first.engine.empty();
    const std::string& title = family.title;
    LineValues& line = lines_[title];
    line.name = is_own ? std::string(title_of(first.settings.algorithm)) : title;
    if (is_own && field_named("joints").is_read_by(first.settings.algorithm))
      factors_.insert(title.substr(std::min({title.find(" τ="), title.find(" κ="), title.size()})));
    for (const SweepRecord& run : family.runs) {
      const Settings& s = run.settings;
      if (field_named("substeps").is_read_by(s.algorithm) && is_own) line.substeps.insert(s.substeps);
      if (s.algorithm != Algorithm::a1 && is_own) line.iterations.insert(s.iterations);
      line.divisions.insert(run.divisions);
    }
  }

  /// Names algorithms with one line by their name alone, except A2, whose m matters, omits τ and κ that all
  /// lines share from the others' titles, and adds the settings of each line to the caption.
  void finish(Sheet& sheet) const {
    for (Panel& panel : sheet.panels) {
      for (Series& series : panel.series) series.title = short_title(series.title);
    }
    std::vector<std::pair<std::string, std::set<std::string>>> groups;  // values, names
    for (const auto& [title, line] : lines_) {
      std::string text = text_of(line);
      if (short_title(title) != title) text += "; " + title.substr(title.find(' ') + 1);
      auto found = std::ranges::find(groups, text, [](const auto& group) { return group.first; });
      if (found == groups.end()) found = groups.insert(groups.end(), {text, {}});
      found->second.insert(line.name);
    }
    std::vector<std::string> sentences;
    for (const auto& [text, names] : groups)
      sentences.push_back(fmt::format("{}: {}.", fmt::join(names, ", "), text));
    sheet.caption.insert(sheet.caption.begin(), fmt::format("{}", fmt::join(sentences, " ")));
  }

 private:
  std::string short_title(const std::string& title) const {
    const std::string& name = lines_.at(title).name;
    const auto is_named_so = [&](const auto& line) { return line.second.name == name; };
    if (std::ranges::count_if(lines_, is_named_so) == 1 && name != "A2") return name;
    const bool shares = factors_.size() == 1 && title.ends_with(*factors_.begin());
    return shares ? title.substr(0, title.size() - factors_.begin()->size()) : title;
  }

  std::map<std::string, LineValues> lines_;  ///< by title
  std::set<std::string> factors_;            ///< " τ=0.6/0.9 κ=1/0.7", of A3 to A5
};

/// A measure of a run's work.
using Work = std::function<double(const SweepRecord&)>;

/// Returns why a run is not drawn; null where it is drawn.
const char* reason_to_leave_out(const SweepRecord& record, double work) {
  // An error above three times the scene's size says only that the run diverged.
  if (!(error_or_gap_of(record) < 3)) return "lost (error above three times the scene's size)";
  if (!exceeds_uncertainty(record)) return "below a hundred times the reference's uncertainty";
  return work > 0 ? nullptr : "without a value on the x axis";
}

/// Returns the series of a family; where none of its runs can be drawn, notes on the sheet why.
std::optional<Series> series_of(const RunFamily& family, bool contacts, const Work& work, Sheet& sheet) {
  Series series{family.title, family_style(family, contacts)};
  std::map<std::string, int> missing;
  for (const SweepRecord& record : family.runs) {
    const double spent = work(record);
    if (const char* const reason = reason_to_leave_out(record, spent)) {
      ++missing[reason];
    } else {
      series.points.push_back({spent, std::max(error_or_gap_of(record), smallest_plotted_error)});
    }
  }
  std::ranges::sort(series.points);
  if (!series.points.empty()) return series;
  std::vector<std::string> parts;
  for (const auto& [reason, count] : missing)
    parts.push_back(fmt::format("{} {}", counted(count, "run"), reason));
  sheet.left_out.push_back(
      {family.runs.front().scene, family.title, fmt::format("{}", fmt::join(parts, ", "))});
  return std::nullopt;
}

/// Returns the families of a scene that the sheet shows. Notes the others on the sheet.
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
        {records.front().scene, runs.title, fmt::format("{}: {}", counted(runs.count, "run"), runs.reason)});
  }
  return families;
}

/// Draws one panel for each scene: errors of families of runs against a measure of their work.
Sheet error_sheet(const std::vector<SweepRecord>& records, const std::vector<std::string>& scenes,
                  const std::string& title, const std::string& x_title, Chosen chosen, const Work& work) {
  Sheet sheet{.title = title};
  Captioner captioner;
  for (const std::string& scene : scenes) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    const double horizon = own.front().horizon;
    Panel panel{.title = horizon > 0 ? fmt::format("{}, {:.3g} s", scene, horizon) : scene,
                .x = {x_title, true},
                .y = {error_or_gap_title(own), true}};
    for (const RunFamily& family : chosen_families(own, chosen, sheet)) {
      if (std::optional<Series> series = series_of(family, has_contacts(own), work, sheet)) {
        panel.series.push_back(std::move(*series));
        captioner.add(family);
      }
    }
    // Leave out a scene without rows, which has no position on an axis of rows.
    if (!panel.series.empty()) sheet.panels.push_back(std::move(panel));
  }
  separate_styles(sheet);
  captioner.finish(sheet);
  return sheet;
}

}  // namespace

Sheet work_sheet(const FigureSource& source, WorkFigure kind, bool contacts) {
  constexpr const char* cpu_time = "CPU time of a simulated second, s";
  constexpr const char* not_drawn =
      "Down and to the left is better. Not drawn: runs that are lost (error above three times the scene's "
      "size), and errors below a hundred times the reference's uncertainty.";
  const auto is_any = [](const RunFamily&) { return true; };
  std::vector<std::string> scenes = plotted_scenes(source, contacts);
  const bool has_others = kind == WorkFigure::engines || kind == WorkFigure::engine_steps;
  if (has_others)
    std::erase_if(scenes, [&](const std::string& scene) { return !has_engines(source, scene); });
  const auto sheet_of = [&](const char* title, const char* x_title, Chosen chosen, const Work& work,
                            std::vector<std::string> caption) {
    Sheet sheet = error_sheet(source.records, scenes,
                              fmt::format("{}: {}", title, contacts ? "contacts" : "joints and spin"),
                              x_title, chosen, work);
    sheet.caption.insert(sheet.caption.end(), caption.begin(), caption.end());
    return sheet;
  };
  switch (kind) {
    case WorkFigure::time:
      return sheet_of("Error against CPU time", cpu_time, is_ours_or_accurate, cpu_time_of,
                      {"One core, medians of the sweep's repetitions.", not_drawn});
    case WorkFigure::engines:
      return sheet_of("Beside other engines", cpu_time, is_any, cpu_time_of,
                      {"The same scene files, one core. Down and to the left is better."});
    case WorkFigure::engine_steps:
      return sheet_of("Beside other engines, by step", "h / n, s", is_any, substep_of,
                      {"Nothing was tuned: engines have the settings that they ship with and n = 1, Rapier "
                       "n = m. Errors below 1e-10 are drawn there."});
    case WorkFigure::rows:
      break;
  }
  Sheet sheet =
      sheet_of("Error against rows solved", "rows solved in a simulated second", is_ours, row_rate, {});
  const auto has_a1 = [](const Panel& panel) {
    return std::ranges::find(panel.series, "A1", &Series::title) != panel.series.end();
  };
  if (std::ranges::any_of(sheet.panels, has_a1))
    sheet.caption.emplace_back("A1 counts each row once for each active set that it tries.");
  sheet.caption.emplace_back(not_drawn);
  return sheet;
}

Sheet choice_sheet(const std::vector<SweepRecord>& own) {
  const auto cost = [is_timed = has_times(own)](const SweepRecord& record) {
    return is_timed ? 1000 * cpu_time_of(record) : row_rate(record);
  };
  const std::string& scene = own.front().scene;
  Sheet sheet = error_sheet(own, {scene},
                            fmt::format("{}: {} against {}", scene, error_or_gap_title(own), cost_title(own)),
                            cost_title(own), is_ours, cost);
  if (sheet.panels.empty()) return sheet;
  sheet.columns = 1;
  sheet.width = 560;
  sheet.panel_height = 220;
  Panel& panel = sheet.panels.front();
  panel.title.clear();
  Series chosen{"chosen", {0, 6, false, false, true, 2}};
  for (const double tolerance : choice_tolerances) {
    const auto run = cheapest(own, tolerance);
    if (!run) continue;
    const std::array point{cost(*run), std::max(error_or_gap_of(*run), smallest_plotted_error)};
    const std::string text = fmt::format("{:g} %", 100 * tolerance);
    if (!chosen.points.empty() && chosen.points.front() == point) {
      panel.notes.back().text += ", " + text;
    } else {
      chosen.points.push_back(point);
      // Write to the left and below: no run is cheaper and better, so there are no curves.
      panel.notes.push_back({point[0], point[1], text, true});
    }
  }
  if (!chosen.points.empty()) panel.series.push_back(std::move(chosen));
  return sheet;
}

Sheet order_sheet(const FigureSource& source) {
  Sheet sheet = error_sheet(source.records, plotted_scenes(source, false),
                            "Error against the (sub-)step: order", "h / n, s", is_ours, substep_of);
  std::erase_if(sheet.panels, [](const Panel& panel) {
    return std::ranges::none_of(panel.series, [](const Series& line) { return line.points.size() > 1; });
  });
  for (Panel& panel : sheet.panels) {
    // Put the triangle below the line of A1, or of the first family.
    if (panel.series.front().points.size() < 2) continue;
    const auto& points = panel.series.front().points;
    const auto& anchor = points[points.size() / 2];
    panel.triangle = std::array{anchor[0] * 1.3, anchor[1] * 0.12};
    // Extend the range to whole decades that hold the lines and the triangle.
    double least = (*panel.triangle)[1];
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
      "level, Jacobians of the step's start (A4, A5) or few iterations (A2) dominate.");
  return sheet;
}

Sheet equal_rows_sheet(const FigureSource& source) {
  Sheet sheet{.title = "At equal row solves: n sub-steps, or n iterations",
              .caption = {"The scene's step, single rows, τ = κ = 1: both solve each row n times a step, A2 "
                          "fewer where it converges before (claim 3 of the report)."},
              .panel_height = 280};
  for (const std::string& scene : scenes_of(source.records)) {
    Series substeps{"A3: n sub-steps, one iteration each", {2, 7}};
    Series iterations{"A2: one step, n iterations", {1, 5, true}};
    double most = 64;
    for (const EqualRowRun& run : equal_row_runs(source.records, scene)) {
      const bool is_a3 = run.record.settings.algorithm == Algorithm::a3;
      Series& series = is_a3 ? substeps : iterations;
      series.points.push_back({static_cast<double>(run.n), error_or_gap_of(run.record)});
      most = std::max(most, series.points.back()[0]);
    }
    if (substeps.points.size() < 2 || iterations.points.size() < 2) continue;
    std::ranges::sort(substeps.points);
    std::ranges::sort(iterations.points);
    sheet.panels.push_back({.title = scene,
                            .x = {"n", true, std::array{0.8, 1.25 * most}, "(1, 4, 16, 64, 256)"},
                            .y = {error_or_gap_title(of_scene(source.records, scene)), true},
                            .series = {std::move(substeps), std::move(iterations)}});
  }
  return sheet;
}

}  // namespace substep::report
