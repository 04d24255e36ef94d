// Frames of films: their layout, strips and overlays.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "render/text.h"
#include "render/video/composition.h"
#include "render/video/film_camera.h"
#include "render/video/overlay.h"
#include "render/video/strips.h"
#include "render/video/time_sheet.h"
#include "render/video/titles.h"
#include "sim/error.h"
#include "sim/measure/motion.h"
#include "tests/scene_files.h"

namespace substep::render {
namespace {

/// Returns A1 to A5 and the reference in a scene.
Comparison compared(const Scene& scene, double duration, const QuantityChoice& quantities = {}) {
  ComparisonSettings settings;
  Settings base;
  base.step = settings.step = scene.step;
  const auto settings_of = [&](Algorithm algorithm) {
    base.algorithm = algorithm;
    return base;
  };
  settings.panels = default_panels({settings_of, true});
  settings.duration = duration;
  settings.quantities = quantities;
  return simulate_comparison(scene, settings);
}

Image frame_of(const Composition& composition, int k) {
  const Image picture(composition.picture_width(), composition.picture_height());
  return composition.frame(k, std::vector<Image>(6, picture));
}

TEST(Composition, CutsLongTitles) {
  const Comparison comparison = compared(scene_named("pendulum"), 0.2);
  const Image brief = frame_of(Composition(comparison, "test", 640, 360), 6);
  const Image full = frame_of(Composition(comparison, std::string(160, 'm'), 640, 360), 6);
  // The clock and the frame's number have at least 90 pixels.
  for (int y = 0; y < 20; ++y) {
    for (int x = 640 - 90; x < 640; ++x)
      ASSERT_EQ(brief.pixel(x, y)[0], full.pixel(x, y)[0]) << x << " " << y;
  }
}

int pixels_of(const Image& image, const Color& color) {
  int count = 0;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
    const auto is_near = [&](std::size_t c) { return std::abs(image.rgb[i + c] - color[c]) < 30; };
    count += is_near(0) && is_near(1) && is_near(2) ? 1 : 0;
  }
  return count;
}

TEST(Composition, MarksDivergedRun) {
  Comparison comparison = compared(scene_named("pendulum"), 0.2);
  // Returns the reddest pixel in the middle of the second panel's picture.
  const auto reddest = [&] {
    const Image image = frame_of(Composition(comparison, "test", 640, 360), 6);
    int most = 0;
    for (int y = 75; y < 135; ++y) {
      for (int x = image.width / 3; x < 2 * image.width / 3; ++x) {
        const std::uint8_t* const p = image.pixel(x, y);
        if (p[1] < 140 && p[2] < 110) most = std::max(most, static_cast<int>(p[0]));
      }
    }
    return most;
  };
  EXPECT_LT(reddest(), 100);  // measured 15
  comparison.runs[1].diverged = 0.1;
  comparison.runs[1].poses.resize(3);
  comparison.runs[1].errors.resize(3);
  EXPECT_GT(reddest(), 240);  // measured 255
}

TEST(Composition, ArrangesPanelsByNumberAndFrameShape) {
  using Rows = std::vector<int>;
  const std::array<Rows, 9> wide{{{1}, {2}, {3}, {2, 2}, {3, 2}, {3, 3}, {4, 3}, {4, 4}, {5, 4}}};
  for (int count = 1; count <= 9; ++count)
    EXPECT_EQ(rows_for(count, 1268, 654, 110), wide.at(static_cast<std::size_t>(count - 1))) << count;
  EXPECT_EQ(rows_for(2, 720, 1200, 100), (Rows{1, 1}));
  EXPECT_EQ(rows_for(5, 608, 1032, 80), (Rows{2, 2, 1}));
  EXPECT_EQ(rows_for(6, 1080, 1032, 100), (Rows{2, 2, 2}));
}

TEST(Composition, FillsFramesOfAnyShape) {
  const Comparison comparison = compared(scene_named("pendulum"), 0);
  for (const auto& [width, height] :
       {std::pair(720, 720), std::pair(404, 720), std::pair(1280, 320), std::pair(360, 640)}) {
    const Composition composition(comparison, "a title that is rather long for some of them", width, height);
    EXPECT_EQ(frame_of(composition, 0).width, width);
    EXPECT_GT(6 * composition.picture_width() * composition.picture_height(), width * height / 4)
        << width << "x" << height;
  }
  EXPECT_THROW(Composition(comparison, "test", 1281, 720), Error);
  EXPECT_THROW(Composition(comparison, "test", 300, 160), Error);
  EXPECT_NO_THROW(Composition(comparison, "test", 320, 180));
}

TEST(Composition, WrapsALongKey) {
  const Comparison comparison = compared(scene_named("pendulum"), 0);
  std::vector<KeyEntry> key(10, {"one of many items    ", film_colors::quiet});
  const Color magenta{255, 0, 255};
  key.emplace_back("■", magenta);
  const Composition composition(comparison, "test", 360, 640, key);
  EXPECT_GT(pixels_of(frame_of(composition, 0), magenta), 4);
}

TEST(Composition, StacksStrips) {
  const Comparison comparison = compared(scene_named("pendulum"), 0.2, {.gap = true, .energy = true});
  const Composition one(comparison, "test", 1280, 720);
  const Composition two(comparison, "test", 1280, 720, {}, strips_named({"error", "gap", "gap"}));
  EXPECT_EQ(one.picture_height() - two.picture_height(), 62);
  EXPECT_NO_THROW(frame_of(two, 3));
  EXPECT_THROW(strips_named({"height"}), Error);
}

TEST(Labels, HaveThreeDigitsAndAUnit) {
  for (const auto& [metres, text] :
       {std::pair(0.0, "0"), std::pair(1e-9, "< 1 µm"), std::pair(1.234e-6, "1.23 µm"),
        std::pair(0.99949e-3, "999 µm"), std::pair(0.99951e-3, "1.00 mm"), std::pair(0.0456, "45.6 mm"),
        std::pair(0.456, "456 mm"), std::pair(1.5, "1.50 m"), std::pair(1234.0, "1.23 km"),
        std::pair(1e300, "> 1000 km")}) {
    EXPECT_EQ(length_label(metres), text);
  }
  EXPECT_EQ(error_label(0.002, 0.001), "2.00 mm");
  EXPECT_EQ(error_label(0.001, 0.002), "≤ 2.00 mm");
  EXPECT_EQ(error_label(0, 2e-7), "< 1 µm");
  EXPECT_EQ(error_label(0, 0), "0");
  EXPECT_EQ(energy_label(-0.0123), "−12.3 mJ");
  EXPECT_EQ(energy_label(1234), "+1.23 kJ");
  EXPECT_EQ(energy_label(0), "0 J");
  // Energies of diverged runs are no losses.
  EXPECT_EQ(energy_label(NAN), "> 1000 MJ");
  EXPECT_EQ((StripAxis{.is_logarithmic = false, .unit = "m"}.label(NAN)), "> 10⁶ m");
}

TEST(ErrorTable, BoundsErrorsBelowUncertainty) {
  Comparison comparison;
  comparison.reference.emplace().uncertainty = {0, 0.002};
  render::Run& run = comparison.runs.emplace_back();
  run.errors = {0, 0.001};
  run.rms_error = 0.0007;
  const std::vector<std::string> row = table_of(comparison, false).rows.at(0);
  EXPECT_EQ(row[1], "≤ 2.00 mm");
  EXPECT_EQ(row[2], "≤ 2.00 mm");
}

TEST(StripAxis, HoldsErrorsInAtMostFiveDecades) {
  Comparison comparison;
  render::Run& run = comparison.runs.emplace_back();
  run.errors = {0, 2e-3, 5e-2, 0.3};
  StripAxis axis = axis_of(comparison, Strip::error);
  EXPECT_EQ(axis.lower, -3);
  EXPECT_EQ(axis.upper, 0);
  EXPECT_DOUBLE_EQ(axis.height(0.1), 2.0 / 3);
  EXPECT_EQ(axis.height(0), 0);
  EXPECT_EQ(axis.height(1e9), 1);
  run.errors = {1e-12, 1e-12, 1e12};
  axis = axis_of(comparison, Strip::error);
  EXPECT_EQ(axis.lower, -3);
  EXPECT_EQ(axis.upper, 2);
  run.errors = {0, 0};
  axis = axis_of(comparison, Strip::error);
  EXPECT_LT(axis.lower, axis.upper);
}

TEST(StripAxis, HoldsEnergiesOfBothSignsButNoExplosion) {
  Comparison comparison;
  std::vector<double>& energies = comparison.runs.emplace_back().quantities.energies;
  for (int i = 0; i < 100; ++i) energies.push_back(-0.03 * i);
  StripAxis axis = axis_of(comparison, Strip::energy);
  EXPECT_EQ(axis.low, -5);
  EXPECT_EQ(axis.high, 0.5);  // room for the line of the start
  EXPECT_EQ(axis.height(-5), 0);
  EXPECT_NEAR(axis.height(0), 5 / 5.5, 1e-12);
  energies.back() = 1e30;
  axis = axis_of(comparison, Strip::energy);
  EXPECT_LT(axis.high, 50);
  EXPECT_EQ(axis.height(1e30), 1);
  // Energy that is lost in the last hundredth is held.
  energies.assign(100, 0);
  energies.back() = -0.7;
  axis = axis_of(comparison, Strip::energy);
  EXPECT_DOUBLE_EQ(axis.low, -1);
  EXPECT_DOUBLE_EQ(axis.high, 0.1);
}

TEST(StripPainter, MarksCurvesBeyondTheAxis) {
  Comparison comparison;
  comparison.times.resize(3);
  render::Run& run = comparison.runs.emplace_back();
  const StripAxis axis{.is_logarithmic = false, .low = -1, .high = 1, .unit = "J"};
  const StripBox strip{Strip::energy, axis, {0, 0, 300, 64}, {10, 10, 150, 44}};
  // Returns whether something is drawn in rows above or below the plot.
  const auto is_marked = [&](double value, int first_row) {
    run.quantities.energies = {0, value, 0};
    Image image(300, 64);
    StripPainter{comparison}.draw(image, strip, 0, 2);
    int brightest = 0;
    for (int y = first_row; y < first_row + 7; ++y) {
      for (int x = 0; x < 160; ++x) brightest = std::max(brightest, static_cast<int>(image.pixel(x, y)[2]));
    }
    return brightest > 100;
  };
  for (const double value : {1 + 1e-9, 5.0, -5.0}) {
    EXPECT_EQ(is_marked(value, 0), value == 5.0) << value;
    EXPECT_EQ(is_marked(value, 57), value == -5.0) << value;
  }
}

/// Tests overlays on a grey picture of a pendulum.
class Overlay : public testing::Test {
 protected:
  Overlay() {
    std::fill(picture_.rgb.begin(), picture_.rgb.end(), std::uint8_t{100});
    fill_rectangle(bodies_, 100, 60, 40, 40, {2, 0, 0});  // a square of body 1 before the sky
    run_.poses = {initial_state(scene_).q};
  }

