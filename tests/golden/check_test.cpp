#include "golden/check/check.h"

#include <gtest/gtest.h>

#include <string>

#include "sim/error.h"
#include "tests/golden/small_suite.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class CheckTest : public testing::Test {
 protected:
  /// Checks, keeps the result, and expects a verdict.
  void expect(Verdict verdict) {
    result_ = suite_.run();
    EXPECT_EQ(result_.verdict, verdict) << name(result_.verdict) << "\n" << result_.text;
    EXPECT_EQ(result_.exit_code, verdict == Verdict::pass ? 0 : 1);
  }

  /// Replaces the hash of a frame in the golden pose log.
  void change_hash(int frame) {
    const std::string line = "\nframe " + std::to_string(frame) + " ";
    const std::string log = read_text(suite_.poses());
    const auto at = log.find(line) + line.size();
    const char digit = log.at(at) == '0' ? '1' : '0';
    replace_in(suite_.poses(), line + log.substr(at, 16), line + digit + log.substr(at + 1, 15));
    suite_.sign();
  }

  SmallSuite suite_;
  CheckResult result_;
};

TEST_F(CheckTest, FailsNewCaseWithoutWritingGoldens) {
  expect(Verdict::created);
  EXPECT_FALSE(fs::exists(suite_.golden("poses")));
  EXPECT_FALSE(fs::exists(suite_.golden("images")));
  EXPECT_TRUE(fs::exists(suite_.shown("actual.poses")));
  EXPECT_TRUE(fs::exists(suite_.shown("f0010.new.png")));
  EXPECT_TRUE(fs::exists(suite_.options.output / "results.json"));
}

TEST_F(CheckTest, PassesItsOwnGoldens) {
  suite_.make_goldens();
  for (int time = 0; time < 2; ++time) {
    expect(Verdict::pass);
    EXPECT_TRUE(result_.notes.empty());
    EXPECT_FALSE(fs::exists(suite_.shown("f0010.actual.png")));
  }
}

TEST_F(CheckTest, BlamesSimulationForAnotherState) {
  suite_.make_goldens();
  change_hash(13);
  expect(Verdict::simulation_changed);
  EXPECT_EQ(result_.poses.difference.first_frame, 13);
  for (const ImageResult& image : result_.images) {
    EXPECT_EQ(image.against_golden->image.judgement, Judgement::exact);
    EXPECT_EQ(image.new_poses->image.judgement, Judgement::exact);
  }
  EXPECT_THAT(result_.text, HasSubstr("frame 13 (0.217 s)"));
  EXPECT_THAT(result_.text, HasSubstr("only velocities differ"));
}

TEST_F(CheckTest, BlamesSimulationForAnotherSolution) {
  suite_.make_goldens();
  suite_.add_to_suite("settings = { substeps = 3 }");
  expect(Verdict::simulation_changed);
  EXPECT_EQ(result_.poses.difference.first_frame, 1);
  EXPECT_EQ(result_.poses.difference.first_full_frame, 10);
  EXPECT_EQ(result_.poses.motion.first.body.substr(0, 4), "box_");
  EXPECT_GT(result_.poses.difference.size, 0);
  EXPECT_THAT(result_.text, HasSubstr("VERDICT: simulation changed (renderer unchanged)"));
  EXPECT_THAT(result_.text, HasSubstr("body " + result_.poses.motion.first.body));
  EXPECT_THAT(result_.text, HasSubstr("header: substeps"));
  EXPECT_THAT(result_.text,
              testing::ContainsRegex("cause    settings changed: substeps [0-9]+, here 3; from"));
  EXPECT_TRUE(fs::exists(suite_.shown("f0020.new.png")));
}

TEST_F(CheckTest, NamesSettingThatSidecarLeavesOut) {
  suite_.make_goldens();
  suite_.add_to_suite("settings = { warm_start = 0.5 }");
  expect(Verdict::simulation_changed);
  EXPECT_THAT(result_.cause, testing::StartsWith("settings changed: warm_start 0, here 0.5; from frame"));
}

TEST_F(CheckTest, NotesAnotherVersionOfProgram) {
  suite_.make_goldens();
  change_hash(13);
  suite_.change_sidecar([](auto& json) { json["made_with"]["substep"] = "0.0.9"; });
  expect(Verdict::simulation_changed);
  EXPECT_THAT(result_.text, HasSubstr("golden made with substep 0.0.9, here "));
  suite_.change_sidecar([](auto& json) { json["made_with"].erase("substep"); });
  expect(Verdict::simulation_changed);
  EXPECT_TRUE(result_.notes.empty());
}

