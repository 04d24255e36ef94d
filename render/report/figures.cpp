#include "render/report/figures.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "render/report/looks.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/measure/ablation.h"
#include "sim/measure/stability_map.h"
#include "sim/measure/text_table.h"
#include "sim/measure/validity_maps.h"
#include "sim/study/advice.h"
#include "sim/study/engines/engines.h"
#include "sim/study/sweep_results.h"

namespace substep {
namespace {

/// Scenes with more than `fewest` runs that are plotted, which have joints or contacts.
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

/// One panel a scene: families of runs, by some measure of their work.
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
    for (const RunFamily& family : families_of(records)) {
      if (!chosen(family)) continue;
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

Sheet work_rows(const FigureSource& source, bool contacts) {
  Sheet sheet = work_sheet(
      source, contacts,
      contacts ? "Error against rows solved: contacts" : "Error against rows solved: joints and spin",
      "rows solved in a simulated second", is_ours, [](const SweepRecord& record) {
        return static_cast<double>(record.metrics->row_solves) / record.duration;
      });
  sheet.caption = {
      "A1 and A2: steps of h, h/2, h/4 … (A2 with contacts: m = 1, 4, 16, 64 at h); A3 to A5: n = 1, 2, 4 … "
      "sub-steps of one iteration at the scene's "
      "h. A direct "
      "solve counts each row once a pivot.",
      "Down and to the left is better. Not drawn: runs that are lost (error above three times the scene's "
      "size), and "
      "errors below a hundred times the reference's own uncertainty."};
  return sheet;
}

Sheet work_time(const FigureSource& source, bool contacts) {
  Sheet sheet = work_sheet(
      source, contacts,
      contacts ? "Error against CPU time: contacts" : "Error against CPU time: joints and spin",
      "CPU time of a simulated second, s", is_ours_or_accurate,
      [](const SweepRecord& record) { return record.times ? record.times->median / record.duration : NAN; });
  sheet.caption = {
      "One core, medians of the sweep's repetitions. Own, order 4 and 8: the accurate mode beside the five, "
      "h, h/2, h/4 …. A1 and A2: steps of h, h/2, h/4 … (A2 with contacts: m "
      "= 1, 4, 16, 64 at h); A3 to A5: n = 1, 2, "
      "4 … "
      "sub-steps of one iteration at the scene's h.",
      "Down and to the left is better. Not drawn: runs that are lost (error above three times the scene's "
      "size), and "
      "errors below a hundred times the reference's own uncertainty."};
  return sheet;
}

Sheet beside_engines(const FigureSource& source, bool contacts) {
  Sheet sheet = work_sheet(
      source, contacts, contacts ? "Beside other engines: contacts" : "Beside other engines: joints and spin",
      "CPU time of a simulated second, s", stands_beside_engines,
      [](const SweepRecord& record) { return record.times ? record.times->median / record.duration : NAN; });
  sheet.caption = {
      "The same scene files, one core. The engines and A1: steps of h, h/2, h/4 …; A3 and A5: n = 1, 2, 4 … "
      "sub-steps of one "
      "iteration at the scene's h; τ = 0.6 with contacts, else 1.",
      "Down and to the left is better. Against the same reference: for contacts it is our A1 at a small "
      "step."};
  return sheet;
}

Sheet order(const FigureSource& source) {
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

Sheet slopes(const FigureSource& source) {
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
    for (const RunFamily& family : families_of(of_scene(source.records, scene))) {
      if (!is_ours(family)) continue;
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

Sheet equal_rows(const FigureSource& source) {
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

Scene scene_at(const FigureSource& source, const std::string& name) {
  return load_scene(source.scenes / (name + ".gltf"));
}

constexpr std::array algorithms{Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5};

std::string title_of(Algorithm algorithm) {
  return fmt::format("A{}", static_cast<int>(algorithm) + 1);
}

Sheet drift(const FigureSource& source) {
  const Settings settings = default_settings(Algorithm::a5);
  Sheet sheet;
  sheet.title = "Drift and energy over time";
  sheet.columns = 2;
  sheet.panel_width = 500;
  sheet.legend_columns = 5;
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
    const Scene scene = scene_at(source, view.scene);
    Panel panel;
    panel.title = view.title;
    panel.x = {"t, s", false, std::array{0.0, scene.duration}, {}};
    panel.y = {view.axis, view.logarithmic, {}, {}};
    if (view.logarithmic) panel.y.range = std::array{1e-6, 10.0};
    for (const Algorithm algorithm : algorithms) {
      Series series{title_of(algorithm), look_of(algorithm), {}};
      series.look.points = false;
      series.look.dashed = algorithm == Algorithm::a5;  // it lies on A4 where nothing tells them apart
      for (const HistoryPoint& point : history(scene, usual_settings(scene, algorithm))) {
        series.points.push_back({point.time, view.value(point)});
      }
      panel.series.push_back(std::move(series));
    }
    sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {
      fmt::format(
          "The default settings, the scene's step: {0} row solves a row and step, A2 m = {0}; A3 to A5 "
          "n = {0}, m = 1, τ = {1:g}, κ = 1, stable joints.",
          settings.substeps, settings.tau),
      "A gap or overlap below 1 µm is off the scale: A1's contacts have none."};
  return sheet;
}

Sheet size(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "Cost against size: a chain of N links";
  sheet.columns = 2;
  sheet.legend_columns = 5;
  Panel whole;
  whole.title = "a step";
  whole.x = {"links", true, {}, {}};
  whole.y = {"CPU time, µs", true, {}, {}};
  Panel each = whole;
  each.title = "a link";
  const Scene scene = scene_at(source, "rod_chain");
  for (const Algorithm algorithm : algorithms) {
    Series steps{title_of(algorithm), look_of(algorithm), {}};
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

/// Marks of a point where the run is right, and of one where it is lost.
constexpr Look holds{2, 7, false, false, true};
constexpr Look fails{4, 2, false, false, true};

/// Three panels in a row, with what became of the runs as points.
Sheet validity_sheet(const std::string& title) {
  Sheet sheet;
  sheet.title = title;
  sheet.columns = 3;
  sheet.panel_width = 360;
  sheet.legend_columns = 3;
  return sheet;
}

Sheet mass_ratio(const FigureSource& source) {
  Sheet sheet = validity_sheet("Mass ratio against sub-steps: a chain with a heavy end");
  const Scene scene = scene_at(source, "heavy_chain");
  struct Row {
    Algorithm algorithm;
    Joints joints;
  };
  for (const Row& row : {Row{Algorithm::a3, Joints::plain}, Row{Algorithm::a5, Joints::plain},
                         Row{Algorithm::a5, Joints::stable}}) {
    Settings settings = usual_settings(scene, row.algorithm);
    settings.joints = row.joints;
    settings.tau = settings.kappa = 1;
    Series good{"error below 1 % of the size", holds, {}};
    Series fair{"bounded: below 10 %", {1, 9, false, false, true}, {}};
    Series lost{"lost", fails, {}};
    for (const MassRatioPoint& point : mass_ratio_map(scene, settings, 1, 64)) {
      Series& series = !point.bounded ? lost : point.error < 0.01 ? good : fair;
      series.points.push_back({point.ratio, static_cast<double>(point.substeps)});
    }
    Panel panel;
    panel.title = fmt::format("{} {}", title_of(row.algorithm), name(row.joints));
    panel.x = {"mass of the end / of a link", true, std::array{0.4, 25000.0}, {}};
    panel.y = {"sub-steps n", true, std::array{0.7, 90.0}, "(1, 2, 4, 8, 16, 32, 64)"};
    panel.series = {std::move(good), std::move(fair), std::move(lost)};
    sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {
      "heavy_chain.gltf, the ball's mass changed; h = 1/60 s, m = 1, τ = κ = 1, 1 s against the reference.",
      "Bounded: RMS error below 10 % of the chain's length, joints open by less than 10 % of a link, no "
      "energy gained."};
  return sheet;
}

Sheet stiffness(const FigureSource&) {
  Sheet sheet = validity_sheet("Step against stiffness: one weight of 1 kg on a spring without damping");
  sheet.panel_height = 300;
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a3, Algorithm::a5}) {
    Settings settings;
    settings.algorithm = algorithm;
    Series good{"keeps its energy to 10 % for 1 s", holds, {}};
    Series damped{"is damped", {1, 6, false, false, true}, {}};
    Series grows{"gains energy", fails, {}};
    for (const StiffnessPoint& point : stiffness_map(settings)) {
      Series& series = !(point.energy <= 1.1) ? grows : point.energy < 0.9 ? damped : good;
      series.points.push_back({point.stiffness, point.step});
    }
    Panel panel;
    panel.title = label(settings).substr(0, label(settings).find("  h="));
    panel.x = {"stiffness, N/m", true, std::array{0.3, 3e8},
               "(1, '10^2' 1e2, '10^4' 1e4, '10^6' 1e6, '10^8' 1e8)"};
    panel.y = {"h, s", true, std::array{1.0 / 700, 1.0 / 20},
               "('1/480' 1./480, '1/240' 1./240, '1/120' 1./120, '1/60' 1./60, '1/30' 1./30)"};
    panel.series = {std::move(good), std::move(damped), std::move(grows)};
    sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {
      "A spring is taken implicitly (a soft limit): too stiff for the step, it should be damped and never "
      "gain "
      "energy."};
  return sheet;
}

Sheet stability(const FigureSource&) {
  Sheet sheet = validity_sheet("Stability of one constraint row under τ and κ");
  sheet.panel_height = 340;
  const std::vector<StabilityPoint> points = measure_stability_map();
  for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    Series stable{"stable", holds, {}};
    Series unstable{"unstable", fails, {}};
    for (const StabilityPoint& point : points) {
      if (point.algorithm != algorithm) continue;
      (point.stable ? stable : unstable).points.push_back({point.kappa, point.tau});
    }
    Panel panel;
    panel.title = title_of(algorithm);
    panel.x = {"κ", false, std::array{0.0, 2.0}, {}};
    panel.y = {"τ", false, std::array{0.0, 4.0}, {}};
    Series border{"closed form: τ = 4 − 2κ", {0, 7, false, true, false}, {}};
    border.points = {{0, stability_border(0)}, {2, stability_border(2)}};
    panel.series = {std::move(stable), std::move(unstable), std::move(border)};
    sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {
      "A weight without gravity whose joint is off by 1 mm; 8 sub-steps, 200 steps. Stable: it came closer."};
  return sheet;
}

Sheet ablation(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "The ablation from A3 to A4 and A5: what each approximation costs";
  sheet.columns = 1;
  sheet.panel_width = 860;
  sheet.panel_height = 360;
  Panel panel;
  panel.title = "";
  panel.x = {"", false, std::array{0.5, 5.5}, "("};
  for (std::size_t i = 1; i < approximations.size(); ++i) {
    panel.x.tics += fmt::format("{}\"{}\" {}", i > 1 ? ", " : "", name(approximations[i]), i);
  }
  panel.x.tics += ")";
  panel.y = {"largest distance from A3, m", true, {}, {}};
  struct Rungs {
    const char* scene;
    int substeps;
    Look look;
  };
  for (const Rungs& row :
       {Rungs{"pendulum", 4, {2, 7, false, true, true}}, Rungs{"rod_chain", 4, {3, 9, false, true, true}},
        Rungs{"heavy_chain", 16, {4, 5, false, true, true}},
        Rungs{"powered_wheel", 4, {5, 11, false, true, true}},
        Rungs{"joint_kinds", 4, {1, 13, false, true, true}}}) {
    Series series{fmt::format("{}, n = {}", row.scene, row.substeps), row.look, {}};
    series.look.line = false;
    const std::vector<double> costs = ablation_costs(scene_at(source, row.scene), row.substeps, 1);
    for (std::size_t i = 1; i < costs.size(); ++i) {
      if (costs[i] > 1e-9) series.points.push_back({static_cast<double>(i), costs[i]});
    }
    panel.series.push_back(std::move(series));
  }
  sheet.panels = {std::move(panel)};
  sheet.caption = {
      "A3 with one approximation switched on, against A3, after 1 s; the scene's step, m = 1, plain joints. "
      "Below "
      "1 nm is not drawn."};
  return sheet;
}

/// An axis around the costs that are finite, with room for a note on either side and a decade to read.
std::array<double, 2> range_of(const ContactAblationCosts& scene) {
  double least = INFINITY;
  double most = -INFINITY;
  for (const double cost : scene.costs) {
    if (!std::isfinite(cost)) continue;
    least = std::min(least, std::log10(cost));
    most = std::max(most, std::log10(cost));
  }
  const double span = std::max(most - std::floor(least), 1.0);
  const double first = std::min(std::floor(least), least - 0.22 * span);
  return {std::pow(10, first), std::pow(10, std::max(most, first + span) + 0.2 * span)};
}

Panel contact_panel(const ContactAblationCosts& scene) {
  Panel panel;
  panel.title = fmt::format("{}: {}", scene.scene, scene.what);
  panel.x = {scene.unit, true, range_of(scene), {}};
  // From above downwards, as in a table.
  panel.y = {"", false, std::array{static_cast<double>(contact_ablations.size()) - 0.4, -0.6}, "("};
  Series all{std::string(name(ContactAblation::all_six)), {0, 5, false, false, true}, {}};
  Series open{"a reading of the report taken out", {2, 7, false, false, true}, {}};
  Series beyond{"what goes beyond the report taken out", {4, 9, false, false, true}, {}};
  for (std::size_t i = 0; i < contact_ablations.size(); ++i) {
    const ContactAblation approximation = contact_ablations[i];
    const auto y = static_cast<double>(i);
    panel.y.tics += fmt::format("{}\"{}\" {}", i > 0 ? ", " : "", name(approximation), i);
    const bool is_lost = !std::isfinite(scene.costs[i]);
    const double x = is_lost ? (*panel.x.range)[0] : scene.costs[i];
    Series& series = i == 0 ? all : is_beyond_report(approximation) ? beyond : open;
    if (!is_lost) series.points.push_back({x, y});
    // Away from the dashed line.
    panel.notes.push_back(
        {x, y, is_lost ? std::string("lost") : short_number(x), !is_lost && x < 0.97 * scene.costs[0]});
  }
  panel.y.tics += ")";
  Series baseline{"as good as all six", {0, 7, true, true, false}, {}};
  baseline.points = {{scene.costs[0], (*panel.y.range)[0]}, {scene.costs[0], (*panel.y.range)[1]}};
  panel.series = {std::move(baseline), std::move(all), std::move(open), std::move(beyond)};
  return panel;
}

Sheet contact_ablation_sheet(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "Ablation of contacts: what each reading costs when it is taken out";
  sheet.columns = 2;
  sheet.panel_width = 640;
  sheet.panel_height = 300;
  sheet.left_margin = 220;
  sheet.legend_columns = 2;
  const std::vector<ContactAblationCosts> measured =
      source.contact_ablation.empty() ? contact_ablation(source.scenes) : source.contact_ablation;
  for (const ContactAblationCosts& scene : measured) sheet.panels.push_back(contact_panel(scene));
  const Settings settings = default_settings(Algorithm::a5);
  sheet.caption = {fmt::format(
      "A5 at the default settings (n = {}, m = {}, τ = {:g}, κ = {:g}, {} joints, the scene's step) with one "
      "of the six readings of contacts taken out. Further to the left is better; the dashed line is where "
      "all six are.",
      settings.substeps, settings.iterations, settings.tau, settings.kappa, name(settings.joints))};
  return sheet;
}

}  // namespace

const std::vector<ReportFigure>& figures() {
  static const std::vector<ReportFigure> all{
      {"work-rows", "error against rows solved: joints and spin", true, true,
       [](const FigureSource& source) { return work_rows(source, false); }},
      {"work-rows-contacts", "error against rows solved: contacts", true, true,
       [](const FigureSource& source) { return work_rows(source, true); }},
      {"work-time", "error against CPU time: joints and spin", false, true,
       [](const FigureSource& source) { return work_time(source, false); }},
      {"work-time-contacts", "error against CPU time: contacts", false, true,
       [](const FigureSource& source) { return work_time(source, true); }},
      {"engines", "beside other engines: joints and spin", false, true,
       [](const FigureSource& source) { return beside_engines(source, false); }},
      {"engines-contacts", "beside other engines: contacts", false, true,
       [](const FigureSource& source) { return beside_engines(source, true); }},
      {"order", "error against the (sub-)step, with slope triangles", true, true, order},
      {"slopes", "local order: the slope from each run to the next", true, true, slopes},
      {"equal-rows", "sub-steps against iterations at equal row solves", true, true, equal_rows},
      {"drift", "joint gaps, overlaps and energy over time", true, false, drift},
      {"mass-ratio", "validity: mass ratio against sub-steps", true, false, mass_ratio},
      {"stiffness", "validity: step against a spring's stiffness", true, false, stiffness},
      {"stability", "validity: τ against κ, with the closed form", true, false, stability},
      {"ablation", "what each approximation from A3 to A5 costs", true, false, ablation},
      {"contact-ablation", "what each reading of contacts costs when it is taken out of A5", true, false,
       contact_ablation_sheet},
      {"size", "CPU time against the length of a chain", false, false, size}};
  return all;
}

const ReportFigure& figure_named(const std::string& name) {
  const auto found = std::ranges::find(figures(), name, &ReportFigure::name);
  if (found != figures().end()) return *found;
  std::vector<std::string_view> names;
  for (const ReportFigure& figure : figures()) names.push_back(figure.name);
  throw Error(fmt::format("there is no figure '{}'; there are {}", name, fmt::join(names, " ")));
}

}  // namespace substep
