// Tests figures and tables of made-up records, documents, and the maps behind figures.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>

#include "render/report/document.h"
#include "render/report/figures.h"
#include "render/report/report.h"
#include "render/report/report_tables.h"
#include "sim/error.h"
#include "sim/measure/invariants.h"
#include "sim/measure/measured_run.h"
#include "sim/measure/validity_maps.h"
#include "sim/model/usual_settings.h"
#include "tests/scene_files.h"

namespace substep::report {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// Returns a run of a scene whose bodies should stand.
SweepRecord standing(Algorithm algorithm, int n, std::int64_t row_solves, double moved) {
  SweepRecord record;
  record.scene = "stack";
  record.settings = divided(default_settings(algorithm), n);
  record.contacts = ContactKind::standing;
  record.duration = 1;
  record.metrics.emplace();
  record.metrics->row_solves = row_solves;
  record.metrics->moved = moved;
  return record;
}

TEST(Descendants, UseTheMostRowsWithinTheBudget) {
  std::vector<SweepRecord> records{
      standing(Algorithm::a5, 16, 1000, 0.001), standing(Algorithm::soft, 4, 600, 0.03),
      standing(Algorithm::soft, 6, 1040, 0.02),  // within 5 % of the budget
      standing(Algorithm::soft, 8, 1200, 0.01), standing(Algorithm::avbd, 10, 900, 0.1),
      standing(Algorithm::a1, 1, 2000, 0),      standing(Algorithm::soft, 6, 1045, 0.5)};
  records[4].metrics->diverged = 0.5;
  records[6].divisions = 2;  // not at the scene's step
  const std::vector<TextTable> tables = equal_cost_of_descendants(records, Cost::rows);
  ASSERT_EQ(tables.size(), 1u);
  std::map<std::string, std::string> cells;
  for (const std::vector<std::string>& row : tables[0].rows) cells[row[0]] = row[1];
  EXPECT_EQ(cells["A5"], "0.001");
  EXPECT_EQ(cells["Soft Step"], "0.02");
  EXPECT_EQ(cells["AVBD"], "lost");
  EXPECT_EQ(cells["A1"], "–");  // it costs more
  FigureSource untimed;
  untimed.records = records;
  EXPECT_TRUE(equal_cost_of_descendants(records, Cost::time).empty());
  EXPECT_TRUE(figure_named("descendants-time").make(untimed).panels.empty());
  EXPECT_EQ(figure_named("descendants-rows").make(untimed).panels.size(), 1u);
  for (SweepRecord& record : untimed.records) record.metrics->row_solves = 0;
  EXPECT_TRUE(figure_named("descendants-rows").make(untimed).panels.empty());
  records.resize(1);
  EXPECT_TRUE(equal_cost_of_descendants(records, Cost::rows).empty());
}

TEST(Descendants, ListFrequencyAndDampingOfContactRows) {
  const std::vector<TextTable> tables = numbers_of(figure_named("soft-rows").make({}));
  ASSERT_EQ(tables.size(), 1u);
  const std::string text = to_text(tables[0]);
  EXPECT_THAT(text, HasSubstr("A5, contacts: ωh = 1.73, ζ = -0.19"));
  EXPECT_THAT(text, HasSubstr("Soft Step, contacts 30 Hz: ωh = 0.79, ζ = 10.00"));
}

TEST(Descendants, CountIterationsOfAvbd) {
  const Scene scene = scene_named("heavy_chain");
  const std::vector<NeededSubsteps> needed =
      needed_substeps(scene, default_settings(Algorithm::avbd), 0.1, 16);
  EXPECT_GT(needed[0].substeps, 1);  // measured 5
  EXPECT_GT(needed[1].substeps, needed[0].substeps);
}

TEST(ReportTables, SpringsOfA1MatchImplicitSteps) {
  const TextTable table = springs_table();
  ASSERT_EQ(table.rows.size(), 5u);
  for (const auto& row : table.rows) EXPECT_EQ(row[2], row[3]) << row[0];  // A1 and its closed form
}

TEST(DefaultSweep, ComparesAlgorithmsAtEqualSettings) {
  const Sweep sweep = read_sweep(scenes_folder() / "sweep.toml");
  EXPECT_TRUE(sweep.properties);
  for (const char* const scene : {"ragdoll", "squeezer", "box_pyramid", "rock_slide"})
    EXPECT_TRUE(sweep.scenes.contains(scene)) << scene;
  // A3, A4 and A5 run equally many settings; rows without blocks are an ablation of some of them.
  std::map<std::string, std::map<Algorithm, int>> settings;
  for (const SweepJob& job : sweep.jobs) {
    const bool is_compared = job.engine.empty() && job.settings.joints != Joints::rows;
    if (is_compared && job.settings.algorithm >= Algorithm::a3) ++settings[job.scene][job.settings.algorithm];
  }
  ASSERT_FALSE(settings.empty());
  for (auto& [scene, counts] : settings) {
    EXPECT_EQ(counts[Algorithm::a3], counts[Algorithm::a4]) << scene;
    EXPECT_EQ(counts[Algorithm::a3], counts[Algorithm::a5]) << scene;
  }
}

TEST(StabilityLimit, EqualsFewestStableSubsteps) {
  Scene scene = scene_named("heavy_chain");
  scene.duration = 1;
  const ReferenceMotion reference = reference_motion(scene, 1);
  Settings settings = usual_settings(scene, Algorithm::a5);
  const StabilityLimit limit = stability_limit(scene, settings, reference, 64);
  ASSERT_GT(limit.divisions, 1);
  settings.substeps = limit.divisions;
  EXPECT_TRUE(measure(scene, settings, reference, false).bounded);
  settings.substeps = limit.divisions - 1;
  EXPECT_FALSE(measure(scene, settings, reference, false).bounded);
  EXPECT_EQ(stability_limit(scene, usual_settings(scene, Algorithm::a5), reference, 1).divisions, 0);
}

TEST(ValidityMaps, DivideStepsOfA1ForMassRatios) {
  const Scene scene = scene_named("heavy_chain");
  const std::vector<MassRatioPoint> points =
      mass_ratio_map(scene, usual_settings(scene, Algorithm::a1), 0.5, 8);
  ASSERT_EQ(points.size(), 20u);
  // 1000 : 1 at the scene's step, which A1 takes in parts, and at an eighth of it.
  EXPECT_TRUE(points[12].bounded);
  EXPECT_TRUE(points[15].bounded);
  EXPECT_LT(points[15].error, 0.01);
}

TEST(ValidityMaps, NeverGiveASpringEnergy) {
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a3, Algorithm::a5}) {
    Settings settings;
    settings.algorithm = algorithm;
    const std::vector<StiffnessPoint> points = stiffness_map(settings);
    EXPECT_EQ(points.size(), 45u);
    for (const StiffnessPoint& point : points) EXPECT_LE(point.energy, 1 + 1e-9);
  }
}

