// A film gets its name only when it is complete, also where ffmpeg reports success.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "program.h"
#include "render/video/ffmpeg.h"
#include "sim/error.h"
#include "tests/error_message.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Film : public Program {
 protected:
  Film() {
    fs::create_directory(folder() / "bin");
    write("a.mp4", "an earlier film");
  }

  /// Replaces ffmpeg by a script.
  void fake(const std::string& script) const {
    write("bin/ffmpeg", "#!/bin/sh\n" + script);
    fs::permissions(folder() / "bin/ffmpeg", fs::perms::owner_all);
  }

  static std::string real_ffmpeg() { return find_ffmpeg().value().string(); }

  void expect_failure(const std::string& part) const {
    const std::vector<std::string> words{
        "video", scene("pendulum.gltf"), "--duration", "0.2", "--size", "320x180", "--output", "a.mp4"};
    const Outcome outcome = run(words, (folder() / "bin").string() + ":" + system_path());
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, HasSubstr(part));
    EXPECT_EQ(content("a.mp4"), "an earlier film");
    EXPECT_EQ(files(), (std::vector<std::string>{"a.mp4", "bin", "bin/ffmpeg"}));
  }
};

TEST_F(Film, ReportsErrorDespiteExitCode0) {
  fake("cat > /dev/null\necho 'Error writing trailer of film: No space left on device' >&2\nexit 0\n");
  expect_failure("ffmpeg failed: Error writing trailer of film: No space left on device");
}

TEST_F(Film, RejectsEmptyFile) {
  fake("cat > /dev/null\nexit 0\n");
  expect_failure("its film has 0 frames of");
}

TEST_F(Film, RejectsTruncatedFile) {
  fake(
      fmt::format("{} \"$@\" || exit\nfor last; do :; done\n"
                  "case $last in file:*) truncate -s -1000 \"${{last#file:}}\";; esac\n",
                  real_ffmpeg()));
  expect_failure("ffmpeg failed: ");
}

TEST_F(Film, KillsStalledFfmpeg) {
  fake("exec sleep 60\n");
  const fs::path program = folder() / "bin/ffmpeg";
  const auto start = std::chrono::steady_clock::now();
  const std::string message = "ffmpeg has done nothing for 0.2 s";
  Ffmpeg deaf(program, {}, {}, std::chrono::milliseconds(200));
  const std::vector<std::uint8_t> more_than_a_pipe_holds(1 << 20);
  EXPECT_THAT(test::message_of([&] { deaf.write(more_than_a_pipe_holds); }), HasSubstr(message));
  Ffmpeg endless(program, {}, {}, std::chrono::milliseconds(200));
  EXPECT_THAT(test::message_of([&] { endless.finish(); }), HasSubstr(message));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

}  // namespace
}  // namespace substep::render
