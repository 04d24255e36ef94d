#include "sim/execution/child_process.h"

#include <gtest/gtest.h>

#include <system_error>

namespace substep {
namespace {

TEST(ChildProcess, ReceivesArgumentsUnchanged) {
  const TemporaryFile out;
  ChildProcess process({"printf", "%s|", "two words", "$HOME; 'quoted'"}, {.out = out.descriptor()});
  EXPECT_TRUE(process.succeeds());
  EXPECT_EQ(out.content(), "two words|$HOME; 'quoted'|");
}

TEST(ChildProcess, ReadsAndWritesFiles) {
  const TemporaryFile in("one\ntwo\n");
  const TemporaryFile out;
  EXPECT_TRUE(ChildProcess({"cat"}, {.in = in.descriptor(), .out = out.descriptor()}).succeeds());
  EXPECT_EQ(out.content(), "one\ntwo\n");
  const TemporaryFile nothing;
  EXPECT_TRUE(ChildProcess({"cat"}, {.in = ChildProcess::nowhere, .out = nothing.descriptor()}).succeeds());
  EXPECT_EQ(nothing.content(), "");
}

TEST(ChildProcess, ReportsExitCodeOrSignal) {
  ChildProcess failing({"false"}, {});
  EXPECT_FALSE(failing.succeeds());
  EXPECT_EQ(failing.exit_code(), 1);
  ChildProcess killed({"sh", "-c", "kill -9 $$"}, {});
  EXPECT_FALSE(killed.succeeds());
  EXPECT_EQ(killed.exit_code(), -SIGKILL);
}

TEST(ChildProcess, ThrowsForMissingProgram) {
  EXPECT_THROW(ChildProcess({"substep-no-such-program"}, {}), std::system_error);
}

TEST(ChildProcess, DestructorKillsProgram) {
  pid_t id = 0;
  {
    const ChildProcess process({"sleep", "infinity"}, {});
    id = process.id();
    EXPECT_EQ(::kill(id, 0), 0);
  }
  EXPECT_EQ(::kill(id, 0), -1);
}

}  // namespace
}  // namespace substep
