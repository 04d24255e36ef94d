#include "golden/suite/suite.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "golden/suite/sidecar.h"
#include "sim/error.h"
#include "tests/error_message.h"
#include "tests/temporary_folder.h"

namespace substep::golden {
namespace {

class SuiteTest : public testing::Test {
 protected:
  Suite read(const std::string& text) {
    folder_.write("suite.toml", text);
    return read_suite(folder_.path() / "suite.toml");
  }

  /// Returns the message, with file and line but without the folder.
  std::string message(const std::string& text) {
    const std::string what = test::message_of([&] { read(text); });
    const std::string prefix = (folder_.path() / "").string();
    EXPECT_TRUE(what.starts_with(prefix)) << what;
    return what.substr(std::min(what.size(), prefix.size()));
  }

  /// Expects a message on a case of a scene s.gltf with more lines.
  void expect_refused(const std::string& lines, const std::string& complaint) {
    EXPECT_EQ(message("[[case]]\nscene = \"s.gltf\"\n" + lines + "\n"), "suite.toml:" + complaint);
  }

  test::TemporaryFolder folder_;
};

TEST_F(SuiteTest, CasesInheritDefaults) {
  const Suite suite = read(R"(
[defaults]
frames = 60
full_every = 20
images = [60, 20]
size = [160, 90]
algorithms = ["a2", "a5"]
tolerance = { hard = 61, level = 5, flip = 0.25 }
pose_tolerance = { position = 0.1, orientation = 0.2, energy = 0.3, penetration = 0.4, resting = 5 }
[defaults.settings]
substeps = 8
[defaults.settings.a2]
iterations = 30
[[case]]
scene = "../scenes/box_stack.gltf"
[[case]]
scene = "../scenes/box_stack.gltf"
variant = "stable"
algorithms = ["a5"]
frames = 50
images = [50]
tolerance = { count = 3 }
[case.settings]
joints = "stable"
step = 0.01
[case.settings.a5]
substeps = 2
)");
  ASSERT_EQ(suite.cases.size(), 3U);
  const SuiteCase& a2 = suite.cases[0];
  EXPECT_EQ(a2.name, "box_stack.a2");
  EXPECT_EQ(a2.scene, (folder_.path() / "../scenes/box_stack.gltf").lexically_normal());
  EXPECT_EQ(a2.settings.algorithm, Algorithm::a2);
  EXPECT_EQ(std::pair(a2.settings.iterations, a2.settings.substeps), std::pair(30, 8));
  EXPECT_EQ(a2.own_settings, (std::vector<std::string_view>{"substeps", "iterations"}));
  EXPECT_EQ(a2.frames, 60);
  EXPECT_EQ(a2.images, (std::vector<int>{20, 60}));
  EXPECT_EQ(std::pair(a2.width, a2.height), std::pair(160, 90));
  EXPECT_EQ(a2.tolerance.hard, 61);
  EXPECT_EQ(a2.tolerance.level, 5);
  EXPECT_EQ(a2.tolerance.flip, 0.25);
  EXPECT_EQ(a2.tolerance.count, ImageTolerance{}.count);
  ASSERT_TRUE(a2.pose_tolerance);
  EXPECT_EQ(a2.pose_tolerance->position, 0.1);
  EXPECT_EQ(a2.pose_tolerance->orientation, 0.2);
  EXPECT_EQ(a2.pose_tolerance->energy, 0.3);
  EXPECT_EQ(a2.pose_tolerance->penetration, 0.4);
  EXPECT_EQ(a2.pose_tolerance->resting, 5);
  EXPECT_EQ(a2.pose_file, folder_.path() / "poses/box_stack/a2.poses");
  EXPECT_EQ(a2.image_file(60), folder_.path() / "images/box_stack/a2.f0060.png");
  EXPECT_EQ(suite.cases[1].settings.iterations, 1);
  const SuiteCase& stable = suite.cases[2];
  EXPECT_EQ(stable.name, "box_stack.a5-stable");
  EXPECT_EQ(stable.settings.joints, Joints::stable);
  EXPECT_EQ(stable.own_settings.back(), "substeps");
  EXPECT_EQ(stable.tolerance.level, 5);
  EXPECT_EQ(stable.tolerance.count, 3);
  EXPECT_EQ(stable.image_file(50), folder_.path() / "images/box_stack/a5-stable.f0050.png");
  // The suite's settings hold, and the scene's in their absence.
  Scene scene;
  scene.step = 0.5;
  scene.substeps = 40;
  const Settings of_a2 = a2.settings_for(scene);
  const Settings of_stable = stable.settings_for(scene);
  EXPECT_EQ(std::pair(of_a2.step, of_a2.iterations), std::pair(0.5, 30));
  EXPECT_EQ(std::pair(of_stable.step, of_stable.substeps), std::pair(0.01, 2));
}

TEST_F(SuiteTest, NamesMistakesWithTheirLine) {
  const std::string keys =
      "step, substeps, iterations, tau, kappa, contact_tau, contact_kappa, joints, relaxation, tolerance, "
      "warm_start, contact_hertz, joint_hertz, alpha, beta";
  const std::string frames = "3: 'frames' must be a whole number from 1 to 100000";
  const std::string flip = "3: 'flip' must be a number, at least 0";
  EXPECT_EQ(message("# nothing\n"), "suite.toml: has no [[case]]");
  EXPECT_EQ(message("case = 3\n"), "suite.toml:1: 'case' must be tables: [[case]]");
  expect_refused(
      "framez = 3",
      "3: unknown key 'framez' in [[case]]; known are scene, variant, poses, frames, full_every, "
      "images, size, algorithms, command, tolerance, pose_tolerance, settings, time_limit, renderer");
  for (const char* const value : {"0", "2.5", "\"2\""})
    expect_refused(fmt::format("frames = {}", value), frames);
  for (const int frame : {25, 130}) {
    expect_refused(
        fmt::format("images = [{}]", frame),
        fmt::format("1: image of frame {}: must be a multiple of full_every = 10 or the last frame, "
                    "120",
                    frame));
  }
  expect_refused("images = 3", "3: 'images' must be a list that is not empty");
  expect_refused("size = [320]", "3: 'size' must be [width, height]");
  expect_refused("algorithms = [\"a6\"]",
                 "3: entries of 'algorithms' must be a1, a2, a3, a4, a5, soft or avbd");
  expect_refused("tolerance = { flip = -1 }", flip);
  expect_refused("tolerance = { flip = nan }", flip);
  expect_refused("settings = { joints = \"stiff\" }", "3: 'joints' must be rows, plain or stable");
  expect_refused("[case.settings.a9]", "3: unknown key 'a9' in settings; known are " + keys +
                                           ", and a table for one of a1, a2, a3, a4, a5, soft, avbd");
  expect_refused("[case.settings.a3]\nsubstep = 2",
                 "4: unknown key 'substep' in settings.a3; known are " + keys);
  expect_refused("[case.settings]\nkappa = 0", "1: s.a1: kappa 0: must be above 0 and at most 2");
  EXPECT_EQ(message("[[case]]\nframes = 3\n"), "suite.toml:1: [[case]] without a 'scene'");
  EXPECT_EQ(message("[[case]]\nscene = \"a.b.gltf\"\n"),
            "suite.toml:2: scene 'a.b.gltf': its name must be of letters, digits, _ and -");
  expect_refused("variant = \"../x\"", "3: 'variant' must be of letters, digits, _ and -");
  expect_refused("[[case]]\nscene = \"s.gltf\"",
                 "3: there is a case s.a1 already: give one of them a 'variant'");
  EXPECT_TRUE(message("[defaults\n").starts_with("suite.toml:1: "));
  expect_refused("poses = \"a.csv\"\nalgorithms = [\"a1\"]",
                 "1: give one of 'algorithms', 'command' and 'poses'");
  expect_refused("poses = \"a.poses.txt\"", "3: 'poses' must be a pose table, *.csv");
  expect_refused(
      "poses = \"a5.csv\"",
      "1: 'a5' cannot name a run: its file needs a name of letters, digits, _ and -, other than an "
      "algorithm's");
  expect_refused("command = []", "3: 'command' must be a list that is not empty");
  EXPECT_THROW(read_suite(folder_.path() / "none.toml"), Error);
}

TEST_F(SuiteTest, ReadsRunsMadeElsewhere) {
  folder_.write("arm.py", "");
  const Suite suite = read(R"(
[defaults]
command = ["python3", "arm.py", "{scene}", "{poses}"]
settings = { step = 0.01, iterations = 7, a2 = { iterations = 9 } }

[[case]]
scene = "s.gltf"

[[case]]
scene = "s.gltf"
variant = "fast"
settings = { step = 0.1 }

[[case]]
scene = "s.gltf"
poses = "runs/arm_2.csv"

[[case]]
scene = "s.gltf"
algorithms = ["a5"]
)");
  ASSERT_EQ(suite.cases.size(), 4U);
  const SuiteCase& command = suite.cases[0];
  EXPECT_EQ(command.name, "s.arm");
  EXPECT_EQ(command.author, "arm");
  EXPECT_EQ(command.command[1], folder_.path() / "arm.py");
  EXPECT_EQ(command.settings.step, 0.01);
  EXPECT_EQ(command.settings.iterations, 7);  // that of A2 is for A2
  EXPECT_EQ(command.pose_file, folder_.path() / "poses/s/arm.poses");
  EXPECT_EQ(suite.cases[1].name, "s.arm-fast");
  EXPECT_EQ(suite.cases[1].settings.step, 0.1);
  EXPECT_EQ(suite.cases[2].name, "s.arm_2");
  EXPECT_EQ(suite.cases[2].poses, folder_.path() / "runs/arm_2.csv");
  EXPECT_TRUE(suite.cases[2].command.empty());
  EXPECT_EQ(suite.cases[3].name, "s.a5");
  EXPECT_TRUE(suite.cases[3].author.empty() && suite.cases[3].command.empty());
}

TEST_F(SuiteTest, SelectsByCaseOrScene) {
  const Suite suite =
      read("[[case]]\nscene = \"one.gltf\"\n[[case]]\nscene = \"two.gltf\"\nalgorithms = [\"a3\"]\n");
  EXPECT_EQ(select(suite, {}).size(), 6U);
  EXPECT_EQ(select(suite, {"one"}).size(), 5U);
  const auto chosen = select(suite, {"two.a3", "one.a1"});
  ASSERT_EQ(chosen.size(), 2U);
  EXPECT_EQ(chosen[0].name, "one.a1");
  EXPECT_EQ(chosen[1].name, "two.a3");
  EXPECT_THROW(select(suite, {"two.a1"}), Error);
}

TEST_F(SuiteTest, RejectsDamagedSidecar) {
  const std::string good = R"({"scene_hash":"1","made_with":{"platform":""},"parts":{},)"
                           R"("poses":{"log_hash":"","track_hash":""},"images":[]})";
  const std::filesystem::path file = folder_.path() / "a3.json";
  const auto complaint = [&](const std::string& text) {
    folder_.write("a3.json", text);
    return test::message_of([&] { read_sidecar(file); });
  };
  EXPECT_EQ(complaint(good), "");
  for (const std::string& text :
       {std::string(), std::string("not JSON"), std::string("[]"), std::string("{}"),
        good.substr(0, good.size() - 2), std::string("{\"scene_hash\":7}")}) {
    EXPECT_EQ(complaint(text), file.string() + ": is damaged") << text;
  }
  EXPECT_EQ(complaint("{\"scene_hash\":\"2\"," + good.substr(1)),
            file.string() + ": the key 'scene_hash' stands twice in one object");
  EXPECT_EQ(read_sidecar(folder_.path() / "missing.json").scene_hash, "");
}

TEST_F(SuiteTest, FindsOrphans) {
  const Suite suite = read("[[case]]\nscene = \"one.gltf\"\nalgorithms = [\"a3\"]\nimages = [60]\n");
  EXPECT_TRUE(orphans(suite).empty());
  folder_.write("poses/one/a3.poses", "");
  folder_.write("images/one/a3.f0060.png", "");
  folder_.write("images/one/a3.json", "{\"scene_hash\":\"\",\"made_with\":{},\"images\":[]}");
  EXPECT_TRUE(orphans(suite).empty());
  folder_.write("images/one/a3.f0120.png", "");
  folder_.write("poses/gone/a1.poses", "");
  const auto found = orphans(suite);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0], folder_.path() / "images/one/a3.f0120.png");
  EXPECT_EQ(found[1], folder_.path() / "poses/gone/a1.poses");
}

TEST_F(SuiteTest, ListsUnreadableFolderOfNoCaseAsOrphan) {
  using std::filesystem::perms;
  const Suite suite = read("[[case]]\nscene = \"one.gltf\"\nalgorithms = [\"a3\"]\n");
  const std::filesystem::path locked = folder_.write("poses/locked/a3.poses", "").parent_path();
  const std::filesystem::path of_case = folder_.write("poses/one/a3.poses", "").parent_path();
  std::filesystem::permissions(folder_.path(), perms::all);
  for (const auto& folder : {locked, of_case}) std::filesystem::permissions(folder, perms::none);
  // Root reads every folder, so look as user `nobody`.
  const bool is_root = ::geteuid() == 0;
  if (is_root) {
    ASSERT_EQ(::seteuid(65534), 0);
  }
  std::vector<std::filesystem::path> found;
  EXPECT_NO_THROW(found = orphans(suite));
  if (is_root) {
    ASSERT_EQ(::seteuid(0), 0);
  }
  for (const auto& folder : {locked, of_case}) std::filesystem::permissions(folder, perms::owner_all);
  EXPECT_EQ(found, std::vector{locked});
}

}  // namespace
}  // namespace substep::golden
