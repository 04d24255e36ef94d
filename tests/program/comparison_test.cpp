#include "render/video/comparison.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "render/text.h"
#include "render/video/composition.h"
#include "render/video/film_camera.h"
#include "render/video/overlay.h"
#include "render/video/seen_frames.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/log/file_output.h"
#include "sim/log/pose_log.h"
#include "sim/measure/motion.h"
#include "sim/scene/scene.h"
#include "tests/error_message.h"
#include "tests/folders.h"
#include "tests/temporary_folder.h"

namespace substep::render {
namespace {

Scene scene(const std::string& name) {
  return load_scene(std::string(test::source_folder) + "/scenes/" + name);
}

ComparisonSettings settings(const Scene& of, double duration) {
  ComparisonSettings result;
  Settings base;
  base.step = of.step;
  result.panels = default_panels(base);
  result.step = of.step;
  result.duration = duration;
  return result;
}

/// Of six points, a sixth of the mass each, that have the body's moments of inertia.
double squared_distance_of_points(const Body& body, const Coordinates& is, const Coordinates& should_be) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3 radii = body.inverse_mass * body.inverse_inertia.cwiseInverse();
    const double second_moment = radii.sum() / 2 - radii[axis];
    for (const double side : {-1.0, 1.0}) {
      const Vector3 point = side * std::sqrt(3 * second_moment) * Vector3::Unit(axis);
      const Vector3 there = is.angular * point + is.linear;
      sum += (there - (should_be.angular * point + should_be.linear)).squaredNorm() / 6;
    }
  }
  return sum;
}

TEST(Comparison, ErrorIsTheDistanceOfTheBodiesPoints) {
  for (const char* const name : {"tumbling_body.gltf", "rod_chain.gltf"}) {
    const Scene loaded = scene(name);
    const Comparison comparison = simulate_comparison(loaded, settings(loaded, 1));
    ASSERT_EQ(comparison.times.size(), 31u);
    for (const render::Run& run : comparison.runs) {
      if (run.is_reference()) continue;
      ASSERT_EQ(run.errors.size(), 31u);
      double mean = 0;
      for (std::size_t k = 0; k < 31; ++k) {
        double expected = 0;
        int count = 0;
        for (std::size_t body = 1; body < loaded.bodies.size(); ++body) {
          if (loaded.bodies[body].inverse_mass == 0) continue;
          expected += squared_distance_of_points(loaded.bodies[body], run.poses[k][body],
                                                 comparison.reference->poses[k][body]);
          ++count;
        }
        expected /= count;
        mean += expected / 31;
        EXPECT_NEAR(run.errors[k], std::sqrt(expected), 1e-12) << name << " frame " << k;
      }
      EXPECT_NEAR(run.rms_error, std::sqrt(mean), 1e-12);
      EXPECT_GT(run.rms_error, 0);
    }
  }
}

TEST(Comparison, PanelsHaveEqualRowSolvesAndOneClock) {
  const Scene loaded = scene("rod_chain.gltf");
  ComparisonSettings chosen = settings(loaded, 0.5);
  Settings base;
  base.step = loaded.step;
  base.substeps = 3;
  base.iterations = 2;
  chosen.panels = default_panels(base);
  const Comparison comparison = simulate_comparison(loaded, chosen);
  ASSERT_EQ(comparison.runs.size(), 6u);
  EXPECT_EQ(comparison.runs[1].panel.settings.iterations, 6);
  for (std::size_t i = 2; i < 5; ++i) EXPECT_EQ(comparison.runs[i].row_solves, comparison.runs[1].row_solves);
  EXPECT_TRUE(comparison.runs[5].is_reference());
  for (std::size_t k = 0; k < comparison.times.size(); ++k) {
    EXPECT_NEAR(comparison.times[k], static_cast<double>(k) / 30, 1e-12);
  }
}

TEST(Comparison, RefinesReferenceWhereSomethingMoves) {
  const Scene resting = scene("box_stack.gltf");
  const Comparison stack = simulate_comparison(resting, settings(resting, 0.2));
  EXPECT_EQ(stack.reference->method, "A1 itself, h=1/240");
  EXPECT_EQ(stack.reference->known, stack.times.size());
  EXPECT_LE(std::ranges::max(stack.reference->uncertainty), 1e-9 * size_of(resting));
  const Scene moving = scene("sliding_ball.gltf");
  const Comparison ball = simulate_comparison(moving, settings(moving, 0.2));
  EXPECT_EQ(ball.reference->method, "A1 itself, h=1/960");
}

