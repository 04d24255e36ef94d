/// Checks with another renderer than the pinned one. These tests are a program of their own, since a process
/// that has pinned the renderer keeps it.

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "render/image.h"
#include "render/renderer.h"
#include "tests/error_message.h"
#include "tests/golden/small_suite.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

class EnvironmentTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_FALSE(render::is_pinned_renderer());
    // Goldens of the pinned renderer cannot be approved here.
    const std::string suite = read_text(suite_.options.suite);
    replace_in(suite_.options.suite, "[defaults]\n", "[defaults]\nrenderer = \"any\"\n");
    suite_.make_goldens();
    write_text(suite_.options.suite, suite);
  }

  void change_pixel(int by) {
    render::Image golden = render::read_png(suite_.image(20));
    std::uint8_t& red = golden.pixel(31, 17)[0];
    red = static_cast<std::uint8_t>(red >= 128 ? red - by : red + by);
    write_png(golden, suite_.image(20));
    suite_.sign();
  }

  SmallSuite suite_;
};

TEST_F(EnvironmentTest, RefusesApproval) {
  fs::remove(suite_.image(20));
  suite_.run();
  const std::string message = test::message_of([&] { suite_.approve_failed(); });
  EXPECT_NE(message.find("not the pinned renderer"), std::string::npos) << message;
  EXPECT_FALSE(fs::exists(suite_.image(20)));
}

TEST_F(EnvironmentTest, PassesWithinToleranceWithNote) {
  change_pixel(1);
  const CheckResult result = suite_.run();
  EXPECT_EQ(result.cases.at(0).verdict, Verdict::pass);
  EXPECT_EQ(result.exit_code(), 0);
  ASSERT_EQ(result.cases.at(0).notes.size(), 1U);
  EXPECT_EQ(result.cases.at(0).notes.at(0), "frame 20 within tolerance: this is not the pinned renderer");
}

TEST_F(EnvironmentTest, BlamesEnvironmentBeyondTolerance) {
  change_pixel(100);
  const CheckResult result = suite_.run();
  EXPECT_EQ(result.cases.at(0).verdict, Verdict::environment);
  EXPECT_EQ(result.exit_code(), 3);
}

TEST_F(EnvironmentTest, JudgesSimulationExactly) {
  change_pixel(100);
  write_text(suite_.options.suite, read_text(suite_.options.suite) + "settings = { substeps = 3 }\n");
  const CheckResult result = suite_.run();
  EXPECT_EQ(result.cases.at(0).verdict, Verdict::simulation_changed);
  EXPECT_EQ(result.exit_code(), 1);
}

/// A suite whose pictures may be of any renderer, drawn by another than the pinned one.
class AnyRenderer : public testing::Test {
 protected:
  AnyRenderer() { replace_in(suite_.options.suite, "[defaults]\n", "[defaults]\nrenderer = \"any\"\n"); }

  /// Makes the goldens look as if another renderer had drawn them, `levels` off.
  void approve_elsewhere(int levels) {
    suite_.make_goldens();
    render::Image golden = render::read_png(suite_.image(20));
    std::uint8_t& red = golden.pixel(31, 17)[0];
    red = static_cast<std::uint8_t>(red >= 128 ? red - levels : red + levels);
    write_png(golden, suite_.image(20));
    suite_.sign();
    auto sidecar = nlohmann::ordered_json::parse(read_text(suite_.sidecar()));
    sidecar["made_with"]["platform"] = "another";
    write_text(suite_.sidecar(), sidecar_text(sidecar));
  }

  SmallSuite suite_;
};

TEST_F(AnyRenderer, ApprovedPlatformComparesExactly) {
  suite_.make_goldens();
  EXPECT_EQ(suite_.run().exit_code(), 0);
  render::Image golden = render::read_png(suite_.image(20));
  golden.pixel(31, 17)[0] ^= 1;
  write_png(golden, suite_.image(20));
  suite_.sign();
  const CheckResult result = suite_.run();
  EXPECT_EQ(result.cases.at(0).verdict, Verdict::renderer_changed) << result.cases.at(0).text;
}

TEST_F(AnyRenderer, ToleratesOtherPlatforms) {
  approve_elsewhere(1);
  const CheckResult result = suite_.run();
  EXPECT_EQ(result.cases.at(0).verdict, Verdict::pass) << result.cases.at(0).text;
  EXPECT_EQ(result.cases.at(0).notes.at(0),
            "frame 20 within tolerance: this is not the renderer that it was approved on");
}

TEST_F(AnyRenderer, ToleratesByFlip) {
  approve_elsewhere(100);
  EXPECT_EQ(suite_.run().cases.at(0).verdict, Verdict::environment);
  write_text(suite_.options.suite, read_text(suite_.options.suite) + "tolerance = { flip = 0.9 }\n");
  EXPECT_EQ(suite_.run().cases.at(0).verdict, Verdict::pass);
  replace_in(suite_.options.suite, "flip = 0.9", "flip = 0.01");
  EXPECT_EQ(suite_.run().cases.at(0).verdict, Verdict::environment);
}

}  // namespace
}  // namespace substep::golden