TEST_F(CheckTest, BlamesSimulationForMoreFrames) {
  suite_.make_goldens();
  replace_in(suite_.options.suite, "frames = 20", "frames = 30");
  expect(Verdict::simulation_changed);
  EXPECT_EQ(result_.poses.difference.first_frame, 21);
  EXPECT_THAT(result_.text, HasSubstr("golden has 21 frames, the run 31"));
  EXPECT_THAT(result_.text, HasSubstr("settings changed: frames 20, here 30; from frame 21 on"));
  EXPECT_THAT(read_text(suite_.shown("player.html")), HasSubstr("\"fate\":\"the golden run ends\""));
}

TEST_F(CheckTest, BlamesRendererForAnotherLight) {
  suite_.make_goldens();
  suite_.repaint();
  expect(Verdict::renderer_changed);
  EXPECT_TRUE(result_.poses.passes);
  for (const ImageResult& image : result_.images) {
    EXPECT_GT(image.against_golden->image.differing, image.against_golden->image.pixels / 10);
    EXPECT_TRUE(image.against_golden->flip.has_value());
  }
  for (const char* file : {"f0010.expected.png", "f0010.actual.png", "f0010.flip.png"})
    EXPECT_TRUE(fs::exists(suite_.shown(file))) << file;
  EXPECT_FALSE(fs::exists(suite_.shown("f0010.new.png")));
  EXPECT_THAT(result_.text, HasSubstr("VERDICT: renderer changed (simulation unchanged)"));
}

TEST_F(CheckTest, BlamesBoth) {
  suite_.make_goldens();
  suite_.repaint();
  change_hash(20);
  expect(Verdict::both_changed);
  // Equal poses by an equal renderer: the simulation causes none of the difference.
  EXPECT_EQ(result_.images.at(0).new_poses->image.judgement, Judgement::exact);
}

TEST_F(CheckTest, BlamesSceneForLightInItsFile) {
  suite_.make_goldens();
  suite_.change_light();
  replace_in(suite_.scene(), "\"extensionsUsed\": [", "\"extensionsUsed\": [\"EXT_other\",");
  expect(Verdict::scene_changed);
  EXPECT_THAT(result_.text, HasSubstr("the extension 'EXT_other' is ignored"));
  EXPECT_EQ(result_.cause, "pose, field of view, brightness or colour of light");
  EXPECT_TRUE(result_.poses.passes);
  EXPECT_FALSE(result_.images.at(0).passes);
  change_hash(13);
  expect(Verdict::scene_changed);
  EXPECT_THAT(result_.text, HasSubstr("the simulation changed, too"));
}

TEST_F(CheckTest, BlamesSceneForSubstepsInItsFile) {
  suite_.make_goldens();
  replace_in(suite_.scene(), "\"substep\":{", "\"substep\":{\"substeps\":12,");
  expect(Verdict::scene_changed);
  EXPECT_EQ(result_.cause, "sub-steps");
  EXPECT_EQ(result_.notes, std::vector<std::string>{"golden made with substeps 10, here 12"});
}

TEST_F(CheckTest, BlamesLoadingOfTheSameFile) {
  suite_.make_goldens();
  // Record the digest of a loader that gives box_3 another mass.
  suite_.change_sidecar([](auto& json) {
    std::string mass = json.at("parts").at("mass");
    mass[12] = mass[12] == '0' ? '1' : '0';
    json["parts"]["mass"] = mass;
  });
  expect(Verdict::pass);  // it moves as it did
  change_hash(1);
  expect(Verdict::loading_changed);
  EXPECT_EQ(result_.cause, "mass, inertia or gravity factor of box_3");
}

TEST_F(CheckTest, ReportsEachMissingGolden) {
  suite_.make_goldens();
  for (const fs::path& file : {suite_.track(), suite_.sidecar(), suite_.image(10), suite_.poses()}) {
    fs::remove(file);
    expect(Verdict::missing);
    if (file == suite_.track() || file == suite_.sidecar()) {
      EXPECT_THAT(result_.text, HasSubstr("there is no " + file.filename().string()));
    }
    suite_.approve_failed();
    expect(Verdict::pass);
  }
}

TEST_F(CheckTest, ReportsPosesMissingAtAnotherRate) {
  suite_.make_goldens();
  replace_in(suite_.options.suite, "images = [10, 20]\n", "images = [5, 20]\nfull_every = 5\n");
  fs::rename(suite_.image(10), suite_.image(5));
  expect(Verdict::missing);
  EXPECT_THAT(result_.text, HasSubstr("the golden log has no poses at frame 5"));
  suite_.approve_failed();
  expect(Verdict::pass);
}