TEST(Comparison, ErrorsEndWhereTheReferenceDoes) {
  // The chain is shorter than the gap it spans: no motion obeys its joints, and A1 explodes at any step.
  const Scene loaded = scene("short_chain.gltf");
  ComparisonSettings chosen = settings(loaded, 0.5);
  chosen.reference_substeps = 8;
  const Comparison comparison = simulate_comparison(loaded, chosen);
  ASSERT_TRUE(comparison.reference);
  EXPECT_EQ(comparison.reference->known, 0u);
  EXPECT_NE(comparison.reference->fate, "");
  EXPECT_TRUE(comparison.reference->is_a1);
  for (const render::Run& run : comparison.runs) {
    EXPECT_TRUE(run.errors.empty());
  }
}

TEST(Comparison, ASmoothScenesReferenceIsNotA1) {
  const Scene loaded = scene("pendulum.gltf");
  const Comparison comparison = simulate_comparison(loaded, settings(loaded, 1));
  EXPECT_EQ(comparison.reference->method, "own, order 8, h=1/960");
  EXPECT_EQ(comparison.reference->known, comparison.times.size());
  EXPECT_EQ(comparison.reference->fate, "");
  EXPECT_FALSE(comparison.reference->is_a1);
  // Its two runs agree far better than A1 at a 16th of the step would: to 1e-3 m / 16.
  EXPECT_LT(*std::ranges::max_element(comparison.reference->uncertainty), 1e-9);  // measured 2e-12
}

TEST(Comparison, TakesA1WhereTheIntegratorEnds) {
  const Scene loaded = scene("governor.gltf");
  const Comparison comparison = simulate_comparison(loaded, settings(loaded, 0.1));
  EXPECT_TRUE(comparison.reference->is_a1);
  EXPECT_EQ(comparison.reference->fate, "");
  EXPECT_EQ(comparison.reference->known, comparison.times.size());
}

TEST(Comparison, APanelsRunIsTheFinishedLogsOrTheEngines) {
  const Scene loaded = scene("pendulum.gltf");
  ComparisonSettings chosen = settings(loaded, 0.5);
  Settings base;
  base.step = loaded.step;
  const test::TemporaryFolder folder;
  const auto log = folder.path() / "comparison_test.poses.txt";
  Simulation simulation(loaded, panel_in("a4,n=2", base).settings);
  write_file(log, to_text(record(simulation, 30, 1)));
  chosen.panels = {panel_in("a4,n=2", base), panel_in("log:" + log.string(), base),
                   panel_in("order-8", base)};
  const Comparison comparison = simulate_comparison(loaded, chosen);
  ASSERT_EQ(comparison.runs.size(), 3u);
  EXPECT_EQ(comparison.runs[0].errors, comparison.runs[1].errors);
  EXPECT_GT(comparison.runs[0].rms_error, 1e-6);
  EXPECT_LT(comparison.runs[2].rms_error, 1e-9);
}

TEST(Panel, TextSaysWhatIsShown) {
  Settings base = default_settings(Algorithm::a3);
  const PanelChoice panel = panel_in("a5,n=4,joints=rows,tau=1,step=1/120,title=four, in rows", base);
  EXPECT_EQ(panel.settings.algorithm, Algorithm::a5);
  EXPECT_EQ(panel.settings.substeps, 4);
  EXPECT_EQ(panel.settings.joints, Joints::rows);
  EXPECT_EQ(panel.settings.step, 1.0 / 120);
  EXPECT_EQ(panel.title, "four, in rows");
  EXPECT_EQ(panel_in("a2,n=3", base).settings.iterations, 3);
  EXPECT_EQ(panel_in("a2,n=3,m=5", base).settings.iterations, 5);
  EXPECT_EQ(panel_in("order-8", base).settings.iterations, base.substeps * base.iterations);
  EXPECT_EQ(panel_in("reference", base).kind, PanelChoice::Kind::reference);
  for (const auto& [text, words] :
       {std::pair("a6", "'a6': give a1 to a5"), std::pair("a5,n", "'n': give KEY=VALUE"),
        std::pair("a5,n=x", "'substeps=x': give a whole number"),
        std::pair("a5,n=2.5", "give a whole number"), std::pair("a5,n=0", "substeps 0"),
        std::pair("a5,size=2", "'size': give some of"),
        std::pair("reference,n=2", "'n=2': a reference has its own settings"),
        std::pair("", "give a1 to a5")}) {
    const std::string message = test::message_of([&] { panel_in(text, base); });
    EXPECT_NE(message.find(words), std::string::npos) << text << ": " << message;
  }
}

