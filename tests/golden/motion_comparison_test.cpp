#include "golden/compare/motion_comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace substep::golden {
namespace {

/// A ball that falls for 20 frames, and touches from frame 10 on.
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

MotionComparison compared(const Fall& golden, const Fall& actual, const PoseTolerance* tolerance = nullptr) {
  return compare_motion(golden.motion(), actual.motion(),
                        tolerance == nullptr ? std::nullopt : std::optional(*tolerance));
}

TEST(MotionComparison, IgnoresRoundingOfTracks) {
  // Both bodies change in frame 3, the ball by 2.8e-6 m; the track rounds the block's place to another step.
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
}

TEST(MotionComparison, EqualRunsAreExact) {
  const PoseTolerance tolerance;
  EXPECT_EQ(compared(Fall(), Fall(), &tolerance).judgement, PoseJudgement::exact);
}

TEST(MotionComparison, RequiresBitsWithoutTolerance) {
  Fall actual;
  actual.move(5, 1e-12);
  const MotionComparison found = compared(Fall(), actual);
  EXPECT_EQ(found.judgement, PoseJudgement::differs);
  EXPECT_EQ(found.first.frame, 5);
  EXPECT_EQ(found.first.bodies, std::vector<std::string>{"ball"});
  EXPECT_EQ(found.first.axis, 'x');
  EXPECT_NEAR(found.first.size, 1e-12, 1e-15);
}

TEST(MotionComparison, ComparesPosesUntilContactsDiffer) {
  PoseTolerance tolerance;
  tolerance.position = 0.01;
  Fall actual;
  actual.move(5, 0.005);
  EXPECT_EQ(compared(Fall(), actual, &tolerance).judgement, PoseJudgement::within);
  actual.move(8, 0.02);
  const MotionComparison beyond = compared(Fall(), actual, &tolerance);
  EXPECT_EQ(beyond.judgement, PoseJudgement::poses);
  EXPECT_EQ(beyond.limit_frame, 8);
  EXPECT_NE(beyond.limit.find("body ball position x"), std::string::npos) << beyond.limit;

  // Where contacts differ before, poses need not agree from there on; invariants must.
  actual.track.frames[7].invariants.touching = 1;
  const MotionComparison chaotic = compared(Fall(), actual, &tolerance);
  EXPECT_EQ(chaotic.contacts_frame, 7);
  EXPECT_EQ(chaotic.judgement, PoseJudgement::within);
  actual.track.frames[15].invariants.energy = 25;
  const MotionComparison hot = compared(Fall(), actual, &tolerance);
  EXPECT_EQ(hot.judgement, PoseJudgement::invariants);
  EXPECT_EQ(hot.limit_frame, 15);
  EXPECT_NE(hot.limit.find("energy"), std::string::npos);
  actual.track.frames[15].invariants.energy = 20;
  actual.track.frames[16].invariants.penetration = 0.01;
  EXPECT_EQ(compared(Fall(), actual, &tolerance).limit_frame, 16);
  actual.track.frames[16].invariants.penetration = 0.001;
  actual.track.frames[17].invariants.resting = 3;
  EXPECT_EQ(compared(Fall(), actual, &tolerance).limit_frame, 17);
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
  for (std::size_t k = 0; k < golden.log.frames.size(); ++k) {
    if (k % 10 != 0) golden.log.frames[k].poses.clear();
  }
  const MotionComparison with = compared(golden, actual);
  EXPECT_EQ(with.first.size_frame, 5);
  const MotionComparison without = compare_motion({&golden.log, nullptr}, actual.motion(), {});
  EXPECT_EQ(without.first.frame, 5);
  EXPECT_TRUE(without.first.bodies.empty());
  EXPECT_EQ(without.first.body, "ball");
  EXPECT_EQ(without.first.size_frame, 10);
}

}  // namespace
}  // namespace substep::golden
