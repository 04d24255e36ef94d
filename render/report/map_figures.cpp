// Draws maps of the settings with which runs are right: from sweeps over two settings, and from runs made
// for a map.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "render/report/figures.h"
#include "sim/measure/validity_maps.h"
#include "sim/model/usual_settings.h"
#include "sim/simulation.h"
#include "sim/study/sweep_results.h"

namespace substep::report {
namespace {

constexpr SeriesStyle good_mark{2, 7, false, false};
constexpr SeriesStyle fair_mark{1, 9, false, false};
constexpr SeriesStyle bad_mark{4, 2, false, false};

using Axes = std::array<double, 2> (*)(const Settings& settings);

/// The runs of a scene that differ in two settings alone.
struct MappedRuns {
  std::vector<SweepRecord> runs;
  std::array<std::set<double>, 2> values;
};

/// Groups the runs of A3 to A5 that differ in two settings alone, `axes`. `without` sets these two to fixed
/// values. Leaves out groups with fewer than `least` values of a setting.
std::vector<MappedRuns> mapped_runs(const std::vector<SweepRecord>& records, Axes axes,
                                    Settings (*without)(Settings settings), std::size_t least) {
  std::vector<MappedRuns> maps;
  std::map<std::string, std::size_t> index;
  for (const SweepRecord& record : records) {
    const Settings& s = record.settings;
    if (!is_own_run(record) || s.algorithm < Algorithm::a3 || !is_of_report(s.algorithm)) continue;
    const auto [at, is_new] = index.try_emplace(record.scene + label(without(s)), maps.size());
    if (is_new) maps.emplace_back();
    MappedRuns& map = maps[at->second];
    map.runs.push_back(record);
    for (std::size_t i = 0; i < 2; ++i) map.values[i].insert(axes(s)[i]);
  }
  std::erase_if(maps, [least](const MappedRuns& map) {
    return map.values[0].size() < least || map.values[1].size() < least;
  });
  return maps;
}

/// Sets a range around the values, and gnuplot's tics at them.
void set_values(Axis& axis, const std::set<double>& values, std::string (*text)(double value)) {
  std::vector<std::string> tics;
  for (const double value : values) tics.push_back(fmt::format("\"{}\" {:.12g}", text(value), value));
  axis.tics = fmt::format("({})", fmt::join(tics, ", "));
  const double low = *values.begin();
  const double high = *values.rbegin();
  const double margin = axis.logarithmic ? std::pow(high / low, 0.1) : 0.1 * (high - low);
  axis.range =
      axis.logarithmic ? std::array{low / margin, high * margin} : std::array{low - margin, high + margin};
}

/// Adds a panel with a point for each run: right, bounded or not bounded.
Panel& add_map(Sheet& sheet, const MappedRuns& map, Axes axes, Axis x, Axis y) {
  std::vector<Series> series{
      {"error or gap below 1 % of the size", good_mark}, {"bounded", fair_mark}, {"not bounded", bad_mark}};
  for (const SweepRecord& run : map.runs) {
    const double error = error_or_gap_of(run);
    Series& own = series.at(!run.metrics->bounded ? 2 : error < 0.01 ? 0 : 1);
    own.points.push_back(axes(run.settings));
    own.values.push_back(error);
  }
  std::erase_if(series, [](const Series& one) { return one.points.empty(); });
  return sheet.panels.emplace_back(Panel{.x = std::move(x), .y = std::move(y), .series = std::move(series)});
}

std::string plain_text(double value) {
  return fmt::format("{:g}", value);
}

constexpr const char* map_caption =
    "Error: RMS over the scene's size while the reference lasts; where it diverges at once, the largest "
    "joint gap or overlap. Bounded: see the report's 'What stays bounded'. Blank: not run. Errors: .csv.";

/// Returns the lowest three boxes of a stack, of this mass in kg each.
Scene three_boxes(Scene scene, double mass) {
  scene.bodies.resize(4);  // the world's, and three boxes
  std::erase_if(scene.colliders, [](const Collider& collider) { return collider.body >= 4; });
  for (Body& body : scene.bodies) {
    if (body.inverse_mass == 0) continue;
    body.inverse_inertia /= mass * body.inverse_mass;
    body.inverse_mass = 1 / mass;
  }
  return scene;
}

/// Returns the largest displacement of a box in 5 s, or the first above 1 m; infinite where a box turns by
/// more than half a radian or the run diverges.
double displacement_of_boxes(const Scene& scene, const Settings& settings) {
  Simulation simulation(scene, settings);
  double largest = 0;
  for (int step = 0; step < std::lround(5 / settings.step) && largest <= 1; ++step) {
    if (simulation.step().status == StepReport::Status::diverged) return infinity;
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
      const Coordinates& q = simulation.state().q[i];
      largest = std::max(largest, (q.linear - scene.bodies[i].pose.position).norm());
      if (q.angular.angularDistance(scene.bodies[i].pose.orientation) > 0.5) return infinity;
    }
  }
  return largest;
}

}  // namespace

