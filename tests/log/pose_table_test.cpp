#include "sim/log/pose_table.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "sim/error.h"
#include "sim/math/rotation.h"
#include "tests/error_message.h"
#include "tests/sim/test_scenes.h"
#include "tests/temporary_folder.h"

namespace substep {
namespace {

using testing::HasSubstr;

constexpr double step = 0.1;

/// Returns a scene of two dynamic bodies, 'crate', whose node is turned, and 'a, "b"', and a kinematic
/// 'lift'.
Scene example_scene() {
  Scene scene = test::empty_scene();
  scene.bodies.resize(4);
  scene.bodies[1].name = "crate";
  scene.bodies[1].inverse_mass = 1;
  scene.bodies[1].body_from_node.orientation = rotation_quaternion({0.3, -0.2, 0.7});
  scene.bodies[2].name = "a, \"b\"";
  scene.bodies[2].inverse_mass = 2;
  scene.bodies[2].linear_velocity = {1, 2, 3};
  scene.bodies[3].name = "lift";
  scene.bodies[3].linear_velocity = {0, 2, 0};
  scene.bodies[3].angular_velocity = {0, 1, 0};
  return scene;
}

/// Returns a header, and rows of both bodies at 0 and 0.25 s, in which "crate" moves by (0.5, 0, −1) m and
/// turns by 1 rad about z.
std::string example_table() {
  const Quaternion end = rotation_quaternion({0, 0, 1});
  return "body,t,qw,qx,qy,qz,z,y,x,note\n"
         "crate,0,1,0,0,0,0,0,0,from\n"
         "\"a, \"\"b\"\"\",0,1,0,0,0,0,0,0,\n" +
         fmt::format("crate,0.25,{},0,0,{},-1,0,0.5,to\n", end.w(), end.z()) +
         "\"a, \"\"b\"\"\",0.25,-1,0,0,0,0,0,1,\n";
}

class PoseTable : public testing::Test {
 protected:
  std::vector<State> read(const std::string& text) const {
    std::ofstream(file_, std::ios::binary) << text;
    return read_pose_table(file_, scene_, step);
  }
  std::string refusal(const std::string& text) const {
    return test::message_of([&] { read(text); });
  }
  /// Returns the error message of the example with one text replaced.
  std::string refusal(const std::string& from, const std::string& to) const {
    std::string text = example_table();
    text.replace(text.find(from), from.size(), to);
    return refusal(text);
  }

