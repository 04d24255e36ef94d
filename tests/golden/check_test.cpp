#include "golden/check/check.h"

#include <gtest/gtest.h>

#include <string>

#include "render/image.h"
#include "render/renderer.h"
#include "sim/error.h"
#include "tests/golden/small_suite.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

class CheckTest : public testing::Test {
 protected:
  CaseResult run() {
    const CheckResult result = suite_.run();
    exit_code_ = result.exit_code();
    EXPECT_EQ(result.cases.size(), 1U);
    text_ = result.cases.at(0).text;
    return result.cases.at(0);
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

  bool says(const std::string& words) const { return text_.find(words) != std::string::npos; }

  SmallSuite suite_;
  int exit_code_ = -1;
  std::string text_;
};

TEST_F(CheckTest, FailsNewCaseWithoutWritingGoldens) {
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::created);
  EXPECT_EQ(exit_code_, 1);
  EXPECT_FALSE(fs::exists(suite_.golden("poses")));
  EXPECT_FALSE(fs::exists(suite_.golden("images")));
  EXPECT_TRUE(fs::exists(suite_.shown("actual.poses")));
  EXPECT_TRUE(fs::exists(suite_.shown("f0010.new.png")));
  EXPECT_TRUE(fs::exists(suite_.options.output / "results.json"));
}

TEST_F(CheckTest, PassesItsOwnGoldens) {
  suite_.make_goldens();
  for (int time = 0; time < 2; ++time) {
    const CaseResult result = run();
    EXPECT_EQ(result.verdict, Verdict::pass) << text_;
    EXPECT_EQ(exit_code_, 0);
    EXPECT_TRUE(result.notes.empty());
    EXPECT_FALSE(fs::exists(suite_.shown("f0010.actual.png")));
  }
}

TEST_F(CheckTest, BlamesSimulationForAnotherState) {
  suite_.make_goldens();
  change_hash(13);
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::simulation_changed);
  EXPECT_EQ(exit_code_, 1);
  EXPECT_EQ(result.poses.difference.first_frame, 13);
  for (const ImageResult& image : result.images) {
    EXPECT_EQ(image.against_golden->image.judgement, Judgement::exact);
    EXPECT_EQ(image.new_poses->image.judgement, Judgement::exact);
  }
  EXPECT_TRUE(says("frame 13 (0.217 s)")) << text_;
  EXPECT_TRUE(says("only velocities differ")) << text_;
}

TEST_F(CheckTest, BlamesSimulationForAnotherSolution) {
  suite_.make_goldens();
  write_text(suite_.options.suite, read_text(suite_.options.suite) + "settings = { substeps = 3 }\n");
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::simulation_changed);
  EXPECT_EQ(result.poses.difference.first_frame, 1);
  EXPECT_EQ(result.poses.difference.first_full_frame, 10);
  EXPECT_EQ(result.poses.motion.first.body.substr(0, 4), "box_");
  EXPECT_GT(result.poses.difference.size, 0);
  EXPECT_TRUE(says("VERDICT: simulation changed (renderer unchanged)")) << text_;
  EXPECT_TRUE(says("body " + result.poses.motion.first.body)) << text_;
  EXPECT_TRUE(says("header: substeps")) << text_;
  EXPECT_TRUE(fs::exists(suite_.shown("f0020.new.png")));
}

TEST_F(CheckTest, BlamesRendererForAnotherLight) {
  suite_.make_goldens();
  suite_.repaint();
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::renderer_changed);
  EXPECT_EQ(exit_code_, 1);
  EXPECT_TRUE(result.poses.passes);
  for (const ImageResult& image : result.images) {
    EXPECT_GT(image.against_golden->image.differing, image.against_golden->image.pixels / 10);
    EXPECT_TRUE(image.against_golden->flip.has_value());
  }
  for (const char* file : {"f0010.expected.png", "f0010.actual.png", "f0010.flip.png"}) {
    EXPECT_TRUE(fs::exists(suite_.shown(file))) << file;
  }
  EXPECT_FALSE(fs::exists(suite_.shown("f0010.new.png")));
  EXPECT_TRUE(says("VERDICT: renderer changed (simulation unchanged)")) << text_;
}

