#include "render/report/report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "render/report/bad_figures.h"
#include "render/report/report_tables.h"
#include "sim/study/advice.h"
#include "sim/study/sweep_results.h"

namespace substep {
namespace {

/// By the figures' names; without those that the sweep has nothing for.
using Pictures = std::map<std::string, std::string>;

Pictures drawn(const FigureSource& source, const std::function<void(double)>& progress) {
  Pictures pictures;
  for (const ReportFigure& figure : figures()) {
    if (progress) progress(static_cast<double>(pictures.size()) / static_cast<double>(figures().size()));
    const Sheet sheet = figure.make(source);
    // A sweep need not have what each figure shows.
    if (!sheet.panels.empty()) pictures[figure.name] = draw(sheet, PictureFormat::svg);
  }
  return pictures;
}

class Report {
 public:
  Report(const FigureSource& source, Pictures pictures)
      : source_(source), records_(source.records), pictures_(std::move(pictures)) {}

  Document page();

 private:
  void introduce();
  void choose();
  void show_work();
  void show_order();
  void compare_equal_rows();
  void show_bounds();
  void show_approximations();
  void show_size();
  void go_through_scenes();
  void describe_references();
  void show_other_engines();
  void list_omissions();

  void picture(const std::string& name) {
    if (!pictures_.contains(name)) return;
    page_.picture(figure_named(name).about, fmt::format("figures/{}.svg", name), pictures_.at(name));
  }

  const FigureSource& source_;
  const std::vector<SweepRecord>& records_;
  const Pictures pictures_;
  Document page_;
};

Document Report::page() {
  introduce();
  choose();
  show_work();
  show_order();
  compare_equal_rows();
  show_bounds();
  show_approximations();
  show_size();
  go_through_scenes();
  describe_references();
  show_other_engines();
  list_omissions();
  return std::move(page_);
}

void Report::introduce() {
  page_.heading(1, "Speed against error of A1 to A5");
  page_.paragraph(fmt::format(
      "{} runs of {} scenes. Errors are distances of the bodies' centres from a reference motion, as root "
      "mean squares "
      "over bodies and time, in parts of the scene's size; errors, rows and overlaps are the same in every "
      "run and on "
      "every machine. CPU times are of one core, medians with half their spread. Made by `substep report`.",
      records_.size(), scenes_of(records_).size()));
  add_bad_figures(records_, page_);
}

void Report::choose() {
  page_.heading(2, "What to choose");
  page_.paragraph(
      "The cheapest run measured that stays bounded, with an RMS error, joint gaps and overlaps below 1 % "
      "and below 0.1 % "
      "of the scene's size. A1 solves directly, A2 iterates m times, A3 to A5 take n sub-steps of m "
      "iterations. The "
      "reasons are below, scene by scene.");
  page_.table(choices_table(records_));
}

void Report::show_work() {
  page_.heading(2, "Error against work");
  for (const char* const name : {"work-time", "work-time-contacts", "work-rows", "work-rows-contacts"})
    picture(name);
}

void Report::show_order() {
  page_.heading(2, "Order");
  const TextTable measured_orders = orders_table(records_);
  page_.paragraph(fmt::format(
      "By how many powers of two the error falls as h/n is halved, over the finest four runs of a family: 1 "
      "is first "
      "order, 0 or less no gain. Empty: too few runs that are bounded and above what the reference is sure "
      "of. Over all scenes: {}.",
      order_ranges(measured_orders)));
  picture("order");
  picture("slopes");
  page_.table(measured_orders);
  page_.paragraph(
      "From each run to the next, scene by scene. A1, A2 and A3 come to 1 on every joint scene once steps "
      "are small "
      "enough for their iterations: on heavy_chain one sweep leaves more than the step does until h/n is "
      "about "
      "1/500 000 s, and the slope is above 1 as that dies away; with 64 iterations it is 1.0 (a test holds "
      "it). A4 and "
      "A5 leave the line where the step h that they take Jacobians for is what is left.");
  for (const std::string& scene : scenes_of(records_)) {
    const std::vector<SweepRecord> own = of_scene(records_, scene);
    if (has_contacts(own)) continue;
    page_.heading(4, scene);
    page_.table(slopes_table(own));
  }
}

void Report::compare_equal_rows() {
  const EqualRows claim = equal_rows(records_);
  page_.heading(2, "Sub-steps or iterations");
  page_.paragraph(fmt::format(
      "At equal row solves n sub-steps beat n iterations, for every n measured, on {} of {} scenes: {}.{}",
      claim.holding.size(), claim.holding.size() + claim.failing.size(), fmt::join(claim.holding, ", "),
      claim.failing.empty() ? "" : fmt::format(" Not on {}.", fmt::join(claim.failing, ", "))));
  picture("equal-rows");
  page_.table(claim.table);
}

void Report::show_bounds() {
  page_.heading(2, "What stays bounded");
  page_.paragraph(
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
  page_.table(limits_table(records_, false));
  page_.paragraph("With contacts; here n = 1 is one pass, so that m = 16 has 16 times as many row solves:");
  page_.table(limits_table(records_, true));
  for (const char* const name : {"mass-ratio", "stability", "stiffness"}) picture(name);
}

void Report::show_approximations() {
  page_.heading(2, "What the approximations cost");
  picture("ablation");
  picture("contact-ablation");
  page_.paragraph(contact_ablation_caption(source_.contact_ablation) + ".");
  page_.table(contact_ablation_table(source_.contact_ablation));
  picture("drift");
}

void Report::show_size() {
  page_.heading(2, "Cost against size");
  picture("size");
}

void Report::go_through_scenes() {
  page_.heading(2, "Scene by scene");
  for (const std::string& scene : scenes_of(records_)) {
    const std::vector<SweepRecord> own = of_scene(records_, scene);
    page_.heading(3, scene);
    page_.paragraph(advice(own));
    page_.paragraph("The runs that no other one beats in error and in cost:");
    page_.table(runs_table(best_runs(own)));
  }
}

void Report::describe_references() {
  page_.heading(2, "References");
  page_.paragraph(
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
  page_.table(references_table(records_));
}

void Report::show_other_engines() {
  const TextTable others = engines_table(records_);
  if (!others.rows.empty()) {
    page_.heading(2, "Beside the five: the accurate mode and other engines");
    page_.paragraph(
        "They run the same scenes at h, h/2, h/4 … and are compared with the same reference. Their rows are "
        "not counted. "
        "Each has passed a pendulum against its closed form in the same run. Where the accurate mode and "
        "Runge-Kutta in "
        "reduced coordinates have the same error, the time says which is the better work.");
    page_.table(others);
    for (const char* const name : {"engines", "engines-contacts"}) picture(name);
  }
}

void Report::list_omissions() {
  const TextTable missing = omitted_table(records_);
  if (!missing.rows.empty()) {
    page_.heading(2, "Omitted");
    page_.table(missing);
  }
}

}  // namespace

Document make_report(const FigureSource& given, const std::function<void(double)>& progress) {
  FigureSource source = given;
  // Once for its figure and its table.
  if (source.contact_ablation.empty()) source.contact_ablation = contact_ablation(source.scenes);
  return Report(source, drawn(source, progress)).page();
}

}  // namespace substep
