// The report's page, figures and tables of a small sweep over joint scenes.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "render/report/figures.h"
#include "render/report/report.h"
#include "render/report/report_tables.h"
#include "sim/study/sweep_results.h"
#include "tests/scene_files.h"

namespace substep::report {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// Records of a pendulum and a rod chain, at halved steps and doubled sub-steps; made once for all tests.
class SweepResults : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const fs::path folder = fs::path(test::build_folder) / "tests/report/sweep";
    fs::create_directories(folder);
    const std::string rod_chain = (scenes_folder() / "rod_chain.gltf").string();
    const std::string grid = fmt::format("[[grid]]\nscenes = [\"{}\", \"{}\"]\n",
                                         (scenes_folder() / "pendulum.gltf").string(), rod_chain);
    // Rename a file of this process: tests run in parallel, and none may read a partial file.
    const fs::path written = folder / fmt::format("small.{}", ::getpid());
    std::ofstream(written)
        << "horizon = 1\nmost = 32\n"
        << grid << "algorithms = [\"a1\", \"a2\"]\ndivisions = [1, 2, 4, 8, 16]\niterations = [16]\n"
        << grid << "algorithms = [\"a3\", \"a4\", \"a5\"]\nsubsteps = [1, 2, 4, 8, 16]\ntau = [1]\n"
        << "joints = [\"plain\", \"stable\", \"rows\"]\n"
        << fmt::format("[[limit]]\nscenes = [\"{}\"]\nalgorithms = [\"a1\"]\n", rod_chain);
    fs::rename(written, folder / "small.toml");
    const Sweep sweep = read_sweep(folder / "small.toml");
    run_sweep(sweep, {folder / "results", 2, 1, 1}, {});
    source_ = new FigureSource;
    source_->records = merge_sweep(sweep, folder / "results");
    source_->scenes = scenes_folder();
    source_->properties = false;
  }
  static void TearDownTestSuite() { delete source_; }

  static const FigureSource& source() { return *source_; }

 private:
  static inline FigureSource* source_ = nullptr;
};

TEST_F(SweepResults, GiveTablesACellForEachColumn) {
  const std::vector<SweepRecord>& records = source().records;
  const std::vector<TextTable> tables{
      choices_table(records), references_table(records), limits_table(records, false),
      orders_table(records),  equal_rows(records).table, equal_cost_table(records),
      energy_table(records),  springs_table(),           runs_table(records)};
  for (const TextTable& table : tables) {
    for (const std::vector<std::string>& row : table.rows)
      EXPECT_EQ(row.size(), table.head.size()) << row.at(0);
  }
}

TEST_F(SweepResults, HaveErrorsAboveTheReferencesUncertainty) {
  for (const SweepRecord& record : source().records) {
    if (!record.metrics) continue;
    EXPECT_GT(record.metrics->error.position.rms, 100 * record.uncertainty) << record.key;
  }
}

TEST_F(SweepResults, DrawTheSameFigureTwice) {
  const ReportFigure& figure = figure_named("work-rows");
  const std::string one = draw(figure.make(source()), PictureFormat::svg);
  EXPECT_EQ(one, draw(figure.make(source()), PictureFormat::svg));
  for (const char* const text : {"rod_chain, 1 s", "A5 stable", "prefers-color-scheme:dark"})
    EXPECT_THAT(one, HasSubstr(text));
  EXPECT_EQ(draw(figure.make(source()), PictureFormat::pdf).substr(0, 5), "%PDF-");
}

TEST_F(SweepResults, AssignEachRunToAFamilyOrLeaveItOut) {
  for (const std::string& scene : scenes_of(source().records)) {
    const std::vector<SweepRecord> own = of_scene(source().records, scene);
    std::size_t count = 0;
    for (const RunFamily& family : families_of(own)) count += family.runs.size();
    for (const RunsLeftOut& runs : left_out_of(own)) count += static_cast<std::size_t>(runs.count);
    EXPECT_EQ(count, static_cast<std::size_t>(std::ranges::count_if(own, is_own_run))) << scene;
  }
}

