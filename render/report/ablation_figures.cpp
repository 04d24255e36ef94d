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

}  // namespace substep::report
