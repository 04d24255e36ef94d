// Figures and tables of A3 and A5 beside their descendants: Soft Step, small-step XPBD, AVBD and warm starts.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "render/report/figures.h"
#include "render/report/report_tables.h"
#include "sim/descendants/descendants.h"
#include "sim/measure/validity_maps.h"
#include "sim/study/sweep_results.h"

namespace substep::report {
namespace {

constexpr double stiffer_hertz = 240;
constexpr std::array merit_range{1e-6, 10.0};  // m

/// A line of the comparison.
struct Contender {
  const char* title;
  SeriesStyle style;
  Settings settings;  ///< without n
};

/// Returns the lines of the comparison, with published defaults.
std::vector<Contender> contenders() {
  const auto line = [](const char* title, Algorithm algorithm) {
    return Contender{title, style_of(algorithm), default_settings(algorithm)};
  };
  const auto variant = [&](const char* title, Algorithm algorithm) {
    Contender result = line(title, algorithm);
    result.style.dashed = true;
    result.style.shape -= 1;
    return result;
  };
  Contender warm = variant("A5, warm start", Algorithm::a5);
  warm.settings.warm_start = 0.5;
  Contender xpbd = variant("XPBD: A3 with τ = κ = 1", Algorithm::a3);
  xpbd.settings = {};
  xpbd.settings.joints = Joints::stable;
  Contender stiffer = variant("Soft Step, 240 Hz", Algorithm::soft);
  stiffer.settings.contact_hertz = stiffer.settings.joint_hertz = stiffer_hertz;
  return {line("A1", Algorithm::a1),
          line("A3", Algorithm::a3),
          line("A5", Algorithm::a5),
          warm,
          xpbd,
          line("Soft Step", Algorithm::soft),
          stiffer,
          line("AVBD", Algorithm::avbd)};
}

/// Returns the line of a run at the scene's step, or of A1 at any step; null: none.
const Contender* find_contender(const std::vector<Contender>& all, const SweepRecord& record) {
  const Settings& settings = record.settings;
  if (record.divisions > 1 && settings.algorithm != Algorithm::a1) return nullptr;
  const auto found = std::ranges::find_if(all, [&](const Contender& contender) {
    Settings same = contender.settings;
    same.step = settings.step;
    same.substeps = settings.substeps;
    if (settings.algorithm == Algorithm::avbd) same.iterations = settings.iterations;
    return label(same) == label(settings);
  });
  return found == all.end() ? nullptr : &*found;
}

bool is_a5(const std::vector<Contender>& all, const SweepRecord& record) {
  const Contender* const found = find_contender(all, record);
  return found != nullptr && found->title == std::string_view("A5");
}

/// Returns row solves, or ms of CPU time, of a simulated second.
double price_of(const SweepRecord& record, Cost cost) {
  if (cost == Cost::rows) return row_rate(record);
  return record.times ? 1000 * record.times->median / record.duration : NAN;
}

/// Returns whether a sweep ran algorithms or options that Nohra's report lacks, and measured the cost.
bool has_descendants(const std::vector<SweepRecord>& records, Cost cost) {
  if (cost == Cost::time && !has_times(records)) return false;
  return std::ranges::any_of(records, [](const SweepRecord& record) {
    return !is_of_report(record.settings.algorithm) || record.settings.warm_start > 0;
  });
}

/// A run's figure of merit: the largest displacement of scenes that stand; the RMS error where the reference
/// lasts; the largest miss of known heights; else the largest joint gap or the deepest overlap.
struct Merit {
  std::string quantity;  ///< "displacement"
  double value = 0;      ///< m; infinite where the run diverged
};

Merit merit_of(const SweepRecord& record) {
  const Metrics& metrics = *record.metrics;
  const auto finite = [&](double value) { return metrics.diverged ? INFINITY : value; };
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

/// Returns the merit of a run, moved into the axis' range.
double drawn_merit(const SweepRecord& record) {
  const double merit = merit_of(record).value;
  return std::clamp(std::isfinite(merit) ? merit : merit_range[1], merit_range[0], merit_range[1]);
}

/// Adds to the sheet a panel for each scene with at least `least` series. `series_of` returns the series of a
/// scene's records that have a merit.
template <typename SeriesOf>
void add_merit_panels(Sheet& sheet, const FigureSource& source, const Axis& x, std::size_t least,
                      const SeriesOf& series_of) {
  for (const std::string& scene : scenes_of(source.records)) {
    std::vector<SweepRecord> records = of_scene(source.records, scene);
    std::erase_if(records, [](const SweepRecord& record) { return !is_own_run(record); });
    if (records.empty()) continue;
    Panel panel{.title = scene,
                .x = x,
                .y = {merit_of(records.front()).quantity + ", m", true, merit_range},
                .series = series_of(records)};
    if (panel.series.size() >= least) sheet.panels.push_back(std::move(panel));
  }
}

}  // namespace

Sheet descendants_sheet(const FigureSource& source, Cost cost) {
  Sheet sheet{.title = fmt::format("The report's algorithms and what came after them, by {}",
                                   cost == Cost::rows ? "row solves" : "CPU time")};
  if (!has_descendants(source.records, cost)) return sheet;
  const char* const x =
      cost == Cost::rows ? "row solves in a simulated second" : "CPU time of a simulated second, ms";
  add_merit_panels(sheet, source, {x, true}, 3, [&](const std::vector<SweepRecord>& records) {
    std::vector<Series> lines;
    const std::vector<Contender> all = contenders();
    for (const Contender& contender : all) {
      if (contender.settings.contact_hertz == stiffer_hertz) continue;  // omit: a panel shows seven lines
      Series series{contender.title, contender.style};
      for (const SweepRecord& record : records) {
        const double price = price_of(record, cost);
        if (!(price > 0) || find_contender(all, record) != &contender) continue;
        series.points.push_back({price, drawn_merit(record)});
      }
      if (!series.points.empty()) lines.push_back(std::move(series));
    }
    return lines;
  });
  sheet.caption = {
      "A1's steps shorten along its line; at the scene's h A3, A5, XPBD and Soft Step take more sub-steps, "
      "AVBD more iterations. Published defaults.",
      "Down and to the left is better. Below 1 µm and above 10 m (fallen, or diverged) points lie on the "
      "border."};
  return sheet;
}

Sheet warm_start_sheet(const FigureSource& source) {
  Sheet sheet{.title = "What a warm start of A5 is worth",
              .caption = {"A5 by default, m = 1, the scene's h. Points on the border are below 1 µm, or "
                          "fallen or diverged."}};
  const Axis substeps{"sub-steps n", true, std::array{0.8, 80.0}, "(1, 4, 16, 64)"};
  add_merit_panels(sheet, source, substeps, 2, [](const std::vector<SweepRecord>& records) {
    std::vector<Series> lines;
    const std::vector<Contender> all = contenders();
    constexpr std::array shapes{7, 5, 9, 11, 13};
    for (int quarters = 0; quarters <= 4; ++quarters) {
      const double fraction = 0.25 * quarters;
      Series series{fmt::format("{:g} of the last impulses", fraction),
                    {quarters, shapes.at(static_cast<std::size_t>(quarters))}};
      for (const SweepRecord& record : records) {
        SweepRecord cold = record;
        cold.settings.warm_start = 0;
        if (record.settings.warm_start != fraction || !is_a5(all, cold)) continue;
        series.points.push_back({static_cast<double>(record.settings.substeps), drawn_merit(record)});
      }
      std::ranges::sort(series.points);
      if (series.points.size() > 1) lines.push_back(std::move(series));
    }
    return lines;
  });
  return sheet;
}

Sheet needed_substeps_sheet(const FigureSource& source) {
  constexpr int most = 256;
  Sheet sheet{.title = "Mass ratio against the sub-steps that hold it",
              .caption = {fmt::format("The fewest of at most {} with which, and with twice and four times as "
                                      "many, the run is bounded; no point: none is.",
                                      most),
                          "The stack stands if no body moves by 17 cm in 5 s; the chain holds if no joint "
                          "opens by 10 % of a link and the error is below 10 %."}};
  for (const char* const name : {"top_heavy_stack", "heavy_chain"}) {
    const Scene scene = source.scene(name);
    Panel panel{
        .title = name,
        .x = {"mass of the heaviest body / of the lightest", true, std::array{0.5, 20000.0}},
        .y = {"sub-steps n, or iterations of AVBD", true, std::array{0.8, 300.0}, "(1, 4, 16, 64, 256)"}};
    for (const Contender& contender : contenders()) {
      if (contender.settings.algorithm == Algorithm::a1) continue;  // A1 has no sub-steps
      Settings settings = contender.settings;
      settings.step = scene.step;
      Series series{contender.title, contender.style};
      for (const NeededSubsteps& point : needed_substeps(scene, settings, 0.5, most)) {
        if (point.substeps > 0) series.points.push_back({point.ratio, static_cast<double>(point.substeps)});
      }
      panel.series.push_back(std::move(series));
    }
    sheet.panels.push_back(std::move(panel));
  }
  return sheet;
}

Sheet soft_rows_sheet(const FigureSource&) {
  Panel panel{
      .title = "one row", .x = {"κ", false, std::array{0.0, 1.1}}, .y = {"τ", false, std::array{0.0, 1.1}}};
  for (const double damping : {0.0, 0.5, 1.0, 2.0, 5.0, 10.0}) {
    Series series{"springs with ζ = 0, 0.5, 1, 2, 5, 10", {7, 7, true, true, false}};
    for (int i = 0; i <= 120; ++i) {
      const double angle = 1e-3 * std::pow(10, 0.05 * i);
      const Softness soft = softness(angle / (2 * std::numbers::pi), damping, 1);
      series.points.push_back({soft.mass_scale, soft.tau(1)});
    }
    panel.series.push_back(std::move(series));
  }
  const auto mark = [&](const std::string& title, const std::string& what, Algorithm algorithm, double kappa,
                        double tau) {
    const double angle = std::sqrt(tau / (1 - kappa));
    const double damping = (kappa - tau) / (2 * std::sqrt(tau * (1 - kappa)));
    const std::string terms =
        kappa < 1 ? fmt::format("ωh = {:.2f}, ζ = {:.2f}", angle, damping) : std::string("rigid");
    SeriesStyle point = style_of(algorithm);
    point.line = false;
    panel.series.push_back({title, point, {{kappa, tau}}});
    panel.notes.push_back({kappa, tau, fmt::format("{}: {}", what, terms)});
  };
  const Settings a5 = default_settings(Algorithm::a5);
  const auto [contact_tau, contact_kappa] = a5.of_contacts();
  mark("A5", "A5, joints", Algorithm::a5, a5.kappa, a5.tau);
  mark("A5", "A5, contacts", Algorithm::a5, contact_kappa, contact_tau);
  mark("XPBD", "XPBD", Algorithm::a3, 1, 1);
  const Settings defaults = default_settings(Algorithm::soft);
  const double hs = sub_step_of(defaults);
  const auto mark_soft = [&](const char* what, double hertz, double damping) {
    const Softness row = softness(hertz, damping, hs);
    mark("Soft Step", fmt::format("Soft Step, {} {:g} Hz", what, hertz), Algorithm::soft, row.mass_scale,
         row.tau(hs));
  };
  mark_soft("contacts", defaults.contact_hertz, soft_contact_damping);
  mark_soft("contacts with what is fixed", 2 * defaults.contact_hertz, soft_contact_damping / 2);
  mark_soft("joints", defaults.joint_hertz, soft_joint_damping);
  return {.title = "One row of A5, of XPBD and of Soft Step",
          .caption = {"v' = (1 − κ) v − τ x/h in a sub-step h: κ is the fraction of the velocity that a row "
                      "takes back, τ that of the position error.",
                      "Soft Step: four sub-steps of 1/240 s, without its accumulated impulse. Above the line "
                      "of ζ = 0 a row throws back."},
          .columns = 1,
          .panel_height = 460,
          .panels = {std::move(panel)}};
}

std::vector<TextTable> equal_cost_of_descendants(const std::vector<SweepRecord>& records, Cost cost) {
  std::vector<TextTable> tables;
  if (!has_descendants(records, cost)) return tables;
  const std::vector<Contender> all = contenders();
  const std::string about = cost == Cost::rows ? "" : "~";
  const double slack = cost == Cost::rows ? 1.05 : 1.1;
  for (const bool stands : {true, false}) {
    TextTable table{{stands ? "displacement, m" : ""}, {}};
    for (const Contender& contender : all) table.rows.push_back({contender.title});
    for (const std::string& scene : scenes_of(records)) {
      std::vector<SweepRecord> own = of_scene(records, scene);
      std::erase_if(own, [&](const SweepRecord& record) {
        return !record.metrics || find_contender(all, record) == nullptr;
      });
      const auto budget = std::ranges::find_if(own, [&](const SweepRecord& record) {
        return record.settings.substeps == 16 && is_a5(all, record);
      });
      if (budget == own.end() || (budget->contacts == ContactKind::standing) != stands) continue;
      table.head.push_back(stands ? scene : fmt::format("{}: {}, m", scene, merit_of(*budget).quantity));
      for (std::size_t i = 0; i < all.size(); ++i) {
        const SweepRecord* chosen = nullptr;
        for (const SweepRecord& record : own) {
          if (find_contender(all, record) != &all[i]) continue;
          if (!(price_of(record, cost) <= slack * price_of(*budget, cost))) continue;
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