TEST(Panel, AFileHasATitleAndPanels) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "comparison_test.toml";
  const auto read = [&](const std::string& text) {
    std::ofstream(file) << text;
    return read_panels(file, Settings{});
  };
  const PanelFile panels = read(
      "title = \"Two\"\n[[panel]]\nshow = \"a5\"\nn = 8\ntitle = \"eight\"\n"
      "[[panel]]\nshow = \"log:run.poses.txt\"\n");
  EXPECT_EQ(panels.title, "Two");
  ASSERT_EQ(panels.panels.size(), 2u);
  EXPECT_EQ(panels.panels[0].settings.substeps, 8);
  EXPECT_EQ(panels.panels[0].title, "eight");
  EXPECT_EQ(panels.panels[1].log, file.parent_path() / "run.poses.txt");
  EXPECT_THROW(read("title = \"none\"\n"), Error);
  EXPECT_THROW(read("[[panel]]\nshow = \"a5\"\nn = true\n"), Error);
  EXPECT_THROW(read("[[panel]]\nn = 2\n"), Error);
}

TEST(Composition, LengthsHaveThreeDigitsAndTheirUnit) {
  EXPECT_EQ(length_label(0), "0");
  EXPECT_EQ(length_label(1e-9), "< 1 µm");
  EXPECT_EQ(length_label(1.234e-6), "1.23 µm");
  EXPECT_EQ(length_label(0.99949e-3), "999 µm");
  EXPECT_EQ(length_label(0.99951e-3), "1.00 mm");
  EXPECT_EQ(length_label(0.0456), "45.6 mm");
  EXPECT_EQ(length_label(0.456), "456 mm");
  EXPECT_EQ(length_label(1.5), "1.50 m");
  EXPECT_EQ(length_label(1234), "1.23 km");
  EXPECT_EQ(length_label(1e300), "> 1000 km");
  EXPECT_EQ(error_label(0.002, 0.001), "2.00 mm");
  EXPECT_EQ(error_label(0.001, 0.002), "≤ 2.00 mm");
  EXPECT_EQ(error_label(0, 2e-7), "< 1 µm");
  EXPECT_EQ(error_label(0, 0), "0");
}

TEST(Composition, ScaleHoldsTheErrorsAndNoMoreThanFiveDecades) {
  Comparison comparison;
  comparison.runs.resize(2);
  comparison.runs[0].errors = {0, 2e-3, 5e-2, 0.3};
  ErrorScale scale = error_scale(comparison);
  EXPECT_EQ(scale.lower, -3);
  EXPECT_EQ(scale.upper, 0);
  EXPECT_DOUBLE_EQ(scale.height(0.1), 2.0 / 3);
  EXPECT_EQ(scale.height(0), 0);
  EXPECT_EQ(scale.height(1e9), 1);
  comparison.runs[0].errors = {1e-12, 1e-12, 1e12};
  scale = error_scale(comparison);
  EXPECT_EQ(scale.lower, -3);
  EXPECT_EQ(scale.upper, 2);
  comparison.runs[0].errors = {0, 0};
  scale = error_scale(comparison);
  EXPECT_LT(scale.lower, scale.upper);
}

TEST(Composition, ADivergedRunIsFrozenAndSaysSo) {
  const Scene loaded = scene("pendulum.gltf");
  Comparison comparison = simulate_comparison(loaded, settings(loaded, 0.2));
  const auto drawn = [&comparison](int k) {
    const Composition composition(comparison, "test", 640, 360);
    const Image picture(composition.picture_width(), composition.picture_height());
    return composition.frame(k, std::vector<Image>(6, picture));
  };
  const Image before = drawn(6);
  comparison.runs[1].diverged = 0.1;
  comparison.runs[1].poses.resize(3);
  comparison.runs[1].errors.resize(3);
  const Image after = drawn(6);
  // The alarm's colour is there now, and was not.
  const auto reddest = [](const Image& image) {
    int most = 0;
    for (int y = 75; y < 135; ++y) {  // inside the second panel's picture
      for (int x = image.width / 3; x < 2 * image.width / 3; ++x) {
        const std::uint8_t* const p = image.pixel(x, y);
        if (p[1] < 140 && p[2] < 110) most = std::max(most, static_cast<int>(p[0]));
      }
    }
    return most;
  };
  EXPECT_LT(reddest(before), 100);  // measured 15
  EXPECT_GT(reddest(after), 240);   // measured 255
}

