/// Approving is killed before, in the middle of and after every call that changes a file, one after another.
/// This program's own write(), rename(), unlink() and remove() stand in the place of the C library's, and
/// count.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <map>
#include <string>

#include "golden/suite/approval_journal.h"
#include "render/renderer.h"
#include "sim/error.h"
#include "tests/golden/small_suite.h"

namespace {

/// How many more such calls are let through; negative: all.
int calls_left = -1;

void count() {
  if (calls_left < 0) return;
  if (calls_left-- == 0) std::raise(SIGKILL);
}

}  // namespace

extern "C" {

// NOLINTBEGIN(readability-inconsistent-declaration-parameter-name)
ssize_t write(int descriptor, const void* bytes, size_t size) {
  count();
  if (calls_left == 0) {
    // The next one is the last: this one gets half of it done.
    syscall(SYS_write, descriptor, bytes, size / 2);
    std::raise(SIGKILL);
  }
  return syscall(SYS_write, descriptor, bytes, size);
}

int rename(const char* from, const char* to) noexcept {
  count();
  return renameat(AT_FDCWD, from, AT_FDCWD, to);
}

int unlink(const char* file) noexcept {
  count();
  return unlinkat(AT_FDCWD, file, 0);
}

int remove(const char* file) noexcept {
  count();
  if (unlinkat(AT_FDCWD, file, 0) == 0) return 0;
  return errno == EISDIR ? unlinkat(AT_FDCWD, file, AT_REMOVEDIR) : -1;
}
// NOLINTEND(readability-inconsistent-declaration-parameter-name)
}

namespace substep {
namespace {

namespace fs = std::filesystem;

class ApproveInterruption : public testing::Test {
 protected:
  using Files = std::map<std::string, std::string>;

  // Small pictures: what is of interest is when files are written.
  ApproveInterruption() { replace_in(suite_.options.suite, "[160, 90]", "[48, 27]"); }

  fs::path folder() const { return suite_.options.suite.parent_path(); }

  Files goldens() const {
    Files files;
    for (const char* part : {"poses", "images"}) {
      if (!fs::exists(folder() / part)) continue;
      for (const auto& entry : fs::recursive_directory_iterator(folder() / part)) {
        if (entry.is_regular_file()) files[entry.path().string()] = read_text(entry.path());
      }
    }
    return files;
  }

  /// What is in the folder but goldens and the suite file.
  int others() const {
    int count = 0;
    for (const auto& entry : fs::directory_iterator(folder())) {
      count += entry.path().filename() != "suite.toml" && !entry.is_directory();
    }
    return count;
  }

  void put(const Files& files) {
    fs::remove_all(folder() / "poses");
    fs::remove_all(folder() / "images");
    for (const auto& [file, content] : files) write_text(file, content);
  }

  /// Whether approving came to its end.
  bool approve_and_kill_after(int calls) {
    const pid_t child = fork();
    if (child == 0) {
      calls_left = calls;
      try {
        suite_.approve_failed();
        _exit(0);
      } catch (const Error&) {
        _exit(1);
      }
    }
    int status = 0;
    waitpid(child, &status, 0);
    const bool is_done = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    EXPECT_TRUE(is_done || (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)) << status;
    return is_done;
  }

  void kill_everywhere(const Files& old) {
    put(old);
    suite_.approve_failed();
    const Files fresh = goldens();
    ASSERT_NE(fresh, old);
    int kept = 0;
    int replaced = 0;
    for (int calls = 0;; ++calls) {
      put(old);
      const bool is_done = approve_and_kill_after(calls);
      finish_approvals(folder());
      const Files found = goldens();
      ++(found == old ? kept : replaced);
      ASSERT_TRUE(found == old || found == fresh) << "killed after " << calls << " calls";
      if (is_done) {
        EXPECT_EQ(found, fresh);
        break;
      }
      // The same command does the rest, and leaves nothing else.
      EXPECT_EQ(suite_.approve_failed().written.empty(), found == fresh);
      EXPECT_EQ(goldens(), fresh);
      EXPECT_EQ(others(), 0);
    }
    // Before the journal has its name: killed in its writing and before its renaming. Then for each of five
    // files, and for the journal's end.
    EXPECT_GE(kept, 2);
    EXPECT_GE(replaced, 10);
    EXPECT_EQ(suite_.run().cases.at(0).verdict, Verdict::pass);
  }

  SmallSuite suite_;
};

TEST_F(ApproveInterruption, ANewCaseHasAllOrNoGoldens) {
  suite_.run();
  kill_everywhere({});
}

TEST_F(ApproveInterruption, AChangedCaseHasItsOldOrItsNewGoldens) {
  suite_.make_goldens();
  const Files old = goldens();
  replace_in(suite_.scene(), "\"gravity\":[0.0,-9.81,0.0]", "\"gravity\":[3.0,9.81,0.0]");
  suite_.run();
  kill_everywhere(old);
}

TEST_F(ApproveInterruption, ACheckPutsInPlaceWhatWasApproved) {
  suite_.run();
  for (int calls = 0; goldens().empty(); ++calls) approve_and_kill_after(calls);
  EXPECT_LT(goldens().size(), 5U);
  const CheckResult result = suite_.run();
  EXPECT_EQ(result.cases.at(0).verdict, Verdict::pass) << result.cases.at(0).text;
  EXPECT_TRUE(result.orphans.empty());
  EXPECT_EQ(goldens().size(), 5U);
}

TEST_F(ApproveInterruption, AJournalThatWouldWriteElsewhereIsRefused) {
  const std::string hash = "cbf29ce484222325";  // of nothing
  for (const char* file : {"../scenes/x", "images/../../x", "/tmp/x", "suite.toml"}) {
    write_text(folder() / ".a.approval",
               std::string("{\"format\":\"substep approval 1\",\"files\":[{\"file\":\"") + file +
                   "\",\"bytes\":0,\"hash\":\"" + hash + "\"}]}\n");
    EXPECT_THROW(finish_approvals(folder()), Error) << file;
  }
  write_text(folder() / ".a.approval",
             "{\"format\":\"substep approval 1\",\"files\":[{\"file\":\"images/x\","
             "\"bytes\":9,\"hash\":\"" +
                 hash + "\"}]}\nshort");
  EXPECT_THROW(finish_approvals(folder()), Error);
  write_text(folder() / ".a.approval", "");
  EXPECT_THROW(finish_approvals(folder()), Error);
  write_text(folder() / ".a.approval",
             "{\"format\":\"substep approval 1\",\"files\":[{\"file\":\"images/x\","
             "\"bytes\":0,\"hash\":\"" +
                 hash + "\"}]}\n");
  finish_approvals(folder());
  EXPECT_TRUE(fs::exists(folder() / "images/x"));
  EXPECT_EQ(others(), 0);
}

}  // namespace
}  // namespace substep
