#include "render/report/descendant_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "render/report/looks.h"
#include "sim/descendants/soft_step.h"
#include "sim/measure/validity_maps.h"
#include "sim/model/usual_settings.h"
#include "sim/study/sweep_results.h"

namespace substep::report {
namespace {

constexpr double shown_warm_start = 0.5;
constexpr double stiffer_hertz = 240;
constexpr std::array merit_range{1e-6, 10.0};  // m

/// A line of the comparison.
struct Contender {
  const char* title;
  Look look;
  Settings settings;  ///< without n
};

/// Returns the lines of the comparison, with published defaults.
std::vector<Contender> contenders() {
  const auto look = [](Algorithm algorithm, bool is_variant) {
    Look result = look_of(algorithm);
    result.dashed = is_variant;
    if (is_variant) result.shape -= 1;
    return result;
  };
  const auto settings = [](Algorithm algorithm) { return default_settings(algorithm); };
  Settings warm = settings(Algorithm::a5);
  warm.warm_start = shown_warm_start;
  Settings xpbd;
  xpbd.joints = Joints::stable;
  Settings stiffer = settings(Algorithm::soft);
  stiffer.contact_hertz = stiffer.joint_hertz = stiffer_hertz;
  return {{"A1", look(Algorithm::a1, false), settings(Algorithm::a1)},
          {"A3", look(Algorithm::a3, false), settings(Algorithm::a3)},
          {"A5", look(Algorithm::a5, false), settings(Algorithm::a5)},
          {"A5, warm start", look(Algorithm::a5, true), warm},
          {"XPBD: A3 with τ = κ = 1", look(Algorithm::a3, true), xpbd},
          {"Soft Step", look(Algorithm::soft, false), settings(Algorithm::soft)},
          {"Soft Step, 240 Hz", look(Algorithm::soft, true), stiffer},
          {"AVBD", look(Algorithm::avbd, false), settings(Algorithm::avbd)}};
}

const Contender* find_contender(const std::vector<Contender>& all, const Settings& settings) {
  for (const Contender& contender : all) {
    Settings same = contender.settings;
    same.step = settings.step;
    same.substeps = settings.substeps;
    if (settings.algorithm == Algorithm::avbd) same.iterations = settings.iterations;
    if (label(same) == label(settings)) return &contender;
  }
  return nullptr;
}

double cost_of(const SweepRecord& record, Cost cost) {
  if (cost == Cost::rows) return static_cast<double>(record.metrics->row_solves) / record.duration;
  return record.times ? 1000 * record.times->median / record.duration : NAN;
}

const char* name_of(Cost cost) {
  return cost == Cost::rows ? "row solves in a simulated second" : "CPU time of a simulated second, ms";
}

/// Returns true where a sweep ran what is not the report's.
bool has_descendants(const std::vector<SweepRecord>& records) {
  return std::ranges::any_of(records, [](const SweepRecord& record) {
    return !is_of_report(record.settings.algorithm) || record.settings.warm_start > 0;
  });
}

/// Returns an empty panel of the record's scene, with the merit's axis.
Panel merit_panel(const SweepRecord& record, const Axis& x) {
  Panel panel;
  const std::string quantity = merit_of(record).quantity;
  panel.title = record.scene;
  panel.x = x;
  panel.y = {quantity + ", m", true, merit_range, {}};
  return panel;
}

double in_range(double merit) {
  return std::clamp(std::isfinite(merit) ? merit : merit_range[1], merit_range[0], merit_range[1]);
}

/// Returns the records of a scene that have a merit.
std::vector<SweepRecord> judged(const FigureSource& source, const std::string& scene) {
  std::vector<SweepRecord> records = of_scene(source.records, scene);
  std::erase_if(records, [](const SweepRecord& record) { return !record.metrics || !record.engine.empty(); });
  return records;
}

}  // namespace

std::string contender_of(const Settings& settings) {
  const std::vector<Contender> all = contenders();
  const Contender* const found = find_contender(all, settings);
  return found ? found->title : "";
}

Merit merit_of(const SweepRecord& record) {
  const Metrics& metrics = *record.metrics;
  const auto finite = [&](double value) {
    return metrics.diverged ? std::numeric_limits<double>::infinity() : value;
  };
  if (record.contacts == ContactKind::standing) return {"displacement", finite(metrics.moved)};
  if (record.horizon >= 1) return {"RMS error", metrics.error.position.rms};
  double miss = -1;
  for (const ExpectedFigure& figure : metrics.expected) {
    if (figure.unit == "m") miss = std::max(miss, figure.error());
  }
  if (miss >= 0) return {"height missed", finite(miss)};
  if (metrics.joint_gap > 0) return {"joint gap", finite(metrics.joint_gap)};
  return {"overlap", finite(metrics.penetration)};
}

Sheet descendants_sheet(const FigureSource& source, Cost cost) {
  Sheet sheet;
  sheet.title = fmt::format("The report's algorithms and what came after them, by {}",
                            cost == Cost::rows ? "row solves" : "CPU time");
  if (!has_descendants(source.records)) return sheet;
  const std::vector<Contender> all = contenders();
  for (const std::string& scene : scenes_of(source.records)) {
    const std::vector<SweepRecord> records = judged(source, scene);
    if (records.empty()) continue;
    Panel panel = merit_panel(records.front(), {name_of(cost), true, {}, {}});
    for (const Contender& contender : all) {
      if (contender.settings.contact_hertz == stiffer_hertz) continue;  // seven lines are enough
      Series series{contender.title, contender.look, {}};
      for (const SweepRecord& record : records) {
        if (find_contender(all, record.settings) != &contender) continue;
        series.points.push_back({cost_of(record, cost), in_range(merit_of(record).value)});
      }
      if (!series.points.empty()) panel.series.push_back(std::move(series));
    }
    if (panel.series.size() > 2) sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {
      "h of the scene. A1: h, h/2, h/4, h/8. A3, A5, XPBD, Soft Step: 1 to 64 sub-steps; AVBD: 1 to 80 "
      "iterations. Published defaults.",
      "Down and to the left is better. Below 1 µm and above 10 m (fallen, or diverged) points lie on the "
      "border."};
  return sheet;
}

Sheet warm_start_sheet(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "What a warm start of A5 is worth";
  for (const std::string& scene : scenes_of(source.records)) {
    const std::vector<SweepRecord> records = judged(source, scene);
    if (records.empty()) continue;
    Panel panel =
        merit_panel(records.front(), {"sub-steps n", true, std::array{0.8, 80.0}, "(1, 4, 16, 64)"});
    constexpr std::array shapes{7, 5, 9, 11, 13};
    for (int quarters = 0; quarters <= 4; ++quarters) {
      const double fraction = 0.25 * quarters;
      const Look look{quarters, shapes.at(quarters), false, true, true};
      Series series{fmt::format("{:g} of the last impulses", fraction), look, {}};
      for (const SweepRecord& record : records) {
        Settings cold = record.settings;
        cold.warm_start = 0;
        if (record.settings.warm_start != fraction || contender_of(cold) != "A5") continue;
        series.points.push_back(
            {static_cast<double>(record.settings.substeps), in_range(merit_of(record).value)});
      }
      std::ranges::sort(series.points);
      if (series.points.size() > 1) panel.series.push_back(std::move(series));
    }
    if (panel.series.size() > 1) sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {
      "A5 by default, m = 1, the scene's h. Points on the border are below 1 µm, or fallen or diverged."};
  return sheet;
}

Sheet needed_substeps_sheet(const FigureSource& source) {
  constexpr int most = 256;
  Sheet sheet;
  sheet.title = "Mass ratio against the sub-steps that hold it";
  for (const char* const name : {"top_heavy_stack", "heavy_chain"}) {
    const Scene scene = source.scene(name);
    Panel panel;
    panel.title = name;
    panel.x = {"mass of the heaviest body / of the lightest", true, std::array{0.5, 20000.0}, {}};
    panel.y = {"sub-steps n, or iterations of AVBD", true, std::array{0.8, 300.0}, "(1, 4, 16, 64, 256)"};
    for (const Contender& contender : contenders()) {
      if (contender.settings.algorithm == Algorithm::a1) continue;  // it has no sub-steps
      Settings settings = contender.settings;
      settings.step = scene.step;
      Series series{contender.title, contender.look, {}};
      for (const NeededSubsteps& point : needed_substeps(scene, settings, 0.5, most)) {
        if (point.substeps > 0) series.points.push_back({point.ratio, static_cast<double>(point.substeps)});
      }
      panel.series.push_back(std::move(series));
    }
    sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {
      fmt::format("The fewest of at most {} with which, and with twice and four times as many, the run "
                  "is bounded; no point: none is.",
                  most),
      "The stack stands if no body moves by 17 cm in 5 s; the chain holds if no joint opens by 10 % of a "
      "link and the error is below 10 %."};
  return sheet;
}

Sheet avbd_stability_sheet(const FigureSource& source) {
  Sheet sheet;
  sheet.title = "AVBD over mass scale and β: three boxes of 1 m on one another";
  const Scene stack = source.scene("box_stack");
  for (const int iterations : {5, 10, 20}) {
    Settings settings = default_settings(Algorithm::avbd);
    settings.iterations = iterations;
    settings.step = stack.step;
    std::array<Series, 4> series{{{"move by less than 1 cm in 5 s", good_mark, {}},
                                  {"by less than 10 cm", {6, 6, false, false, true}, {}},
                                  {"by less than 1 m", {1, 8, false, false, true}, {}},
                                  {"farther, or turn over", lost_mark, {}}}};
    for (const AvbdPoint& point : avbd_map(stack, settings)) {
      const std::size_t kind = point.falls ? 3 : point.moved < 0.01 ? 0 : point.moved < 0.1 ? 1 : 2;
      series.at(kind).points.push_back({point.mass, point.beta});
    }
    Panel panel;
    panel.title = fmt::format("{} iterations", iterations);
    panel.x = {"mass of a box, kg", true, std::array{3e-4, 3e6}, {}};
    panel.y = {"β, N/m²", true, std::array{0.3, 3e10}, {}};
    panel.series.assign(series.begin(), series.end());
    panel.series.push_back({"default", {0, 7, true, true, false}, {{3e-4, 1e4}, {3e6, 1e4}}});
    sheet.panels.push_back(std::move(panel));
  }
  sheet.caption = {"h = 1/60 s, α = 0.99, γ = 0.999. No other method here notices the mass scale."};
  return sheet;
}

Sheet soft_rows_sheet(const FigureSource&) {
  Sheet sheet;
  sheet.title = "One row of A5, of XPBD and of Soft Step";
  sheet.columns = 1;
  sheet.panel_height = 460;
  Panel panel;
  panel.title = "one row";
  panel.x = {"κ", false, std::array{0.0, 1.1}, {}};
  panel.y = {"τ", false, std::array{0.0, 1.1}, {}};
  for (const double damping : {0.0, 0.5, 1.0, 2.0, 5.0, 10.0}) {
    Series series{"springs with ζ = 0, 0.5, 1, 2, 5, 10", {7, 7, true, true, false}, {}};
    for (int i = 0; i <= 120; ++i) {
      const double angle = 1e-3 * std::pow(10, 0.05 * i);
      const Softness soft = softness(angle / (2 * std::numbers::pi), damping, 1);
      series.points.push_back({soft.mass_scale, soft.tau(1)});
    }
    panel.series.push_back(series);
  }
  const auto mark = [&](const std::string& title, const std::string& what, const Look& look, double kappa,
                        double tau) {
    const double angle = std::sqrt(tau / (1 - kappa));
    const double damping = (kappa - tau) / (2 * std::sqrt(tau * (1 - kappa)));
    const std::string terms =
        kappa < 1 ? fmt::format("ωh = {:.2f}, ζ = {:.2f}", angle, damping) : std::string("rigid");
    panel.series.push_back({title, look, {{kappa, tau}}});
    panel.notes.push_back({kappa, tau, fmt::format("{}: {}", what, terms), true});
  };
  const auto point = [](Algorithm algorithm) {
    Look look = look_of(algorithm);
    look.line = false;
    return look;
  };
  const Settings a5 = default_settings(Algorithm::a5);
  const auto [contact_tau, contact_kappa] = a5.of_contacts();
  mark("A5", "A5, joints", point(Algorithm::a5), a5.kappa, a5.tau);
  mark("A5", "A5, contacts", point(Algorithm::a5), contact_kappa, contact_tau);
  mark("XPBD", "XPBD", point(Algorithm::a3), 1, 1);
  const Settings defaults = default_settings(Algorithm::soft);
  const double hs = sub_step_of(defaults);
  const auto soft = [&](const std::string& what, double hertz, double damping) {
    const Softness row = softness(hertz, damping, hs);
    mark("Soft Step", fmt::format("Soft Step, {} {:g} Hz", what, hertz), point(Algorithm::soft),
         row.mass_scale, row.tau(hs));
  };
  soft("contacts", defaults.contact_hertz, soft_contact_damping);
  soft("contacts with what is fixed", 2 * defaults.contact_hertz, soft_contact_damping / 2);
  soft("joints", defaults.joint_hertz, soft_joint_damping);
  sheet.panels.push_back(std::move(panel));
  sheet.caption = {
      "v' = (1 − κ) v − τ x/h in a sub-step h: κ is the fraction of the velocity that a row takes back, τ "
      "that of "
      "the position error.",
      "Soft Step: four sub-steps of 1/240 s, without its accumulated impulse. Above the line of ζ = 0 a row "
      "throws "
      "back."};
  return sheet;
}

std::vector<TextTable> equal_cost_of_descendants(const std::vector<SweepRecord>& records, Cost cost) {
  const std::vector<Contender> all = contenders();
  const std::string about = cost == Cost::rows ? "" : "~";
  const double slack = cost == Cost::rows ? 1.05 : 1.1;
  std::vector<TextTable> tables;
  if (!has_descendants(records)) return tables;
  for (const bool stands : {true, false}) {
    TextTable table{{stands ? "displacement, m" : ""}, {}};
    for (const Contender& contender : all) table.rows.push_back({contender.title});
    for (const std::string& scene : scenes_of(records)) {
      std::vector<SweepRecord> own = of_scene(records, scene);
      std::erase_if(own, [&](const SweepRecord& record) {
        return !record.metrics || !find_contender(all, record.settings);
      });
      const auto budget = std::ranges::find_if(own, [&](const SweepRecord& record) {
        return record.settings.substeps == 16 && contender_of(record.settings) == "A5";
      });
      if (budget == own.end() || (budget->contacts == ContactKind::standing) != stands) continue;
      const std::string quantity = merit_of(*budget).quantity;
      table.head.push_back(stands ? scene : fmt::format("{}: {}, m", scene, quantity));
      for (std::size_t i = 0; i < all.size(); ++i) {
        const SweepRecord* chosen = nullptr;
        for (const SweepRecord& record : own) {
          if (find_contender(all, record.settings) != &all[i]) continue;
          if (!(cost_of(record, cost) <= slack * cost_of(*budget, cost))) continue;
          if (!chosen || record.metrics->row_solves > chosen->metrics->row_solves) chosen = &record;
        }
        const double merit = chosen ? merit_of(*chosen).value : 0;
        table.rows[i].push_back(!chosen                ? "–"
                                : std::isfinite(merit) ? about + short_number(merit)
                                                       : about + "lost");
      }
    }
    if (table.head.size() > 1) tables.push_back(std::move(table));
  }
  return tables;
}

}  // namespace substep::report