TEST(Composition, RowsFollowTheNumberOfPanelsAndTheFramesShape) {
  using Rows = std::vector<int>;
  const std::array<Rows, 9> wide{{{1}, {2}, {3}, {2, 2}, {3, 2}, {3, 3}, {4, 3}, {4, 4}, {5, 4}}};
  for (int count = 1; count <= 9; ++count) {
    EXPECT_EQ(rows_for(count, 1268, 654, 110), wide.at(static_cast<std::size_t>(count - 1))) << count;
  }
  EXPECT_EQ(rows_for(2, 720, 1200, 100), (Rows{1, 1}));
  EXPECT_EQ(rows_for(5, 608, 1032, 80), (Rows{2, 2, 1}));
  EXPECT_EQ(rows_for(6, 1080, 1032, 100), (Rows{2, 2, 2}));
}

TEST(Composition, FilmsHaveAnyShape) {
  const Scene loaded = scene("pendulum.gltf");
  const Comparison comparison = simulate_comparison(loaded, settings(loaded, 0));
  for (const auto& [width, height] :
       {std::pair(720, 720), std::pair(404, 720), std::pair(1280, 320), std::pair(360, 640)}) {
    const Composition composition(comparison, "a title that is rather long for some of them", width, height);
    const Image picture(composition.picture_width(), composition.picture_height());
    const Image frame = composition.frame(0, std::vector<Image>(6, picture));
    EXPECT_EQ(frame.width, width);
    EXPECT_GT(6 * picture.width * picture.height, width * height / 4) << width << "x" << height;
  }
}

TEST(Composition, SizesThatCannotBeFilmedAreRefused) {
  const Scene loaded = scene("pendulum.gltf");
  const Comparison comparison = simulate_comparison(loaded, settings(loaded, 0));
  EXPECT_THROW(Composition(comparison, "test", 1281, 720), Error);
  EXPECT_THROW(Composition(comparison, "test", 300, 160), Error);
  EXPECT_NO_THROW(Composition(comparison, "test", 320, 180));
}

int pixels_of(const Image& image, const std::array<std::uint8_t, 3>& color) {
  int count = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const std::uint8_t* const p = image.pixel(x, y);
      bool same = true;
      for (std::size_t c = 0; c < 3; ++c) same = same && std::abs(p[c] - color[c]) < 30;
      count += same ? 1 : 0;
    }
  }
  return count;
}

TEST(Overlay, PointsAreWhereTheViewShowsThem) {
  View view;  // looks along −Z, as wide as it is far to both sides
  double x = 0;
  double y = 0;
  ASSERT_TRUE(project(view, {0, 0, -2}, 200, 100, x, y));
  EXPECT_NEAR(x, 100, 1e-12);
  EXPECT_NEAR(y, 50, 1e-12);
  ASSERT_TRUE(project(view, {1, 1, -2}, 200, 100, x, y));
  EXPECT_NEAR(x, 150, 1e-12);
  EXPECT_NEAR(y, 25, 1e-12);
  EXPECT_FALSE(project(view, {0, 0, 2}, 200, 100, x, y));
}

TEST(Overlay, AnOpenJointIsRedAndAClosedOneIsNot) {
  const Scene loaded = scene("pendulum.gltf");
  Comparison comparison = simulate_comparison(loaded, settings(loaded, 0.1));
  const View view = view_from(*loaded.camera, 16.0 / 9);
  const auto red = [&] {
    Image picture(320, 180);
    draw_overlays(picture, overlays_named({"joints"}), {loaded, view, comparison.runs[2]});
    return pixels_of(picture, {255, 60, 80});
  };
  EXPECT_EQ(red(), 0);
  for (std::size_t body = 1; body < loaded.bodies.size(); ++body) {
    comparison.runs[2].poses[0][body].linear.x() += 0.3;
  }
  EXPECT_GT(red(), 10);  // measured 15
}