TEST_F(SweepResults, NameTheSeriesLeftOutOfFigures) {
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
              AllOf(HasSubstr("- A3 rows of pendulum: 5 runs: single rows, which 'equal-rows' shows\n"),
                    HasSubstr("- A4 rows of pendulum: 5 runs: single rows\n")));
  // Each family is either drawn or left out.
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
  for (const char* const other : {"A2", "A3", "A4", "A5"}) EXPECT_THAT(caption, Not(HasSubstr(other)));
}

TEST_F(SweepResults, DrawASingleRunAsAPoint) {
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

TEST_F(SweepResults, FillInThePage) {
  const std::string page = to_markdown(report_page(source(), {{"order", {"<svg/>", {}, {}, {}}}}));
  EXPECT_THAT(page, testing::StartsWith("# Speed against error of A1 to A5\n\n## What to choose\n"));
  EXPECT_THAT(page, HasSubstr("\n111 runs of 2 scenes. An error is the root mean square distance"));
  EXPECT_THAT(page, HasSubstr("![pendulum: RMS error / size against rows solved in a simulated second]"));
  EXPECT_THAT(page, HasSubstr("in parts of the scene's size"));  // the template breaks a line here
  EXPECT_THAT(page, HasSubstr("![error against the (sub-)step, with slope triangles](<figures/order.svg>)"));
  for (const char* const heading :
       {"## What to choose", "## Order", "### rod_chain", "## Sub-steps or iterations",
        "## What stays bounded", "### pendulum", "## References"}) {
    EXPECT_THAT(page, HasSubstr(std::string("\n") + heading + "\n")) << heading;
  }
  EXPECT_THAT(page, HasSubstr("scenes: pendulum, rod_chain."));
  // No mark of the template is left.
  EXPECT_EQ(page.find_first_of("{}"), std::string::npos);
  EXPECT_THAT(page, Not(HasSubstr("\n[")));
}

TEST_F(SweepResults, KeepThePageToItsOwnScenes) {
  const std::string page = to_markdown(report_page(source(), {}));
  for (const fs::directory_entry& entry : fs::directory_iterator(scenes_folder())) {
    const std::string name = entry.path().stem().string();
    const bool is_own = name == "pendulum" || name == "rod_chain";
    const bool is_a_word = name == "overlap";  // of the page, too
    if (entry.path().extension() != ".gltf" || is_own || is_a_word) continue;
    EXPECT_THAT(page, Not(HasSubstr(name)));
  }
  // The sweep has no contacts, times, engines or figures.
  for (const char* const word :
       {"CPU", "A2 with contacts", "## Springs", "## Error against", "## Beside the five", "## Omitted"})
    EXPECT_THAT(page, Not(HasSubstr(word)));
  // Each heading has text below, each table a row.
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

TEST_F(SweepResults, ShowScenesThatAnEngineRan) {
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
  // Without times the engine is drawn against the step alone.
  for (SweepRecord& record : beside.records) record.times.reset();
  EXPECT_TRUE(figure_named("engines").make(beside).panels.empty());
  const Sheet steps = figure_named("engine-steps").make(beside);
  ASSERT_EQ(steps.panels.size(), 1u);
  EXPECT_EQ(std::ranges::count(steps.panels[0].series, "some-engine", &Series::title), 1);
  beside.records.back().settings.iterations = 4;
  const Sheet by_m = figure_named("engine-steps").make(beside);
  ASSERT_EQ(by_m.panels.size(), 1u);
  EXPECT_EQ(std::ranges::count(by_m.panels[0].series, "some-engine m=4", &Series::title), 1);
  for (const Series& series : by_m.panels[0].series)
    EXPECT_EQ(std::ranges::count(by_m.panels[0].series, series.style, &Series::style), 1) << series.title;
}

TEST_F(SweepResults, DrawIterationsOfRapierAsSubsteps) {
  FigureSource beside = source();
  SweepRecord& record = beside.records.emplace_back(beside.records.front());
  record.engine = "rapier";
  record.settings = {.step = 1.0 / 60, .substeps = 1, .iterations = 10};
  const Sheet sheet = figure_named("engine-steps").make(beside);
  ASSERT_EQ(sheet.panels.size(), 1u);
  const auto rapier = std::ranges::find(sheet.panels[0].series, "Rapier 0.21", &Series::title);
  ASSERT_NE(rapier, sheet.panels[0].series.end());
  EXPECT_DOUBLE_EQ(rapier->points.at(0)[0], 1.0 / 600);
}

TEST_F(SweepResults, DashStableJointsAlone) {
  FigureSource soft = source();
  for (SweepRecord& record : soft.records) {
    Settings& s = record.settings;
    if (s.algorithm >= Algorithm::a3 && s.joints != Joints::rows) s.tau = s.contact_tau = 0.6;
  }
  const Sheet sheet = figure_named("order").make(soft);
  std::map<std::string, SeriesStyle> styles;
  for (const Series& series : sheet.panels.at(0).series) styles[series.title] = series.style;
  // All three share τ = 0.6, which the caption names.
  for (const char* const title : {"A3", "A4", "A5"}) {
    const SeriesStyle plain = styles.at(std::string(title) + " plain");
    SeriesStyle stable = styles.at(std::string(title) + " stable");
    EXPECT_TRUE(stable.dashed && !plain.dashed) << title;
    stable.dashed = false;
    EXPECT_EQ(stable, plain) << title;
  }
  EXPECT_THAT(caption_text(sheet), HasSubstr("stable τ=0.6"));
}

TEST_F(SweepResults, LeaveOutLinesOfOnePoint) {
  FigureSource single = source();
  std::set<std::pair<std::string, Algorithm>> seen;
  std::erase_if(single.records, [&](const SweepRecord& record) {
    return !seen.emplace(record.scene, record.settings.algorithm).second;
  });
  EXPECT_TRUE(figure_named("order").make(single).panels.empty());
  const std::string page = to_markdown(report_page(single, {}));
  EXPECT_THAT(page, Not(HasSubstr(":\n\n#")));
}

TEST_F(SweepResults, NameTheSideAheadAtEachError) {
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
  for (const char* const engine : {"order-4", ""}) add(engine, 1e-4, 1e-9);  // ours, but none of the five
  records.back().settings.algorithm = Algorithm::soft;
  std::vector<std::string> rows;
  for (const std::vector<std::string>& row : ahead_table(records).rows)
    rows.push_back(row[1] + ": " + row.back());
  EXPECT_THAT(rows, testing::ElementsAre("100 mm: the other, 2 times", "30 mm: ours, 8 times",
                                         "10 mm: ours, 2 times", "3 mm: ours alone"));
  std::vector<SweepRecord> untimed = records;
  for (SweepRecord& record : untimed) {
    if (is_other_engine(record)) record.times.reset();
  }
  EXPECT_TRUE(ahead_table(untimed).rows.empty());
  records[1].metrics->error = {{0, 0}, {0.1, 0.1}};  // turns in place
  EXPECT_TRUE(ahead_table(records).rows.empty());
}

TEST_F(SweepResults, LimitEqualCostToTwiceTheCheapest) {
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

TEST_F(SweepResults, CompareEnergyAtEqualRows) {
  const TextTable table = energy_table(source().records);
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_THAT(to_text(table), HasSubstr("A3 stable"));
  // Stable joints only take energy from the pendulum (claim 14).
  const auto column = std::ranges::find(table.head, "A3 stable") - table.head.begin();
  EXPECT_THAT(table.rows[0][static_cast<std::size_t>(column)], testing::MatchesRegex("-.* / rounding"));
}

TEST_F(SweepResults, ListOmittedRunsOnThePage) {
  FigureSource omitted = source();
  SweepRecord& record = omitted.records.emplace_back(omitted.records.front());
  record.engine = "no-such";
  record.omitted = "the program was built without it";
  record.metrics.reset();
  const std::string page = to_markdown(report_page(omitted, {}));
  EXPECT_THAT(page, HasSubstr("## Omitted\n"));
  EXPECT_THAT(page, HasSubstr("the program was built without it"));
}

TEST_F(SweepResults, RecommendTheCheapestGoodRun) {
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

TEST_F(SweepResults, OrderBestRunsByCostAndError) {
  const std::vector<SweepRecord> best = best_runs(of_scene(source().records, "rod_chain"));
  ASSERT_GE(best.size(), 2u);
  for (std::size_t i = 1; i < best.size(); ++i) {
    EXPECT_GE(best[i].metrics->row_solves, best[i - 1].metrics->row_solves);
    EXPECT_LT(error_of(best[i]), error_of(best[i - 1]));
  }
}

}  // namespace
}  // namespace substep::report
