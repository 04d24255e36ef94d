// Tests the jobs of sweep files, and that records are read as they were written.

#include "sim/study/sweep.h"

#include <gmock/gmock.h>

#include <string>

#include "sim/log/file_output.h"
#include "sim/model/settings_fields.h"
#include "sim/model/usual_settings.h"
#include "tests/error_message.h"
#include "tests/folders.h"
#include "tests/scene_files.h"
#include "tests/temporary_folder.h"

namespace substep {
namespace {

/// Reads a sweep of one grid over a scene of the tree.
Sweep sweep_over(const std::string& scene, const std::string& lines) {
  const test::TemporaryFolder folder;
  const std::string file = std::string(test::source_folder) + "/scenes/" + scene + ".gltf";
  return read_sweep(folder.write("sweep.toml", "[[grid]]\nscenes = [\"" + file + "\"]\n" + lines));
}

TEST(SweepFile, UsesDefaultsForMissingKeys) {
  // A governor has a closed loop, for which A2 and A3 have defaults of their own.
  for (const char* const scene : {"pendulum", "governor", "box_stack"}) {
    const Sweep all =
        sweep_over(scene, "algorithms = [\"a1\", \"a2\", \"a3\", \"a4\", \"a5\", \"soft\", \"avbd\"]\n");
    ASSERT_EQ(all.jobs.size(), 7u);
    for (const SweepJob& job : all.jobs) {
      const Settings usual = usual_settings(all.scenes.at(scene), job.settings.algorithm);
      EXPECT_EQ(label(job.settings), label(usual)) << scene;
      for (const SettingsField& field : settings_fields) {
        if (!field.is_read_by(usual.algorithm)) continue;
        EXPECT_EQ(text_of(job.settings, field), text_of(usual, field)) << job.key << " " << field.name;
      }
    }
  }
}

TEST(SweepFile, MeasuresDefaultOfEachAlgorithm) {
  const Sweep sweep = sweep_of({std::string(test::source_folder) + "/scenes/heavy_chain.gltf"}, false);
  int defaults = 0;
  for (const SweepJob& job : sweep.jobs) {
    const Settings usual = usual_settings(sweep.scenes.at("heavy_chain"), job.settings.algorithm);
    EXPECT_EQ(tau_text(job.settings), job.settings.algorithm >= Algorithm::a3 ? tau_text(usual) : "1");
    defaults += label(job.settings) == label(usual) ? 1 : 0;
  }
  EXPECT_EQ(defaults, 5) << "the default of each algorithm is measured";
}

TEST(SweepFile, AppliesTauToContacts) {
  const Sweep one = sweep_over("box_stack", "algorithms = [\"a5\"]\ntau = [1]\n");
  EXPECT_EQ(tau_text(one.jobs.at(0).settings), "1");
  EXPECT_EQ(kappa_text(one.jobs.at(0).settings), "1");
}

TEST(SweepFile, GivesEnginesTenIterations) {
  const Sweep one = sweep_over("pendulum", "engines = [\"bullet-si\"]\ndivisions = [2]\n");
  EXPECT_EQ(one.jobs.at(0).key, "pendulum.bullet-si-h2-m10");
}

TEST(SweepFile, RoundsDurationToWholeSteps) {
  const test::TemporaryFolder folder;
  const std::string text = content_of(scenes_folder() / "pendulum.gltf").value();
  const std::string whole = "\"duration\":5.0,";
  const std::size_t begin = text.find(whole);
  ASSERT_NE(begin, std::string::npos);
  const auto duration_of = [&](const std::string& duration) {
    std::string other = text;
    other.replace(begin, whole.size(), "\"duration\":" + duration + ",");
    return sweep_of({folder.write("pendulum.gltf", other)}, false).scenes.at("pendulum").duration;
  };
  EXPECT_EQ(duration_of("5.0"), 5);
  EXPECT_NEAR(duration_of("4.99"), 299.0 / 60, 1e-12);
  EXPECT_THAT(test::message_of([&] { duration_of("1e9"); }), testing::HasSubstr("from the scene's step"));
}

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

TEST(SweepRecord, QuotesSceneInCsv) {
  SweepRecord record = example();
  record.scene = "slow \"pendulum\", 0.4";
  for (const std::string& text : {errors_csv({record}), times_csv({record})})
    EXPECT_THAT(text, testing::HasSubstr("\n\"slow \"\"pendulum\"\", 0.4\",a3,"));
}

TEST(SweepRecord, RefusesImpossibleValues) {
  const auto expect_refused = [](const std::string& key, const std::string& value, const std::string& wrong) {
    std::string text = to_json(example());
    const std::string good = "\"" + key + "\":" + value;
    ASSERT_NE(text.find(good), std::string::npos) << text;
    text.replace(text.find(good), good.size(), "\"" + key + "\":" + wrong);
    const std::string message = test::message_of([&] { record_in(text); });
    EXPECT_NE(message.find("not what a sweep wrote"), std::string::npos) << key << ": " << message;
  };
  EXPECT_EQ(test::message_of([] { record_in(to_json(example())); }), "");
  expect_refused("row_solves", "1200", "-1");
  expect_refused("joint_gap", "0.0", "-1e-9");
  expect_refused("rms", "0.0", "1.0");  // more than the largest
  expect_refused("substep_radius", "0.75", "-0.5");
  expect_refused("contacts", "\"moving\"", "\"flying\"");
}

TEST(ContactKind, FollowsReferenceMotion) {
  const auto kind_in = [](const std::string& name) {
    const Scene scene = scene_named(name);
    return contact_kind(scene, reference_motion(scene, 0.1));
  };
  EXPECT_EQ(kind_in("pendulum"), ContactKind::none);
  EXPECT_EQ(kind_in("box_stack"), ContactKind::standing);
  EXPECT_EQ(kind_in("sliding_ball"), ContactKind::moving);
}

}  // namespace
}  // namespace substep
