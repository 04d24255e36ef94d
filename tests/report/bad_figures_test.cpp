// The choice and order of figures at the report's top, on made-up measurements.

#include "render/report/bad_figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace substep::report {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

SweepRecord run(const std::string& scene, Algorithm algorithm, double way, double height) {
  SweepRecord record;
  record.key = scene + std::string(name(algorithm)) + std::to_string(way);
  record.scene = scene;
  record.label = "label of " + record.key;
  record.settings.algorithm = algorithm;
  record.size = record.duration = 1;
  Metrics metrics;
  metrics.expected = {{"way", "m", Bound::equal, 1, 0.1, way},
                      {"height", "m", Bound::at_most, 2, 0.5, height}};
  record.metrics = metrics;
  return record;
}

TEST(BadFigures, AreSortedTheWorstFirstAndCounted) {
  const std::vector<SweepRecord> records{
      run("good", Algorithm::a1, 1.05, 1), run("slope", Algorithm::a1, 1.2, 1),
      run("slope", Algorithm::a5, 1.3, 1), run("slope", Algorithm::a5, 1.01, 1),
      run("throw", Algorithm::a3, 1, 8),   run("stack", Algorithm::a2, INFINITY, 1),
  };
  const std::vector<BadFigure> bad = bad_figures(records);
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
  const std::string table = to_text(bad_figures_table(bad));
  EXPECT_THAT(table, HasSubstr("never"));
  EXPECT_THAT(table, HasSubstr("≤ 2 m"));
  // A5 and A1 miss the slope's way: A5, the worse, has the line of both.
  EXPECT_THAT(table, HasSubstr("A5, A1"));
  EXPECT_THAT(table, HasSubstr("2 of 3"));
}

std::string page_of(const std::vector<SweepRecord>& records) {
  Document page;
  add_bad_figures(records, page);
  return to_markdown(page);
}

TEST(BadFigures, AreATableOnThePage) {
  EXPECT_THAT(page_of({run("slope", Algorithm::a1, 1.2, 1)}),
              AllOf(HasSubstr("## What is off"), HasSubstr("| slope | A1 | way | 1 m | 1.2 m | 2 times |")));
}

TEST(BadFigures, AreLeftOutWhereThereAreNone) {
  EXPECT_EQ(page_of({run("slope", Algorithm::a1, 1.01, 1)}), "");
  SweepRecord unknown = run("slope", Algorithm::a1, 1, 1);
  unknown.metrics->expected.clear();
  EXPECT_EQ(page_of({unknown}), "");
}

}  // namespace
}  // namespace substep::report
