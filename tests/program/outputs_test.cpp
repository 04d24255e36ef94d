// A command writes its output completely or ends with an error, and changes and leaves no other file.

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

#include "program.h"
#include "sim/log/file_output.h"
#include "sim/math/base64.h"

namespace substep {
namespace {

namespace fs = std::filesystem;
using Outputs = Program;

TEST_F(Outputs, FailOnLostStandardOutput) {
  printed("run $S/pendulum.gltf --output a.txt");
  for (const std::string words :
       {"--help", "info $S/pendulum.gltf", "info --json $S/pendulum.gltf", "diff a.txt a.txt",
        "run --output b.txt $S/pendulum.gltf", "measure --duration 0.1 $S/pendulum.gltf",
        "check --case pendulum.a5 --output check --suite $S/../golden"}) {
    const Outcome full = expect(words + " > /dev/full", 2, {}, {"standard output"});
    EXPECT_EQ(std::ranges::count(full.err, '\n'), 1) << full.err;
    expect(words + " >&-", 2, {}, {"standard output"});
  }
  // No file reused the descriptor of the closed stream: the log holds no printed text.
  EXPECT_EQ(content("b.txt"), content("a.txt"));
}

TEST_F(Outputs, AreNeitherInputsNorEachOther) {
  copy_scene("pendulum.gltf");
  fs::create_hard_link(folder() / "pendulum.gltf", folder() / "same.gltf");
  fs::create_symlink("pendulum.gltf", folder() / "link.txt");
  const std::string before = content("pendulum.gltf");
  for (const std::string output : {"pendulum.gltf", "./pendulum.gltf", "same.gltf", "link.txt"}) {
    for (const std::string command :
         {"run --output ", "measure --output ", "measure --reference ", "video --output "})
      refuses(command + output + " pendulum.gltf", "is what the scene is read from");
    refuses("render --layout sheet pendulum.gltf --output " + output, "is a scene");
  }
  refuses("run pendulum.gltf --output x --csv ./x", "--output and --csv are one file");
  refuses("video pendulum.gltf --output x.mp4 --poster x.mp4", "--output and --poster are one file");
  EXPECT_EQ(content("pendulum.gltf"), before);
  printed("run pendulum.gltf --csv run.csv");
  refuses("measure pendulum.gltf --run run.csv --output ./run.csv", "is the run and would be overwritten");
  // Nothing is lost in a device.
  printed("run pendulum.gltf --output /dev/null --csv /dev/null");
}

TEST_F(Outputs, TreatSceneBufferAsInput) {
  copy_scene("pendulum.gltf");
  std::string text = content("pendulum.gltf");
  const std::size_t uri = text.find("data:");
  ASSERT_NE(uri, std::string::npos);
  const std::size_t data = text.find(',', uri) + 1;
  const std::size_t end = text.find('"', uri);
  std::optional<char> stranger;
  write("shape.bin", base64_decoded(text.substr(data, end - data), stranger));
  write("pendulum.gltf", text.replace(uri, end - uri, "shape.bin"));
  refuses("run pendulum.gltf --output shape.bin", "is what the scene is read from");
}

TEST_F(Outputs, RemoveFilesOfKilledRun) {
  write(".a.txt.12345-0.partial", "of a run that was killed");
  fs::create_directory(folder() / ".frames.12345-0.partial");
  write(".frames.12345-0.partial/frame_0000.png", "x");
  write(".a.txt.12346-0.partial", "of a run that goes on");
  write(".b.txt.12345-0.partial", "of another output");
  write(".a.txt.notes.partial", "no name that a run gives");
  const int held = open((folder() / ".a.txt.12346-0.partial").c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_EQ(flock(held, LOCK_EX), 0);
  printed("run $S/pendulum.gltf --output a.txt");
  printed("video $S/pendulum.gltf --duration 0.1 --size 320x180 --frames frames");
  close(held);
  for (const auto& [name, is_left] : {std::pair(".a.txt.12345-0.partial", false),
                                      {".frames.12345-0.partial", false},
                                      {".a.txt.12346-0.partial", true},
                                      {".b.txt.12345-0.partial", true},
                                      {".a.txt.notes.partial", true}})
    EXPECT_EQ(fs::exists(folder() / name), is_left) << name;
}

TEST_F(Outputs, NeedNoMemoryOfLongRuns) {
  const std::string scene = this->scene("pendulum.gltf");
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

TEST_F(Outputs, DifferInPosesUnderOneHash) {
  printed("run $S/pendulum.gltf --duration 0.5 --output a.txt");
  std::string text = content("a.txt");
  const std::size_t pose = text.find("\npose 1 ", text.find("\nframe 7 ")) + 8;
  ASSERT_NE(pose, std::string::npos + 8);
  const double x = std::stod(text.substr(pose));
  text.replace(pose, text.find(' ', pose) - pose, fmt::format("{}", x + 0.5));
  write("b.txt", text);
  expect("diff a.txt b.txt", 1,
         {"frame 7: different poses with the same hash", "largest over all poses: 0.5 m"});
  printed("diff a.txt a.txt");
}

TEST_F(Outputs, RefuseNonsense) {
  refuses("diff /dev/zero /dev/zero", "this is no pose log");
  std::string text = content_of(scene("pendulum.gltf")).value();
  const std::size_t mass = text.find("\"mass\":");
  ASSERT_NE(mass, std::string::npos);
  write("twice.gltf", text.insert(mass, "\"mass\":7,"));
  refuses("run twice.gltf", "twice.gltf: the key 'mass' stands twice in one object");
}

}  // namespace
}  // namespace substep
