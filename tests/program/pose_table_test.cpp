// Tests every command that takes a run with runs of other programs.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "program.h"
#include "sim/log/file_output.h"
#include "tests/scene/example_scene.h"

namespace substep {
namespace {

class PoseTableCommands : public Program {
 protected:
  void SetUp() override { printed("run $S/incline.gltf --csv rig.csv --output ours.poses.txt"); }
};

TEST_F(PoseTableCommands, TableOfRunHasItsPoses) {
  expect("diff ours.poses.txt rig.csv --scene $S/incline.gltf", 1,
         {"author:  → rig\n", "largest over all poses: 0 m, "});
  const Json tumbling = Json::parse(content_of(scene("tumbling_body.gltf")).value());
  write("pivoting.gltf", test::edited(tumbling, "/nodes/3/$/motion/mass = 0").dump());
  printed("run pivoting.gltf --duration 0.1 --csv pivoting.csv --output pivoting.poses.txt");
  expect("diff pivoting.poses.txt pivoting.csv --scene pivoting.gltf", 1,
         {"all 7 frames have the same state"});
  ASSERT_EQ(command("cp rig.csv copy.csv").exit_code, 0);
  printed("diff rig.csv copy.csv --scene $S/incline.gltf");
  refuses("diff rig.csv rig.csv", "name the table's scene with --scene FILE");
  refuses("export rig.csv", "name the table's scene with --scene FILE");
  refuses("export rig.csv --scene $S/pendulum.gltf",
          "rig.csv:2: pendulum has no body 'rubber_block': there are rod");
}

TEST_F(PoseTableCommands, TableIsMeasuredAndFilmed) {
  const Outcome measured = expect("measure $S/incline.gltf --run rig.csv", 0,
                                  {"\nrig ", "Known figures: 3, all within tolerance."});
  EXPECT_THAT(measured.out, testing::Not(testing::HasSubstr("row solves")));
  refuses("measure $S/incline.gltf --run rig.csv --times 2", "--times excludes --run");
  const std::string film =
      printed("player $S/incline.gltf --panel log:rig.csv --panel log:ours.poses.txt --output both.html");
  // Both rows have the errors of the same poses, which are below the reference's uncertainty.
  const auto errors_of = [&](const std::string& row) {
    const std::string line = film.substr(film.find(row));
    return line.substr(line.find("≤"), 24);
  };
  EXPECT_EQ(errors_of("rig  rig.csv"), errors_of("A3  ours.poses.txt"));
  printed("render rig.csv --scene $S/incline.gltf --time 1 --size 64x36");
  EXPECT_FALSE(content("rig.f0060.png").empty());
}

TEST_F(PoseTableCommands, RefusalsAndCommandsArePanels) {
  // Write a simulator in which nothing moves, and one that refuses the scene.
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
  const Outcome film =
      expect("player $S/incline.gltf --panels panels.toml --duration 1 --output film.html", 0,
             {"not simulated: it has contacts: its motion is not smooth",
              "not simulated: python3 ended with exit code 1: no motors"});
  // Blocks that do not slide fall behind by decimetres.
  EXPECT_THAT(film.out, testing::ContainsRegex("\nstill .* [0-9]+ mm +[0-9]+ mm "));
  expect_content("film.html", {"not simulated: it has contacts"});
}

TEST_F(PoseTableCommands, PythonOfPageWritesTable) {
  const std::string page = content_of(scene("format.md")).value();
  const std::size_t begin = page.find("```python\n", page.find("<!-- writer -->")) + 10;
  write("writer.py", page.substr(begin, page.find("```", begin) - begin));
  ASSERT_EQ(command("python3 writer.py").exit_code, 0);
  write("ball.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\no ball\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  expect("export fall.csv --scene ball.obj", 0, {"wrote fall.glb: 61 frames"});
  printed("run ball.obj --copies 2 --duration 0.1 --output two.poses.txt --csv two.csv");
  printed("diff two.csv two.csv --scene ball.obj --copies 2");
  refuses("render two.poses.txt", "another version of ball.obj, or with other options for a mesh");
}

}  // namespace
}  // namespace substep
