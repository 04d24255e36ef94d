// The results and figures of a small sweep over joint scenes.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "render/report/descendant_figures.h"
#include "render/report/figures.h"
#include "render/report/report.h"
#include "render/report/report_tables.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/measure/joint_gap.h"
#include "sim/measure/measured_run.h"
#include "sim/measure/validity_maps.h"
#include "sim/model/usual_settings.h"
#include "sim/study/advice.h"
#include "sim/study/sweep_results.h"
#include "tests/folders.h"

namespace substep::report {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

fs::path scenes() {
  return fs::path(test::source_folder) / "scenes";
}

/// Pendulum and rod chain, at halved steps and doubled sub-steps; made once for all tests.
class SweepResults : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const fs::path folder = fs::path(test::build_folder) / "tests/report/sweep";
    fs::create_directories(folder);
    std::ofstream(folder / "small.toml")
        << "horizon = 1\nmost = 32\n"
        << "[[grid]]\nscenes = [\"" << (scenes() / "pendulum.gltf").string() << "\", \""
        << (scenes() / "rod_chain.gltf").string() << "\"]\n"
        << "algorithms = [\"a1\", \"a2\"]\ndivisions = [1, 2, 4, 8, 16]\niterations = [16]\n"
        << "[[grid]]\nscenes = [\"" << (scenes() / "pendulum.gltf").string() << "\", \""
        << (scenes() / "rod_chain.gltf").string() << "\"]\n"
        << "algorithms = [\"a3\", \"a4\", \"a5\"]\nsubsteps = [1, 2, 4, 8, 16]\ntau = [1]\n"
           "joints = [\"plain\", \"stable\", \"rows\"]\n"
        << "[[limit]]\nscenes = [\"" << (scenes() / "rod_chain.gltf").string()
        << "\"]\nalgorithms = [\"a1\"]\n";
    const Sweep sweep = read_sweep(folder / "small.toml");
    run_sweep(sweep, {folder / "results", 2, 1, 1}, {});
    merge_sweep(sweep, folder / "results");
    source_ = new FigureSource;
    source_->records = read_records(folder / "results");
    source_->scenes = scenes();
    source_->properties = false;
  }
  static void TearDownTestSuite() { delete source_; }

  static const FigureSource& source() { return *source_; }

  static std::vector<SweepRecord> family(const std::string& scene, const std::string& title) {
    for (const RunFamily& candidate : families_of(of_scene(source_->records, scene))) {
      if (candidate.title == title) return candidate.runs;
    }
    return {};
  }

 private:
  static inline FigureSource* source_ = nullptr;
};

TEST_F(SweepResults, EveryRowOfATableHasACellForEachColumn) {
  const std::vector<SweepRecord>& records = source().records;
  const std::vector<TextTable> tables{
      choices_table(records), references_table(records), limits_table(records, false), slopes_table(records),
      orders_table(records),  equal_rows(records).table, equal_cost_table(records),    energy_table(records),
      springs_table(),        runs_table(records)};
  for (const TextTable& table : tables) {
    for (const std::vector<std::string>& row : table.rows)
      EXPECT_EQ(row.size(), table.head.size()) << row.at(0);
  }
}

TEST_F(SweepResults, EachErrorIsAHundredTimesTheReferencesUncertainty) {
  for (const SweepRecord& record : source().records) {
    if (!record.metrics) continue;
    EXPECT_GT(record.metrics->error.position.rms, 100 * record.uncertainty) << record.key;
  }
}

TEST_F(SweepResults, TheFigureIsTheSameTwice) {
  const ReportFigure& figure = figure_named("work-rows");
  const std::string one = draw(figure.make(source()), PictureFormat::svg);
  EXPECT_EQ(one, draw(figure.make(source()), PictureFormat::svg));
  for (const char* const part : {"rod\\_chain, 1 s", "A5 stable", "prefers-color-scheme:dark"}) {
    std::string text = part;
    std::erase(text, '\\');
    EXPECT_THAT(one, HasSubstr(text));
  }
  EXPECT_EQ(draw(figure.make(source()), PictureFormat::pdf).substr(0, 5), "%PDF-");
}

