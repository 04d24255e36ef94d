#include "golden/approval/approve.h"

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "sim/error.h"
#include "tests/error_message.h"
#include "tests/golden/small_suite.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

class ApproveTest : public testing::Test {
 protected:
  /// Returns every file below golden/ with its content.
  std::map<std::string, std::string> goldens() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(suite_.options.suite.parent_path())) {
      if (entry.is_regular_file()) files[entry.path().string()] = read_text(entry.path());
    }
    return files;
  }

  /// Returns why approving is refused, and expects that it wrote nothing.
  std::string refusal() {
    const auto before = goldens();
    const std::string message = test::message_of([&] { suite_.approve_failed(); });
    EXPECT_NE(message, "") << "was approved";
    EXPECT_EQ(goldens(), before);
    return message;
  }

  void change_light() { replace_in(suite_.scene(), "\"intensity\":3.0", "\"intensity\":2.5"); }

  SmallSuite suite_;
};

TEST_F(ApproveTest, MakesGoldensOnceWithProvenance) {
  suite_.run();
  const Approval first = suite_.approve_failed("the first ones");
  EXPECT_EQ(first.written.size(), 5U);  // poses, track, two pictures, sidecar
  const auto after_first = goldens();
  const Approval second = suite_.approve_failed("once more");
  EXPECT_TRUE(second.written.empty());
  EXPECT_EQ(second.already_good, std::vector<std::string>{"box_stack.a3"});
  EXPECT_EQ(goldens(), after_first);

  const auto sidecar = nlohmann::json::parse(read_text(suite_.sidecar()));
  EXPECT_EQ(sidecar.at("case"), "box_stack.a3");
  EXPECT_EQ(sidecar.at("approved").at("reason"), "the first ones");
  EXPECT_EQ(sidecar.at("approved").at("date").get<std::string>().size(), 10U);
  EXPECT_EQ(sidecar.at("images").size(), 2U);
  EXPECT_EQ(sidecar.at("images").at(0).at("pixels").get<std::string>().size(), 16U);
  EXPECT_FALSE(sidecar.at("made_with").at("renderer").get<std::string>().empty());
  EXPECT_FALSE(sidecar.at("made_with").at("compiler").get<std::string>().empty());
}

TEST_F(ApproveTest, WritesOnlyWhatDiffers) {
  suite_.make_goldens();
  const auto before = goldens();
  fs::remove(suite_.image(10));
  suite_.run();
  const Approval approval = suite_.approve_failed("found again");
  ASSERT_EQ(approval.written.size(), 2U);
  EXPECT_EQ(approval.written.at(0), suite_.image(10));
  EXPECT_EQ(approval.written.at(1), suite_.sidecar());
  auto after = goldens();
  after[suite_.sidecar().string()] = before.at(suite_.sidecar().string());
  EXPECT_EQ(after, before);
}

TEST_F(ApproveTest, ComparesPicturesByPixels) {
  suite_.run();
  const render::Image shown = render::read_png(suite_.shown("f0020.new.png"));
  suite_.approve_failed();
  EXPECT_EQ(render::read_png(suite_.image(20)).rgb, shown.rgb);
  EXPECT_EQ(read_text(suite_.image(20)), render::to_small_png(shown));
  // The same pixels in other bytes are the same golden.
  render::write_png(shown, suite_.image(20));
  const auto before = goldens();
  EXPECT_TRUE(suite_.approve_failed().written.empty());
  EXPECT_EQ(goldens(), before);
  EXPECT_EQ(suite_.run().cases.at(0).verdict, Verdict::pass);
}

TEST_F(ApproveTest, ContinuesAnInterruptedApproval) {
  suite_.make_goldens();
  const auto before = goldens();
  replace_in(suite_.scene(), "\"gravity\":[0.0,-9.81,0.0]", "\"gravity\":[3.0,9.81,0.0]");
  suite_.run();
  EXPECT_EQ(suite_.approve_failed().written.back(), suite_.sidecar());
  const auto after = goldens();
  // The approval was killed after the poses, and before the sidecar.
  const auto interrupt = [&] {
    for (const auto& [file, content] : before) {
      if (file != suite_.poses()) write_text(file, content);
    }
  };
  interrupt();
  suite_.approve_failed();
  EXPECT_EQ(goldens(), after);
  interrupt();
  EXPECT_EQ(suite_.run().cases.at(0).verdict, Verdict::golden_edited);
  suite_.approve_failed();
  EXPECT_EQ(suite_.run().cases.at(0).verdict, Verdict::pass);
}

