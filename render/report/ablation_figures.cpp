#include "render/report/ablation_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "sim/measure/ablation.h"
#include "sim/measure/text_table.h"
#include "sim/measure/validity_maps.h"

namespace substep::report {
namespace {

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
  Series all{std::string(name(ContactAblation::none)), {0, 5, false, false, true}, {}};
  Series off{"an option switched off", {2, 7, false, false, true}, {}};
  for (std::size_t i = 0; i < contact_ablations.size(); ++i) {
    const ContactAblation approximation = contact_ablations[i];
    const auto y = static_cast<double>(i);
    panel.y.tics += fmt::format("{}\"{}\" {}", i > 0 ? ", " : "", name(approximation), i);
    const bool is_lost = !std::isfinite(scene.costs[i]);
    const double x = is_lost ? (*panel.x.range)[0] : scene.costs[i];
    Series& series = i == 0 ? all : off;
    if (!is_lost) series.points.push_back({x, y});
    // Away from the dashed line.
    panel.notes.push_back(
        {x, y, is_lost ? std::string("lost") : short_number(x), !is_lost && x < 0.97 * scene.costs[0]});
  }
  panel.y.tics += ")";
  Series baseline{"as good as A5", {0, 7, true, true, false}, {}};
  baseline.points = {{scene.costs[0], (*panel.y.range)[0]}, {scene.costs[0], (*panel.y.range)[1]}};
  panel.series = {std::move(baseline), std::move(all), std::move(off)};
  return panel;
}

}  // namespace

Sheet ablation_sheet(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "The ablation from A3 to A4 and A5: what each approximation costs";
  sheet.columns = 1;
  sheet.panel_height = 360;
  Panel panel;
  panel.title = "";
  panel.x = {"", false, std::array{0.5, 5.5}, "("};
  for (std::size_t i = 1; i < approximations.size(); ++i) {
    panel.x.tics += fmt::format("{}\"{}\" {}", i > 1 ? ", " : "", name(approximations[i]), i);
  }
  panel.x.tics += ")";
  panel.y = {"largest distance from A3, m", true, {}, {}};
  struct AblatedScene {
    const char* scene;
    int substeps;
    Look look;
  };
  for (const AblatedScene& row : {AblatedScene{"pendulum", 4, {2, 7, false, true, true}},
                                  AblatedScene{"rod_chain", 4, {3, 9, false, true, true}},
                                  AblatedScene{"heavy_chain", 16, {4, 5, false, true, true}},
                                  AblatedScene{"powered_wheel", 4, {5, 11, false, true, true}},
                                  AblatedScene{"joint_kinds", 4, {1, 13, false, true, true}}}) {
    Series series{fmt::format("{}, n = {}", row.scene, row.substeps), row.look, {}};
    series.look.line = false;
    const std::vector<double> costs = ablation_costs(source.scene(row.scene), row.substeps, 1);
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

Sheet contact_ablation_sheet(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "Ablation of contacts: what each option costs when it is switched off";
  sheet.columns = 2;
  sheet.panel_height = 300;
  const std::vector<ContactAblationCosts> measured =
      source.contact_ablation.empty() ? contact_ablation(source.scenes) : source.contact_ablation;
  for (const ContactAblationCosts& scene : measured) sheet.panels.push_back(contact_panel(scene));
  const Settings settings = default_settings(Algorithm::a5);
  sheet.caption = {fmt::format(
      "A5 at the default settings of most scenes (n = {}, m = {}, τ = {}, κ = {} of joints/contacts, {} "
      "joints, the scene's "
      "step) with one option of contacts switched off. Further to the left is better; the dashed line is A5.",
      settings.substeps, settings.iterations, tau_text(settings), kappa_text(settings),
      name(settings.joints))};
  return sheet;
}

}  // namespace substep::report
