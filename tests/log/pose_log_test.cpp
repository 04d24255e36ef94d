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

/// Returns a log of two bodies and five frames, every second one with poses, with numbers of 16 to 17 digits.
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
                     {{std::nextafter(0.1 * k, 1.0), -1.0 / 3, 1e300},
                      Quaternion(0.5, -0.5, 0.5, std::nextafter(0.5, 1.0))},
                     {{-0.0, denormal, -1e-17 * k}, Quaternion::Identity()}};
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

/// Returns the message of the Error that parsing `text` throws; empty where it is valid.
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
  EXPECT_THAT(text, testing::StartsWith(R"(substep pose log 1
units metres seconds radians
scene two_boxes.gltf
scene-hash 00c5e0f3a11d2b69
algorithm a5
step 0.016666666666666666
substeps 7
iterations 2
tau 0.30000000000000004
kappa 0.3333333333333333
contact_tau 0.7
contact_kappa 0
joints stable
relaxation 1
tolerance 0
modelled joints: 1 ball; no contacts
body 1 crate
body 2 line\x0abreak \x5c and ümlaut
full-every 2
frame 0 f00dfeed00000000
pose 1 5e-324 -0.3333333333333333 1e+300 0.5 -0.5 0.5 0.5000000000000001
pose 2 -0 5e-324 -0 1 0 0 0
frame 1 f00dfeed00000001
)"));
  EXPECT_THAT(text, testing::EndsWith("end ok 4\n"));
}

/// A change of the example's text, and the line number and words of the message that it causes.
struct Malformed {
  const char* from;
  const char* to;
  const char* line;
  const char* words;
};

TEST(PoseLog, RefusesMalformedLogWithItsLine) {
  for (const auto& [from, to, line, words] : std::initializer_list<Malformed>{
           {"log 1\n", "log 2\n", "1", "version 2"},
           {"log 1\n", "log 1\r\n", "1", "ends in CR LF"},
           {"substep pose", "\x89PNG\r\x1a", "1", "no pose log"},
           {"metres", "feet", "2", "is expected"},
           {"00c5e0f3a11d2b69", "c5e0", "4", "16 hexadecimal"},
           {"00c5e0f3a11d2b69", "00c5e0f3a11d2bzz", "4", "hash"},
           {"algorithm a5", "algorithm a6", "5", "a1, a2, a3, a4, a5, soft or avbd"},
           {"step 0.016666666666666666", "step fast", "6", "'fast'"},
           {"step 0.016666666666666666", "step nan", "6", "'nan'"},
           {"step 0.016666666666666666", "step 0", "15", "step 0"},
           {"substeps 7", "substeps 99999999999999999999", "7", "substeps"},
           {"substeps 7\n", "", "7", "'substeps …' is expected"},
           {"joints stable", "joints loose", "13", "rows, plain or stable"},
           {"line\\x0a", "line\\xg", "18", "backslash"},
           {"line\\x0abreak \\x5c and ümlaut", "line\\x0", "18", "backslash"},
           {"body 2", "body 3", "18", "body 2 is expected"},
           {"body 2", "body 2000000000", "18", "body 2 is expected"},
           {"full-every 2", "full-every 0", "19", "at least 1"},
           {"full-every 2", "full-every 2000000000", "27", "must have no poses"},
           {"frame 1 ", "frame 2 ", "23", "frame 1 is expected"},
           {"frame 1 ", "frame 2147483647 ", "23", "frame 1 is expected"},
           {"frame 1 ", "frame -1 ", "23", "frame 1 is expected"},
           {"pose 2 -0", "pose 2 nan", "22", "'nan'"},
           {"pose 2 -0", "pose 2 inf", "22", "'inf'"},
           {"pose 2 -0", "pose 2 1e999", "22", "'1e999'"},
           {"pose 2 -0", "pose 2 -0m", "22", "'-0m'"},
           {"pose 2 -0 ", "pose 2 ", "22", "8 items"},
           {"5e-324 -0 1 0 0 0", "5e-324 -0 1 0 0 0 0", "22", "'0 0'"},
           {"pose 2 -0", "pose 2  -0", "22", "8 items"},
           {"-0 1 0 0 0\n", "-0 2 0 0 0\n", "22", "quaternion"},
           {"pose 2 -0 5e-324 -0 1 0 0 0\n", "", "22", "pose of body 2 is missing"},
           {"frame 1 ", "pose 3 0 0 0 1 0 0 0\nframe 1 ", "23", "too many"},
           {"pose 1 5e-324", "pose 2 5e-324", "21", "pose of body 1 is expected"},
           {"pose 1 5e-324", "pose 0 5e-324", "21", "pose of body 1 is expected"},
           {"frame 2 ", "pose 1 0 0 0 1 0 0 0\npose 2 0 0 0 1 0 0 0\nframe 2 ", "26", "must have no poses"},
           {"end ok 4\n", "", "31", "truncated"},
           {"end ok 4\n", "end ok", "31", "truncated"},
           {"end ok 4", "end ok 5", "31", "'end ok 4'"},
           {"end ok 4", "end fine 4", "31", "'end ok 4'"},
           {"end ok 4", "end diverged 3 body 1 crate", "31", "end that fits"},
           {"end ok 4\n", "end ok 4\nend ok 4\n", "32", "nothing may follow"}}) {
    SCOPED_TRACE(std::string(from) + " → " + to);
    const std::string message = failure(replaced(to_text(example()), from, to));
    EXPECT_THAT(message, HasSubstr("a.poses.txt:" + std::string(line) + ": "));
    EXPECT_THAT(message, HasSubstr(words));
    EXPECT_THAT(message, testing::Not(HasSubstr("\n")));
  }
}