TEST_F(CheckTest, ApprovalByNameRenewsTrack) {
  suite_.make_goldens();
  const std::string track = read_text(suite_.track());
  const std::string suite = read_text(suite_.options.suite);
  suite_.add_to_suite("settings = { substeps = 3 }");
  suite_.run();
  write_text(suite_.track(), read_text(suite_.shown("actual.track")));
  write_text(suite_.options.suite, suite);
  suite_.sign();
  expect(Verdict::pass);
  EXPECT_EQ(suite_.approve_named({"box_stack.a3"}).written,
            (std::vector<fs::path>{suite_.track(), suite_.sidecar()}));
  EXPECT_EQ(read_text(suite_.track()), track);
}

TEST_F(CheckTest, ReportsDamagedScene) {
  suite_.make_goldens();
  write_text(suite_.scene(), read_text(suite_.scene()).substr(0, 1000));
  expect(Verdict::error);
  EXPECT_THAT(result_.cause, HasSubstr("box_stack.gltf"));
  EXPECT_THAT(result_.cause, testing::Not(HasSubstr("\n")));
  EXPECT_THAT(result_.text, HasSubstr("approve  not from this check"));
  EXPECT_THAT(suite_.result_text("junit.xml"), HasSubstr("errors=\"1\""));
}

TEST_F(CheckTest, ReportsRemedyForDamagedGoldens) {
  suite_.make_goldens();
  for (const fs::path& file : {suite_.sidecar(), suite_.poses(), suite_.track(), suite_.image(10)}) {
    write_text(file, read_text(file).substr(0, 200));
    expect(Verdict::error);
    EXPECT_THAT(result_.cause, HasSubstr(file.filename().string()));
    EXPECT_THAT(result_.cause, testing::EndsWith("put back the golden that was approved, or delete it, then "
                                                 "check and approve again"));
    fs::remove(file);
    expect(Verdict::missing);
    suite_.approve_failed();
    expect(Verdict::pass);
  }
}

TEST_F(CheckTest, KeepsResultsUntilSuiteAndNamesAreRead) {
  suite_.make_goldens();
  suite_.run();
  const std::string results = suite_.result_text("results.json");
  suite_.options.cases = {"typo"};
  EXPECT_THROW(suite_.run(), Error);
  write_text(suite_.options.suite, "[[case]]\nscene = 7\n");
  EXPECT_THROW(suite_.run(), Error);
  EXPECT_EQ(suite_.result_text("results.json"), results);
  EXPECT_TRUE(fs::exists(suite_.options.output / "report.html"));
  EXPECT_THAT(suite_.result_text("junit.xml"), HasSubstr("tests=\"1\" failures=\"0\" errors=\"1\""));
}

TEST_F(CheckTest, FailsOrphansButFilesOfFileManagers) {
  suite_.make_goldens();
  for (const char* file : {"images/.DS_Store", "poses/box_stack/Thumbs.db", "poses/desktop.ini"})
    write_text(suite_.golden(file), "");
  expect(Verdict::pass);
  EXPECT_TRUE(result_.orphans.empty());
  write_text(suite_.golden("poses/box_stack/a9.poses"), "");
  const CheckResult result = suite_.run();
  EXPECT_EQ(result.verdict, Verdict::pass);
  ASSERT_EQ(result.orphans.size(), 1U);
  EXPECT_EQ(result.orphans.at(0).filename(), "a9.poses");
  EXPECT_EQ(result.exit_code, 1);
}

TEST_F(CheckTest, FindsOneEditedPixel) {
  suite_.make_goldens();
  suite_.change_pixel(1);
  expect(Verdict::golden_edited);
  EXPECT_EQ(result_.cause, "a3.f0020.png differs from what was approved");
  EXPECT_TRUE(result_.images.at(0).passes);
  const ImageComparison& found = result_.images.at(1).against_golden->image;
  EXPECT_EQ(found.differing, 1);
  EXPECT_EQ(found.max, 1);
  EXPECT_EQ(found.max_x, 31);
  EXPECT_EQ(found.max_y, 17);
  for (const char* const words :
       {"1 px differ", "but this renderer must be exact", "differs from the approved one"})
    EXPECT_THAT(result_.text, HasSubstr(words));
}

TEST_F(CheckTest, FindsEditedPoses) {
  suite_.make_goldens();
  const std::string log = read_text(suite_.poses());
  const auto pose = log.find("\npose ", log.find("\nframe 20 "));
  const auto digit = log.find('.', pose) + 1;
  replace_in(suite_.poses(), log.substr(pose, digit + 2 - pose),
             log.substr(pose, digit - pose) + (log.at(digit) == '1' ? "2" : "1") + log.substr(digit + 1, 1));
  expect(Verdict::golden_edited);
  EXPECT_EQ(result_.cause, "a3.poses differs from what was approved");
  EXPECT_FALSE(result_.poses.passes);
  EXPECT_THAT(result_.text, HasSubstr("it was edited"));
}

}  // namespace
}  // namespace substep::golden
