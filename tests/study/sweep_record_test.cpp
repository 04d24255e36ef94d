// A sweep's record is read as it was written, and one that no sweep could have written is refused.

#include "sim/study/sweep_record.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "tests/error_message.h"
#include "tests/folders.h"

namespace substep {
namespace {

SweepRecord example() {
  SweepRecord record;
  record.key = "0123";
  record.scene = "a scene";
  record.label = "A3  n=4 m=1 plain  h=1/60";
  record.settings.algorithm = Algorithm::a3;
  record.settings.substeps = 4;
  record.divisions = 2;
  record.contacts = ContactKind::moving;
  record.size = 3;
  record.duration = 2;
  record.reference = "A1 at h/512";
  record.uncertainty = 1e-6;
  record.turn_uncertainty = 2e-6;
  record.horizon = 1.5;
  record.substep_radius = 0.75;
  record.metrics.emplace();
  record.metrics->row_solves = 1200;
  record.times = RunTimes{0.002, 0.001, 0.003, 3, {1, 2, 3, 4}};
  record.limit = StabilityLimit{2, 8, 5};
  return record;
}

TEST(SweepRecord, RoundTripKeepsRecord) {
  const SweepRecord record = example();
  const SweepRecord read = record_in(to_json(record));
  EXPECT_EQ(to_json(read), to_json(record));
  EXPECT_EQ(read.settings.substeps, 4);
  EXPECT_EQ(read.divisions, 2);
  EXPECT_EQ(read.contacts, ContactKind::moving);
  EXPECT_EQ(read.substep_radius, 0.75);
  ASSERT_TRUE(read.metrics && read.times && read.limit);
  EXPECT_EQ(read.metrics->row_solves, 1200);
  EXPECT_EQ(read.times->median, 0.002);
  EXPECT_EQ(read.limit->runs, 5);
}

TEST(SweepRecord, RefusesNegativeValues) {
  const auto complaint = [](const SweepRecord& record) {
    return test::message_of([&] { record_in(to_json(record)); });
  };
  EXPECT_EQ(complaint(example()), "");
  SweepRecord record = example();
  record.metrics->row_solves = -1;
  EXPECT_NE(complaint(record).find("row_solves"), std::string::npos) << complaint(record);
  record = example();
  record.metrics->joint_gap = -1e-9;
  EXPECT_NE(complaint(record).find("joint_gap"), std::string::npos) << complaint(record);
  record = example();
  record.substep_radius = -0.5;
  EXPECT_NE(complaint(record).find("substep_radius"), std::string::npos) << complaint(record);
}

TEST(SweepRecord, RefusesUnknownContactKind) {
  std::string text = to_json(example());
  text.replace(text.find("moving"), 6, "flying");
  EXPECT_THROW(record_in(text), Error);
}

TEST(ContactKind, FollowsTheReferenceMotion) {
  const auto kind_in = [](const std::string& name) {
    const Scene scene = load_scene(std::filesystem::path(test::source_folder) / "scenes" / (name + ".gltf"));
    return contact_kind(scene, reference_motion(scene, 0.1));
  };
  EXPECT_EQ(kind_in("pendulum"), ContactKind::none);
  EXPECT_EQ(kind_in("box_stack"), ContactKind::standing);
  EXPECT_EQ(kind_in("sliding_ball"), ContactKind::moving);
}

}  // namespace
}  // namespace substep