TEST_F(SweepResults, EachMeasuredRunIsInAFamilyOrLeftOut) {
  for (const std::string& scene : scenes_of(source().records)) {
    const std::vector<SweepRecord> own = of_scene(source().records, scene);
    std::size_t count = 0;
    for (const RunFamily& family : families_of(own)) count += family.runs.size();
    for (const RunsLeftOut& runs : left_out_of(own)) count += static_cast<std::size_t>(runs.count);
    EXPECT_EQ(count, static_cast<std::size_t>(std::ranges::count_if(own, is_own_run))) << scene;
  }
}

TEST_F(SweepResults, FiguresNameTheSeriesTheyLeaveOut) {
  FigureSource lost = source();
  for (SweepRecord& record : lost.records) {
    if (record.scene == "pendulum" && record.settings.algorithm == Algorithm::a5)
      record.metrics->error.position = {INFINITY, INFINITY};
  }
  const Sheet sheet = figure_named("work-rows").make(lost);
  EXPECT_EQ(
      std::ranges::count(sheet.left_out, LeftOut{"pendulum", "A5 stable",
                                                 "5 runs lost (error above three times the scene's size)"}),
      1);
  EXPECT_THAT(caption_text(sheet),
              HasSubstr("- A3 rows of pendulum: 5 runs: single rows, which 'equal-rows' shows"));
  // One of each is drawn or left out, and the caption names no other algorithm.
  for (const std::string& scene : scenes_of(lost.records)) {
    for (const RunFamily& family : families_of(of_scene(lost.records, scene))) {
      const auto has = [&](const Panel& panel) {
        return panel.title.starts_with(scene) &&
               std::ranges::count(panel.series, family.title, &Series::title) == 1;
      };
      const bool is_left_out = std::ranges::any_of(sheet.left_out, [&](const LeftOut& one) {
        return one.scene == scene && one.series == family.title;
      });
      EXPECT_TRUE(is_left_out != std::ranges::any_of(sheet.panels, has)) << scene << " " << family.title;
    }
  }
  FigureSource first = source();
  std::erase_if(first.records,
                [](const SweepRecord& record) { return record.settings.algorithm != Algorithm::a1; });
  const std::string caption = caption_text(figure_named("work-rows").make(first));
  EXPECT_THAT(caption, HasSubstr("A1: h divided by 1, 2, 4, 8, 16."));
  for (const char* const other : {"A2", "A3", "A4", "A5", "Own"}) EXPECT_THAT(caption, Not(HasSubstr(other)));
}

TEST_F(SweepResults, ASingleRunIsAPointOfItsFigure) {
  FigureSource few = source();
  std::erase_if(few.records, [](const SweepRecord& record) {
    const Settings& s = record.settings;
    return s.algorithm != Algorithm::a5 || s.substeps != 4 || s.joints != Joints::stable;
  });
  const Sheet sheet = figure_named("work-rows").make(few);
  ASSERT_EQ(sheet.panels.size(), 2u);
  ASSERT_EQ(sheet.panels[0].series.size(), 1u);
  EXPECT_EQ(sheet.panels[0].series[0].title, "A5");
  EXPECT_EQ(sheet.panels[0].series[0].points.size(), 1u);
}

TEST_F(SweepResults, ThePageIsTheTemplateFilledIn) {
  const std::string page = to_markdown(report_page(source(), {{"order", {"<svg/>", {}, {}, {}}}}));
  EXPECT_THAT(page, testing::StartsWith("# Speed against error of A1 to A5\n\n## What to choose\n"));
  EXPECT_THAT(page, HasSubstr("\n111 runs of 2 scenes. An error is the root mean square distance"));
  EXPECT_THAT(page, HasSubstr("in parts of the scene's size"));  // a line's end in the template
  EXPECT_THAT(page, HasSubstr("![error against the (sub-)step, with slope triangles](figures/order.svg)"));
  for (const char* const heading :
       {"## What to choose", "## Order", "#### rod_chain", "## Sub-steps or iterations",
        "## What stays bounded", "### pendulum", "## References"}) {
    EXPECT_THAT(page, HasSubstr(std::string("\n") + heading + "\n")) << heading;
  }
  EXPECT_THAT(page, HasSubstr("scenes: pendulum, rod_chain."));
  // No engine ran and nothing was left out: these sections go.
  EXPECT_THAT(page, Not(HasSubstr("## Beside the five")));
  EXPECT_THAT(page, Not(HasSubstr("## Omitted")));
  // Nothing of the template is left as it was written there.
  EXPECT_EQ(page.find_first_of("{}"), std::string::npos);
  EXPECT_THAT(page, Not(HasSubstr("\n[")));
}

