// Runs that other programs made, in every command that takes a run.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

#include "program.h"
#include "tests/folders.h"

namespace substep {
namespace {

using testing::HasSubstr;

class PoseTableCommands : public Program {
 protected:
  void SetUp() override {
    ASSERT_EQ(run({"run", scene("incline.gltf"), "--csv", "rig.csv", "--output", "ours.poses.txt"}).exit_code,
              0);
  }
};

TEST_F(PoseTableCommands, TableOfRunHasItsPoses) {
  const Outcome diff = run({"diff", "ours.poses.txt", "rig.csv", "--scene", scene("incline.gltf")});
  EXPECT_EQ(diff.exit_code, 1);
  EXPECT_THAT(diff.out, HasSubstr("author:  → rig\n"));
  EXPECT_THAT(diff.out, HasSubstr("largest over all poses: 0 m, "));
  EXPECT_EQ(run({"diff", "rig.csv", "rig.csv", "--scene", scene("incline.gltf")}).exit_code, 0);
  expect_refused({"diff", "rig.csv", "rig.csv"}, "name the table's scene with --scene FILE");
  expect_refused({"export", "rig.csv"}, "name the table's scene with --scene FILE");
  expect_refused({"export", "rig.csv", "--scene", scene("pendulum.gltf")},
                 "rig.csv:2: pendulum has no body 'rubber_block': there are rod");
}

TEST_F(PoseTableCommands, TableIsMeasuredAndFilmed) {
  const Outcome measured = run({"measure", scene("incline.gltf"), "--run", "rig.csv"});
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  EXPECT_THAT(measured.out, HasSubstr("\nrig "));
  EXPECT_THAT(measured.out, HasSubstr("Known figures: 3, all within tolerance."));
  expect_refused({"measure", scene("incline.gltf"), "--run", "rig.csv", "--times", "2"}, "without --times");
  const Outcome film = run({"player", scene("incline.gltf"), "--panel", "log:rig.csv", "--panel",
                            "log:ours.poses.txt", "--output", "both.html"});
  ASSERT_EQ(film.exit_code, 0) << film.err;
  // Both rows have the errors of the same poses.
  const auto errors_of = [&](const std::string& row) {
    const std::string line = film.out.substr(film.out.find(row));
    return line.substr(line.find("µm") - 5, 24);
  };
  EXPECT_EQ(errors_of("rig  rig.csv"), errors_of("A3  ours.poses.txt"));
  EXPECT_EQ(run({"render", "rig.csv", "--scene", scene("incline.gltf"), "--time", "1", "--size", "64x36"})
                .exit_code,
            0);
  EXPECT_FALSE(content("rig.f0060.png").empty());
}

TEST_F(PoseTableCommands, RefusalsAndCommandsArePanels) {
  // A simulator in which nothing moves, and one that cannot do the scene.
  write("still.py", R"(import csv, json, sys
scene = json.load(open(sys.argv[1]))
table = csv.writer(open(sys.argv[2], "w"))
table.writerow("t body x y z qw qx qy qz".split())
for t in (0, scene["duration"]):
    for body in scene["bodies"]:
        if body.get("kind") == "dynamic":
            table.writerow([t, body["name"], *body["position"], *body["orientation"]])
)");
  write("panels.toml",
        "[[panel]]\nshow = \"order-4\"\n"
        "[[panel]]\ncommand = [\"python3\", \"still.py\", \"{scene}\", \"{poses}\"]\n"
        "[[panel]]\ncommand = [\"python3\", \"-c\", \"exit('no motors')\", \"{poses}\"]\n");
  const Outcome film = run({"player", scene("incline.gltf"), "--panels", "panels.toml", "--duration", "1",
                            "--output", "film.html"});
  ASSERT_EQ(film.exit_code, 0) << film.err;
  EXPECT_THAT(film.out, HasSubstr("not simulated: it has contacts: its motion is not smooth"));
  EXPECT_THAT(film.out, HasSubstr("not simulated: python3 ended with exit code 1: no motors"));
  // Blocks that do not slide fall behind by decimetres.
  EXPECT_THAT(film.out, testing::ContainsRegex("\nstill .* [0-9]+ mm +[0-9]+ mm "));
  EXPECT_THAT(content("film.html"), HasSubstr("not simulated: it has contacts"));
}

/// Returns the block of Python of the page about formats.
std::string python_of_page() {
  std::ifstream stream(std::string(test::source_folder) + "/scenes/format.md");
  const std::string page(std::istreambuf_iterator<char>(stream), {});
  const std::size_t begin = page.find("```python\n", page.find("<!-- writer -->")) + 10;
  return page.substr(begin, page.find("```", begin) - begin);
}

TEST_F(PoseTableCommands, PythonOfPageWritesTable) {
  write("writer.py", python_of_page());
  ASSERT_EQ(std::system(("cd '" + folder().string() + "' && python3 writer.py").c_str()), 0);
  write("ball.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\no ball\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  EXPECT_THAT(run({"export", "fall.csv", "--scene", "ball.obj"}).out, HasSubstr("wrote fall.glb: 61 frames"));
}

}  // namespace
}  // namespace substep
