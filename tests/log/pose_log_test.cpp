#include "sim/log/pose_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <string>

#include "tests/error_message.h"

namespace substep {
namespace {

using testing::HasSubstr;

Coordinates coordinates(double x, double y, double z, const Quaternion& angular) {
  Coordinates result;
  result.linear = Vector3(x, y, z);
  result.angular = angular;
  return result;
}

/// Two bodies, five frames, full every second; with numbers that few decimals do not hold.
PoseLog example() {
  PoseLog log;
  log.scene = "two_boxes.gltf";
  log.scene_hash = 0x00c5e0f3a11d2b69;
  log.settings.algorithm = Algorithm::a5;
  log.settings.step = 1.0 / 60;
  log.settings.substeps = 7;
  log.settings.iterations = 2;
  log.settings.tau = 0.1 + 0.2;
  log.settings.kappa = 1.0 / 3;
  log.settings.contact_tau = 0.7;
  log.settings.joints = Joints::stable;
  log.modelled = "joints: 1 ball; no contacts";
  log.bodies = {"world", "crate", "line\nbreak \\ and ümlaut"};
  log.full_every = 2;
  for (int k = 0; k < 5; ++k) {
    PoseLog::Frame frame;
    frame.hash = 0xf00dfeed00000000u + static_cast<unsigned>(k);
    if (k % 2 == 0) {
      const double denormal = std::numeric_limits<double>::denorm_min();
      frame.poses = {Coordinates{},
                     coordinates(std::nextafter(0.1 * k, 1.0), -1.0 / 3, 1e300,
                                 Quaternion(0.5, -0.5, 0.5, std::nextafter(0.5, 1.0))),
                     coordinates(-0.0, denormal, -1e-17 * k, Quaternion::Identity())};
    }
    log.frames.push_back(frame);
  }
  return log;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

/// The message that reading `text` fails with; empty when it is read.
std::string failure(const std::string& text) {
  return test::message_of([&] { parse_pose_log(text, "a.poses.txt"); });
}

TEST(PoseLog, RoundTripKeepsBits) {
  const PoseLog log = example();
  const PoseLog back = parse_pose_log(to_text(log), "text");
  EXPECT_EQ(to_text(back), to_text(log));
  EXPECT_EQ(back.bodies, log.bodies);
  EXPECT_EQ(back.settings.tau, log.settings.tau);
  EXPECT_EQ(back.settings.joints, Joints::stable);
  ASSERT_EQ(back.frames.size(), 5u);
  EXPECT_TRUE(back.frames[1].poses.empty());
  for (const std::size_t k : {0u, 2u, 4u}) {
    ASSERT_EQ(back.frames[k].poses.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(back.frames[k].poses[i].linear, log.frames[k].poses[i].linear);
      EXPECT_EQ(back.frames[k].poses[i].angular.coeffs(), log.frames[k].poses[i].angular.coeffs());
    }
  }
  EXPECT_TRUE(std::signbit(back.frames[0].poses[2].linear.x()));
  EXPECT_TRUE(compare(log, back).none());
}

TEST(PoseLog, FollowsDocumentedFormat) {
  const std::string text = to_text(example());
  EXPECT_THAT(text,
              testing::StartsWith("substep pose log 1\n"
                                  "units metres seconds radians\n"
                                  "scene two_boxes.gltf\n"
                                  "scene-hash 00c5e0f3a11d2b69\n"
                                  "algorithm a5\n"
                                  "step 0.016666666666666666\n"
                                  "substeps 7\n"
                                  "iterations 2\n"
                                  "tau 0.30000000000000004\n"
                                  "kappa 0.3333333333333333\n"
                                  "contact_tau 0.7\n"
                                  "contact_kappa 0\n"
                                  "joints stable\n"
                                  "relaxation 1\n"
                                  "tolerance 0\n"
                                  "modelled joints: 1 ball; no contacts\n"
                                  "body 1 crate\n"
                                  "body 2 line\\x0abreak \\x5c and ümlaut\n"
                                  "full-every 2\n"
                                  "frame 0 f00dfeed00000000\n"
                                  "pose 1 5e-324 -0.3333333333333333 1e+300 0.5 -0.5 0.5 0.5000000000000001\n"
                                  "pose 2 -0 5e-324 -0 1 0 0 0\n"
                                  "frame 1 f00dfeed00000001\n"));
  EXPECT_THAT(text, testing::EndsWith("end ok 4\n"));
}

struct Malformed {
  std::string what;
  std::string from;
  std::string to;
  std::string line;     ///< in the message
  std::string message;  ///< part of it
};

class MalformedLog : public testing::TestWithParam<Malformed> {};

TEST_P(MalformedLog, IsRefusedWithItsLine) {
  const Malformed& p = GetParam();
  const std::string message = failure(replaced(to_text(example()), p.from, p.to));
  EXPECT_THAT(message, HasSubstr("a.poses.txt:" + p.line + ": "));
  EXPECT_THAT(message, HasSubstr(p.message));
  EXPECT_THAT(message, testing::Not(HasSubstr("\n")));
}

INSTANTIATE_TEST_SUITE_P(
    EveryKind, MalformedLog,
    testing::Values(
        Malformed{"version", "log 1\n", "log 2\n", "1", "version 2"},
        Malformed{"other_file", "substep pose", "\x89PNG\r\x1a", "1", "no pose log"},
        Malformed{"units", "metres", "feet", "2", "is expected"},
        Malformed{"hash_short", "00c5e0f3a11d2b69", "c5e0", "4", "16 hexadecimal"},
        Malformed{"hash_letters", "00c5e0f3a11d2b69", "00c5e0f3a11d2bzz", "4", "hash"},
        Malformed{"algorithm", "algorithm a5", "algorithm a6", "5", "a1, a2, a3, a4, a5, soft or avbd"},
        Malformed{"step_words", "step 0.016666666666666666", "step fast", "6", "'fast'"},
        Malformed{"step_nan", "step 0.016666666666666666", "step nan", "6", "'nan'"},
        Malformed{"step_zero", "step 0.016666666666666666", "step 0", "15", "step 0"},
        Malformed{"substeps_huge", "substeps 7", "substeps 99999999999999999999", "7", "substeps"},
        Malformed{"substeps_missing", "substeps 7\n", "", "7", "'substeps …' is expected"},
        Malformed{"joints", "joints stable", "joints loose", "13", "rows, plain or stable"},
        Malformed{"name_escape", "line\\x0a", "line\\xg", "18", "backslash"},
        Malformed{"name_escape_cut", "line\\x0abreak \\x5c and ümlaut", "line\\x0", "18", "backslash"},
        Malformed{"body_index", "body 2", "body 3", "18", "body 2 is expected"},
        Malformed{"body_huge", "body 2", "body 2000000000", "18", "body 2 is expected"},
        Malformed{"full_every_zero", "full-every 2", "full-every 0", "19", "at least 1"},
        Malformed{"full_every_huge", "full-every 2", "full-every 2000000000", "27", "must have no poses"},
        Malformed{"frame_skipped", "frame 1 ", "frame 2 ", "23", "frame 1 is expected"},
        Malformed{"frame_huge", "frame 1 ", "frame 2147483647 ", "23", "frame 1 is expected"},
        Malformed{"frame_negative", "frame 1 ", "frame -1 ", "23", "frame 1 is expected"},
        Malformed{"nan", "pose 2 -0", "pose 2 nan", "22", "'nan'"},
        Malformed{"infinity", "pose 2 -0", "pose 2 inf", "22", "'inf'"},
        Malformed{"overflow", "pose 2 -0", "pose 2 1e999", "22", "'1e999'"},
        Malformed{"number_tail", "pose 2 -0", "pose 2 -0m", "22", "'-0m'"},
        Malformed{"few_items", "pose 2 -0 ", "pose 2 ", "22", "8 items"},
        Malformed{"many_items", "5e-324 -0 1 0 0 0", "5e-324 -0 1 0 0 0 0", "22", "'0 0'"},
        Malformed{"two_spaces", "pose 2 -0", "pose 2  -0", "22", "8 items"},
        Malformed{"quaternion", "-0 1 0 0 0\n", "-0 2 0 0 0\n", "22", "quaternion"},
        Malformed{"pose_missing", "pose 2 -0 5e-324 -0 1 0 0 0\n", "", "22", "pose of body 2 is missing"},
        Malformed{"pose_too_many", "frame 1 ", "pose 3 0 0 0 1 0 0 0\nframe 1 ", "23", "too many"},
        Malformed{"pose_order", "pose 1 5e-324", "pose 2 5e-324", "21", "pose of body 1 is expected"},
        Malformed{"pose_of_world", "pose 1 5e-324", "pose 0 5e-324", "21", "pose of body 1 is expected"},
        Malformed{"pose_unasked", "frame 2 ", "pose 1 0 0 0 1 0 0 0\npose 2 0 0 0 1 0 0 0\nframe 2 ", "26",
                  "must have no poses"},
        Malformed{"end_missing", "end ok 4\n", "", "31", "truncated"},
        Malformed{"end_cut", "end ok 4\n", "end ok", "31", "truncated"},
        Malformed{"end_frame", "end ok 4", "end ok 5", "31", "'end ok 4'"},
        Malformed{"end_kind", "end ok 4", "end fine 4", "31", "'end ok 4'"},
        Malformed{"end_diverged_early", "end ok 4", "end diverged 3 body 1 crate", "31", "end that fits"},
        Malformed{"after_end", "end ok 4\n", "end ok 4\nend ok 4\n", "32", "nothing may follow"}),
    [](const auto& one) { return one.param.what; });

TEST(PoseLog, ReadsLogsWithoutContactStabilization) {
  const std::string text = replaced(to_text(example()), "contact_tau 0.7\ncontact_kappa 0\n", "");
  const PoseLog log = parse_pose_log(text, "text");
  EXPECT_EQ(log.settings.contact_tau, 0);
  EXPECT_EQ(log.settings.of_contacts().tau, 0.1 + 0.2);
}

TEST(PoseLog, AcceptsNamesThatEndWithEscape) {
  PoseLog log = example();
  log.bodies[2] = "line\n";
  EXPECT_EQ(parse_pose_log(to_text(log), "text").bodies[2], "line\n");
}

TEST(PoseLog, RefusesEveryTruncation) {
  const std::string text = to_text(example());
  for (std::size_t length = 0; length < text.size(); ++length) {
    EXPECT_NE(failure(text.substr(0, length)), "") << "cut to " << length << " bytes";
  }
}

TEST(PoseLog, NamesMissingFileAndFolder) {
  const auto message = [](const std::filesystem::path& file) {
    return test::message_of([&] { read_pose_log(file); });
  };
  EXPECT_THAT(message("not_there.poses.txt"), HasSubstr("not_there.poses.txt: there is no such file"));
  EXPECT_THAT(message(std::filesystem::temp_directory_path()), HasSubstr("is a folder"));
}

TEST(PoseLog, KeepsFailureOfRun) {
  PoseLog log = example();
  for (const char* const end : {"diverged 5 body 2 line\nbreak \\ and ümlaut", "unsolved 3 steps 2"}) {
    log.end = end;
    EXPECT_EQ(parse_pose_log(to_text(log), "text").end, end);
  }
}

TEST(PoseLogCompare, NamesFirstFrameBodyAndAxis) {
  const PoseLog expected = example();
  PoseLog actual = expected;
  for (std::size_t k = 1; k < 5; ++k) actual.frames[k].hash ^= 1;
  actual.frames[2].poses[1].linear.x() += 1e-9;
  actual.frames[2].poses[2].linear.y() += 3e-9;
  actual.frames[4].poses[2].linear.x() += 0.25;
  const PoseDifference difference = compare(expected, actual);
  EXPECT_FALSE(difference.none());
  EXPECT_EQ(difference.first_frame, 1);
  EXPECT_EQ(difference.first_full_frame, 2);
  EXPECT_EQ(difference.body, 2);
  EXPECT_EQ(difference.axis, 'y');
  EXPECT_DOUBLE_EQ(difference.size, 3e-9);
  EXPECT_EQ(difference.largest_position, 0.25);
  EXPECT_EQ(difference.headers, "");
}

TEST(PoseLogCompare, MeasuresPureTurn) {
  const PoseLog expected = example();
  PoseLog actual = expected;
  const double angle = 1e-7;
  actual.frames[4].hash ^= 1;
  actual.frames[4].poses[2].angular = Quaternion(std::cos(angle / 2), std::sin(angle / 2), 0, 0);
  const PoseDifference difference = compare(expected, actual);
  EXPECT_EQ(difference.first_full_frame, 4);
  EXPECT_EQ(difference.body, 2);
  EXPECT_EQ(difference.axis, 'r');
  EXPECT_NEAR(difference.size, angle, 1e-20);  // measured 0
  EXPECT_EQ(difference.largest_orientation, difference.size);
  EXPECT_EQ(difference.largest_position, 0);
}

TEST(PoseLogCompare, HashDetectsVelocityChange) {
  const PoseLog expected = example();
  PoseLog actual = expected;
  actual.frames[3].hash ^= 1;
  const PoseDifference difference = compare(expected, actual);
  EXPECT_EQ(difference.first_frame, 3);
  EXPECT_EQ(difference.first_full_frame, 4);
  EXPECT_EQ(difference.axis, ' ');
  EXPECT_EQ(difference.size, 0);
}

TEST(PoseLogCompare, NamesDifferenceOfHeaders) {
  const PoseLog expected = example();
  PoseLog actual = expected;
  actual.settings.substeps = 8;
  actual.bodies[1] = "barrel";
  actual.frames.pop_back();
  actual.frames.pop_back();
  actual.end = "diverged 3 body 1 barrel";
  const PoseDifference difference = compare(expected, actual);
  EXPECT_EQ(difference.headers,
            "substeps: 7 → 8\n"
            "body 1: crate → barrel\n"
            "last frame: 4 → 2\n"
            "end: ok → diverged 3 body 1 barrel");
  EXPECT_EQ(difference.first_frame, 3);
  EXPECT_EQ(difference.first_full_frame, -1);
}

// settings_fields_test compares each field of the settings.
TEST(PoseLogCompare, ComparesEveryHeaderLine) {
  const PoseLog expected = example();
  const auto difference = [&](const auto& change) {
    PoseLog actual = expected;
    change(actual);
    EXPECT_FALSE(compare(expected, actual).none());
    return compare(expected, actual).headers;
  };
  EXPECT_EQ(difference([](PoseLog& log) { log.scene = "other.gltf"; }), "scene: two_boxes.gltf → other.gltf");
  EXPECT_EQ(difference([](PoseLog& log) { log.scene_hash = 1; }),
            "scene-hash: 00c5e0f3a11d2b69 → 0000000000000001");
  EXPECT_EQ(difference([](PoseLog& log) { log.modelled = "nothing"; }),
            "modelled: joints: 1 ball; no contacts → nothing");
  EXPECT_EQ(difference([](PoseLog& log) { log.bodies.emplace_back("third"); }), "bodies: 2 → 3");
  EXPECT_EQ(difference([](PoseLog& log) { log.full_every = 4; }), "full-every: 2 → 4");
}

TEST(PoseLogCompare, ReportsMovedPoseUnderEqualHash) {
  const PoseLog expected = example();
  PoseLog actual = expected;
  actual.frames[2].poses[2].linear.x() += 0.5;
  const PoseDifference moved = compare(expected, actual);
  EXPECT_FALSE(moved.none());
  EXPECT_EQ(moved.first_contradiction, 2);
  EXPECT_EQ(moved.first_frame, -1);
  EXPECT_EQ(moved.largest_position, 0.5);
  actual = expected;
  actual.frames[4].poses[1].angular.coeffs() *= -1;
  EXPECT_EQ(compare(expected, actual).first_contradiction, 4);
}

}  // namespace
}  // namespace substep