TEST_F(SweepResults, ThePageSpeaksOfItsOwnScenesAlone) {
  const std::string page = to_markdown(report_page(source(), {}));
  for (const fs::directory_entry& entry : fs::directory_iterator(scenes())) {
    const std::string name = entry.path().stem().string();
    const bool is_own = name == "pendulum" || name == "rod_chain";
    const bool is_a_word = name == "overlap";
    if (entry.path().extension() != ".gltf" || is_own || is_a_word) continue;
    EXPECT_THAT(page, Not(HasSubstr(name)));
  }
  // No contacts, no times, no engine, no figure: nothing is said of them.
  for (const char* const word : {"CPU", "sliding", "A2 with contacts", "## Springs", "## Error against"})
    EXPECT_THAT(page, Not(HasSubstr(word)));
  // No table without a row and no heading without a word below.
  for (std::size_t at = page.find("\n#"); at != std::string::npos; at = page.find("\n#", at + 1)) {
    const std::size_t below = page.find_first_not_of('\n', page.find('\n', at + 1));
    const bool goes_deeper = page.compare(below, 2, "##") == 0;
    EXPECT_TRUE(below != std::string::npos && (page[below] != '#' || goes_deeper)) << page.substr(at, 60);
  }
  for (std::size_t at = page.find("|---"); at != std::string::npos; at = page.find("|---", at + 1)) {
    const std::size_t below = page.find('\n', at) + 1;
    EXPECT_EQ(page[below], '|') << page.substr(page.rfind('\n', at - 2) + 1, 200);
    at = below;
  }
}

TEST_F(SweepResults, ScenesBesideEnginesAreThoseWhereOneRan) {
  EXPECT_TRUE(figure_named("engines").make(source()).panels.empty());
  FigureSource beside = source();
  for (const double step : {1.0 / 60, 1.0 / 120}) {
    SweepRecord& record = beside.records.emplace_back(beside.records.front());
    record.engine = "some-engine";
    record.settings.step = step;
    record.times = RunTimes{1, 1, 1, 1, {}};
  }
  const Sheet sheet = figure_named("engines").make(beside);
  ASSERT_EQ(sheet.panels.size(), 1u);
  EXPECT_THAT(sheet.panels[0].title, HasSubstr("pendulum"));
  // An engine without times is drawn against the step alone.
  for (SweepRecord& record : beside.records) record.times.reset();
  EXPECT_TRUE(figure_named("engines").make(beside).panels.empty());
  const Sheet steps = figure_named("engine-steps").make(beside);
  ASSERT_EQ(steps.panels.size(), 1u);
  EXPECT_EQ(std::ranges::count(steps.panels[0].series, "some-engine", &Series::title), 1);
}

/// Returns a run that stands, with so many row solves.
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

TEST(Descendants, MostRowsWithinTheBudgetAreCompared) {
  std::vector<SweepRecord> records{
      standing(Algorithm::a5, 16, 1000, 0.001), standing(Algorithm::soft, 4, 600, 0.03),
      standing(Algorithm::soft, 6, 1040, 0.02),  // a twentieth more is no more
      standing(Algorithm::soft, 8, 1200, 0.01), standing(Algorithm::avbd, 10, 900, 0.1),
      standing(Algorithm::a1, 1, 2000, 0)};
  records[4].metrics->diverged = 0.5;
  const std::vector<TextTable> tables = equal_cost_of_descendants(records, Cost::rows);
  ASSERT_EQ(tables.size(), 1u);
  std::map<std::string, std::string> cells;
  for (const std::vector<std::string>& row : tables[0].rows) cells[row[0]] = row[1];
  EXPECT_EQ(cells["A5"], "0.001");
  EXPECT_EQ(cells["Soft Step"], "0.02");
  EXPECT_EQ(cells["AVBD"], "lost");
  EXPECT_EQ(cells["A1"], "–");  // it costs more
  records.resize(1);
  EXPECT_TRUE(equal_cost_of_descendants(records, Cost::rows).empty());
}