  test::TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "rig.csv";
  Scene scene_ = example_scene();
};

TEST_F(PoseTable, InterpolatesBetweenRows) {
  const std::vector<State> states = read(example_table());
  ASSERT_EQ(states.size(), 3);
  for (int k = 0; k < 3; ++k) {
    const double fraction = k * step / 0.25;
    EXPECT_NEAR((states[k].q[1].linear - fraction * Vector3(0.5, 0, -1)).norm(), 0, 1e-15);
    const Quaternion node = states[k].q[1].angular * scene_.bodies[1].body_from_node.orientation;
    EXPECT_NEAR((rotation_vector(node) - Vector3(0, 0, fraction)).norm(), 0, 1e-15);
    // The quaternion changes its sign, which is no turn.
    EXPECT_NEAR(rotation_vector(states[k].q[2].angular).norm(), 0, 1e-15);
    EXPECT_NEAR(states[k].q[3].linear.y(), 2 * k * step, 1e-15);
    EXPECT_NEAR(rotation_vector(states[k].q[3].angular).y(), k * step, 1e-15);
  }
}

TEST_F(PoseTable, DifferentiatesPosesWithoutVelocities) {
  const std::vector<State> states = read(example_table());
  EXPECT_EQ(states[0].v[2].linear, Vector3(1, 2, 3));
  EXPECT_NEAR((states[1].v[1].linear - Vector3(2, 0, -4)).norm(), 0, 1e-14);
  EXPECT_NEAR((states[1].v[1].angular - Vector3(0, 0, 4)).norm(), 0, 1e-14);
  // Follow parabolas, which have exact velocities at the end too.
  std::string text = "t,body,x,y,z,qw,qx,qy,qz\n";
  for (const double t : {0.0, 0.1, 0.2}) {
    const Quaternion q = rotation_quaternion({0, 0, 3 * t * t});
    text += fmt::format("{},crate,{},0,0,{},0,0,{}\n", t, 5 * t * t, q.w(), q.z());
    text += fmt::format("{},\"a, \"\"b\"\"\",0,0,0,1,0,0,0\n", t);
  }
  const Velocity last = read(text).at(2).v[1];
  EXPECT_NEAR((last.linear - Vector3(2, 0, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((last.angular - Vector3(0, 0, 1.2)).norm(), 0, 1e-12);
}

TEST_F(PoseTable, ReadsCrlfAndByteOrderMark) {
  std::string text = "\xef\xbb\xbf" + example_table();
  for (std::size_t i = 0; (i = text.find('\n', i)) != std::string::npos; i += 2) text.insert(i, "\r");
  const std::vector<State> states = read(text + "\r\n\r\n");
  const std::vector<State> plain = read(example_table());
  ASSERT_EQ(states.size(), plain.size());
  for (std::size_t k = 0; k < plain.size(); ++k) EXPECT_EQ(hash(states[k]), hash(plain[k]));
}

TEST_F(PoseTable, KeepsPosesAtSteps) {
  const double x = std::nextafter(1.0 / 3, 1.0);
  std::string text = "t,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n";
  for (int k = 0; k < 3; ++k) {
    for (const char* body : {"crate", "\"a, \"\"b\"\"\""}) {
      text += fmt::format("{},{},{},0,0,1,0,0,0,{},0,0,0,0,{}\n", k * step, body, x * k, x, -x);
    }
  }
  const std::vector<State> states = read(text);
  ASSERT_EQ(states.size(), 3);
  EXPECT_EQ(states[2].q[2].linear.x(), 2 * x);
  EXPECT_EQ(states[2].v[2].linear.x(), x);
  EXPECT_EQ(states[2].v[2].angular.z(), -x);
}

TEST_F(PoseTable, NamesLineOfFault) {
  EXPECT_THAT(refusal(""), HasSubstr("rig.csv:1: the table is empty"));
  struct MalformedTable {
    const char* from;
    const char* to;
    const char* words;
  };
  for (const auto& [from, to, words] : std::initializer_list<MalformedTable>{
           {"qz,z", "qz,zz", "rig.csv:1: the header lacks z"},
           {"qz,z", "qz,qz", "rig.csv:1: the header has two columns qz"},
           {",note", ",vx", "the header lacks vy, vz, wx, wy, wz"},
           {"crate,0,1", "crane,0,1", "rig.csv:2: test has no body 'crane': there are crate, a, \"b\", lift"},
           {"crate,0,1,0,0,0,0,0,0,from\n", "", "crate begins at 0.25 s"},
           {"crate,0,1,0", "crate,0,nan,0", "rig.csv:2: qw 'nan' is not a finite number"},
           {"crate,0,1,0", "crate,0,,0", "rig.csv:2: qw '' is not a finite number"},
           {"crate,0,1,0", "crate,0,0,0", "rig.csv:2: the quaternion is not of length 1"},
           {"0,from", "from", "rig.csv:2: 10 fields are expected as in the header, not 9"},
           {"crate,0.25", "crate,0", "rig.csv:4: crate has two rows at 0 s"},
           {"crate,0.25", "crate,-1", "rig.csv:4: crate goes from 0 s back to -1 s"},
           {"crate,0.25", "crate,1e300", "rig.csv:4: 1e+300 s at steps of"},
           {"\"\"\",0.25,", "\"\"\n0.25,", "rig.csv:5: a quoted field has no closing quote"}}) {
    EXPECT_THAT(refusal(from, to), HasSubstr(words));
  }
  EXPECT_THAT(refusal(example_table() + "crate,0.3,1,0,0,0,0,0,0,\n"),
              HasSubstr("rig.csv:7: the table ends with 3 rows of crate and 2 of a, \"b\""));
  EXPECT_THAT(refusal("t,body,x,y,z,qw,qx,qy,qz\ncrate,0,0,0,0,1,0,0,0\n"),
              HasSubstr("rig.csv:2: test has no body '0'"));
  EXPECT_THAT(refusal("t,body,x,y,z,qw,qx,qy,qz\n0,crate,0,0,0,1,0,0,0\n"),
              HasSubstr("the table ends without a row of a, \"b\""));
  EXPECT_THAT(refusal("t,body,x,y,z,qw,qx,qy,qz\n"), HasSubstr("the table ends without a row of crate"));
  EXPECT_THAT(refusal(std::string(1 << 20, 'x')), HasSubstr("the row is longer than 65536 bytes"));
  scene_.bodies[3].inverse_inertia.x() = 1;
  EXPECT_THAT(refusal(example_table()), HasSubstr("the table ends without a row of lift"));
  std::filesystem::remove(file_);
  EXPECT_THROW(read_pose_table(file_, scene_, step), Error);
  EXPECT_THROW(read_pose_table(folder_.path(), scene_, step), Error);
}

TEST_F(PoseTable, RefusesBodiesOfOneName) {
  scene_.bodies[2].name = "crate";
  EXPECT_THAT(refusal(example_table()), HasSubstr("two bodies of test are called crate"));
}

TEST_F(PoseTable, InterpolatesAMillionRows) {
  scene_.bodies.resize(2);
  std::ofstream stream(file_);
  stream << "t,body,x,y,z,qw,qx,qy,qz\n";
  constexpr int rows = 1000000;
  for (int i = 0; i < rows; ++i) stream << fmt::format("{},crate,{},0,0,1,0,0,0\n", i * 1e-6, i);
  stream.close();
  const std::vector<State> states = read_pose_table(file_, scene_, step);
  ASSERT_EQ(states.size(), 10);
  EXPECT_NEAR(states[5].q[1].linear.x(), 500000, 1e-6);
}

TEST_F(PoseTable, BecomesLogThatNamesAuthor) {
  std::ofstream(file_, std::ios::binary) << example_table();
  const PoseLog log = read_run(file_, scene_, step);
  EXPECT_EQ(log.author, "rig");
  ASSERT_EQ(log.frames.size(), 3);
  EXPECT_EQ(log.frames[0].velocities.size(), 4);
  const PoseLog again = parse_pose_log(to_text(log), "again");
  EXPECT_EQ(again.author, "rig");
  EXPECT_EQ(again.settings.step, step);
  EXPECT_TRUE(compare(log, again).none());
  PoseLog ours = log;
  ours.author.clear();
  EXPECT_THAT(compare(log, ours).headers, HasSubstr("author: rig → "));
}

}  // namespace
}  // namespace substep
