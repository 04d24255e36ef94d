/// Tracks, and runs compared by logs and tracks.

#include "golden/compare/track.h"

#include <gtest/gtest.h>

#include <string>

#include "golden/compare/motion_comparison.h"
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
      const double difference = (read.frames[k].poses[i].linear - poses[i].linear).cwiseAbs().maxCoeff();
      EXPECT_LE(difference, 0.5001 * Track::resolution);
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

/// A ball that falls for 20 frames, and whose digest of touching pairs changes at frame 10.
struct Fall {
  PoseLog log;
  Track track;

  Fall() {
    log.bodies = {"world", "ball", "block"};
    for (int k = 0; k <= 20; ++k) {
      Coordinates ball;
      ball.linear = {0, 2 - 0.1 * k, 0};
      Coordinates block;
      block.linear = {1, 0, 0};
      log.frames.push_back({static_cast<std::uint64_t>(k), {Coordinates{}, ball, block}});
      Track::Frame frame;
      frame.digests = {0, static_cast<std::uint16_t>(k), 7};
      frame.poses = log.frames.back().poses;
      frame.invariants = {static_cast<std::uint16_t>(k < 10 ? 0 : 1), 20, 0.001, 1};
      track.frames.push_back(frame);
    }
  }

  /// Moves the ball from `frame` on.
  void move(int frame, double by) {
    for (std::size_t k = static_cast<std::size_t>(frame); k < log.frames.size(); ++k) {
      log.frames[k].hash += 1000;
      log.frames[k].poses[1].linear.x() += by;
      track.frames[k].digests[1] = static_cast<std::uint16_t>(track.frames[k].digests[1] + 1000);
      track.frames[k].poses = log.frames[k].poses;
    }
  }

  LoggedMotion motion() const { return {&log, &track}; }
};

MotionComparison compared(const Fall& golden, const Fall& actual, const PoseTolerance* tolerance = nullptr,
                          const Scene& scene = {}) {
  return compare_motion(golden.motion(), actual.motion(), scene,
                        tolerance == nullptr ? std::nullopt : std::optional(*tolerance));
}

TEST(MotionComparison, IgnoresRoundingOfTracks) {
  // Both bodies change in frame 3, the ball by 2.8e-6 m; the track rounds the block's position to another
  // multiple of its resolution.
  const Fall golden;
  Fall actual;
  actual.move(3, 2.8e-6);
  for (std::size_t k = 3; k <= 20; ++k) actual.track.frames[k].digests[2] = 8;
  Fall rounded = golden;
  for (std::size_t k = 3; k < 10; ++k) {
    // Poses are logged every tenth frame only.
    rounded.log.frames[k].poses.clear();
    actual.log.frames[k].poses.clear();
    actual.track.frames[k].poses = golden.track.frames[k].poses;
    actual.track.frames[k].poses[2].linear.x() += Track::resolution;
  }
  const FirstChange first = compared(rounded, actual).first;
  EXPECT_EQ(first.frame, 3);
  EXPECT_EQ(first.body, "ball");
  EXPECT_EQ(first.size_frame, 10);
  EXPECT_NEAR(first.size, 2.8e-6, 1e-12);
  const PoseTolerance tolerance{.position = 5e-6};
  EXPECT_EQ(compared(rounded, actual, &tolerance).judgement, PoseJudgement::within);
}

TEST(MotionComparison, RequiresBitsWithoutTolerance) {
  Fall actual;
  actual.move(5, 1e-12);
  const MotionComparison found = compared(Fall(), actual);
  EXPECT_EQ(found.judgement, PoseJudgement::not_exact);
  EXPECT_EQ(found.first.frame, 5);
  EXPECT_EQ(found.first.bodies, std::vector<std::string>{"ball"});
  EXPECT_EQ(found.first.axis, 'x');
  EXPECT_NEAR(found.first.size, 1e-12, 1e-15);
}

