/// Approving is killed before and in the middle of every call that changes a file, one after another. This
/// program's own write() and rename() stand in the place of the C library's, and count.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <map>
#include <string>

#include "sim/error.h"
#include "tests/golden/small_suite.h"

namespace {

/// Calls that are let through before the process is killed; negative: all.
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
    // The next call is the last: this one writes half of its bytes.
    syscall(SYS_write, descriptor, bytes, size / 2);
    std::raise(SIGKILL);
  }
  return syscall(SYS_write, descriptor, bytes, size);
}

int rename(const char* from, const char* to) noexcept {
  count();
  return renameat(AT_FDCWD, from, AT_FDCWD, to);
}
// NOLINTEND(readability-inconsistent-declaration-parameter-name)
}

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

/// A case that was checked after its motion changed, to be approved.
class InterruptedApproval : public testing::Test {
 protected:
  using Files = std::map<std::string, std::string>;

  InterruptedApproval() {
    // Small pictures: only the order of the writes matters here.
    replace_in(suite_.options.suite, "[160, 90]", "[48, 27]");
    suite_.make_goldens();
    old_ = goldens();
    replace_in(suite_.scene(), "\"gravity\":[0.0,-9.81,0.0]", "\"gravity\":[3.0,9.81,0.0]");
    suite_.run();
  }

  /// The goldens' contents, without what an interrupted write left beside them.
  Files goldens() const {
    Files files;
    for (const fs::path& file :
         {suite_.poses(), suite_.track(), suite_.image(10), suite_.image(20), suite_.sidecar()}) {
      files[file.string()] = read_text(file);
    }
    return files;
  }

  static void put(const Files& files) {
    for (const auto& [file, content] : files) write_text(file, content);
  }

  /// Returns whether approving came to its end.
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

  SmallSuite suite_;
  Files old_;
};

TEST_F(InterruptedApproval, WritesSidecarLastAndContinues) {
  suite_.approve_failed();
  const Files fresh = goldens();
  int halves = 0;
  for (int calls = 0;; ++calls) {
    put(old_);
    const bool is_done = approve_and_kill_after(calls);
    const Files found = goldens();
    for (const auto& [file, content] : found) {
      EXPECT_TRUE(content == old_.at(file) || content == fresh.at(file)) << file << ", " << calls << " calls";
    }
    const bool has_new_sidecar = found.at(suite_.sidecar().string()) == fresh.at(suite_.sidecar().string());
    if (has_new_sidecar) {
      EXPECT_EQ(found, fresh);
    }
    halves += found != old_ && found != fresh;
    if (is_done) break;
    suite_.approve_failed();
    EXPECT_EQ(goldens(), fresh) << calls << " calls";
  }
  EXPECT_GE(halves, 4);  // killed after each of the four files before the sidecar
}

TEST_F(InterruptedApproval, ShowsAsEditedGoldens) {
  int calls = 0;
  while (goldens() == old_) approve_and_kill_after(calls++);
  const CheckResult result = suite_.run();
  EXPECT_EQ(result.cases.at(0).verdict, Verdict::golden_edited) << result.cases.at(0).text;
  suite_.approve_failed();
  EXPECT_EQ(suite_.run().cases.at(0).verdict, Verdict::pass);
}

}  // namespace
}  // namespace substep::golden