Sheet step_map_sheet(const FigureSource& source) {
  const Axes axes = [](const Settings& s) { return std::array{static_cast<double>(s.substeps), s.step}; };
  const auto without = [](Settings s) {
    s.substeps = 1;
    s.step = 1;
    return s;
  };
  Sheet sheet{.title = "Sub-steps n against the step h", .caption = {map_caption}};
  for (const MappedRuns& map : mapped_runs(source.records, axes, without, 2)) {
    const SweepRecord& first = map.runs.front();
    Panel& panel = add_map(sheet, map, axes, {"n", true}, {"h, s", true});
    panel.title = fmt::format("{}: {}", first.scene, title_of(first.settings.algorithm));
    set_values(panel.x, map.values[0], plain_text);
    set_values(panel.y, map.values[1], [](double h) { return fmt::format("1/{:.6g}", 1 / h); });
  }
  return sheet;
}

Sheet factor_map_sheet(const FigureSource& source) {
  const Axes axes = [](const Settings& s) { return std::array{s.kappa, s.tau}; };
  const auto without = [](Settings s) {
    // Leave out runs whose contacts have factors of their own.
    if (s.contact_tau == 0 && s.contact_kappa == 0) s.tau = s.kappa = 1;
    return s;
  };
  Sheet sheet{.title = "τ against κ, of joints and contacts alike", .caption = {map_caption}};
  for (const MappedRuns& map : mapped_runs(source.records, axes, without, 3)) {
    const SweepRecord& first = map.runs.front();
    Panel& panel = add_map(sheet, map, axes, {"κ"}, {"τ"});
    panel.title =
        fmt::format("{}: {}, n = {}, h = 1/{:.6g} s", first.scene, title_of(first.settings.algorithm),
                    first.settings.substeps, 1 / first.settings.step);
    set_values(panel.x, map.values[0], plain_text);
    set_values(panel.y, map.values[1], plain_text);
  }
  return sheet;
}

Sheet mass_ratio_sheet(const FigureSource& source) {
  Sheet sheet{.title = "Mass ratio against sub-steps: a chain with a heavy end",
              .caption = {"heavy_chain.gltf, the ball's mass changed; 1 s against the reference. A1: steps "
                          "of 1/(60 n) s; A3, A5: h = 1/60 s, m = 1, τ = κ = 1.",
                          "At one n all four solve each row as often.",
                          "Bounded: RMS error below 10 % of the chain's length, joint gaps below 10 % of the "
                          "smallest body, energy rise below 10 % of a fall's."},
              .columns = 2};
  const Scene scene = source.scene("heavy_chain");
  for (const auto& [algorithm, joints] :
       {std::pair(Algorithm::a1, Joints::plain), std::pair(Algorithm::a3, Joints::plain),
        std::pair(Algorithm::a5, Joints::plain), std::pair(Algorithm::a5, Joints::stable)}) {
    Settings settings = usual_settings(scene, algorithm);
    settings.joints = joints;
    settings.tau = settings.kappa = 1;
    std::vector<Series> series{{"error below 1 % of the size", good_mark},
                               {"bounded: below 10 %", fair_mark},
                               {"not bounded", bad_mark}};
    for (const MassRatioPoint& point : mass_ratio_map(scene, settings, 1, 64)) {
      const std::size_t kind = !point.bounded ? 2 : point.error < 0.01 ? 0 : 1;
      series[kind].points.push_back({point.ratio, static_cast<double>(point.substeps)});
    }
    const bool is_direct = algorithm == Algorithm::a1;
    sheet.panels.push_back({.title = is_direct ? std::string(title_of(algorithm))
                                               : fmt::format("{} {}", title_of(algorithm), name(joints)),
                            .x = {"mass of the end / of a link", true, std::array{0.4, 25000.0}},
                            .y = {is_direct ? "n: steps of 1/(60 n) s" : "sub-steps n", true,
                                  std::array{0.7, 90.0}, "(1, 2, 4, 8, 16, 32, 64)"},
                            .series = std::move(series)});
  }
  return sheet;
}