TEST(Overlay, TheGhostIsTheReferencesOutline) {
  const Scene loaded = scene("pendulum.gltf");
  const Comparison comparison = simulate_comparison(loaded, settings(loaded, 0.1));
  const View view = view_from(*loaded.camera, 16.0 / 9);
  Image bodies(320, 180);  // sky, and a square of body 1
  fill_rectangle(bodies, 100, 60, 40, 40, {2, 0, 0});
  Image picture(320, 180);
  OverlayFrame frame{loaded, view, comparison.runs[2]};
  frame.reference = &*comparison.reference;
  frame.reference_bodies = &bodies;
  draw_overlays(picture, overlays_named({"ghost"}), frame);
  const int outline = pixels_of(picture, {217, 217, 217});
  EXPECT_GE(outline, 156);  // of the square's 4 · 40
  EXPECT_LE(outline, 164);
  EXPECT_EQ(picture.pixel(120, 80)[0], 0);
}

TEST(Overlay, BodiesTakeTheColorOfTheirError) {
  const Scene loaded = scene("pendulum.gltf");
  Comparison comparison = simulate_comparison(loaded, settings(loaded, 0.1));
  const View view = view_from(*loaded.camera, 16.0 / 9);
  Image bodies(320, 180);
  fill_rectangle(bodies, 100, 60, 40, 40, {2, 0, 0});
  const auto color = [&](double error) {
    Image picture(320, 180);
    std::fill(picture.rgb.begin(), picture.rgb.end(), std::uint8_t{100});
    comparison.runs[2].poses[1][1] = comparison.reference->poses[1][1];
    comparison.runs[2].poses[1][1].linear.x() += error;
    OverlayFrame frame{loaded, view, comparison.runs[2]};
    frame.k = 1;
    frame.reference = &*comparison.reference;
    frame.bodies = &bodies;
    draw_overlays(picture, overlays_named({"error"}), frame);
    EXPECT_EQ(picture.pixel(10, 10)[0], 100);
    const std::uint8_t* const p = picture.pixel(120, 80);
    return std::array<int, 3>{p[0], p[1], p[2]};
  };
  // Viridis' ends, for errors of 10^-3 and 1 m.
  EXPECT_EQ(color(1e-4), (std::array<int, 3>{68, 1, 84}));
  EXPECT_EQ(color(10), (std::array<int, 3>{253, 231, 37}));
}

TEST(Overlay, BodiesTakeTheColorOfTheirSpeedOrDepth) {
  const Scene loaded = scene("pendulum.gltf");
  render::Run run;
  run.poses = {initial_state(loaded).q};
  const View view = view_from(*loaded.camera, 16.0 / 9);
  Image bodies(320, 180);
  fill_rectangle(bodies, 100, 60, 40, 40, {2, 0, 0});
  const auto color = [&](const char* overlay, OverlayScales scales) {
    Image picture(320, 180);
    std::fill(picture.rgb.begin(), picture.rgb.end(), std::uint8_t{100});
    OverlayFrame frame{loaded, view, run, scales};
    frame.bodies = &bodies;
    draw_overlays(picture, overlays_named({overlay}), frame);
    const std::uint8_t* const p = picture.pixel(120, 80);
    return std::array<int, 3>{p[0], p[1], p[2]};
  };
  run.readings.speeds = {{0, 2}};
  EXPECT_EQ(color("velocity", {false, 0, 2}), (std::array<int, 3>{253, 231, 37}));
  EXPECT_EQ(color("velocity", {false, 0, 4}), (std::array<int, 3>{33, 145, 140}));
  run.readings.depths = {{0, 1e-3F}};
  EXPECT_EQ(color("penetration", {true, 1e-5, 1e-1}), (std::array<int, 3>{33, 145, 140}));
}

TEST(Overlay, AnArrowIsAsLongAsItsImpulse) {
  const Scene loaded = scene("pendulum.gltf");
  render::Run run;
  run.poses = {initial_state(loaded).q};
  run.readings.contacts = {{{1, 0, {0, 0, -2}, {0, 3, 0}}}};
  Image picture(200, 100);
  OverlayFrame frame{loaded, View{}, run, {true, 1e-3, 1, 0.25}};
  draw_overlays(picture, overlays_named({"contacts"}), frame);
  int top = 100;
  for (int y = 0; y < 100; ++y) {
    if (picture.pixel(100, y)[0] > 200) top = std::min(top, y);
  }
  // From the middle, 0.75 m at 2 m where the picture is 4 m high: 18.75 pixels, and half the line's width.
  EXPECT_NEAR(top, 50 - 18.75, 2.5);
  EXPECT_EQ(picture.pixel(60, 50)[0], 0);
}