TEST_F(CheckTest, BlamesSceneForLightInItsFile) {
  suite_.make_goldens();
  replace_in(suite_.scene(), "\"intensity\":3.0", "\"intensity\":2.5");
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::scene_changed) << text_;
  EXPECT_EQ(result.cause, "placement or strength of light");
  EXPECT_TRUE(result.poses.passes);
  EXPECT_FALSE(result.images.at(0).passes);
}

TEST_F(CheckTest, PassesReformattedScene) {
  suite_.make_goldens();
  write_text(suite_.scene(), read_text(suite_.scene()) + "\n");
  EXPECT_EQ(run().verdict, Verdict::pass) << text_;
}

TEST_F(CheckTest, ReportsSimulationBesideSceneChange) {
  suite_.make_goldens();
  change_hash(13);
  replace_in(suite_.scene(), "\"intensity\":3.0", "\"intensity\":2.5");
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::scene_changed) << text_;
  EXPECT_TRUE(says("the simulation changed, too")) << text_;
}

TEST_F(CheckTest, BlamesLoadingOfTheSameFile) {
  suite_.make_goldens();
  // Note the mass as a loader would that took box_3 for heavier.
  auto sidecar = nlohmann::ordered_json::parse(read_text(suite_.sidecar()));
  std::string mass = sidecar.at("parts").at("mass");
  mass[12] = mass[12] == '0' ? '1' : '0';
  sidecar["parts"]["mass"] = mass;
  write_text(suite_.sidecar(), sidecar_text(sidecar));
  EXPECT_EQ(run().verdict, Verdict::pass);  // it moves as it did
  change_hash(1);
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::loading_changed) << text_;
  EXPECT_EQ(result.cause, "mass or inertia of box_3");
}

TEST_F(CheckTest, ReportsEachMissingGolden) {
  suite_.make_goldens();
  for (const fs::path& file : {suite_.track(), suite_.sidecar(), suite_.image(10), suite_.poses()}) {
    fs::remove(file);
    EXPECT_EQ(run().verdict, Verdict::missing) << file;
    EXPECT_EQ(exit_code_, 1);
    if (file == suite_.track() || file == suite_.sidecar()) {
      EXPECT_TRUE(says("there is no " + file.filename().string())) << text_;
    }
    suite_.approve_failed();
    EXPECT_EQ(run().verdict, Verdict::pass) << text_;
  }
}

TEST_F(CheckTest, ApprovalByNameRenewsTrack) {
  suite_.make_goldens();
  const std::string track = read_text(suite_.track());
  const std::string suite = read_text(suite_.options.suite);
  write_text(suite_.options.suite, suite + "settings = { substeps = 3 }\n");
  run();
  fs::copy_file(suite_.shown("actual.track"), suite_.track(), fs::copy_options::overwrite_existing);
  write_text(suite_.options.suite, suite);
  suite_.sign();
  EXPECT_EQ(run().verdict, Verdict::pass) << text_;
  ApproveOptions options = suite_.approval();
  options.cases = {"box_stack.a3"};
  EXPECT_EQ(approve(options).written, (std::vector<fs::path>{suite_.track(), suite_.sidecar()}));
  EXPECT_EQ(read_text(suite_.track()), track);
}

TEST_F(CheckTest, ReportsDamagedScene) {
  suite_.make_goldens();
  write_text(suite_.scene(), read_text(suite_.scene()).substr(0, 1000));
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::error);
  EXPECT_EQ(exit_code_, 1);
  EXPECT_NE(result.cause.find("box_stack.gltf"), std::string::npos) << result.cause;
  EXPECT_EQ(result.cause.find('\n'), std::string::npos);
  EXPECT_TRUE(says("approve  not from this check")) << text_;
  const std::string xml = read_text(suite_.options.output / "junit.xml");
  EXPECT_NE(xml.find("errors=\"1\""), std::string::npos) << xml;
}

TEST_F(CheckTest, ReportsDamagedSidecar) {
  suite_.make_goldens();
  write_text(suite_.sidecar(), read_text(suite_.sidecar()).substr(0, 200));
  EXPECT_EQ(run().verdict, Verdict::error);
  EXPECT_TRUE(says("a3.json: is damaged")) << text_;
}

