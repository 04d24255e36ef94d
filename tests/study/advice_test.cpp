// Tests the recommendations on made-up measurements.

#include "sim/study/sweep_results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace substep {
namespace {

using testing::HasSubstr;
using testing::Not;

SweepRecord run(Algorithm algorithm, int n, double error, std::int64_t rows, bool bounded = true) {
  SweepRecord record;
  record.key = std::string(name(algorithm)) + std::to_string(n);
  record.scene = "scene";
  record.settings.algorithm = algorithm;
  record.settings.substeps = n;
  record.size = 1;
  record.duration = 1;
  Metrics metrics;
  metrics.error.position = {error, error};
  metrics.row_solves = rows;
  metrics.bounded = bounded;
  record.metrics = metrics;
  return record;
}

TEST(Cheapest, UsesRowsWithoutTimes) {
  const std::vector<SweepRecord> runs{run(Algorithm::a1, 1, 0.02, 10), run(Algorithm::a3, 4, 0.005, 40),
                                      run(Algorithm::a3, 16, 0.0005, 160),
                                      run(Algorithm::a5, 2, 0.001, 20, false)};
  EXPECT_EQ(cheapest(runs, 0.01)->settings.substeps, 4);
  EXPECT_EQ(cheapest(runs, 0.001)->settings.substeps, 16);
  EXPECT_FALSE(cheapest(runs, 0.0001));
}

TEST(Cheapest, AvoidsRunsWhoseFinerRunsDiverge) {
  std::vector<SweepRecord> runs{run(Algorithm::a3, 4, 0.005, 80), run(Algorithm::a5, 4, 0.005, 40),
                                run(Algorithm::a5, 8, 0.1, 80, false)};
  EXPECT_EQ(cheapest(runs, 0.01)->settings.algorithm, Algorithm::a3);
  // A run with another τ is no refinement of this one.
  runs[2].settings.tau = 0.5;
  EXPECT_EQ(cheapest(runs, 0.01)->settings.algorithm, Algorithm::a5);
}

TEST(Cheapest, UsesTimesIfMeasured) {
  std::vector<SweepRecord> runs{run(Algorithm::a1, 1, 0.005, 10), run(Algorithm::a3, 4, 0.005, 40)};
  runs[0].times = RunTimes{2, 2, 2, 1, {}};
  runs[1].times = RunTimes{1, 1, 1, 1, {}};
  EXPECT_EQ(cheapest(runs, 0.01)->settings.algorithm, Algorithm::a3);
}

TEST(Advice, RecommendsRunWithinOnePercent) {
  EXPECT_THAT(advice({run(Algorithm::a1, 1, 0.5, 10)}), HasSubstr("No run stays within 1 %"));
  EXPECT_THAT(advice({run(Algorithm::a1, 1, 0.005, 10), run(Algorithm::a5, 4, 0.5, 10)}),
              HasSubstr("**A1 with h = 1/60 s**"));
}

TEST(Advice, AvoidsSmallerSubstepsWhereCoupledRowsGrow) {
  std::vector<SweepRecord> runs{run(Algorithm::a1, 1, 0.5, 10), run(Algorithm::a5, 16, 0.7, 160)};
  EXPECT_THAT(advice(runs), HasSubstr("take smaller steps than were measured"));
  runs[1].substep_radius = 1;  // the radius of a free mode, to rounding
  EXPECT_THAT(advice(runs), HasSubstr("take smaller steps than were measured"));
  runs[1].substep_radius = 1.06;
  EXPECT_THAT(advice(runs), Not(HasSubstr("take smaller steps than were measured")));
  EXPECT_THAT(advice(runs), HasSubstr("smaller sub-steps are no way there in A5 with n = 16"));
  EXPECT_THAT(advice(runs), HasSubstr("grows by a factor of 1.06 in each"));
}

TEST(Advice, RejectsRunsThatChangeEnergy) {
  std::vector<SweepRecord> runs{run(Algorithm::a1, 1, 0.001, 100), run(Algorithm::a3, 4, 0.005, 40),
                                run(Algorithm::a5, 2, 0.004, 10, false), run(Algorithm::a5, 4, 0.004, 20)};
  for (SweepRecord& record : runs) record.metrics->energy_scale = 50;
  runs[2].metrics->energy_growth = 17;
  runs[3].metrics->energy_change = -12;
  EXPECT_EQ(cheapest(runs, 0.01)->settings.algorithm, Algorithm::a3);
  const std::string text = advice(runs);
  EXPECT_THAT(text, HasSubstr("2 settings that are within 1 %"));
  EXPECT_THAT(text, HasSubstr("its energy rises by 17 J"));
  // The most accurate run loses energy, a cheaper one does not.
  runs[0].metrics->energy_change = -6;
  EXPECT_EQ(cheapest(runs, 0.01)->settings.algorithm, Algorithm::a3);
  for (SweepRecord& record : runs) record.contacts = ContactKind::standing;
  EXPECT_EQ(cheapest(runs, 0.01)->settings.algorithm, Algorithm::a1);
}

TEST(Advice, NamesSettingsOtherThanDefaults) {
  SweepRecord record = run(Algorithm::a2, 1, 0, 1);
  record.settings.iterations = 16;
  record.settings.relaxation = 1.6;
  record.settings.step = 2.5;
  EXPECT_EQ(spoken(record, true), "A2 with m = 16, ω = 1.6, h = 2.5 s");
  record.settings = default_settings(Algorithm::a5);
  record.settings.warm_start = 0.5;
  EXPECT_EQ(spoken(record, true), "A5 with n = 10, warm = 0.5, h = 1/60 s");
}

TEST(Advice, ReportsTurnsInRadians) {
  SweepRecord record = run(Algorithm::a5, 16, 4.6e-14, 10);  // its centres drift, and err by rounding
  record.metrics->error.orientation = {0.132, 0.2};
  EXPECT_EQ(error_of(record), 0.132);
  EXPECT_EQ(error_text(record), "0.132 rad");
  EXPECT_EQ(error_or_gap_title({record}), "RMS turn, rad");
  EXPECT_THAT(advice({record}), HasSubstr("No run stays within 0.01 rad"));
  // A joint gap of 8 µm does not change the scene's errors from turns to distances.
  std::vector<SweepRecord> runs{record, record};
  runs[1].metrics->error.position = {8e-6, 8e-6};
  mark_turns(runs);
  EXPECT_EQ(error_text(runs[1]), "0.132 rad");
  record.metrics->error.position = {0.02, 0.02};
  EXPECT_EQ(error_text(record), "2 %");
}

TEST(Order, IgnoresErrorsBelowHundredUncertainties) {
  std::vector<SweepRecord> runs;
  for (const int n : {1, 2, 4, 8}) runs.push_back(run(Algorithm::a3, n, n < 8 ? 0.01 / n : 0.00001, n));
  for (SweepRecord& record : runs) record.uncertainty = 1e-6;
  EXPECT_NEAR(*measured_order(runs), 1, 1e-12);
}

TEST(Order, EqualsSlopeOfPowerLaw) {
  std::vector<SweepRecord> runs;
  for (const int n : {1, 2, 4, 8}) runs.push_back(run(Algorithm::a3, n, 0.01 / n / n, n));
  EXPECT_NEAR(*measured_order(runs), 2, 1e-12);
  runs.resize(2);
  EXPECT_FALSE(measured_order(runs));
}

}  // namespace
}  // namespace substep
