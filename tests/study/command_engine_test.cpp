#include "sim/study/engines/command_engine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "sim/error.h"
#include "tests/error_message.h"
#include "tests/scene_files.h"
#include "tests/temporary_folder.h"

namespace substep {
namespace {

using testing::HasSubstr;

/// A shell script as a simulator of the pendulum, which hangs still.
class CommandEngine : public testing::Test {
 protected:
  std::vector<State> run(const std::string& script, double time_limit = 20) const {
    return run_command({"sh", "-c", script, "sim", "{scene}", "{settings}", "{poses}"}, scene_,
                       {.step = 0.25}, time_limit);
  }
  std::string refusal(const std::string& script, double time_limit = 20) const {
    return test::message_of([&] { run(script, time_limit); });
  }

  Scene scene_ = scene_named("pendulum");
  const std::string table_ =
      "printf 't,body,x,y,z,qw,qx,qy,qz\\n0,rod,1,2,3,1,0,0,0\\n0.5,rod,1,3,3,1,0,0,0\\n' > \"$3\"";
};

TEST_F(CommandEngine, ReadsPosesOfCommand) {
  const std::vector<State> states = run(table_);
  ASSERT_EQ(states.size(), 3);
  EXPECT_EQ(states[1].q[1].linear, Vector3(1, 2.5, 3));
}

TEST_F(CommandEngine, GivesSceneAndSettings) {
  EXPECT_EQ(refusal("grep -q '\"format\": \"substep scene 1\"' \"$1\" && grep -q '\"step\":0.25' \"$2\" && " +
                    table_),
            "");
}

TEST_F(CommandEngine, SaysHowCommandFailed) {
  EXPECT_EQ(refusal("echo one >&2; echo two >&2; exit 7"), "sh ended with exit code 7: two");
  EXPECT_EQ(refusal("exit 7"), "sh ended with exit code 7");
  EXPECT_EQ(refusal("kill -9 $$"), "sh ended with signal 9");
  // A simulator's own refusal.
  EXPECT_EQ(refusal("echo 'there are motors' >&2; exit 3"), "there are motors");
  EXPECT_EQ(refusal("sleep 20", 0.1), "sh has not ended after 0.1 s");
  EXPECT_EQ(refusal("true"), "sh wrote no poses");
  EXPECT_EQ(refusal(table_ + "; exit 1"), "sh ended with exit code 1");
  EXPECT_THAT(refusal("echo t > \"$3\""), HasSubstr("poses.csv:1: the header lacks body"));
  EXPECT_THROW(run_command({"true", "{scene}"}, scene_, {}), Error);
  EXPECT_THROW(run_command({"no-such-program", "{poses}"}, scene_, {}), Error);
}

TEST_F(CommandEngine, FindsFilesBesideFile) {
  const test::TemporaryFolder folder;
  const auto script = folder.write("mine.py", "");
  EXPECT_EQ(beside({"python3", "mine.py", "other.py", "{poses}"}, folder.path()),
            (Command{"python3", script.string(), "other.py", "{poses}"}));
  EXPECT_EQ(command_engine({"python3", script.string(), "{poses}"}).label, "mine");
  EXPECT_EQ(command_engine({"/usr/bin/mine", "{poses}"}).label, "mine");
}

}  // namespace
}  // namespace substep
