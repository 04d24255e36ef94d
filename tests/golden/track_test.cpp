#include "golden/compare/track.h"

#include <gtest/gtest.h>

#include <string>

#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/log/pose_log.h"
#include "tests/folders.h"
#include "tests/temporary_folder.h"

namespace substep::golden {
namespace {

struct RecordedRun {
  PoseLog log;
  Track track;
};

RecordedRun run(const char* scene_file, int frames) {
  const Scene scene = load_scene(std::string(test::source_folder) + "/scenes/" + scene_file);
  Settings settings;
  settings.step = scene.step;
  Simulation simulation(scene, settings);
  Tracker tracker(scene, settings);
  tracker.add(simulation.state());
  RecordedRun result;
  result.log =
      record(simulation, frames, 1, [&](int, const StepReport&) { tracker.add(simulation.state()); });
  result.track = tracker.take();
  return result;
}

TEST(Track, RoundTripKeepsRoundedPoses) {
  const RecordedRun made = run("bouncing_balls.gltf", 60);
  const test::TemporaryFolder folder;
  folder.write("a.track", to_bytes(made.track));
  const Track read = read_track(folder.path() / "a.track");
  ASSERT_EQ(read.frames.size(), made.log.frames.size());
  for (std::size_t k = 0; k < read.frames.size(); ++k) {
    const auto& poses = made.log.frames[k].poses;
    ASSERT_EQ(read.frames[k].poses.size(), poses.size());
    EXPECT_EQ(read.frames[k].digests, made.track.frames[k].digests);
    EXPECT_EQ(read.frames[k].invariants.touching, made.track.frames[k].invariants.touching);
    EXPECT_EQ(read.frames[k].invariants.resting, made.track.frames[k].invariants.resting);
    for (std::size_t i = 1; i < poses.size(); ++i) {
      const double apart = (read.frames[k].poses[i].linear - poses[i].linear).cwiseAbs().maxCoeff();
      EXPECT_LE(apart, 0.5001 * Track::resolution);
      // A second trip changes nothing.
      EXPECT_EQ(read.frames[k].poses[i].linear, made.track.frames[k].poses[i].linear);
    }
  }
  EXPECT_EQ(to_bytes(read), to_bytes(made.track));
}

TEST(Track, IsSmall) {
  const RecordedRun made = run("box_stack.gltf", 120);
  EXPECT_LT(to_bytes(made.track).size(), to_text(made.log).size() / 10);
}

TEST(Track, KeepsEnergyOfFallingBall) {
  const RecordedRun made = run("bouncing_balls.gltf", 10);
  const double start = made.track.frames.front().invariants.energy;
  EXPECT_NEAR(made.track.frames[9].invariants.energy, start, 0.05 * start);
  EXPECT_EQ(made.track.frames.front().invariants.penetration, 0);
}

TEST(Track, RejectsDamagedFiles) {
  const std::string good = to_bytes(run("bouncing_balls.gltf", 20).track);
  const test::TemporaryFolder folder;
  const auto read = [&](const std::string& bytes) {
    folder.write("a.track", bytes);
    return read_track(folder.path() / "a.track");
  };
  EXPECT_NO_THROW(read(good));
  EXPECT_THROW(read(""), Error);
  EXPECT_THROW(read("substep track 2\n"), Error);
  EXPECT_THROW(read(good.substr(0, good.size() / 2)), Error);
  std::string flipped = good;
  flipped[flipped.size() / 2] = static_cast<char>(flipped[flipped.size() / 2] ^ 16);
  EXPECT_THROW(read(flipped), Error);
  EXPECT_THROW(read_track(folder.path() / "none.track"), Error);
}

}  // namespace
}  // namespace substep::golden