TEST(ValidityMaps, JoinTheLinksOfALongerChain) {
  const Scene chain = lengthened_chain(scene_named("rod_chain"), 12);
  EXPECT_EQ(chain.bodies.size(), 13u);
  EXPECT_EQ(chain.joints.size(), 12u);
  EXPECT_LT(JointGapMeter(chain).gap(initial_state(chain)), 1e-12);
  EXPECT_THROW(lengthened_chain(scene_named("pendulum"), 5), Error);
}

/// Returns a run of A3 with single rows or of A2, with n sub-steps or iterations.
SweepRecord single_rows(Algorithm algorithm, int n, std::int64_t row_solves, double error) {
  SweepRecord record = standing(algorithm, 1, row_solves, 0);
  record.settings = {};
  record.settings.algorithm = algorithm;
  record.settings.joints = Joints::rows;
  (algorithm == Algorithm::a2 ? record.settings.iterations : record.settings.substeps) = n;
  record.size = 1;
  record.metrics->error.position = {error, error};
  return record;
}

TEST(EqualRows, CountPartsOfTheStep) {
  // A2 takes the step in eight parts.
  FigureSource source;
  source.properties = false;
  source.records = {single_rows(Algorithm::a3, 1, 100, 0.5),     single_rows(Algorithm::a3, 16, 1600, 0.1),
                    single_rows(Algorithm::a2, 1, 800, 0.4),     single_rows(Algorithm::a2, 2, 1600, 0.2),
                    single_rows(Algorithm::a2, 16, 12800, 0.01), single_rows(Algorithm::a2, 2, 1600, 0.05)};
  source.records.back().settings.relaxation = 1.3;  // not compared
  const EqualRows equal = equal_rows(source.records);
  ASSERT_EQ(equal.table.rows.size(), 1u);
  EXPECT_THAT(equal.table.rows[0], testing::ElementsAre("stack", "16", "10 %", "20 %", "0.5"));
  EXPECT_THAT(equal.won_on, testing::ElementsAre("stack"));
  const Sheet sheet = figure_named("equal-rows").make(source);
  ASSERT_EQ(sheet.panels.size(), 1u);
  EXPECT_EQ(sheet.panels[0].x.range.value()[1], 160);  // 16 iterations in each part are n = 128
  const auto page = [&] {
    return to_markdown(report_page(source, {{"equal-rows", {"<svg/>", {}, {}, {}}}}));
  };
  EXPECT_THAT(page(), HasSubstr("on 1 of 1 scenes: stack."));
  for (SweepRecord& record : source.records)
    record.metrics->error = {{0, 0}, record.metrics->error.position};  // turns in place
  EXPECT_THAT(equal_rows(source.records).table.rows[0],
              testing::ElementsAre("stack", "16", "0.1 rad", "0.2 rad", "0.5"));
  EXPECT_EQ(figure_named("equal-rows").make(source).panels[0].y.title, "RMS turn, rad");
  source.records.erase(source.records.begin() + 3);
  EXPECT_THAT(page(), AllOf(HasSubstr("equal-rows.svg"), Not(HasSubstr("At equal row solves (equal step"))));
}

