// A sweep's record is read as it was written, and one that no sweep could have written is refused.

#include "sim/study/sweep_record.h"

#include <gtest/gtest.h>

#include <string>

#include "sim/error.h"

namespace substep {
namespace {

SweepRecord example() {
  SweepRecord record;
  record.key = "0123";
  record.scene = "a scene";
  record.use = SceneUse::trial;
  record.label = "A3  n=4 m=1 plain  h=1/60";
  record.settings.algorithm = Algorithm::a3;
  record.settings.substeps = 4;
  record.divisions = 2;
  record.traits.has_joints = true;
  record.traits.has_loops = true;
  record.traits.contacts = ContactKind::rolling;
  record.traits.mass_ratio = 30;
  record.traits.spring_angle = 1.5;
  record.size = 3;
  record.duration = 2;
  record.reference = "A1 at h/512";
  record.uncertainty = 1e-6;
  record.turn_uncertainty = 2e-6;
  record.horizon = 1.5;
  record.substep_radius = 0.75;
  record.metrics.emplace();
  record.metrics->row_solves = 1200;
  record.coarser = MotionDifference{{0.25, 0.5}, {0.125, 1}};
  record.times = RunTimes{0.002, 0.001, 0.003, 3, {1, 2, 3, 4}};
  record.limit = StabilityLimit{2, 8, 5};
  return record;
}

TEST(SweepRecord, IsReadAsItWasWritten) {
  const SweepRecord record = example();
  const SweepRecord read = record_in(to_json(record));
  EXPECT_EQ(to_json(read), to_json(record));
  EXPECT_EQ(read.settings.substeps, 4);
  EXPECT_EQ(read.divisions, 2);
  EXPECT_EQ(read.use, SceneUse::trial);
  ASSERT_TRUE(read.coarser);
  EXPECT_EQ(read.coarser->position.rms, 0.25);
  EXPECT_EQ(read.coarser->orientation.largest, 1);
  EXPECT_TRUE(read.traits.has_joints && read.traits.has_loops);
  EXPECT_EQ(read.traits.contacts, ContactKind::rolling);
  EXPECT_EQ(read.traits.mass_ratio, 30);
  EXPECT_EQ(read.traits.spring_angle, 1.5);
  EXPECT_EQ(read.substep_radius, 0.75);
  ASSERT_TRUE(read.metrics && read.times && read.limit);
  EXPECT_EQ(read.metrics->row_solves, 1200);
  EXPECT_EQ(read.times->median, 0.002);
  EXPECT_EQ(read.limit->runs, 5);
}

TEST(SweepRecord, OfLessThanNothingIsRefused) {
  const auto complaint = [](const SweepRecord& record) -> std::string {
    try {
      record_in(to_json(record));
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  };
  EXPECT_EQ(complaint(example()), "");
  SweepRecord record = example();
  record.metrics->row_solves = -1;
  EXPECT_NE(complaint(record).find("row_solves"), std::string::npos) << complaint(record);
  record = example();
  record.metrics->joint_gap = -1e-9;
  EXPECT_NE(complaint(record).find("joint_gap"), std::string::npos) << complaint(record);
  record = example();
  record.coarser->position.rms = -0.25;
  EXPECT_NE(complaint(record).find("coarser"), std::string::npos) << complaint(record);
  record = example();
  record.substep_radius = -0.5;
  EXPECT_NE(complaint(record).find("substep_radius"), std::string::npos) << complaint(record);
}

}  // namespace
}  // namespace substep
