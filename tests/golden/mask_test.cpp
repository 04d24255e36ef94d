#include "golden/compare/mask.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "golden/check/check.h"
#include "golden/report/report.h"
#include "sim/error.h"
#include "tests/golden/small_suite.h"

namespace substep {
namespace {

constexpr int width = 8;
constexpr int height = 6;

Image grey() {
  Image image(width, height);
  std::fill(image.rgb.begin(), image.rgb.end(), std::uint8_t{100});
  return image;
}

/// An image of bodies: the world, and body 1 at a single pixel.
Image one_body_at(int x, int y) {
  Image bodies(width, height);
  for (std::size_t i = 0; i < bodies.rgb.size(); i += 3) bodies.rgb[i] = 1;
  bodies.pixel(x, y)[0] = 2;
  return bodies;
}

Mask box_mask(PixelBox box) {
  Mask mask;
  mask.box = box;
  mask.reason = "a test";
  return mask;
}

class Masks : public testing::Test {
 protected:
  MaskedPicture apply(std::vector<Mask> masks) const {
    return masked(grey(), actual_, one_body_at(4, 3), masks, {"world", "rotor"});
  }

  Image actual_ = grey();
};

TEST_F(Masks, ABoxHidesWhatDiffersInItAndNothingElse) {
  actual_.pixel(2, 1)[1] = 140;
  actual_.pixel(5, 4)[0] = 101;
  const MaskedPicture result = apply({box_mask({1, 1, 3, 2})});
  EXPECT_EQ(compare(result.expected, actual_).above[0], 1);
  ASSERT_EQ(result.parts.size(), 1U);
  EXPECT_EQ(result.parts[0].text(), "box [1, 1, 3, 2] (a test): 1 of 6 px differ, most by 40 levels");
  EXPECT_TRUE(result.parts[0].passes);
}

TEST_F(Masks, ABodyIsItsPixelsAndThoseNextToThem) {
  Mask mask;
  mask.body = "rotor";
  mask.reason = "it turns";
  actual_.pixel(3, 2)[0] = 90;  // next to it, where its edge is blended
  actual_.pixel(6, 3)[0] = 90;  // two pixels off
  const MaskedPicture result = apply({mask});
  EXPECT_EQ(result.parts[0].pixels, 9);
  EXPECT_EQ(result.parts[0].differing, 1);
  const ImageComparison rest = compare(result.expected, actual_);
  EXPECT_EQ(rest.above[0], 1);
  EXPECT_EQ(rest.max_x, 6);
}

TEST_F(Masks, AToleranceHoldsWithinTheMask) {
  Mask mask = box_mask({0, 0, 4, 4});
  mask.tolerance.emplace();
  mask.tolerance->hard = 50;
  mask.tolerance->level = 5;
  mask.tolerance->count = 1;
  actual_.pixel(0, 0)[0] = 140;
  EXPECT_TRUE(apply({mask}).parts[0].passes);
  EXPECT_EQ(compare(apply({mask}).expected, actual_).above[0], 0);
  actual_.pixel(1, 0)[0] = 106;
  MaskedPicture result = apply({mask});
  EXPECT_FALSE(result.parts[0].passes);
  EXPECT_EQ(result.parts[0].text(),
            "box [0, 0, 4, 4] (a test): 2 of 16 px differ, most by 40 levels, 2 px > 5 levels; beyond its "
            "tolerance, 1 px > 5 levels, none > 50");
  // What fails in a mask is seen as everything else.
  EXPECT_EQ(compare(result.expected, actual_).above[0], 2);
  actual_ = grey();
  actual_.pixel(0, 0)[0] = 151;
  EXPECT_FALSE(apply({mask}).parts[0].passes);
}

TEST_F(Masks, SomethingMustBeLeftToCompare) {
  EXPECT_THROW(apply({box_mask({0, 0, width, 3}), box_mask({0, 3, width, 3})}), Error);
  EXPECT_NO_THROW(apply({box_mask({0, 0, width, height - 1})}));
}

/// A case some of whose goldens are others by now.
class MaskedCase : public testing::Test {
 protected:
  MaskedCase() : suite_("bouncing_balls", 40) { suite_.make_goldens(); }

  /// To the case's table.
  void add(const std::string& line) const {
    write_text(suite_.options.suite, read_text(suite_.options.suite) + line + "\n");
  }

  void change_pixel(int x, int y, int by) const {
    Image golden = read_png(suite_.image(40));
    std::uint8_t& red = golden.pixel(x, y)[0];
    red = static_cast<std::uint8_t>(red < 128 ? red + by : red - by);
    write_png(golden, suite_.image(40));
    suite_.sign();
  }

  CaseResult run() { return suite_.run().cases.at(0); }

  std::string page() const { return read_text(report_file(suite_.options.output)); }