  /// Returns the colour of a pixel under the overlay.
  std::array<int, 3> color_at(int x, int y, const char* overlay, const OverlayFrame& frame) const {
    Image picture = picture_;
    draw_overlays(picture, overlays_named({overlay}), frame);
    EXPECT_EQ(picture.pixel(10, 10)[0], 100);
    const std::uint8_t* const p = picture.pixel(x, y);
    return {p[0], p[1], p[2]};
  }

  const Scene scene_ = scene_named("pendulum");
  const View view_ = view_from(*scene_.camera, 16.0 / 9);
  Image picture_{320, 180};
  Image bodies_{320, 180};
  render::Run run_;
};

TEST_F(Overlay, ProjectsPoints) {
  const View view;  // looks along −Z, as wide as it is far to both sides
  const auto middle = project(view, {0, 0, -2}, 200, 100);
  ASSERT_TRUE(middle);
  EXPECT_NEAR((*middle)[0], 100, 1e-12);
  EXPECT_NEAR((*middle)[1], 50, 1e-12);
  const auto corner = project(view, {1, 1, -2}, 200, 100);
  ASSERT_TRUE(corner);
  EXPECT_NEAR((*corner)[0], 150, 1e-12);
  EXPECT_NEAR((*corner)[1], 25, 1e-12);
  EXPECT_FALSE(project(view, {0, 0, 2}, 200, 100));
}

TEST_F(Overlay, MarksOpenJointsRed) {
  const auto red = [&] {
    Image picture(320, 180);
    draw_overlays(picture, overlays_named({"joints"}), {scene_, view_, run_});
    return pixels_of(picture, {255, 60, 80});
  };
  EXPECT_EQ(red(), 0);
  for (std::size_t body = 1; body < scene_.bodies.size(); ++body) run_.poses[0][body].linear.x() += 0.3;
  EXPECT_GT(red(), 10);  // measured 15
}

TEST_F(Overlay, DrawsTheReferencesOutline) {
  Image picture(320, 180);
  const ReferenceRun reference;
  OverlayFrame frame{scene_, view_, run_};
  frame.reference = &reference;
  frame.reference_bodies = &bodies_;
  draw_overlays(picture, overlays_named({"ghost"}), frame);
  EXPECT_NEAR(pixels_of(picture, {217, 217, 217}), 4 * 40, 4);
  EXPECT_EQ(picture.pixel(120, 80)[0], 0);
}

TEST_F(Overlay, ColoursBodiesByErrorSpeedAndDepth) {
  constexpr std::array<int, 3> lowest{68, 1, 84};  // viridis
  constexpr std::array<int, 3> middle{33, 145, 140};
  constexpr std::array<int, 3> highest{253, 231, 37};
  OverlayFrame frame{scene_, view_, run_};
  frame.bodies = &bodies_;
  ReferenceRun reference;
  reference.poses = run_.poses;
  frame.reference = &reference;
  run_.errors = {0};
  for (const auto& [error, color] : {std::pair(1e-4, lowest), std::pair(10.0, highest)}) {
    run_.poses = reference.poses;
    run_.poses[0][1].linear.x() += error;
    EXPECT_EQ(color_at(120, 80, "error", frame), color);
  }
  run_.quantities.speeds = {{0, 2}};
  frame.scales = {false, 0, 2};
  EXPECT_EQ(color_at(120, 80, "velocity", frame), highest);
  frame.scales = {false, 0, 4};
  EXPECT_EQ(color_at(120, 80, "velocity", frame), middle);
  run_.quantities.depths = {{0, 1e-3F}};
  frame.scales = {true, 1e-5, 1e-1};
  EXPECT_EQ(color_at(120, 80, "penetration", frame), middle);
}

TEST_F(Overlay, DrawsImpulsesAsArrowsToScale) {
  run_.quantities.contacts = {{{1, 0, {0, 0, -2}, {0, 3, 0}}}};
  Image picture(200, 100);
  draw_overlays(picture, overlays_named({"contacts"}), {scene_, View{}, run_, {true, 1e-3, 1, 0.25}});
  int top = 100;
  for (int y = 0; y < 100; ++y) {
    if (picture.pixel(100, y)[0] > 200) top = std::min(top, y);
  }
  // The arrow has 0.75 m, 2 m ahead, where the picture is 4 m high: 18.75 pixels, and half the line's width.
  EXPECT_NEAR(top, 50 - 18.75, 2.5);
  EXPECT_EQ(picture.pixel(60, 50)[0], 0);
}

TEST_F(Overlay, DrawsAScaleOfARoundImpulse) {
  run_.quantities.contacts = {{}};
  Image picture(640, 360);
  // The view looks along −Z at the bodies' middle, 4 m ahead: 45 pixels a metre, 30 an N·s at 2/3 m for each.
  View view;
  const Vector3 middle = middle_of(scene_);
  view.eye = {middle.x(), middle.y(), middle.z() + 4};
  draw_overlays(picture, overlays_named({"contacts"}), {scene_, view, run_, {true, 1e-3, 1, 2.0 / 3}});
  int right = 0;
  for (int x = 0; x < 100; ++x) {
    const std::uint8_t* const p = picture.pixel(x, 360 - 16);
    if (p[0] > 150 && p[2] < 120) right = x;
  }
  // A fifth of the width, 128 pixels, holds 4.3 N·s: the scale's arrow has 2 N·s and begins at pixel 8.
  EXPECT_NEAR(right, 8 + 60, 3);
}

TEST_F(Overlay, WritesADivergenceOfTheFrame) {
  ReferenceRun reference;
  reference.poses = {run_.poses[0], run_.poses[0]};
  reference.poses[0][1].linear.x() += 0.5;
  reference.poses[1][1].linear.x() += 0.7;
  OverlayFrame frame{scene_, view_, run_};
  frame.reference = &reference;
  Image first = picture_;
  draw_divergence(first, 1, frame);
  frame.k = 1;
  Image second = picture_;
  draw_divergence(second, 1, frame);
  EXPECT_NE(first.rgb, picture_.rgb);
  EXPECT_NE(first.rgb, second.rgb);  // 500 and 700 mm
}

TEST_F(Overlay, RejectsUnknownNames) {
  EXPECT_THROW(overlays_named({"trails", "forces"}), Error);
  EXPECT_THROW(overlays_named({"error", "velocity"}), Error);
  EXPECT_FALSE(overlays_named({}).any());
}

/// Returns a figure of one run, whose pictures have 320x180 pixels, gaps of 8 and lines of 22.
Image figure_of(const Scene& scene, const std::string& panel, const std::vector<double>& times) {
  TimeSheetSettings sheet;
  Settings base = default_settings(Algorithm::a5);
  base.step = sheet.comparison.step = scene.step;
  sheet.comparison.panels = {panel_in(panel, {[&](Algorithm) { return base; }})};
  sheet.comparison.has_reference = panel == "reference";
  sheet.comparison.reference_substeps = 8;
  sheet.times = times;
  sheet.title = std::string(160, 'm');
  sheet.width = 320;
  sheet.height = 180;
  sheet.camera = still_camera_named("scene", scene);
  return draw_time_sheet(scene, sheet).image;
}

TEST(TimeSheet, StepsBackToAFlyingBody) {
  Scene loaded = scene_named("tumbling_body");
  loaded.gravity = Vector3::Zero();
  loaded.bodies[1].linear_velocity = {5, 0, 0};
  const Image figure = figure_of(loaded, "a5", {1.9, 2});
  const int top = 8 + 3 * 22 + 22;
  int changed = 0;
  for (int y = top; y < top + 180 - 22; ++y) {
    for (int x = 8; x < 8 + 320; ++x)
      changed += std::abs(figure.pixel(x, y)[0] - figure.pixel(x + 328, y)[0]) > 30 ? 1 : 0;
  }
  EXPECT_GT(changed, 10);  // 0 where the body is out of sight
  for (int y = 0; y < 8 + 22; ++y) ASSERT_EQ(figure.pixel(figure.width - 4, y)[0], 255);  // beside the title
}

TEST(TimeSheet, MarksAnUnknownReference) {
  const Image figure = figure_of(scene_named("short_chain"), "reference", {0.5});
  Image note(320, 22);
  paste(note, figure, -8, -(8 + 3 * 22 + 22 + 180 - 22));
  EXPECT_GT(pixels_of(note, {40, 43, 50}), 10);  // 0 without the note
}

}  // namespace
}  // namespace substep::render
