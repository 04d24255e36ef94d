#include "golden/approval/approve.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "sim/error.h"
#include "tests/error_message.h"
#include "tests/golden/small_suite.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

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

  const auto sidecar = suite_.sidecar_json();
  EXPECT_EQ(sidecar.at("case"), "box_stack.a3");
  EXPECT_EQ(sidecar.at("approved").at("reason"), "the first ones");
  EXPECT_EQ(sidecar.at("approved").at("date").get<std::string>().size(), 10U);
  EXPECT_EQ(sidecar.at("images").size(), 2U);
  EXPECT_EQ(sidecar.at("images").at(0).at("pixels").get<std::string>().size(), 16U);
  EXPECT_FALSE(sidecar.at("made_with").at("renderer").get<std::string>().empty());
  for (const char* const key : {"substep", "compiler"})
    EXPECT_FALSE(sidecar.at("made_with").at(key).get<std::string>().empty());
}

TEST_F(ApproveTest, WritesOnlyDifferingFiles) {
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
  // Equal pixels in other bytes are an equal golden.
  render::write_png(shown, suite_.image(20));
  const auto before = goldens();
  EXPECT_TRUE(suite_.approve_failed().written.empty());
  EXPECT_EQ(goldens(), before);
  EXPECT_EQ(suite_.run().verdict, Verdict::pass);
}

TEST_F(ApproveTest, ContinuesAnInterruptedApproval) {
  suite_.make_goldens();
  const auto before = goldens();
  replace_in(suite_.scene(), "\"gravity\":[0.0,-9.81,0.0]", "\"gravity\":[3.0,9.81,0.0]");
  suite_.run();
  EXPECT_EQ(suite_.approve_failed().written.back(), suite_.sidecar());
  const auto after = goldens();
  for (const bool is_checked : {false, true}) {
    // The approval was killed after the poses, and before the sidecar.
    for (const auto& [file, content] : before) {
      if (file != suite_.poses()) write_text(file, content);
    }
    if (is_checked) {
      EXPECT_EQ(suite_.run().verdict, Verdict::golden_edited);
    }
    suite_.approve_failed();
    if (!is_checked) {
      EXPECT_EQ(goldens(), after);
    }
  }
  EXPECT_EQ(suite_.run().verdict, Verdict::pass);
}

TEST_F(ApproveTest, FailsTheCheckUntilTheSidecarIsWritten) {
  suite_.make_goldens();
  const auto interrupted_after = [&](const auto& change) {
    change();
    suite_.run();
    const std::string sidecar = read_text(suite_.sidecar());
    EXPECT_EQ(suite_.approve_failed().written.back(), suite_.sidecar());
    const auto whole = goldens();
    // The approval was killed when all files but the sidecar were the new ones.
    write_text(suite_.sidecar(), sidecar);
    EXPECT_EQ(suite_.run().verdict, Verdict::golden_edited);
    suite_.approve_failed();
    EXPECT_EQ(goldens(), whole);
    EXPECT_EQ(suite_.run().verdict, Verdict::pass);
  };
  interrupted_after([&] { suite_.repaint(); });  // pictures alone
  interrupted_after([&] { replace_in(suite_.options.suite, "tau = 0.6", "tau = 0.5"); });
}

TEST_F(ApproveTest, NeedsReasonNamesAndCheck) {
  EXPECT_THAT(refusal(), HasSubstr("run 'substep check' first"));
  suite_.run();
  EXPECT_THROW(suite_.approve_failed(" "), Error);
  EXPECT_THROW(suite_.approve_named({}), Error);
  EXPECT_EQ(test::message_of([&] { suite_.approve_named({"box_stack.a4"}); }),
            "the last check had no case 'box_stack.a4'; it had box_stack.a3");
  EXPECT_FALSE(fs::exists(suite_.poses()));
  suite_.approve_named({"box_stack"});
  EXPECT_TRUE(fs::exists(suite_.poses()));
}

TEST_F(ApproveTest, RefusesChangedResults) {
  suite_.run();
  write_text(suite_.shown("f0010.new.png"), read_text(suite_.shown("f0020.new.png")) + " ");
  EXPECT_THAT(refusal(), HasSubstr("f0010.new.png is no longer what the check left"));
  fs::remove(suite_.shown("f0010.new.png"));
  EXPECT_THAT(refusal(), HasSubstr("f0010.new.png is no longer what the check left"));
}

TEST_F(ApproveTest, RefusesChangedGoldenOrSuite) {
  suite_.make_goldens();
  suite_.change_light();
  suite_.run();
  write_text(suite_.image(10), read_text(suite_.image(20)) + " ");
  EXPECT_THAT(refusal(), HasSubstr("a3.f0010.png is no longer what the check saw"));
  replace_in(suite_.options.suite, "images = [10, 20]", "images = [10]");
  EXPECT_THAT(refusal(), HasSubstr("is not the suite file that was checked"));
}

TEST_F(ApproveTest, RefusesChangedScene) {
  suite_.run();
  suite_.change_light();
  EXPECT_THAT(refusal(), HasSubstr("its scene is no longer what the check loaded"));
}

TEST_F(ApproveTest, RenewalKeepsDateAndReason) {
  suite_.make_goldens();
  suite_.change_sidecar([](auto& json) {
    json["approved"] = {{"date", "2020-02-02"}, {"reason", "long ago"}};
    json["made_with"]["compiler"] = "an old one";
  });
  const auto sidecar = suite_.sidecar_json();
  write_text(suite_.scene(), read_text(suite_.scene()) + "\n");  // the same scene in another file
  EXPECT_EQ(suite_.run().verdict, Verdict::pass);
  EXPECT_EQ(suite_.approve_named({"box_stack.a3"}).written,
            (std::vector<fs::path>{suite_.poses(), suite_.sidecar()}));
  const auto renewed = suite_.sidecar_json();
  EXPECT_NE(renewed.at("scene_hash"), sidecar.at("scene_hash"));
  EXPECT_EQ(renewed.at("approved"), sidecar.at("approved"));
  EXPECT_EQ(renewed.at("made_with"), sidecar.at("made_with"));
  EXPECT_EQ(suite_.run().verdict, Verdict::pass);
  EXPECT_TRUE(suite_.approve_named({"box_stack.a3"}).written.empty());
}

TEST_F(ApproveTest, RefusesDamagedResults) {
  suite_.run();
  replace_in(suite_.options.output / "results.json", "\"ended\": true", "\"ended\": false");
  EXPECT_THAT(refusal(), HasSubstr("out: the check did not end: 1 of 1 cases were checked"));
  write_text(suite_.options.output / "results.json", "{\"format\":");
  EXPECT_THAT(refusal(), HasSubstr("is damaged"));
  write_text(suite_.options.output / "results.json", "{\"format\": \"another\"}");
  EXPECT_THAT(refusal(), HasSubstr("another version"));
}

}  // namespace
}  // namespace substep::golden