  SmallSuite suite_;
};

TEST_F(MaskedCase, WhatDiffersUnderAMaskIsSaidAndIsNoFailure) {
  change_pixel(31, 17, 9);
  EXPECT_EQ(run().verdict, Verdict::renderer_changed);
  add(R"(masks = [{ box = [30, 10, 5, 20], reason = "a clock" }])");
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::pass) << result.text;
  ASSERT_EQ(result.notes.size(), 1U);
  EXPECT_EQ(result.notes[0],
            "frame 40, masked: box [30, 10, 5, 20] (a clock): 1 of 100 px differ, most by 9 levels");
  EXPECT_NE(page().find("2 masked parts of pictures and bodies with tolerances of their own; 1 differ"),
            std::string::npos);
  EXPECT_NE(page().find("1 of 100 px differ, most by 9 levels"), std::string::npos);
  // Nothing of what is masked becomes golden by itself.
  ApproveOptions options = suite_.approval();
  options.renews = true;
  EXPECT_TRUE(approve(options).written.empty());
}

TEST_F(MaskedCase, WhatDiffersBesideAMaskFailsAsBefore) {
  change_pixel(31, 17, 9);
  change_pixel(50, 40, 3);
  add(R"(masks = [{ box = [30, 10, 5, 20], reason = "a clock" }])");
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::renderer_changed);
  EXPECT_EQ(result.images.at(1).against_golden->image.above[0], 1);
  EXPECT_EQ(result.images.at(1).against_golden->image.max_x, 50);
  EXPECT_NE(result.text.find("frame 40, masked: box [30, 10, 5, 20] (a clock): 1 of 100 px"),
            std::string::npos);
}

TEST_F(MaskedCase, BeyondTheMasksOwnToleranceItFails) {
  change_pixel(31, 17, 9);
  const std::string mask =
      R"(masks = [{ box = [30, 10, 5, 20], reason = "noise", tolerance = { level = 5, count = )";
  add(mask + "1 } }]");
  EXPECT_EQ(run().verdict, Verdict::pass);
  replace_in(suite_.options.suite, "count = 1", "count = 0");
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::renderer_changed);
  EXPECT_NE(result.text.find("1 px > 5 levels; beyond its tolerance, 0 px > 5 levels, none > 64"),
            std::string::npos)
      << result.text;
  EXPECT_NE(page().find("<mark>1 of 100 px"), std::string::npos);
}

TEST_F(MaskedCase, TheRestIsJudgedAsIfTheMaskedWereNotThere) {
  // More than half of the picture is masked, and all of the rest is in another light.
  suite_.repaint();
  add(R"(masks = [{ box = [60, 0, 100, 90], reason = "most of it" }])");
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::renderer_changed);
  EXPECT_EQ(result.cause, "light, camera or sky");
  std::int64_t pixels = 0;
  for (const BodyBlame& body : result.images.at(1).against_golden->blame->bodies) pixels += body.pixels;
  EXPECT_LE(pixels, 60 * 90);
}

TEST_F(MaskedCase, AMaskOfABodyThatIsNotThereIsAnError) {
  add(R"(masks = [{ body = "ball_9", reason = "x" }])");
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::error);
  EXPECT_EQ(result.cause.find("the mask 'ball_9' is of no body of the scene: it has ball_0 ball_1"), 0U)
      << result.cause;
}

TEST_F(MaskedCase, AMaskOfABodyThatNoPictureShowsIsAnError) {
  add(R"(masks = [{ body = "ball_4", reason = "x" }])");
  EXPECT_EQ(run().verdict, Verdict::pass);
  // Out of the picture.
  replace_in(suite_.scene(), "\"yfov\":", "\"yfov\":0.001,\"was\":");
  const CaseResult result = run();
  EXPECT_EQ(result.cause, "the mask of body ball_4 covers nothing: none of the case's pictures shows it");
}

TEST_F(MaskedCase, ABodyHasAToleranceOfItsOwn) {
  replace_in(suite_.scene(), "\"restitution\":0.5", "\"restitution\":0.4");
  const CaseResult exact = run();
  ASSERT_FALSE(exact.poses.passes);
  const std::string body = exact.poses.motion.first.body;
  ASSERT_EQ(exact.poses.motion.first.bodies, std::vector<std::string>{body});
  const std::string own = "body_tolerances = [{ body = \"" + body + "\", reason = \"it may\", position = ";
  add(own + "0.5 }]");
  const CaseResult result = run();
  EXPECT_EQ(result.verdict, Verdict::pass) << result.text;
  const double most = result.poses.motion.deviations.at(0).position;
  EXPECT_GT(most, 0.01);
  ASSERT_FALSE(result.notes.empty());
  EXPECT_EQ(result.notes.back(), fmt::format("body {} (it may): differs by up to {:.2g} m and 0 rad; its own "
                                             "tolerance is 0.5 m and 0.001 rad",
                                             body, most));
  EXPECT_NE(page().find("poses of body " + body), std::string::npos);
  replace_in(suite_.options.suite, "position = 0.5", "position = 0.001");
  EXPECT_EQ(run().poses.motion.judgement, PoseJudgement::poses);
}

TEST_F(MaskedCase, TheOtherBodiesMustBeExactThen) {
  add(R"(body_tolerances = [{ body = "ball_0", reason = "it may", position = 0.5 }])");
  replace_in(suite_.scene(), "\"restitution\":0.5", "\"restitution\":0.4");
  const CaseResult result = run();
  EXPECT_EQ(result.poses.motion.judgement, PoseJudgement::poses);
  EXPECT_NE(result.poses.motion.limit.find("changed, and has no tolerance of its own"), std::string::npos);
  replace_in(suite_.options.suite, "ball_0", "nobody");
  EXPECT_EQ(run().cause.find("the tolerance 'nobody' is of no body of the scene"), 0U);
}

}  // namespace
}  // namespace substep