TEST(MotionComparison, ComparesPosesUntilContactsDiffer) {
  const PoseTolerance tolerance{.position = 0.01};
  Fall actual;
  actual.move(5, 0.005);
  EXPECT_EQ(compared(Fall(), actual, &tolerance).judgement, PoseJudgement::within);
  actual.move(8, 0.02);
  const MotionComparison beyond = compared(Fall(), actual, &tolerance);
  EXPECT_EQ(beyond.judgement, PoseJudgement::poses);
  EXPECT_EQ(beyond.limit_frame, 8);
  EXPECT_NE(beyond.limit.find("body ball position x"), std::string::npos) << beyond.limit;

  // Where contacts differ earlier, poses need not agree from there on; invariants must.
  actual.track.frames[7].invariants.touching = 1;
  const MotionComparison chaotic = compared(Fall(), actual, &tolerance);
  EXPECT_EQ(chaotic.contacts_frame, 7);
  EXPECT_EQ(chaotic.judgement, PoseJudgement::within);
  const auto expect_beyond = [&](int frame, const std::string& what, const Invariants& changed) {
    Fall other = actual;
    other.track.frames[static_cast<std::size_t>(frame)].invariants = changed;
    const MotionComparison found = compared(Fall(), other, &tolerance);
    EXPECT_EQ(found.judgement, PoseJudgement::invariants);
    EXPECT_EQ(found.limit_frame, frame);
    EXPECT_NE(found.limit.find(what), std::string::npos) << found.limit;
  };
  expect_beyond(15, "energy", {1, 25, 0.001, 1});
  expect_beyond(16, "penetration", {1, 20, 0.01, 1});
  expect_beyond(17, "rest", {1, 20, 0.001, 3});
}

TEST(MotionComparison, LimitsEnergyAlikeAtAnyHeight) {
  const PoseTolerance tolerance;
  Scene scene;
  scene.gravity = {0, -10, 0};
  scene.bodies.resize(3);
  scene.bodies[1].inverse_mass = 1;
  scene.bodies[1].inverse_inertia.setConstant(2.5);  // a box with a diagonal of 2.7 m has it
  for (const double height : {-80, 0, 80}) {
    Fall golden;
    // The ball falls from 2 m above `height` to `height`.
    for (std::size_t k = 0; k <= 20; ++k) {
      golden.log.frames[k].poses[1].linear.y() += height;
      golden.track.frames[k].poses = golden.log.frames[k].poses;
      golden.track.frames[k].invariants.energy += 10 * height;
    }
    Fall actual = golden;
    actual.log.frames[10].hash += 1000;
    actual.track.frames[10].invariants.touching = 7;
    actual.track.frames[15].invariants.energy -= 0.8;
    EXPECT_EQ(compared(golden, actual, &tolerance, scene).judgement, PoseJudgement::within) << height;
    actual.track.frames[15].invariants.energy -= 0.4;
    EXPECT_EQ(compared(golden, actual, &tolerance, scene).limit_frame, 15) << height;
  }
}

TEST(MotionComparison, RejectsAnotherEnd) {
  const PoseTolerance tolerance;
  Fall actual;
  actual.log.end = "diverged 21 body 1 ball";
  actual.log.frames.back().hash = 5;
  EXPECT_EQ(compared(Fall(), actual, &tolerance).judgement, PoseJudgement::end);
}

TEST(MotionComparison, FindsOtherContactsInFirstFrame) {
  Fall actual;
  actual.move(0, 0.1);
  actual.track.frames[0].invariants.touching = 1;
  EXPECT_EQ(compared(Fall(), actual).contacts_frame, 0);
}

TEST(MotionComparison, UsesTracksBetweenStoredPoses) {
  Fall golden;
  Fall actual;
  actual.move(5, 0.2);
  for (std::size_t k = 0; k < golden.log.frames.size(); ++k)
    if (k % 10 != 0) golden.log.frames[k].poses.clear();
  const MotionComparison with = compared(golden, actual);
  EXPECT_EQ(with.first.size_frame, 5);
  const MotionComparison without = compare_motion({&golden.log, nullptr}, actual.motion(), {}, {});
  EXPECT_EQ(without.first.frame, 5);
  EXPECT_TRUE(without.first.bodies.empty());
  EXPECT_EQ(without.first.body, "ball");
  EXPECT_EQ(without.first.size_frame, 10);
}

}  // namespace
}  // namespace substep::golden
