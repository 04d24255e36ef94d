#include "render/report/report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "render/report/bad_figures.h"
#include "sim/study/advice.h"
#include "sim/study/engines/engines.h"
#include "sim/study/sweep_results.h"

namespace substep {
namespace {

std::string percent(double share) {
  if (!std::isfinite(share)) return "lost";
  if (share < 1e-11) return "rounding";
  return fmt::format("{:.2g} %", 100 * share);
}

std::string milliseconds(const SweepRecord& record) {
  if (!record.times) return "";
  const RunTimes& t = *record.times;
  const double spread = (t.largest - t.smallest) / 2 / std::max(t.median, 1e-12);
  return fmt::format("{:.3g} ± {:.0f} %", 1000 * cost_of(record), 100 * spread);
}

TextTable choices(const std::vector<SweepRecord>& records) {
  TextTable table{
      {"scene", "for 1 % of its size", "ms a simulated second", "for 0.1 %", "ms a simulated second"}, {}};
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    std::vector<std::string> row{scene};
    for (const double tolerance : {0.01, 0.001}) {
      const auto run = cheapest(own, tolerance);
      row.push_back(run ? run->label : "none");
      row.push_back(run ? milliseconds(*run) : "");
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

TextTable references(const std::vector<SweepRecord>& records) {
  TextTable table{{"scene", "reference", "until, s", "where it ends", "its uncertainty, m", "rad",
                   "smallest error, m", "size, m"},
                  {}};
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    double smallest = INFINITY;
    for (const SweepRecord& record : own) {
      // Exact but for rounding is no error that a reference could be held to.
      if (record.metrics && record.metrics->error.position.rms > smallest_plotted_error * record.size &&
          is_sure(record)) {
        smallest = std::min(smallest, record.metrics->error.position.rms);
      }
    }
    const SweepRecord& first = own.front();
    table.rows.push_back(
        {scene, first.reference, fmt::format("{:g}", first.horizon),
         first.divergence_point.empty() ? "as asked" : fmt::format("{} parts", first.divergence_point),
         short_number(first.uncertainty), short_number(first.turn_uncertainty), short_number(smallest),
         short_number(first.size)});
  }
  return table;
}

/// "n = 4", "h/8", "1" …
std::string limit_text(const SweepRecord& record) {
  const StabilityLimit& limit = *record.limit;
  const bool by_substeps = record.settings.algorithm >= Algorithm::a3;
  if (limit.divisions == 0)
    return by_substeps ? fmt::format("n > {}", limit.most) : fmt::format("h < h/{}", limit.most);
  if (by_substeps) return fmt::format("n = {}", limit.divisions);
  return limit.divisions == 1 ? "h" : fmt::format("h/{}", limit.divisions);
}

/// Of the scenes with contacts, or of the others: they are looked for with other settings.
TextTable limits(const std::vector<SweepRecord>& records, bool contacts) {
  TextTable table{{"scene"}, {}};
  const auto title = [&](const SweepRecord& record) {
    const Settings& s = record.settings;
    std::string text = fmt::format("A{}", static_cast<int>(s.algorithm) + 1);
    if (s.algorithm >= Algorithm::a3 && !contacts) text += fmt::format(" {}", name(s.joints));
    if (s.algorithm >= Algorithm::a2) text += fmt::format(" m={}", s.iterations);
    if (s.algorithm >= Algorithm::a3 && s.tau != 1) text += fmt::format(" τ={:g}", s.tau);
    return text;
  };
  std::map<std::string, std::map<std::string, std::string>> cells;
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    if (has_contacts(own) != contacts) continue;
    for (const SweepRecord& record : own) {
      if (!record.limit) continue;
      if (std::ranges::find(table.head, title(record)) == table.head.end())
        table.head.push_back(title(record));
      cells[scene][title(record)] = limit_text(record);
    }
  }
  std::sort(table.head.begin() + 1, table.head.end());
  for (auto& [scene, by_title] : cells) {
    std::vector<std::string> row{scene};
    for (std::size_t i = 1; i < table.head.size(); ++i) row.push_back(by_title[table.head[i]]);
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// By how many powers of two the error falls from each run of a family to the next.
TextTable slopes(const std::vector<SweepRecord>& records) {
  TextTable table{{"h/n, s"}, {}};
  std::map<double, std::size_t, std::greater<>> columns;
  std::vector<RunFamily> families = families_of(records);
  std::erase_if(families, [](const RunFamily& family) { return !family.runs.front().engine.empty(); });
  for (const RunFamily& family : families) {
    for (const auto& [middle, slope] : local_orders(family.runs)) columns[middle] = 0;
  }
  for (auto& [middle, column] : columns) {
    column = table.head.size();
    table.head.push_back(
        fmt::format("1/{:.0f} → 1/{:.0f}", 1 / (middle * std::sqrt(2.0)), std::sqrt(2.0) / middle));
  }
  for (const RunFamily& family : families) {
    std::vector<std::string> row(table.head.size());
    row[0] = family.title;
    for (const auto& [middle, slope] : local_orders(family.runs))
      row[columns.at(middle)] = fmt::format("{:.2f}", slope);
    table.rows.push_back(std::move(row));
  }
  return table;
}

TextTable orders(const std::vector<SweepRecord>& records) {
  TextTable table{{"scene"}, {}};
  std::vector<std::string> scenes;
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    if (has_contacts(own)) continue;
    scenes.push_back(scene);
    for (const RunFamily& family : families_of(own)) {
      if (!family.runs.front().engine.empty()) continue;
      if (std::ranges::find(table.head, family.title) == table.head.end()) table.head.push_back(family.title);
    }
  }
  for (const std::string& scene : scenes) {
    std::vector<std::string> row(table.head.size());
    row[0] = scene;
    for (const RunFamily& family : families_of(of_scene(records, scene))) {
      if (!family.runs.front().engine.empty()) continue;
      const auto column = std::ranges::find(table.head, family.title) - table.head.begin();
      const auto order = measured_order(family.runs);
      row[static_cast<std::size_t>(column)] = order ? fmt::format("{:.2f}", *order) : "";
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// "A1: 0.98 to 1.22; …": the range of a family's orders over the scenes.
std::string order_ranges(const TextTable& table) {
  std::vector<std::string> ranges;
  for (std::size_t column = 1; column < table.head.size(); ++column) {
    double least = INFINITY;
    double most = -INFINITY;
    for (const auto& row : table.rows) {
      if (row[column].empty()) continue;
      least = std::min(least, std::stod(row[column]));
      most = std::max(most, std::stod(row[column]));
    }
    if (least <= most) ranges.push_back(fmt::format("{} {:.2f} to {:.2f}", table.head[column], least, most));
  }
  return fmt::format("{}", fmt::join(ranges, ", "));
}

struct EqualRows {
  TextTable table{{"scene", "n", "A3: n sub-steps", "A2: n iterations", "ratio"}, {}};
  std::vector<std::string> holding;  ///< scenes on which sub-steps won for every n above 1
  std::vector<std::string> failing;
};

EqualRows equal_rows(const std::vector<SweepRecord>& records) {
  EqualRows result;
  for (const std::string& scene : scenes_of(records)) {
    std::map<int, std::array<double, 2>> errors;
    std::map<int, int> found;
    for (const SweepRecord& record : equal_row_runs(records, scene)) {
      const bool is_a3 = record.settings.algorithm == Algorithm::a3;
      const int n = is_a3 ? record.settings.substeps : record.settings.iterations;
      errors[n].at(is_a3 ? 0 : 1) = error_of(record);
      ++found[n];
    }
    bool holds = true;
    bool has_any = false;
    for (const auto& [n, pair] : errors) {
      if (n == 1 || found[n] != 2) continue;
      has_any = true;
      holds = holds && pair[0] < pair[1];
      const bool both = std::isfinite(pair[0]) && std::isfinite(pair[1]);
      result.table.rows.push_back({scene, std::to_string(n), percent(pair[0]), percent(pair[1]),
                                   both ? fmt::format("{:.2g}", pair[0] / pair[1]) : ""});
    }
    if (has_any) (holds ? result.holding : result.failing).push_back(scene);
  }
  return result;
}

TextTable runs_table(const std::vector<SweepRecord>& runs) {
  TextTable table{{"", "RMS error", "largest, m", "joint gap, m", "overlap, m", "energy, J: end − start",
                   "rows a simulated s", "ms a simulated s"},
                  {}};
  for (const SweepRecord& run : runs) {
    const Metrics& x = *run.metrics;
    table.rows.push_back({run.label, (is_sure(run) ? "" : "≈") + percent(error_of(run)),
                          short_number(x.error.position.largest), short_number(x.joint_gap),
                          short_number(x.penetration), short_number(x.energy_change),
                          short_number(static_cast<double>(x.row_solves) / run.duration), milliseconds(run)});
  }
  return table;
}

/// Engines that ran beside ours, with how they were set.
TextTable engines_that_ran(const std::vector<SweepRecord>& records) {
  TextTable table{{"engine", "settings"}, {}};
  for (const Engine& engine : engines()) {
    const bool ran = std::ranges::any_of(
        records, [&](const SweepRecord& record) { return record.engine == engine.name && record.metrics; });
    if (ran) table.rows.push_back({engine.label, engine.settings});
  }
  return table;
}

TextTable omitted(const std::vector<SweepRecord>& records) {
  TextTable table{{"scene", "engine", "why"}, {}};
  for (const SweepRecord& record : records) {
    // Once, not for each step.
    const std::vector<std::string> row{record.scene, record.engine, record.omitted};
    if (!record.omitted.empty() && (table.rows.empty() || table.rows.back() != row))
      table.rows.push_back(row);
  }
  return table;
}

TextTable contact_ablation_of_table(const std::vector<ContactAblationCosts>& ablation) {
  TextTable table{{"taken out"}, {}};
  for (const ContactAblationCosts& column : ablation) table.head.push_back(column_title(column));
  for (std::size_t i = 0; i < contact_ablations.size(); ++i) {
    std::vector<std::string> row{row_title(contact_ablations[i])};
    for (const ContactAblationCosts& column : ablation) row.push_back(short_number(column.costs[i]));
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace

Document make_report(const FigureSource& given, const std::function<void(double)>& progress) {
  FigureSource source = given;
  // Once for its figure and its table.
  if (source.contact_ablation.empty()) source.contact_ablation = contact_ablation(source.scenes);
  const std::vector<SweepRecord>& records = source.records;
  std::map<std::string, std::string> pictures;
  for (const ReportFigure& figure : figures()) {
    if (progress) progress(static_cast<double>(pictures.size()) / static_cast<double>(figures().size()));
    const Sheet sheet = figure.make(source);
    // A sweep need not have what each figure shows.
    if (!sheet.panels.empty()) pictures[figure.name] = draw(sheet, PictureFormat::svg);
  }
  Document page;
  const auto picture = [&](const std::string& name) {
    if (!pictures.contains(name)) return;
    page.picture(figure_named(name).about, fmt::format("figures/{}.svg", name), pictures.at(name));
  };
  page.heading(1, "Speed against error of A1 to A5");
  page.paragraph(fmt::format(
      "{} runs of {} scenes. Errors are distances of the bodies' centres from a reference motion, as root "
      "mean squares "
      "over bodies and time, in parts of the scene's size; errors, rows and overlaps are the same in every "
      "run and on "
      "every machine. CPU times are of one core, medians with half their spread. Made by `substep report`.",
      records.size(), scenes_of(records).size()));
  add_bad_figures(records, page);
  page.heading(2, "What to choose");
  page.paragraph(
      "The cheapest run measured that stays bounded, with an RMS error, joint gaps and overlaps below 1 % "
      "and below 0.1 % "
      "of the scene's size. A1 solves directly, A2 iterates m times, A3 to A5 take n sub-steps of m "
      "iterations. The "
      "reasons are below, scene by scene.");
  page.table(choices(records));
  page.heading(2, "Error against work");
  for (const char* const name : {"work-time", "work-time-contacts", "work-rows", "work-rows-contacts"})
    picture(name);
  page.heading(2, "Order");
  const TextTable measured_orders = orders(records);
  page.paragraph(fmt::format(
      "By how many powers of two the error falls as h/n is halved, over the finest four runs of a family: 1 "
      "is first "
      "order, 0 or less no gain. Empty: too few runs that are bounded and above what the reference is sure "
      "of. Over all scenes: {}.",
      order_ranges(measured_orders)));
  picture("order");
  picture("slopes");
  page.table(measured_orders);
  page.paragraph(
      "From each run to the next, scene by scene. A1, A2 and A3 come to 1 on every joint scene once steps "
      "are small "
      "enough for their iterations: on heavy_chain one sweep leaves more than the step does until h/n is "
      "about "
      "1/500 000 s, and the slope is above 1 as that dies away; with 64 iterations it is 1.0 (a test holds "
      "it). A4 and "
      "A5 leave the line where the step h that they take Jacobians for is what is left.");
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    if (has_contacts(own)) continue;
    page.heading(4, scene);
    page.table(slopes(own));
  }
  const EqualRows claim = equal_rows(records);
  page.heading(2, "Sub-steps or iterations");
  page.paragraph(fmt::format(
      "At equal row solves n sub-steps beat n iterations, for every n measured, on {} of {} scenes: {}.{}",
      claim.holding.size(), claim.holding.size() + claim.failing.size(), fmt::join(claim.holding, ", "),
      claim.failing.empty() ? "" : fmt::format(" Not on {}.", fmt::join(claim.failing, ", "))));
  picture("equal-rows");
  page.table(claim.table);
  page.heading(2, "What stays bounded");
  page.paragraph(
      "The fewest sub-steps n at the scene's step (A3 to A5), or the largest step (A1, A2), with which a run "
      "stays "
      "bounded: found by bisection, and the same with twice and four times as many. Bounded is what stays "
      "finite to the "
      "scene's end, with an RMS error below 10 % of the scene's size while there is a reference, with joints "
      "and "
      "contacts that give way by less than 10 % of the smallest body's size, and without a rise of energy by "
      "more than "
      "10 % of what a fall by the scene's size or its first speed is worth. What the reference leaves "
      "standing must "
      "stand: no body may ever be further from its start than 10 % of the smallest body's size.");
  page.table(limits(records, false));
  page.paragraph("With contacts; here n = 1 is one pass, so that m = 16 has 16 times as many row solves:");
  page.table(limits(records, true));
  for (const char* const name : {"mass-ratio", "stability", "stiffness"}) picture(name);
  page.heading(2, "What the approximations cost");
  picture("ablation");
  picture("contact-ablation");
  page.paragraph(contact_ablation_caption(source.contact_ablation) + ".");
  page.table(contact_ablation_of_table(source.contact_ablation));
  picture("drift");
  page.heading(2, "Cost against size");
  picture("size");
  page.heading(2, "Scene by scene");
  for (const std::string& scene : scenes_of(records)) {
    const std::vector<SweepRecord> own = of_scene(records, scene);
    page.heading(3, scene);
    page.paragraph(advice(own));
    page.paragraph("The runs that no other one beats in error and in cost:");
    page.table(runs_table(best_runs(own)));
  }
  page.heading(2, "References");
  page.paragraph(
      "Without contacts the reference is the accurate mode: constraints at acceleration level in maximal "
      "coordinates, "
      "extrapolated midpoint steps of order 12, projected back onto positions and velocities; it goes on "
      "through limits "
      "that are met and drives that saturate. With contacts it is A1 at steps halved again and again and, "
      "where the "
      "motion is smooth, extrapolated to step zero. The uncertainty is by how much the last halving moved "
      "any body. "
      "Errors less than a hundred times as large are not drawn, and have ≈ in tables. Where the refinements "
      "part the "
      "reference ends: single bodies cannot be followed any further, and what is measured after that are "
      "gaps, overlaps, "
      "energy, and what has moved that should stand.");
  page.table(references(records));
  const TextTable others = engines_that_ran(records);
  if (!others.rows.empty()) {
    page.heading(2, "Beside the five: the accurate mode and other engines");
    page.paragraph(
        "They run the same scenes at h, h/2, h/4 … and are compared with the same reference. Their rows are "
        "not counted. "
        "Each has passed a pendulum against its closed form in the same run. Where the accurate mode and "
        "Runge-Kutta in "
        "reduced coordinates have the same error, the time says which is the better work.");
    page.table(others);
    for (const char* const name : {"engines", "engines-contacts"}) picture(name);
  }
  const TextTable missing = omitted(records);
  if (!missing.rows.empty()) {
    page.heading(2, "Omitted");
    page.table(missing);
  }
  return page;
}

}  // namespace substep