TEST(LimitsTable, HasColumnForEachSetting) {
  std::vector<SweepRecord> records{single_rows(Algorithm::a2, 4, 1, 0), single_rows(Algorithm::a2, 4, 1, 0),
                                   standing(Algorithm::avbd, 5, 1, 0)};
  records[0].settings.relaxation = 1.6;
  constexpr std::array divisions{1, 9, 49};
  for (std::size_t i = 0; i < records.size(); ++i) {
    records[i].metrics.reset();
    records[i].limit = StabilityLimit{divisions[i], 64, 1};
  }
  const TextTable table = limits_table(records, false);
  EXPECT_THAT(table.head, testing::ElementsAre("scene", "A2 m=4", "A2 m=4 ω=1.6", "AVBD"));
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_THAT(table.rows[0], testing::ElementsAre("stack", "h/9", "h", "m = 49"));
}

/// Returns a run of two known figures with these measured values.
SweepRecord judged_run(const std::string& scene, Algorithm algorithm, double way, double height) {
  SweepRecord record;
  record.scene = scene;
  record.settings.algorithm = algorithm;
  record.size = record.duration = 1;
  record.metrics.emplace().expected = {{"way", "m", Bound::equal, 1, 0.1, way},
                                       {"height", "m", Bound::at_most, 2, 0.5, height}};
  return record;
}

TEST(BadFigures, SortByTolerances) {
  const std::vector<BadFigure> bad = bad_figures(
      {judged_run("good", Algorithm::a1, 1.05, 1), judged_run("slope", Algorithm::a1, 1.2, 1),
       judged_run("slope", Algorithm::a5, 1.3, 1), judged_run("slope", Algorithm::a5, 1.01, 1),
       judged_run("throw", Algorithm::a3, 1, 8), judged_run("stack", Algorithm::a2, INFINITY, 1)});
  ASSERT_EQ(bad.size(), 4u);
  EXPECT_EQ(bad[0].scene, "stack");
  EXPECT_EQ(bad[1].scene, "throw");
  EXPECT_EQ(bad[1].figure.name, "height");
  EXPECT_NEAR(bad[1].severity(), 12, 1e-12);
  EXPECT_EQ(bad[2].scene, "slope");
  EXPECT_EQ(bad[2].algorithm, Algorithm::a5);
  EXPECT_EQ(bad[2].bad, 1);
  EXPECT_EQ(bad[2].runs, 2);
  EXPECT_EQ(bad[3].algorithm, Algorithm::a1);
  // A5 and A1 miss the same figure: they share a line, which names A5 first, the worse.
  EXPECT_THAT(to_text(bad_figures_table(bad)),
              AllOf(HasSubstr("diverged"), HasSubstr("≤ 2 m"), HasSubstr("A5, A1"), HasSubstr("2 of 3")));
}

TEST(BadFigures, AddSectionToPage) {
  FigureSource source;
  source.properties = false;
  source.records = {judged_run("slope", Algorithm::a1, 1.2, 1)};
  EXPECT_THAT(
      to_markdown(report_page(source, {})),
      AllOf(HasSubstr("## Missed values"), HasSubstr("| slope | A1 | way | 1 m | 1.2 m | 2 times |")));
  source.records = {judged_run("slope", Algorithm::a1, 1.01, 1)};
  EXPECT_THAT(to_markdown(report_page(source, {})), Not(HasSubstr("## Missed values")));
  source.records[0].metrics->expected.clear();
  EXPECT_THAT(to_markdown(report_page(source, {})), Not(HasSubstr("## Missed values")));
}

Document document() {
  Document document;
  document.heading(1, "Page");
  document.paragraph("1 < 2, **strong** and `code`");
  document.table({{"", "a|b"}, {{"row", "1"}}});
  document.picture("about", "figures/one 1.svg", "<svg a=\"1\">é</svg>");
  return document;
}

TEST(Document, BecomesMarkdown) {
  EXPECT_EQ(to_markdown(document()),
            "# Page\n\n1 < 2, **strong** and `code`\n\n|  | a\\|b |\n|---|---:|\n| row | 1 |\n\n"
            "![about](<figures/one 1.svg>)\n");
}

TEST(Document, BecomesOneHtmlFile) {
  const std::string html = to_html(document());
  for (const char* const part :
       {"<title>Page</title>", "<p>1 &lt; 2, <strong>strong</strong> and <code>code</code></p>",
        "<th>a|b</th>", "data:image/svg+xml;charset=utf-8,%3Csvg a=%221%22%3E%C3%A9%3C/svg%3E"}) {
    EXPECT_THAT(html, HasSubstr(part));
  }
  EXPECT_THAT(html, Not(HasSubstr("figures/one 1.svg")));
  // Wide tables scroll on a phone. Blanks in property names would make browsers ignore the style.
  const std::string style = html.substr(0, html.find("</style>"));
  EXPECT_THAT(style, AllOf(HasSubstr(".table{overflow-x:auto}"), HasSubstr("@media(max-width:700px)"),
                           Not(testing::ContainsRegex("[a-z] - [a-z]"))));
}

}  // namespace
}  // namespace substep::report