TEST_F(CheckTest, RemovesStaleResultsOfUnreadableSuite) {
  suite_.make_goldens();
  run();
  write_text(suite_.options.suite, "[[case]]\nscene = 7\n");
  EXPECT_THROW(suite_.run(), Error);
  EXPECT_FALSE(fs::exists(suite_.options.output / "results.json"));
  EXPECT_FALSE(fs::exists(suite_.options.output / "report.html"));
  const std::string xml = read_text(suite_.options.output / "junit.xml");
  EXPECT_NE(xml.find("tests=\"1\" failures=\"0\" errors=\"1\""), std::string::npos) << xml;
}

TEST_F(CheckTest, IgnoresFilesOfFileManagers) {
  suite_.make_goldens();
  for (const char* file : {"images/.DS_Store", "poses/box_stack/Thumbs.db", "poses/desktop.ini"}) {
    write_text(suite_.golden(file), "");
  }
  EXPECT_TRUE(suite_.run().orphans.empty());
}

TEST_F(CheckTest, FindsOneEditedPixel) {
  suite_.make_goldens();
  render::Image golden = render::read_png(suite_.image(20));
  std::uint8_t& red = golden.pixel(31, 17)[0];
  red = static_cast<std::uint8_t>(red ^ 1);
  render::write_png(golden, suite_.image(20));
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::golden_edited);
  EXPECT_EQ(result.cause, "a3.f0020.png is not what was approved");
  EXPECT_TRUE(result.images.at(0).passes);
  const ImageComparison& found = result.images.at(1).against_golden->image;
  EXPECT_EQ(found.differing, 1);
  EXPECT_EQ(found.max, 1);
  EXPECT_EQ(found.max_x, 31);
  EXPECT_EQ(found.max_y, 17);
  EXPECT_TRUE(says("1 px differ")) << text_;
  EXPECT_TRUE(says("exact is the rule on this renderer")) << text_;
  EXPECT_TRUE(says("is not the one that was approved")) << text_;
}

TEST_F(CheckTest, BlamesBoth) {
  suite_.make_goldens();
  suite_.repaint();
  change_hash(20);
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::both_changed);
  // The same poses by the same renderer: none of the difference is the simulation's.
  EXPECT_EQ(result.images.at(0).new_poses->image.judgement, Judgement::exact);
}

TEST_F(CheckTest, FindsEditedPoses) {
  suite_.make_goldens();
  const std::string log = read_text(suite_.poses());
  const auto pose = log.find("\npose ", log.find("\nframe 20 "));
  const auto digit = log.find('.', pose) + 1;
  replace_in(suite_.poses(), log.substr(pose, digit + 2 - pose),
             log.substr(pose, digit - pose) + (log.at(digit) == '1' ? "2" : "1") + log.substr(digit + 1, 1));
  const CaseResult result = run();
  EXPECT_FALSE(result.poses.passes);
  EXPECT_EQ(result.verdict, Verdict::golden_edited);
  EXPECT_TRUE(says("it was edited")) << text_;
}

TEST_F(CheckTest, FailsOrphans) {
  suite_.make_goldens();
  write_text(suite_.golden("poses/box_stack/a9.poses"), "");
  const CheckResult result = suite_.run();
  EXPECT_EQ(result.cases.at(0).verdict, Verdict::pass);
  ASSERT_EQ(result.orphans.size(), 1U);
  EXPECT_EQ(result.orphans.at(0).filename(), "a9.poses");
  EXPECT_EQ(result.exit_code(), 1);
}

TEST_F(CheckTest, ReportsPosesMissingAtAnotherRate) {
  suite_.make_goldens();
  replace_in(suite_.options.suite, "images = [10, 20]\n", "images = [5, 20]\nfull_every = 5\n");
  fs::rename(suite_.image(10), suite_.golden("images/box_stack/a3.f0005.png"));
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::missing);
  EXPECT_TRUE(says("the golden log has no poses at frame 5")) << text_;
  suite_.approve_failed();
  EXPECT_EQ(run().verdict, Verdict::pass) << text_;
}

TEST_F(CheckTest, BlamesSimulationForMoreFrames) {
  suite_.make_goldens();
  replace_in(suite_.options.suite, "frames = 20", "frames = 30");
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::simulation_changed);
  EXPECT_EQ(result.poses.difference.first_frame, 21);
  EXPECT_TRUE(says("golden has 21 frames, the run 31")) << text_;
}

}  // namespace
}  // namespace substep::golden
