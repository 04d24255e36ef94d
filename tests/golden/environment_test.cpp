/// Checks with another renderer than the pinned one. These tests are a program of their own, since a process
/// that has pinned the renderer keeps it.

#include <gtest/gtest.h>

#include <string>

#include "render/renderer.h"
#include "tests/error_message.h"
#include "tests/golden/small_suite.h"

namespace substep::golden {
namespace {

/// A suite that accepts pictures of any renderer, drawn by another than the pinned one.
class AnyRenderer : public testing::Test {
 protected:
  AnyRenderer() {
    EXPECT_FALSE(render::is_pinned_renderer());
    replace_in(suite_.options.suite, "[defaults]\n", "[defaults]\nrenderer = \"any\"\n");
    suite_.make_goldens();
  }

  /// Makes the goldens look as if another renderer had drawn them, `levels` off.
  void approve_elsewhere(int levels) {
    suite_.change_pixel(levels);
    suite_.sign();
    suite_.change_sidecar([](auto& json) { json["made_with"]["platform"] = "another"; });
  }

  void expect(Verdict verdict, int code, const std::vector<std::string>& notes = {}) {
    const CheckResult result = suite_.run();
    EXPECT_EQ(result.verdict, verdict) << result.text;
    EXPECT_EQ(result.exit_code, code);
    if (!notes.empty()) {
      EXPECT_EQ(result.notes, notes);
    }
  }

  SmallSuite suite_;
};

TEST_F(AnyRenderer, ApprovedPlatformComparesExactly) {
  expect(Verdict::pass, 0);
  suite_.change_pixel(1);
  suite_.sign();
  expect(Verdict::renderer_changed, 1);
}

TEST_F(AnyRenderer, ToleratesOtherPlatforms) {
  approve_elsewhere(1);
  EXPECT_EQ(suite_.run().notes.at(0),
            "frame 20 within tolerance: this is not the renderer that it was approved on");
  expect(Verdict::pass, 0);
}

TEST_F(AnyRenderer, ToleratesByFlip) {
  approve_elsewhere(100);
  expect(Verdict::environment, 3);
  suite_.add_to_suite("tolerance = { flip = 0.9 }");
  expect(Verdict::pass, 0);
  replace_in(suite_.options.suite, "flip = 0.9", "flip = 0.01");
  expect(Verdict::environment, 3);
  EXPECT_THAT(suite_.run().text, testing::HasSubstr("fails by FLIP"));
}

/// A suite for the pinned renderer, whose goldens were approved with renderer = "any".
class EnvironmentTest : public AnyRenderer {
 protected:
  EnvironmentTest() { replace_in(suite_.options.suite, "renderer = \"any\"\n", ""); }
};

TEST_F(EnvironmentTest, RefusesApproval) {
  std::filesystem::remove(suite_.image(20));
  suite_.run();
  EXPECT_THAT(test::message_of([&] { suite_.approve_failed(); }),
              testing::HasSubstr("not the pinned renderer"));
  EXPECT_FALSE(std::filesystem::exists(suite_.image(20)));
}

TEST_F(EnvironmentTest, PassesWithinToleranceWithNote) {
  suite_.change_pixel(1);
  suite_.sign();
  expect(Verdict::pass, 0, {"frame 20 within tolerance: this is not the pinned renderer"});
}

TEST_F(EnvironmentTest, BlamesEnvironmentOrSimulationBeyondTolerance) {
  suite_.change_pixel(100);
  suite_.sign();
  expect(Verdict::environment, 3);
  suite_.add_to_suite("settings = { substeps = 3 }");
  expect(Verdict::simulation_changed, 1);
}

}  // namespace
}  // namespace substep::golden