TEST(Descendants, RowsAreSpringsOrThrowBack) {
  const std::vector<TextTable> tables = numbers_of(figure_named("soft-rows").make({}));
  ASSERT_EQ(tables.size(), 1u);
  const std::string text = to_text(tables[0]);
  EXPECT_THAT(text, HasSubstr("A5, contacts: ωh = 1.73, ζ = -0.19"));
  EXPECT_THAT(text, HasSubstr("Soft Step, contacts 30 Hz: ωh = 0.79, ζ = 10.00"));
}

TEST(Descendants, IterationsOfAvbdAreCounted) {
  const Scene scene = load_scene(scenes() / "heavy_chain.gltf");
  const std::vector<NeededSubsteps> needed =
      needed_substeps(scene, default_settings(Algorithm::avbd), 0.1, 16);
  EXPECT_GT(needed[0].substeps, 1);  // measured 5 of at most 256
  EXPECT_GT(needed[1].substeps, needed[0].substeps);
}

TEST_F(SweepResults, AheadIsWhoIsCheaperWithinAnError) {
  std::vector<SweepRecord> records = of_scene(source().records, "pendulum");
  const auto add = [&](const std::string& engine, double error, double seconds) {
    SweepRecord& record = records.emplace_back(records.front());
    record.engine = engine;
    record.label = engine.empty() ? "A9" : engine;
    record.metrics->bounded = true;
    record.metrics->error.position = {error, error};
    record.duration = 1;
    record.times = RunTimes{seconds, seconds, seconds, 1, {}};
  };
  EXPECT_TRUE(ahead_table(records).rows.empty());  // no other engine ran
  records.erase(records.begin() + 1, records.end());
  records.front().times.reset();
  add("", 0.02, 0.5);
  add("", 0.002, 2);
  add("peer", 0.05, 0.25);
  add("peer", 0.008, 4);
  add("order-4", 0, 1e-9);  // ours, but none of the five
  std::vector<std::string> said;
  for (const std::vector<std::string>& row : ahead_table(records).rows)
    said.push_back(row[1] + ": " + row.back());
  EXPECT_THAT(said, testing::ElementsAre("100 mm: the other, 2 times", "30 mm: ours, 8 times",
                                         "10 mm: ours, 2 times", "3 mm: ours: no other is there"));
}

TEST_F(SweepResults, EqualCostIsNoMoreThanTwiceTheCheapest) {
  const TextTable table = equal_cost_table(source().records);
  ASSERT_EQ(table.rows.size(), 2u);
  const std::vector<SweepRecord> own = of_scene(source().records, "rod_chain");
  const SweepRecord cheap = *cheapest(own, 0.01);
  double least = 1;
  for (const SweepRecord& record : own) {
    const bool is_affordable = record.metrics && record.metrics->row_solves <= 2 * cheap.metrics->row_solves;
    if (is_affordable && record.metrics->bounded) least = std::min(least, error_of(record));
  }
  EXPECT_THAT(to_text(table), HasSubstr(fmt::format("**{:.2g} %", 100 * least)));
}

TEST_F(SweepResults, EnergyIsComparedAtEqualRows) {
  const TextTable table = energy_table(source().records);
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_THAT(to_text(table), HasSubstr("A3 stable"));
  // Stable joints only take energy from the pendulum (claim 14): its largest rise is none.
  const auto column = std::ranges::find(table.head, "A3 stable") - table.head.begin();
  EXPECT_THAT(table.rows[0][static_cast<std::size_t>(column)], testing::MatchesRegex("-.* / rounding"));
}

TEST(ReportTables, SpringsAreDampedAsImplicitStepsDo) {
  const TextTable table = springs_table();
  ASSERT_EQ(table.rows.size(), 5u);
  for (const auto& row : table.rows) EXPECT_EQ(row[2], row[3]) << row[0];  // A1 and its closed form
}