Sheet stiffness_sheet(const FigureSource&) {
  Sheet sheet{.title = "Step against stiffness: one weight of 1 kg on a spring without damping",
              .caption = {"A spring is a soft limit, integrated implicitly: one too stiff for the step loses "
                          "energy, and must never gain any."},
              .panel_height = 300};
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a3, Algorithm::a5}) {
    Settings settings;
    settings.algorithm = algorithm;
    std::vector<Series> series{{"keeps its energy to 10 % for 1 s", good_mark},
                               {"is damped", {1, 6, false, false}},
                               {"gains energy", bad_mark}};
    for (const StiffnessPoint& point : stiffness_map(settings)) {
      const std::size_t kind = !(point.energy <= 1.1) ? 2 : point.energy < 0.9 ? 1 : 0;
      series[kind].points.push_back({point.stiffness, point.step});
    }
    sheet.panels.push_back(
        {.title = label(settings).substr(0, label(settings).find("  h=")),
         .x = {"stiffness, N/m", true, std::array{0.3, 3e8},
               "(1, '10^2' 1e2, '10^4' 1e4, '10^6' 1e6, '10^8' 1e8)"},
         .y = {"h, s", true, std::array{1.0 / 700, 1.0 / 20},
               "('1/480' 1./480, '1/240' 1./240, '1/120' 1./120, '1/60' 1./60, '1/30' 1./30)"},
         .series = std::move(series)});
  }
  return sheet;
}

Sheet stability_sheet(const FigureSource&) {
  Sheet sheet{.title = "Stability of one constraint row under τ and κ",
              .caption = {"A weight without gravity whose joint is off by 1 mm; 8 sub-steps, 200 steps. "
                          "Stable: it came closer."},
              .panel_height = 340};
  const std::vector<StabilityPoint> points = stability_map();
  for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    Series stable{"stable", good_mark};
    Series unstable{"unstable", bad_mark};
    for (const StabilityPoint& point : points) {
      if (point.algorithm != algorithm) continue;
      (point.converges ? stable : unstable).points.push_back({point.kappa, point.tau});
    }
    Series border{"closed form: τ = 4 − 2κ",
                  {0, 7, false, true, false},
                  {{0, stability_border(0)}, {2, stability_border(2)}}};
    sheet.panels.push_back({.title = std::string(title_of(algorithm)),
                            .x = {"κ", false, std::array{0.0, 2.0}},
                            .y = {"τ", false, std::array{0.0, 4.0}},
                            .series = {std::move(stable), std::move(unstable), std::move(border)}});
  }
  return sheet;
}

Sheet avbd_stability_sheet(const FigureSource& source) {
  Sheet sheet{
      .title = "AVBD: three boxes of 1 m in a stack, by mass and β",
      .caption = {"h = 1/60 s, α = 0.99, γ = 0.999. No other method here depends on the mass scale."}};
  const Scene stack = source.scene("box_stack");
  for (const int iterations : {5, 10, 20}) {
    Settings settings = default_settings(Algorithm::avbd);
    settings.iterations = iterations;
    settings.step = stack.step;
    std::vector<Series> series{{"move by less than 1 cm in 5 s", good_mark},
                               {"by less than 10 cm", {6, 6, false, false}},
                               {"by less than 1 m", {1, 8, false, false}},
                               {"farther, or turn over", bad_mark}};
    for (int decade = -3; decade <= 6; ++decade) {
      const double mass = std::pow(10, decade);
      const Scene boxes = three_boxes(stack, mass);
      for (int exponent = 0; exponent <= 10; ++exponent) {
        settings.beta = std::pow(10, exponent);
        const double moved = displacement_of_boxes(boxes, settings);
        const std::size_t kind = moved < 0.01 ? 0 : moved < 0.1 ? 1 : moved <= 1 ? 2 : 3;
        series[kind].points.push_back({mass, settings.beta});
      }
    }
    series.push_back({"default", {0, 7, true, true, false}, {{3e-4, 1e4}, {3e6, 1e4}}});
    sheet.panels.push_back({.title = fmt::format("{} iterations", iterations),
                            .x = {"mass of a box, kg", true, std::array{3e-4, 3e6}},
                            .y = {"β, N/m²", true, std::array{0.3, 3e10}},
                            .series = std::move(series)});
  }
  return sheet;
}

}  // namespace substep::report
