#include "render/report/run_figures.h"

#include <fmt/format.h>

#include <array>

#include "render/report/looks.h"
#include "sim/error.h"
#include "sim/measure/metrics.h"
#include "sim/measure/stage_times.h"
#include "sim/measure/sweep_errors.h"
#include "sim/measure/validity_maps.h"
#include "sim/model/usual_settings.h"

namespace substep::report {
namespace {

constexpr std::array algorithms{Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5};

}  // namespace

Sheet drift_sheet(const FigureSource& source) {
  const Settings settings = default_settings(Algorithm::a5);
  Sheet sheet;
  sheet.title = "Drift and energy over time";
  sheet.columns = 2;
  struct View {
    const char* scene;
    const char* title;
    const char* axis;
    bool logarithmic;
    double (*value)(const HistoryPoint&);
  };
  const std::array<View, 4> views{{{"rod_chain", "rod_chain: joints", "largest gap, m", true,
                                    [](const HistoryPoint& p) { return p.joint_gap; }},
                                   {"rod_chain", "rod_chain: energy", "E − E(0), J", false,
                                    [](const HistoryPoint& p) { return p.energy_change; }},
                                   {"heavy_chain", "heavy_chain: joints", "largest gap, m", true,
                                    [](const HistoryPoint& p) { return p.joint_gap; }},
                                   {"stone_pyramid", "stone_pyramid: contacts", "deepest overlap, m", true,
                                    [](const HistoryPoint& p) { return p.penetration; }}}};
  for (const View& view : views) {
    const Scene scene = source.scene(view.scene);
    Panel panel;
    panel.title = view.title;
    panel.x = {"t, s", false, std::array{0.0, scene.duration}, {}};
    panel.y = {view.axis, view.logarithmic, {}, {}};
    if (view.logarithmic) panel.y.range = std::array{1e-6, 10.0};
    for (const Algorithm algorithm : algorithms) {
      Series series{std::string(title_of(algorithm)), look_of(algorithm), {}};
      series.look.points = false;
      series.look.dashed = algorithm == Algorithm::a5;  // it lies on A4 where nothing tells them apart
      Settings of_run = default_settings(algorithm);
      of_run.step = scene.step;
      for (const HistoryPoint& point : history(scene, of_run)) {
        series.points.push_back({point.time, view.value(point)});
      }
      panel.series.push_back(std::move(series));
    }
    sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {fmt::format("The default settings of most scenes, the scene's step: {0} row solves a row "
                               "and step, A2 m = {0}; A3 to A5 "
                               "n = {0}, m = 1, τ = {1}, κ = {2} of joints/contacts, stable joints.",
                               settings.substeps, tau_text(settings), kappa_text(settings)),
                   "A gap or overlap below 1 µm is off the scale: A1's contacts have none."};
  return sheet;
}

Sheet size_sheet(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "Cost against size: a chain of N links";
  sheet.columns = 2;
  Panel whole;
  whole.title = "a step";
  whole.x = {"links", true, {}, {}};
  whole.y = {"CPU time, µs", true, {}, {}};
  Panel each = whole;
  each.title = "a link";
  const Scene scene = source.scene("rod_chain");
  for (const Algorithm algorithm : algorithms) {
    Series steps{std::string(title_of(algorithm)), look_of(algorithm), {}};
    Series links = steps;
    for (const int count : {4, 8, 16, 32, 64, 128, 256, 512}) {
      Scene chain = lengthened_chain(scene, count);
      Settings settings = usual_settings(chain, algorithm);
      settings.substeps = 4;
      settings.iterations = algorithm == Algorithm::a2 ? 4 : 1;
      settings.tau = settings.kappa = 1;
      settings.joints = algorithm == Algorithm::a3 ? Joints::plain : Joints::stable;
      // It may well tear: what a step costs does not change.
      constexpr int steps_timed = 60;
      chain.duration = steps_timed * settings.step;
      const double time = time_run(chain, settings, 5).median / steps_timed * 1e6;
      steps.points.push_back({static_cast<double>(count), time});
      links.points.push_back({static_cast<double>(count), time / count});
    }
    whole.series.push_back(std::move(steps));
    each.series.push_back(std::move(links));
  }
  sheet.panels = {std::move(whole), std::move(each)};
  sheet.caption = {
      "rod_chain.gltf made longer; A2 m = 4, A3 to A5 n = 4, m = 1, τ = κ = 1, A3 plain, A4 and A5 "
      "stable joints; "
      "medians of five runs of 60 steps, one core."};
  return sheet;
}

Sheet sweep_errors_sheet(const FigureSource& source) {
  constexpr std::size_t most = 12;
  if (source.problems.empty() || source.problems.size() > most)
    throw Error(fmt::format("give one to {} friction problems with --problem", most));
  Sheet sheet;
  sheet.title = "Row-by-row sweeps on friction problems";
  Panel panel;
  panel.x = {"sweeps", true, {}, {}};
  panel.y = {"natural-map error", true, {}, {}};
  for (const std::filesystem::path& file : source.problems) {
    const FrozenProblem problem = load_frozen_problem(file);
    // A colour for each of six, then the same with other points.
    constexpr std::array shapes{7, 5};
    const std::size_t number = panel.series.size();
    const Look look{.hue = static_cast<int>(number % 6), .shape = shapes[number / 6]};
    Series series{fmt::format("{} ({} contacts)", file.stem().stem().string(), problem.contacts()), look, {}};
    for (const auto& [sweeps, error] : sweep_errors(problem, 1e-8))
      series.points.push_back({static_cast<double>(sweeps), error});
    panel.series.push_back(std::move(series));
  }
  sheet.panels = {std::move(panel)};
  sheet.caption = {
      "Each sweep solves a normal, then its friction's two rows as one block, as A2 does; it ends at 1e-8."};
  return sheet;
}

}  // namespace substep::report
