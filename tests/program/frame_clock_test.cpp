#include "render/video/frame_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "render/video/comparison.h"
#include "render/video/strip_axis.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "tests/folders.h"

namespace substep::render {
namespace {

Scene scene(const std::string& name) {
  return load_scene(std::string(test::source_folder) + "/scenes/" + name);
}

ComparisonSettings slow_motion(const std::vector<std::string>& panels) {
  ComparisonSettings settings;
  for (const std::string& panel : panels)
    settings.panels.push_back(panel_in(panel, default_settings(Algorithm::a5)));
  settings.duration = 0.5;
  settings.frame_interval = 0.2 / 30;
  return settings;
}

TEST(FrameClock, PlacesFramesBetweenSteps) {
  const std::vector<FrameClock> clocks = frame_clocks({0.1, 0.15, 0.02}, {1.0 / 60, 1.0 / 240});
  // Frames at 0.1, 0.12, 0.14: steps 6, 7.2 and 8.4.
  EXPECT_EQ(clocks[0].steps, (std::vector<std::int64_t>{6, 7, 8, 9}));
  EXPECT_EQ(clocks[1].steps, (std::vector<std::int64_t>{24, 28, 32, 36}));
  ASSERT_EQ(clocks[0].places.size(), 3u);
  EXPECT_EQ(clocks[0].places[1].before, 1u);
  EXPECT_NEAR(clocks[0].places[1].weight, 0.2, 1e-9);
  EXPECT_EQ(clocks[0].frames_of(4), 3u);
  EXPECT_EQ(clocks[0].frames_of(3), 2u);
  EXPECT_THROW(frame_clocks({0, 1, 0.02}, {1.0 / 60, 1.0 / 90}), Error);
  EXPECT_EQ(frame_clocks({0, 1, 1.0 / 30}, {1.0 / 60, 1.0 / 90})[1].steps[1], 3);
}

TEST(SlowMotion, ShowsADistinctPoseInEachFrame) {
  const Scene loaded = scene("pendulum.gltf");
  const Comparison comparison = simulate_comparison(loaded, slow_motion({"a5", "a3,step=1/240"}));
  ASSERT_EQ(comparison.times.size(), 76u);
  for (const auto& run : comparison.runs) {
    ASSERT_EQ(run.poses.size(), 76u);
    std::set<double> heights;
    for (const auto& poses : run.poses) heights.insert(poses[1].linear.y());
    EXPECT_EQ(heights.size(), 76u);
    for (const auto& poses : run.poses) EXPECT_NEAR(poses[1].angular.norm(), 1, 1e-12);
  }
}

TEST(SlowMotion, AddsNoErrorOfItsOwn) {
  const Scene loaded = scene("pendulum.gltf");
  ComparisonSettings at_steps = slow_motion({"a3", "a3,step=1/480"});
  at_steps.frame_interval = 1.0 / 60;
  const Comparison exact = simulate_comparison(loaded, at_steps);
  const Comparison slow = simulate_comparison(loaded, slow_motion({"a3", "a3,step=1/480"}));
  for (std::size_t run = 0; run < 2; ++run) {
    const double error = exact.runs[run].errors.back();
    EXPECT_GT(error, 1e-6);
    EXPECT_NEAR(slow.runs[run].errors.back(), error, 1e-9);
    EXPECT_LE(slow.runs[run].rms_error, 1.05 * exact.runs[run].rms_error);
  }
}

TEST(Strip, ShowsErrorsWhereTheReferenceHolds) {
  const Scene loaded = scene("pendulum.gltf");
  EXPECT_EQ(simulate_comparison(loaded, slow_motion({"a5"})).strip, Strip::error);
}

TEST(Strip, ShowsGapsWhereTheReferenceEndsAtOnce) {
  // The chain is shorter than the gap it spans: A1 explodes at any step.
  const Scene loaded = scene("short_chain.gltf");
  const Comparison comparison = simulate_comparison(loaded, slow_motion({"a5", "a3,n=2"}));
  EXPECT_EQ(comparison.strip, Strip::gap);
  for (const auto& run : comparison.runs) {
    ASSERT_EQ(run.readings.gaps.size(), run.poses.size());
    EXPECT_GT(run.readings.gaps.back(), 1e-4);
  }
  EXPECT_EQ(words_of(comparison, Strip::gap), "largest gap of a joint");
}

TEST(Strip, FollowsWhatTheSceneExpects) {
  const Scene loaded = scene("incline.gltf");
  ComparisonSettings settings = slow_motion({"a5"});
  settings.has_reference = false;
  const auto way = std::ranges::find(loaded.expected, Quantity::way, &Expectation::quantity);
  settings.readings.expected = &*way;
  settings.duration = way->from;
  settings.frame_interval = 1.0 / 30;
  const Comparison comparison = simulate_comparison(loaded, settings);
  EXPECT_NEAR(comparison.runs[0].readings.expected.back(), way->value, way->tolerance);
  const StripAxis axis = axis_of(comparison, Strip::expected);
  EXPECT_FALSE(axis.is_logarithmic);
  EXPECT_EQ(axis.mark, way->value);
  EXPECT_LE(axis.low, 0);
  EXPECT_EQ(axis.label(1.314), "1.31 m");
}

}  // namespace
}  // namespace substep::render
