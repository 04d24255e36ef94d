// What a command writes arrives whole, or the code says that it did not; nothing else is touched, and nothing
// is left.

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "program.h"
#include "sim/math/base64.h"
#include "tests/folders.h"

namespace substep {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Outputs : public Program {
 protected:
  std::string pendulum() const { return scene("pendulum.gltf"); }

  /// The shell's view of `substep` with these words, in folder().
  Outcome shell(const std::string& words) const {
    return run_command(
        fmt::format("cd {} && {} {}", quoted(folder().string()), quoted(SUBSTEP_PROGRAM), words));
  }
};

TEST_F(Outputs, WhatStandardOutputDoesNotTakeIsAnError) {
  ASSERT_EQ(run({"run", pendulum(), "--output", "a.txt"}).exit_code, 0);
  const std::string suite = quoted(std::string(test::source_folder) + "/golden");
  for (const std::string& words :
       {std::string("--help"), "info " + quoted(pendulum()), "info --json " + quoted(pendulum()),
        std::string("diff a.txt a.txt"), "run --output b.txt " + quoted(pendulum()),
        "measure --duration 0.1 " + quoted(pendulum()),
        "check --case pendulum.a5 --output check --suite " + suite}) {
    const Outcome full = shell(words + " > /dev/full");
    EXPECT_EQ(full.exit_code, 2) << words;
    EXPECT_THAT(full.err, HasSubstr("standard output")) << words;
    EXPECT_EQ(std::ranges::count(full.err, '\n'), 1) << full.err;
    const Outcome closed = shell(words + " >&-");
    EXPECT_EQ(closed.exit_code, 2) << words;
    EXPECT_THAT(closed.err, HasSubstr("standard output")) << words;
  }
  // No file took the number of the closed stream: the log holds no word of what was said.
  EXPECT_EQ(content("b.txt"), content("a.txt"));
}

TEST_F(Outputs, AreNeitherInputsNorEachOther) {
  const fs::path copy = folder() / "pendulum.gltf";
  fs::copy_file(pendulum(), copy);
  fs::create_hard_link(copy, folder() / "same.gltf");
  fs::create_symlink("pendulum.gltf", folder() / "link.txt");
  const std::string before = content("pendulum.gltf");
  for (const char* const output : {"pendulum.gltf", "./pendulum.gltf", "same.gltf", "link.txt"}) {
    for (const char* const command : {"run", "measure", "video"}) {
      expect_refused({command, "pendulum.gltf", "--output", output}, "is what the scene is read from");
    }
    expect_refused({"render", "--layout", "sheet", "pendulum.gltf", "--output", output}, "is a scene");
  }
  expect_refused({"run", "pendulum.gltf", "--output", "x", "--csv", "./x"},
                 "--output and --csv are one file");
  expect_refused({"video", "pendulum.gltf", "--output", "x.mp4", "--poster", "x.mp4"},
                 "--output and --poster are one file");
  EXPECT_EQ(content("pendulum.gltf"), before);
  // Nothing is lost in a device.
  EXPECT_EQ(run({"run", "pendulum.gltf", "--output", "/dev/null", "--csv", "/dev/null"}).exit_code, 0);
}

TEST_F(Outputs, ABufferOfTheSceneIsAnInput) {
  fs::copy_file(pendulum(), folder() / "pendulum.gltf");
  std::string text = content("pendulum.gltf");
  const std::size_t uri = text.find("data:");
  ASSERT_NE(uri, std::string::npos);
  const std::size_t data = text.find(',', uri) + 1;
  const std::size_t end = text.find('"', uri);
  std::optional<char> stranger;
  write("shape.bin", base64_decoded(text.substr(data, end - data), stranger));
  write("pendulum.gltf", text.replace(uri, end - uri, "shape.bin"));
  expect_refused({"run", "pendulum.gltf", "--output", "shape.bin"}, "is what the scene is read from");
}

TEST_F(Outputs, WhatAKilledRunLeftGoesWithTheNextOne) {
  write(".a.txt.12345-0.partial", "of a run that was killed");
  fs::create_directory(folder() / ".frames.12345-0.partial");
  write(".frames.12345-0.partial/frame_0000.png", "x");
  write(".a.txt.12346-0.partial", "of a run that goes on");
  write(".b.txt.12345-0.partial", "of another output");
  write(".a.txt.notes.partial", "no name that a run gives");
  const int held = open((folder() / ".a.txt.12346-0.partial").c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_EQ(flock(held, LOCK_EX), 0);
  ASSERT_EQ(run({"run", pendulum(), "--output", "a.txt"}).exit_code, 0);
  ASSERT_EQ(
      run({"video", pendulum(), "--duration", "0.1", "--size", "320x180", "--frames", "frames"}).exit_code,
      0);
  close(held);
  const std::vector<std::string> left = files();
  EXPECT_THAT(left, testing::Not(testing::Contains(".a.txt.12345-0.partial")));
  EXPECT_THAT(left, testing::Not(testing::Contains(".frames.12345-0.partial")));
  for (const char* const name :
       {".a.txt.12346-0.partial", ".b.txt.12345-0.partial", ".a.txt.notes.partial"}) {
    EXPECT_THAT(left, testing::Contains(name));
  }
}

TEST_F(Outputs, ALongRunTakesNoMoreMemoryThanAShortOne) {
  const std::string scene = pendulum();
  const std::string log = (folder() / "a.txt").string();
  const std::string table = (folder() / "a.csv").string();
  const auto kilobytes = [&](const char* duration) {
    const pid_t process = fork();
    if (process == 0) {
      execl(SUBSTEP_PROGRAM, SUBSTEP_PROGRAM, "run", scene.c_str(), "--step", "1/1000", "--duration",
            duration, "--output", log.c_str(), "--csv", table.c_str(), nullptr);
      _exit(127);
    }
    int status = 0;
    rusage usage{};
    EXPECT_EQ(wait4(process, &status, 0, &usage), process);
    EXPECT_EQ(status, 0);
    return usage.ru_maxrss;
  };
  // 10⁵ steps have 17 MB of poses and as much of a table; measured 0.3 MB more.
  EXPECT_LT(kilobytes("100"), kilobytes("0.01") + 4000);
}

TEST_F(Outputs, ADifferentPoseUnderOneHashIsADifference) {
  ASSERT_EQ(run({"run", pendulum(), "--duration", "0.5", "--output", "a.txt"}).exit_code, 0);
  std::string text = content("a.txt");
  const std::size_t pose = text.find("\npose 1 ", text.find("\nframe 7 ")) + 8;
  ASSERT_NE(pose, std::string::npos);
  const double x = std::stod(text.substr(pose));
  text.replace(pose, text.find(' ', pose) - pose, fmt::format("{}", x + 0.5));
  write("b.txt", text);
  const Outcome outcome = run({"diff", "a.txt", "b.txt"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.out, HasSubstr("frame 7: other poses under one hash"));
  EXPECT_THAT(outcome.out, HasSubstr("largest over all poses: 0.5 m"));
  EXPECT_EQ(run({"diff", "a.txt", "a.txt"}).exit_code, 0);
}

TEST_F(Outputs, SmallNonsenseIsRefused) {
  expect_refused({"diff", "/dev/zero", "/dev/zero"}, "this is no pose log");
  expect_refused({"video", pendulum(), "--hold", "nan"}, "--hold nan");
  expect_refused({"video", pendulum(), "--poster", "p.png", "--poster-time", "nan"}, "--poster-time nan");
  const std::string mesh = std::string(test::source_folder) + "/tests/scene/meshes/knot.obj";
  expect_refused({"run", mesh, "--height", "1e300"}, "the height must be from 0 to 100000 m");
  fs::copy_file(pendulum(), folder() / "twice.gltf");
  std::string text = content("twice.gltf");
  const std::size_t mass = text.find("\"mass\":");
  ASSERT_NE(mass, std::string::npos);
  write("twice.gltf", text.insert(mass, "\"mass\":7,"));
  expect_refused({"run", "twice.gltf"}, "twice.gltf: the key 'mass' stands twice in one object");
}

}  // namespace
}  // namespace substep
