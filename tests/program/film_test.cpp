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
};

TEST_F(Film, KeepsOldFileWhereFfmpegFails) {
  const std::string cut = fmt::format(
      "{} \"$@\" || exit\nfor last; do :; done\n"
      "case $last in file:*) truncate -s -1000 \"${{last#file:}}\";; esac\n",
      find_ffmpeg().value().string());
  const std::string trouble = "Error writing trailer of film: No space left on device";
  for (const auto& [script, message] :
       {std::pair("cat > /dev/null\necho '" + trouble + "' >&2\nexit 0\n", "ffmpeg failed: " + trouble),
        {"cat > /dev/null\nexit 0\n", "its film has 0 frames of"},
        {cut, "ffmpeg failed: "}}) {
    fake(script);
    const Outcome outcome = command(
        "PATH=\"$PWD/bin:$PATH\" $P video $S/pendulum.gltf --duration 0.2 --size 320x180 --output a.mp4");
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, HasSubstr(message));
    EXPECT_EQ(content("a.mp4"), "an earlier film");
    EXPECT_EQ(files(), (std::vector<std::string>{"a.mp4", "bin", "bin/ffmpeg"}));
  }
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
