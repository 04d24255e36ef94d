#include "render/report/validity_figures.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "render/report/looks.h"
#include "sim/measure/stability_map.h"
#include "sim/measure/substep_map.h"
#include "sim/measure/validity_maps.h"
#include "sim/model/usual_settings.h"

namespace substep::report {
Sheet mass_ratio_sheet(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "Mass ratio against sub-steps: a chain with a heavy end";
  const Scene scene = source.scene("heavy_chain");
  struct Row {
    Algorithm algorithm;
    Joints joints;
  };
  sheet.columns = 2;
  for (const Row& row : {Row{Algorithm::a1, Joints::plain}, Row{Algorithm::a3, Joints::plain},
                         Row{Algorithm::a5, Joints::plain}, Row{Algorithm::a5, Joints::stable}}) {
    Settings settings = usual_settings(scene, row.algorithm);
    settings.joints = row.joints;
    settings.tau = settings.kappa = 1;
    Series good{"error below 1 % of the size", good_mark, {}};
    Series fair{"bounded: below 10 %", fair_mark, {}};
    Series lost{"lost", lost_mark, {}};
    for (const MassRatioPoint& point : mass_ratio_map(scene, settings, 1, 64)) {
      Series& series = !point.bounded ? lost : point.error < 0.01 ? good : fair;
      series.points.push_back({point.ratio, static_cast<double>(point.substeps)});
    }
    Panel panel;
    const bool is_direct = row.algorithm == Algorithm::a1;
    panel.title = is_direct ? std::string(title_of(row.algorithm))
                            : fmt::format("{} {}", title_of(row.algorithm), name(row.joints));
    panel.x = {"mass of the end / of a link", true, std::array{0.4, 25000.0}, {}};
    panel.y = {is_direct ? "n: steps of 1/(60 n) s" : "sub-steps n", true, std::array{0.7, 90.0},
               "(1, 2, 4, 8, 16, 32, 64)"};
    panel.series = {std::move(good), std::move(fair), std::move(lost)};
    sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {
      "heavy_chain.gltf, the ball's mass changed; 1 s against the reference. A1: steps of 1/(60 n) s; A3, "
      "A5: h "
      "= 1/60 s, m = 1, τ = κ = 1.",
      "At one n all four solve each row as often.",
      "Bounded: RMS error below 10 % of the chain's length, joints open by less than 10 % of a link, no "
      "energy gained."};
  return sheet;
}

Sheet stiffness_sheet(const FigureSource&) {
  Sheet sheet;
  sheet.title = "Step against stiffness: one weight of 1 kg on a spring without damping";
  sheet.panel_height = 300;
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a3, Algorithm::a5}) {
    Settings settings;
    settings.algorithm = algorithm;
    Series good{"keeps its energy to 10 % for 1 s", good_mark, {}};
    Series damped{"is damped", {1, 6, false, false, true}, {}};
    Series grows{"gains energy", lost_mark, {}};
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

Sheet stability_sheet(const FigureSource&) {
  Sheet sheet;
  sheet.title = "Stability of one constraint row under τ and κ";
  sheet.panel_height = 340;
  const std::vector<StabilityPoint> points = measure_stability_map();
  for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    Series stable{"stable", good_mark, {}};
    Series unstable{"unstable", lost_mark, {}};
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

Sheet coupled_rows_sheet(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "One row's limit is not the system's: growth in a sub-step";
  sheet.panel_height = 340;
  sheet.columns = 2;
  const std::vector<CoupledRows> systems = coupled_rows(source.scenes);
  constexpr std::array shapes{7, 6, 5, 9, 11, 4, 8};
  for (const auto& [kappa, iterations] :
       {std::pair{1.0, 1}, std::pair{1.0, 4}, std::pair{lower_kappa, 1}, std::pair{lower_kappa, 4}}) {
    Panel panel;
    panel.title = fmt::format("κ = {:g}, m = {}", kappa, iterations);
    panel.x = {"τ", false, std::array{0.0, 2.0}, {}};
    panel.y = {"growth in 100 sub-steps", true, std::array{1e-3, 1e6}, {}};
    for (std::size_t k = 0; k < systems.size(); ++k) {
      Series series{systems[k].name, {static_cast<int>(k), shapes.at(k)}, {}};
      for (int t = 1; t <= 20; ++t)
        series.points.push_back(
            {0.1 * t, std::pow(largest_radius(systems[k], {0.1 * t, kappa}, iterations), 100)});
      panel.series.push_back(std::move(series));
    }
    panel.series.push_back({"above it all grows", {0, 7, true, true, false}, {{0, 1}, {2, 1}}});
    sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {
      "The spectral radius of a sub-step's map of A3, to the power of 100: joints in blocks, at rest, off by "
      "little;",
      "the largest of seven positions. The sub-step's length falls out: where it grows, smaller ones do not "
      "help."};
  return sheet;
}

}  // namespace substep::report
