// A film takes its name only when it is whole, whatever ffmpeg says of it.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "program.h"
#include "render/video/ffmpeg.h"
#include "sim/error.h"

namespace substep {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Film : public Program {
 protected:
  Film() {
    fs::create_directory(folder() / "bin");
    write("a.mp4", "an earlier film");
  }

  /// Puts a script in ffmpeg's place.
  void fake(const std::string& script) const {
    write("bin/ffmpeg", "#!/bin/sh\n" + script);
    fs::permissions(folder() / "bin/ffmpeg", fs::perms::owner_all);
  }

  Outcome film() const {
    return run(
        {"video", scene("pendulum.gltf"), "--duration", "0.2", "--size", "320x180", "--output", "a.mp4"},
        (folder() / "bin").string() + ":" + system_path());
  }

  void expect_failure(const std::string& part) const {
    const Outcome outcome = film();
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, HasSubstr(part));
    EXPECT_EQ(content("a.mp4"), "an earlier film");
    EXPECT_EQ(files(), (std::vector<std::string>{"a.mp4", "bin", "bin/ffmpeg"}));
  }
};

TEST_F(Film, AMessageIsAFailureWhateverTheCode) {
  fake("cat > /dev/null\necho 'Error writing trailer of film: No space left on device' >&2\nexit 0\n");
  expect_failure("ffmpeg failed: Error writing trailer of film: No space left on device");
}

TEST_F(Film, AnEmptyFileIsAFailure) {
  fake("cat > /dev/null\nexit 0\n");
  expect_failure("its film has 0 frames of");
}

TEST_F(Film, ACutFileIsAFailure) {
  const std::optional<fs::path> real = find_ffmpeg();
  if (!real) GTEST_SKIP() << "ffmpeg is not installed";
  fake(
      fmt::format("{} \"$@\" || exit\nfor last; do :; done\n"
                  "case $last in file:*) truncate -s -1000 \"${{last#file:}}\";; esac\n",
                  real->string()));
  expect_failure("ffmpeg failed: ");
}

TEST_F(Film, AFullDiskIsAFailure) {
  if (!find_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
  fs::create_directory(folder() / "disk");
  const std::string disk = quoted((folder() / "disk").string());
  const auto on_disk = [&](const std::string& command) {
    return run_command(fmt::format(
        "unshare -m sh -c {}",
        quoted(fmt::format("mount -t tmpfs -o size=48k none {} && cd {} && {}", disk, disk, command))));
  };
  if (on_disk("true").exit_code != 0) GTEST_SKIP() << "no small disk can be made here: that takes root";
  const Outcome outcome =
      on_disk(fmt::format("{} video {} --duration 2 --size 640x360 --output a.mp4; echo code $?; ls -A",
                          SUBSTEP_PROGRAM, quoted(scene("pendulum.gltf"))));
  EXPECT_EQ(outcome.out, "code 2\n");  // and no file
  EXPECT_THAT(outcome.err, HasSubstr("substep: ffmpeg failed: "));
}

TEST_F(Film, AHangEnds) {
  fake("exec sleep 60\n");
  const fs::path program = folder() / "bin/ffmpeg";
  const auto start = std::chrono::steady_clock::now();
  const std::string message = "ffmpeg has done nothing for 0.2 s";
  const auto message_of = [](const auto& call) {
    try {
      call();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  Ffmpeg deaf(program, {}, {}, std::chrono::milliseconds(200));
  const std::vector<std::uint8_t> more_than_a_pipe_holds(1 << 20);
  EXPECT_THAT(message_of([&] { deaf.write(more_than_a_pipe_holds); }), HasSubstr(message));
  Ffmpeg endless(program, {}, {}, std::chrono::milliseconds(200));
  EXPECT_THAT(message_of([&] { endless.finish(); }), HasSubstr(message));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

}  // namespace
}  // namespace substep