TEST(DefaultSweep, HasASceneOfEachSort) {
  const Sweep sweep = read_sweep(scenes() / "sweep.toml");
  EXPECT_TRUE(sweep.properties);
  for (const char* const scene : {"ragdoll", "squeezer", "box_pyramid", "rock_slide"})
    EXPECT_TRUE(sweep.scenes.contains(scene)) << scene;
  // A3, A4 and A5 with the same settings: none has been tried less.
  std::map<std::string, std::map<Algorithm, int>> settings;
  for (const SweepJob& job : sweep.jobs) {
    const bool is_compared = job.engine.empty() && job.settings.joints != Joints::rows;
    if (is_compared && job.settings.algorithm >= Algorithm::a3) ++settings[job.scene][job.settings.algorithm];
  }
  for (auto& [scene, counts] : settings) {
    EXPECT_EQ(counts[Algorithm::a3], counts[Algorithm::a4]) << scene;
    EXPECT_EQ(counts[Algorithm::a3], counts[Algorithm::a5]) << scene;
  }
}

TEST_F(SweepResults, ThePageHasWhatWasLeftOut) {
  FigureSource omitted = source();
  SweepRecord& record = omitted.records.emplace_back(omitted.records.front());
  record.engine = "no-such";
  record.omitted = "the program was built without it";
  record.metrics.reset();
  const std::string page = to_markdown(report_page(omitted, {}));
  EXPECT_THAT(page, HasSubstr("## Omitted\n"));
  EXPECT_THAT(page, HasSubstr("the program was built without it"));
}

TEST_F(SweepResults, AdviceNamesTheCheapestThatIsGoodEnough) {
  const std::vector<SweepRecord> own = of_scene(source().records, "rod_chain");
  const auto run = cheapest(own, 0.01);
  ASSERT_TRUE(run);
  EXPECT_LE(error_of(*run), 0.01);
  for (const SweepRecord& other : own) {
    if (!other.metrics || other.metrics->row_solves >= run->metrics->row_solves) continue;
    const bool is_good =
        other.metrics->bounded && error_of(other) <= 0.01 && other.metrics->joint_gap <= 0.01 * other.size;
    EXPECT_FALSE(is_good) << other.key;
  }
  EXPECT_THAT(advice(own), HasSubstr("For 1 % of the scene's size take **A"));
  EXPECT_FALSE(cheapest(own, 1e-12));
}

TEST_F(SweepResults, BestRunsGetBetterAsTheyCostMore) {
  const std::vector<SweepRecord> best = best_runs(of_scene(source().records, "rod_chain"));
  ASSERT_GE(best.size(), 2u);
  for (std::size_t i = 1; i < best.size(); ++i) {
    EXPECT_GE(best[i].metrics->row_solves, best[i - 1].metrics->row_solves);
    EXPECT_LT(error_of(best[i]), error_of(best[i - 1]));
  }
}

TEST(StabilityLimit, IsFoundAndIsTheSmallest) {
  Scene scene = load_scene(scenes() / "heavy_chain.gltf");
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

TEST(ValidityMaps, TheMassRatioHasSmallerStepsOfA1) {
  const Scene scene = load_scene(scenes() / "heavy_chain.gltf");
  const std::vector<MassRatioPoint> points =
      mass_ratio_map(scene, usual_settings(scene, Algorithm::a1), 0.5, 8);
  ASSERT_EQ(points.size(), 20u);
  // 1000 : 1 at the scene's step, which A1 takes in parts, and at an eighth of it.
  EXPECT_TRUE(points[12].bounded);
  EXPECT_TRUE(points[15].bounded);
  EXPECT_LT(points[15].error, 0.01);
}

TEST(ValidityMaps, AStiffSpringIsDampedAndNeverGainsEnergy) {
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a3, Algorithm::a5}) {
    Settings settings;
    settings.algorithm = algorithm;
    for (const StiffnessPoint& point : stiffness_map(settings)) EXPECT_LE(point.energy, 1 + 1e-9);
  }
}

TEST(ValidityMaps, ALongerChainHasItsLinksJoined) {
  const Scene chain = lengthened_chain(load_scene(scenes() / "rod_chain.gltf"), 12);
  EXPECT_EQ(chain.bodies.size(), 13u);
  EXPECT_EQ(chain.joints.size(), 12u);
  EXPECT_LT(joint_gap(chain, initial_state(chain)), 1e-12);
  EXPECT_THROW(lengthened_chain(load_scene(scenes() / "pendulum.gltf"), 5), Error);
}

}  // namespace
}  // namespace substep::report
