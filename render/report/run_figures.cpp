// Figures that simulate their own runs: drift over time, cost against size, sweeps over friction problems,
// growth of coupled rows, approximations one by one.

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "render/report/figures.h"
#include "sim/direct/frozen_problem.h"
#include "sim/error.h"
#include "sim/measure/ablation.h"
#include "sim/measure/invariants.h"
#include "sim/measure/stepper.h"
#include "sim/measure/substep_map.h"
#include "sim/measure/validity_maps.h"
#include "sim/model/usual_settings.h"
#include "sim/simulation.h"

namespace substep::report {
namespace {

constexpr std::array algorithms{Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5};

/// A quantity that drifts.
enum class Drift { joint_gap, energy, penetration };

/// Returns a line of an algorithm's drift over the scene's time, until the run diverges.
Series history_of(const Scene& scene, Algorithm algorithm, Drift drift) {
  Series series{std::string(title_of(algorithm)), style_of(algorithm)};
  series.style.points = false;
  series.style.dashed = algorithm == Algorithm::a5;  // A4 shows under A5 where their runs are equal
  Settings settings = default_settings(algorithm);
  settings.step = scene.step;
  Simulation simulation(scene, settings);
  PenetrationMeter overlaps(scene);
  const JointGapMeter joints(scene);
  const double start = energy(scene, simulation.state());
  const auto steps = static_cast<int>(std::lround(scene.duration / settings.step));
  for (int k = 1; k <= steps; ++k) {
    if (simulation.step().status == StepReport::Status::diverged) break;
    const State& state = simulation.state();
    series.points.push_back({k * settings.step, drift == Drift::joint_gap ? joints.gap(state)
                                                : drift == Drift::energy  ? energy(scene, state) - start
                                                                          : overlaps.depth(state)});
  }
  return series;
}

}  // namespace

Sheet drift_sheet(const FigureSource& source) {
  const Settings settings = default_settings(Algorithm::a5);
  Sheet sheet{
      .title = "Drift and energy over time",
      .caption =
          {fmt::format(
               "The default settings of A5 with {0} solves of each row in a step: A2 m = {0}; A3 to A5 "
               "n = {0}, m = 1, τ = {1}, κ = {2} (joints/contacts), stable joints; the scene's step.",
               settings.substeps, tau_text(settings), kappa_text(settings)),
           "Gaps and overlaps below 1 µm are off the scale; A1's contacts have none."},
      .columns = 2};
  struct History {
    const char* scene;
    const char* about;
    const char* axis;
    bool logarithmic;
    Drift drift;
  };
  for (const History& shown :
       {History{"rod_chain", "joints", "largest gap, m", true, Drift::joint_gap},
        History{"rod_chain", "energy", "E − E(0), J", false, Drift::energy},
        History{"heavy_chain", "joints", "largest gap, m", true, Drift::joint_gap},
        History{"top_heavy_stack", "contacts", "deepest overlap, m", true, Drift::penetration}}) {
    const Scene scene = source.scene(shown.scene);
    Panel& panel = sheet.panels.emplace_back();
    panel.title = fmt::format("{}: {}", shown.scene, shown.about);
    panel.x = {"t, s", false, std::array{0.0, scene.duration}};
    panel.y = {shown.axis, shown.logarithmic};
    if (shown.logarithmic) panel.y.range = std::array{1e-6, 10.0};
    for (const Algorithm algorithm : algorithms)
      panel.series.push_back(history_of(scene, algorithm, shown.drift));
  }
  return sheet;
}

Sheet size_sheet(const FigureSource& source) {
  Panel whole{.title = "a step", .x = {"links", true}, .y = {"CPU time, µs", true}};
  Panel each = whole;
  each.title = "a link";
  const Scene scene = source.scene("rod_chain");
  for (const Algorithm algorithm : algorithms) {
    Series steps{std::string(title_of(algorithm)), style_of(algorithm)};
    Series links = steps;
    for (const int count : {4, 8, 16, 32, 64, 128, 256, 512}) {
      Scene chain = lengthened_chain(scene, count);
      Settings settings = usual_settings(chain, algorithm);
      settings.substeps = 4;
      settings.iterations = algorithm == Algorithm::a2 ? 4 : 1;
      settings.tau = settings.kappa = 1;
      settings.joints = algorithm == Algorithm::a3 ? Joints::plain : Joints::stable;
      // Time the steps whether or not the chain tears: a step's cost does not change.
      constexpr int steps_timed = 60;
      chain.duration = steps_timed * settings.step;
      const double time = time_run(chain, settings, 5).median / steps_timed * 1e6;
      steps.points.push_back({static_cast<double>(count), time});
      links.points.push_back({static_cast<double>(count), time / count});
    }
    whole.series.push_back(std::move(steps));
    each.series.push_back(std::move(links));
  }
  return {.title = "Cost against size: a chain of N links",
          .caption = {"rod_chain.gltf made longer; A2 m = 4, A3 to A5 n = 4, m = 1, τ = κ = 1, A3 plain, A4 "
                      "and A5 stable joints; medians of five runs of 60 steps, one core."},
          .columns = 2,
          .panels = {std::move(whole), std::move(each)}};
}

Sheet sweep_errors_sheet(const FigureSource& source) {
  constexpr std::size_t most = 12;
  if (source.problems.empty() || source.problems.size() > most)
    throw Error("give one to {} friction problems with --problem", most);
  Panel panel{.x = {"sweeps", true}, .y = {"natural-map error", true}};
  for (const std::filesystem::path& file : source.problems) {
    const FrozenProblem problem = load_frozen_problem(file);
    // Take a colour for each of six, then the same colours with other points.
    constexpr std::array shapes{7, 5};
    const std::size_t number = panel.series.size();
    const SeriesStyle style{.hue = static_cast<int>(number % 6), .shape = shapes.at(number / 6)};
    Series series{fmt::format("{} ({} contacts)", file.stem().stem().string(), problem.contacts()), style};
    for (const auto& [sweeps, error] : sweep_errors(problem, 1e-8))
      series.points.push_back({static_cast<double>(sweeps), error});
    panel.series.push_back(std::move(series));
  }
  return {.title = "Row-by-row sweeps on friction problems",
          .caption = {"Each sweep solves a normal, then its friction's two rows as one block, as A2 does. A "
                      "run ends at an error of 1e-8 or after 4096 sweeps."},
          .panels = {std::move(panel)}};
}

Sheet coupled_rows_sheet(const FigureSource& source) {
  Sheet sheet{
      .title = "Coupled rows can grow although each row alone is stable",
      .caption = {"Growth in 100 sub-steps of A3, for joints in blocks and bodies at rest: "
                  "the spectral radius of one sub-step's map to the power of 100,",
                  "the largest of seven positions. It does not depend on the sub-step's length: where "
                  "it is above 1, smaller sub-steps do not help."},
      .columns = 2,
      .panel_height = 340};
  const std::vector<CoupledRows> systems = coupled_rows(source.scenes);
  constexpr std::array shapes{7, 6, 5, 9, 11, 4, 8};
  for (const auto& [kappa, iterations] :
       {std::pair{1.0, 1}, std::pair{1.0, 4}, std::pair{lower_kappa, 1}, std::pair{lower_kappa, 4}}) {
    Panel panel{.title = fmt::format("κ = {:g}, m = {}", kappa, iterations),
                .x = {"τ", false, std::array{0.0, 2.0}},
                .y = {"growth in 100 sub-steps", true, std::array{1e-3, 1e6}}};
    for (std::size_t k = 0; k < systems.size(); ++k) {
      Series series{systems[k].name, {static_cast<int>(k), shapes.at(k)}};
      for (int t = 1; t <= 20; ++t)
        series.points.push_back(
            {0.1 * t, std::pow(largest_radius(systems[k], {0.1 * t, kappa}, iterations), 100)});
      panel.series.push_back(std::move(series));
    }
    panel.series.push_back({"above it all grows", {0, 7, true, true, false}, {{0, 1}, {2, 1}}});
    sheet.panels.push_back(std::move(panel));
  }
  return sheet;
}

Sheet ablation_sheet(const FigureSource& source) {
  Panel panel{.x = {"", false, std::array{0.5, 5.5}, "("}, .y = {"largest distance from A3, m", true}};
  for (std::size_t i = 1; i < approximations.size(); ++i)
    panel.x.tics += fmt::format("{}\"{}\" {}", i > 1 ? ", " : "", approximations[i].name, i);
  panel.x.tics += ")";
  struct AblatedScene {
    const char* name;
    int substeps;
    SeriesStyle style;
  };
  for (const AblatedScene& scene :
       {AblatedScene{"pendulum", 4, {2, 7}}, AblatedScene{"rod_chain", 4, {3, 9}},
        AblatedScene{"heavy_chain", 16, {4, 5}}, AblatedScene{"powered_wheel", 4, {5, 11}},
        AblatedScene{"joint_kinds", 4, {1, 13}}}) {
    Series series{fmt::format("{}, n = {}", scene.name, scene.substeps), scene.style};
    series.style.line = false;
    const std::vector<double> costs = ablation_costs(source.scene(scene.name), scene.substeps, 1);
    for (std::size_t i = 1; i < costs.size(); ++i)
      if (costs[i] > 1e-9) series.points.push_back({static_cast<double>(i), costs[i]});
    panel.series.push_back(std::move(series));
  }
  return {.title = "The ablation from A3 to A4 and A5: what each approximation costs",
          .caption = {"A3 with one approximation, or all of A4's, against A3 after 1 s; the scene's step, m "
                      "= 1, plain joints. Distances below 1 nm are not drawn."},
          .columns = 1,
          .panel_height = 360,
          .panels = {std::move(panel)}};
}

}  // namespace substep::report