TEST_F(ApproveTest, FailsTheCheckUntilTheSidecarIsWritten) {
  suite_.make_goldens();
  const auto interrupted_after = [&](const auto& change) {
    change();
    suite_.run();
    const std::string sidecar = read_text(suite_.sidecar());
    EXPECT_EQ(suite_.approve_failed().written.back(), suite_.sidecar());
    const auto whole = goldens();
    // It died when all files but the sidecar were the new ones.
    write_text(suite_.sidecar(), sidecar);
    EXPECT_EQ(suite_.run().cases.at(0).verdict, Verdict::golden_edited);
    suite_.approve_failed();
    EXPECT_EQ(goldens(), whole);
    EXPECT_EQ(suite_.run().cases.at(0).verdict, Verdict::pass);
  };
  interrupted_after([&] { suite_.repaint(); });  // pictures alone
  interrupted_after([&] { replace_in(suite_.options.suite, "tau = 0.6", "tau = 0.5"); });
}

TEST_F(ApproveTest, NeedsReasonNamesAndCheck) {
  EXPECT_NE(refusal().find("run 'substep check' first"), std::string::npos);
  suite_.run();
  ApproveOptions options = suite_.approval(" ");
  options.all_failed = true;
  EXPECT_THROW(approve(options), Error);
  options.reason = "good";
  options.all_failed = false;
  EXPECT_THROW(approve(options), Error);
  options.cases = {"box_stack.a4"};
  EXPECT_THROW(approve(options), Error);
  EXPECT_FALSE(fs::exists(suite_.poses()));
}

TEST_F(ApproveTest, RefusesChangedResults) {
  suite_.run();
  fs::copy_file(suite_.shown("f0020.new.png"), suite_.shown("f0010.new.png"),
                fs::copy_options::overwrite_existing);
  write_text(suite_.shown("f0010.new.png"), read_text(suite_.shown("f0010.new.png")) + " ");
  EXPECT_NE(refusal().find("f0010.new.png is no longer what the check left"), std::string::npos);
  fs::remove(suite_.shown("f0010.new.png"));
  EXPECT_NE(refusal().find("f0010.new.png is no longer what the check left"), std::string::npos);
}

TEST_F(ApproveTest, RefusesChangedGolden) {
  suite_.make_goldens();
  change_light();
  suite_.run();
  fs::copy_file(suite_.image(20), suite_.image(10), fs::copy_options::overwrite_existing);
  write_text(suite_.image(10), read_text(suite_.image(10)) + " ");
  EXPECT_NE(refusal().find("a3.f0010.png is no longer what the check saw"), std::string::npos);
}

TEST_F(ApproveTest, RefusesChangedSuite) {
  suite_.run();
  replace_in(suite_.options.suite, "images = [10, 20]", "images = [10]");
  EXPECT_NE(refusal().find("is not the suite file that was checked"), std::string::npos);
}

TEST_F(ApproveTest, RenewalKeepsDateAndReason) {
  suite_.make_goldens();
  auto sidecar = nlohmann::ordered_json::parse(read_text(suite_.sidecar()));
  sidecar["approved"] = {{"date", "2020-02-02"}, {"reason", "long ago"}};
  sidecar["made_with"]["compiler"] = "an old one";
  write_text(suite_.sidecar(), sidecar_text(sidecar));
  write_text(suite_.scene(), read_text(suite_.scene()) + "\n");  // the same scene in another file
  EXPECT_EQ(suite_.run().cases.at(0).verdict, Verdict::pass);
  ApproveOptions options = suite_.approval();
  options.cases = {"box_stack.a3"};
  EXPECT_EQ(approve(options).written, (std::vector<fs::path>{suite_.poses(), suite_.sidecar()}));
  const auto renewed = nlohmann::ordered_json::parse(read_text(suite_.sidecar()));
  EXPECT_NE(renewed.at("scene_hash"), sidecar.at("scene_hash"));
  EXPECT_EQ(renewed.at("approved"), sidecar.at("approved"));
  EXPECT_EQ(renewed.at("made_with"), sidecar.at("made_with"));
  EXPECT_EQ(suite_.run().cases.at(0).verdict, Verdict::pass);
  EXPECT_TRUE(approve(options).written.empty());
}

TEST_F(ApproveTest, RefusesDamagedResults) {
  suite_.run();
  write_text(suite_.options.output / "results.json", "{\"format\":");
  EXPECT_NE(refusal().find("is damaged"), std::string::npos);
  write_text(suite_.options.output / "results.json", "{\"format\": \"another\"}");
  EXPECT_NE(refusal().find("another version"), std::string::npos);
}

}  // namespace
}  // namespace substep::golden