TEST(Overlay, TheScaleIsAnArrowOfARoundImpulse) {
  const Scene loaded = scene("pendulum.gltf");
  render::Run run;
  run.poses = {initial_state(loaded).q};
  run.readings.contacts = {{}};
  Image picture(640, 360);
  // It looks along −Z at the bodies' middle, 4 m ahead: 45 pixels a metre, 30 an N·s at 2/3 m for each.
  View view;
  const Vector3 middle = middle_of(loaded);
  view.eye = {middle.x(), middle.y(), middle.z() + 4};
  draw_overlays(picture, overlays_named({"contacts"}), {loaded, view, run, {true, 1e-3, 1, 2.0 / 3}});
  int right = 0;
  for (int x = 0; x < 100; ++x) {
    const std::uint8_t* const p = picture.pixel(x, 360 - 16);
    if (p[0] > 150 && p[2] < 120) right = x;
  }
  // 128 pixels, a fifth of the width, hold 4.3 N·s: the arrow is of 2 N·s, and begins at 8.
  EXPECT_NEAR(right, 8 + 60, 3);
}

TEST(SeenFrames, HoldAllRunsButAnExplosion) {
  const Scene loaded = scene("pendulum.gltf");
  Comparison comparison;
  comparison.times.resize(3);
  comparison.runs.resize(3);
  const double size = size_of(loaded);
  for (std::size_t run = 0; run < 3; ++run) {
    for (const double way : {0.0, 0.1, run == 0 ? 0.2 : run == 1 ? 0.9 : 100.0}) {
      comparison.runs[run].poses.push_back(initial_state(loaded).q);
      comparison.runs[run].poses.back()[1].linear.x() += way * size;
    }
  }
  const auto frames = seen_frames(loaded, comparison);
  EXPECT_EQ(frames.size(), 1u + 3 + 3 + 2);
}

TEST(Comparison, ReadsWhatStripsAndOverlaysShow) {
  const Scene loaded = scene("box_stack.gltf");
  ComparisonSettings choice = settings(loaded, 0.2);
  choice.panels.erase(choice.panels.begin() + 1, choice.panels.end() - 2);  // A1, A5, the reference
  choice.panels.pop_back();
  choice.has_reference = false;
  choice.readings = {true, true, true, true, true};
  const Comparison comparison = simulate_comparison(loaded, choice);
  for (const auto& run : comparison.runs) {
    const Readings& readings = run.readings;
    ASSERT_EQ(readings.energies.size(), run.poses.size());
    EXPECT_EQ(readings.energies[0], 0);
    ASSERT_EQ(readings.gaps.size(), run.poses.size());
    EXPECT_EQ(readings.gaps.back(), 0);  // there is no joint
    ASSERT_EQ(readings.speeds.back().size(), loaded.bodies.size());
    EXPECT_LT(readings.speeds.back()[1], 0.05F);
    ASSERT_EQ(readings.depths.back().size(), loaded.bodies.size());
    EXPECT_LT(readings.depths.back()[1], 0.01F);
    EXPECT_TRUE(readings.contacts.front().empty());
    EXPECT_GE(readings.contacts.back().size(), 4u);
  }
}

TEST(Comparison, ARunDepartsWhereABodyIsFirstAway) {
  const Scene loaded = scene("pendulum.gltf");
  Comparison comparison = simulate_comparison(loaded, settings(loaded, 0.2));
  render::Run run = comparison.runs[4];
  run.poses = comparison.reference->poses;
  EXPECT_FALSE(departure_of(loaded, comparison, run));
  run.poses[3][1].linear.x() += 0.5;
  run.poses[4][1].linear.x() += 0.7;
  const std::optional<Departure> departure = departure_of(loaded, comparison, run);
  ASSERT_TRUE(departure);
  EXPECT_EQ(departure->frame, 3u);
  EXPECT_EQ(departure->body, 1);
  EXPECT_NEAR(departure->distance, 0.5, 1e-9);
  comparison.reference->known = 3;
  EXPECT_FALSE(departure_of(loaded, comparison, run));
}