TEST(PoseLog, ReadsLogsWithoutContactStabilization) {
  const std::string text = replaced(to_text(example()), "contact_tau 0.7\ncontact_kappa 0\n", "");
  const PoseLog log = parse_pose_log(text, "text");
  EXPECT_EQ(log.settings.contact_tau, 0);
  EXPECT_EQ(log.settings.of_contacts().tau, 0.1 + 0.2);
}

TEST(PoseLog, ReadsNameThatEndsWithEscape) {
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

/// Compares the example with a changed one.
template <typename Change>
PoseDifference compared(const Change& change) {
  PoseLog actual = example();
  change(actual);
  return compare(example(), actual);
}

TEST(PoseLogCompare, NamesFirstFrameBodyAndAxis) {
  const PoseDifference difference = compared([](PoseLog& log) {
    for (std::size_t k = 1; k < 5; ++k) log.frames[k].hash ^= 1;
    log.frames[2].poses[1].linear.x() += 1e-9;
    log.frames[2].poses[2].linear.y() += 3e-9;
    log.frames[4].poses[2].linear.x() += 0.25;
  });
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
  const double angle = 1e-7;
  const PoseDifference difference = compared([&](PoseLog& log) {
    log.frames[4].hash ^= 1;
    log.frames[4].poses[2].angular = Quaternion(std::cos(angle / 2), std::sin(angle / 2), 0, 0);
  });
  EXPECT_EQ(difference.first_full_frame, 4);
  EXPECT_EQ(difference.body, 2);
  EXPECT_EQ(difference.axis, 'r');
  EXPECT_NEAR(difference.size, angle, 1e-20);  // measured 0
  EXPECT_EQ(difference.largest_orientation, difference.size);
  EXPECT_EQ(difference.largest_position, 0);
}

TEST(PoseLogCompare, HashDetectsVelocityChange) {
  const PoseDifference difference = compared([](PoseLog& log) { log.frames[3].hash ^= 1; });
  EXPECT_EQ(difference.first_frame, 3);
  EXPECT_EQ(difference.first_full_frame, 4);
  EXPECT_EQ(difference.axis, ' ');
  EXPECT_EQ(difference.size, 0);
}

// settings_fields_test compares each field of the settings.
TEST(PoseLogCompare, NamesDifferenceOfHeaders) {
  const PoseDifference difference = compared([](PoseLog& log) {
    log.scene = "other.gltf";
    log.scene_hash = 1;
    log.settings.substeps = 8;
    log.modelled = "nothing";
    log.bodies[1] = "barrel";
    log.bodies.emplace_back("third");
    log.full_every = 4;
    log.frames.resize(3);
    log.end = "diverged 3 body 1 barrel";
  });
  EXPECT_EQ(difference.headers,
            "scene: two_boxes.gltf → other.gltf\n"
            "scene-hash: 00c5e0f3a11d2b69 → 0000000000000001\n"
            "substeps: 7 → 8\n"
            "modelled: joints: 1 ball; no contacts → nothing\n"
            "bodies: 2 → 3\n"
            "body 1: crate → barrel\n"
            "full-every: 2 → 4\n"
            "last frame: 4 → 2\n"
            "end: ok → diverged 3 body 1 barrel");
  EXPECT_EQ(difference.first_frame, 3);
  EXPECT_EQ(difference.first_full_frame, -1);
  EXPECT_FALSE(compared([](PoseLog& log) { log.full_every = 4; }).none());
}

TEST(PoseLogCompare, ReportsMovedPoseUnderEqualHash) {
  const PoseDifference moved = compared([](PoseLog& log) { log.frames[2].poses[2].linear.x() += 0.5; });
  EXPECT_FALSE(moved.none());
  EXPECT_EQ(moved.first_contradiction, 2);
  EXPECT_EQ(moved.first_frame, -1);
  EXPECT_EQ(moved.largest_position, 0.5);
  const auto negate = [](PoseLog& log) { log.frames[4].poses[1].angular.coeffs() *= -1; };
  EXPECT_EQ(compared(negate).first_contradiction, 4);
}

}  // namespace
}  // namespace substep