TEST(Composition, TheAxisOfEnergyHoldsBothSidesButNoExplosion) {
  Comparison comparison;
  comparison.runs.resize(1);
  for (int i = 0; i < 100; ++i) comparison.runs[0].readings.energies.push_back(-0.03 * i);
  StripAxis axis = axis_of(comparison, Strip::energy);
  EXPECT_EQ(axis.low, -5);
  EXPECT_EQ(axis.high, 0.5);  // room for the line of the start
  EXPECT_EQ(axis.height(-5), 0);
  EXPECT_NEAR(axis.height(0), 5 / 5.5, 1e-12);
  comparison.runs[0].readings.energies.back() = 1e30;
  axis = axis_of(comparison, Strip::energy);
  EXPECT_LT(axis.high, 50);
  EXPECT_EQ(axis.height(1e30), 1);
  EXPECT_EQ(energy_label(-0.0123), "−12.3 mJ");
  EXPECT_EQ(energy_label(1234), "+1.23 kJ");
  EXPECT_EQ(energy_label(0), "0 J");
}

TEST(Composition, StripsStandBelowEachOther) {
  const Scene loaded = scene("pendulum.gltf");
  ComparisonSettings choice = settings(loaded, 0.2);
  choice.readings.energy = choice.readings.gap = true;
  const Comparison comparison = simulate_comparison(loaded, choice);
  const Composition one(comparison, "test", 1280, 720);
  const Composition two(comparison, "test", 1280, 720, {}, strips_named({"error", "gap", "gap"}));
  EXPECT_EQ(one.picture_height() - two.picture_height(), 62);
  const Image picture(two.picture_width(), two.picture_height());
  EXPECT_NO_THROW(two.frame(3, std::vector<Image>(6, picture)));
  EXPECT_THROW(strips_named({"height"}), Error);
}

TEST(Overlay, UnknownNamesAreRefused) {
  EXPECT_THROW(overlays_named({"trails", "forces"}), Error);
  EXPECT_THROW(overlays_named({"error", "velocity"}), Error);
  EXPECT_FALSE(overlays_named({}).any());
}

TEST(FilmCamera, IsOneOfTheScenesByTheNameOfItsNodeOrItsOwn) {
  Scene loaded = scene("pendulum.gltf");
  Camera side = *loaded.camera;
  side.pose.position = {7, 0, 0};
  loaded.cameras.push_back({"on the left", "wide", side});
  for (const char* const name : {"name:on the left", "name:wide"}) {
    EXPECT_EQ(seen_by(camera_named(name, loaded), loaded).camera->pose.position.x(), 7) << name;
  }
  EXPECT_EQ(seen_by(camera_named("scene", loaded), loaded).camera->pose.position,
            loaded.camera->pose.position);
  EXPECT_FALSE(seen_by(camera_named("fit", loaded), loaded).camera);
}

TEST(FilmCamera, FollowsABodyAndGoesRoundTheScene) {
  const Scene loaded = scene("rod_chain.gltf");
  const View view = view_from(*loaded.camera, 16.0 / 9);
  const FilmCamera follow = camera_named("follow:" + loaded.bodies[2].name, loaded);
  EXPECT_EQ(follow.follows, 2);
  const View along = moved(view, follow, {1, 2, 3}, 1, Vector3::Zero());
  EXPECT_NEAR((along.eye - view.eye).y, 2, 1e-12);
  // Half round: on the other side of the middle, and looking back.
  const View round = moved(view, camera_named("orbit:90", loaded), Vector3::Zero(), 2, {0.5, 0, 0.25});
  EXPECT_NEAR(round.eye.x, 1 - view.eye.x, 1e-12);
  EXPECT_NEAR(round.eye.y, view.eye.y, 1e-12);
  EXPECT_NEAR(round.eye.z, 0.5 - view.eye.z, 1e-12);
  EXPECT_NEAR(round.forward.x, -view.forward.x, 1e-12);
  for (const char* const text : {"follow:nobody", "orbit:round", "somewhere", "name:nobody"}) {
    EXPECT_THROW(camera_named(text, loaded), Error) << text;
  }
}

}  // namespace
}  // namespace substep::render
