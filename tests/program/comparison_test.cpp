// Tests comparisons: reference, errors and other quantities; panels, titles and strips.

#include "render/video/comparison.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "render/video/strips.h"
#include "render/video/titles.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/log/pose_log.h"
#include "sim/measure/motion.h"
#include "sim/model/usual_settings.h"
#include "tests/error_message.h"
#include "tests/scene_files.h"
#include "tests/temporary_folder.h"

namespace substep::render {
namespace {

using VideoRun = render::Run;

/// Returns defaults of panels: these settings for each algorithm, as if n and m had been typed.
PanelDefaults defaults_of(const Settings& base) {
  const auto settings = [base](Algorithm algorithm) {
    Settings result = base;
    result.algorithm = algorithm;
    return result;
  };
  return {settings, true};
}

/// Returns the settings of a comparison of these panels, or of the default ones.
ComparisonSettings settings(const Scene& scene, double duration,
                            const std::vector<std::string>& panels = {}) {
  ComparisonSettings result;
  Settings base = panels.empty() ? Settings{} : default_settings(Algorithm::a5);
  base.step = result.step = scene.step;
  if (panels.empty()) result.panels = default_panels(defaults_of(base));
  for (const std::string& panel : panels) result.panels.push_back(panel_in(panel, defaults_of(base)));
  result.duration = duration;
  return result;
}

/// Returns the mean squared distance between two poses, m², of six points that share the body's mass equally
/// and have its moments of inertia.
double squared_distance_of_points(const Body& body, const Coordinates& is, const Coordinates& should_be) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3 squared_radii = body.inverse_mass * body.inverse_inertia.cwiseInverse();
    const double second_moment = squared_radii.sum() / 2 - squared_radii[axis];
    for (const double side : {-1.0, 1.0}) {
      const Vector3 point = side * std::sqrt(3 * second_moment) * Vector3::Unit(axis);
      const Vector3 there = is.angular * point + is.linear;
      sum += (there - (should_be.angular * point + should_be.linear)).squaredNorm() / 6;
    }
  }
  return sum;
}

TEST(Comparison, MeasuresDistanceOfBodiesPoints) {
  for (const char* const name : {"tumbling_body", "rod_chain"}) {
    const Scene loaded = scene_named(name);
    const Comparison comparison = simulate_comparison(loaded, settings(loaded, 1));
    ASSERT_EQ(comparison.times.size(), 31u);
    for (const VideoRun& run : comparison.runs) {
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

TEST(Comparison, GivesPanelsEqualRowSolvesAndOneClock) {
  const Scene loaded = scene_named("rod_chain");
  ComparisonSettings chosen = settings(loaded, 0.5);
  Settings base = chosen.panels[2].settings;
  base.substeps = 3;
  base.iterations = 2;
  chosen.panels = default_panels(defaults_of(base));
  const Comparison comparison = simulate_comparison(loaded, chosen);
  ASSERT_EQ(comparison.runs.size(), 6u);
  EXPECT_EQ(comparison.runs[1].panel.settings.iterations, 6);
  for (std::size_t i = 2; i < 5; ++i) EXPECT_EQ(comparison.runs[i].row_solves, comparison.runs[1].row_solves);
  EXPECT_TRUE(comparison.runs[5].is_reference());
  for (std::size_t k = 0; k < comparison.times.size(); ++k)
    EXPECT_NEAR(comparison.times[k], static_cast<double>(k) / 30, 1e-12);
}

TEST(Comparison, ChoosesTheReferenceByTheScene) {
  // Bodies that rest need no finer steps of A1; smooth motions have an integrator.
  const auto reference_in = [](const char* scene, double duration, const char* method) {
    const Scene loaded = scene_named(scene);
    const Comparison comparison = simulate_comparison(loaded, settings(loaded, duration));
    EXPECT_EQ(comparison.reference->method, method);
    EXPECT_EQ(comparison.reference->is_a1, comparison.reference->method.starts_with("A1"));
    EXPECT_EQ(comparison.reference->known, comparison.times.size());
    EXPECT_EQ(comparison.reference->fate, "");
    EXPECT_EQ(comparison.strip, Strip::error);
    return std::ranges::max(comparison.reference->uncertainty);
  };
  EXPECT_LE(reference_in("box_stack", 0.2, "A1 itself, h=1/240"), 1e-9 * size_of(scene_named("box_stack")));
  reference_in("sliding_ball", 0.2, "A1 itself, h=1/960");
  EXPECT_LT(reference_in("pendulum", 1, "own, order 8, h=1/960"), 1e-9);  // measured 2e-12
  reference_in("governor", 0.1, "A1 itself, h=1/960");  // the integrator ends at the governor's joints
}

TEST(Comparison, ShowsGapsWithoutAReference) {
  // The chain is shorter than the gap it spans: no motion obeys its joints, and A1 diverges at any step.
  const Scene loaded = scene_named("short_chain");
  ComparisonSettings chosen = settings(loaded, 0.5, {"a5", "a3,n=2"});
  chosen.reference_substeps = 8;
  chosen.frame_interval = 0.2 / 30;
  const Comparison comparison = simulate_comparison(loaded, chosen);
  ASSERT_TRUE(comparison.reference);
  EXPECT_EQ(comparison.reference->known, 0u);
  EXPECT_NE(comparison.reference->fate, "");
  EXPECT_TRUE(comparison.reference->is_a1);
  EXPECT_EQ(comparison.strip, Strip::gap);
  EXPECT_EQ(words_of(comparison, Strip::gap), "largest gap of a joint");
  for (const VideoRun& run : comparison.runs) {
    EXPECT_TRUE(run.errors.empty());
    ASSERT_EQ(run.quantities.gaps.size(), run.poses.size());
    EXPECT_GT(run.quantities.gaps.back(), 1e-4);
  }
}

TEST(Comparison, ShowsLogsAndEngines) {
  const Scene loaded = scene_named("pendulum");
  const test::TemporaryFolder folder;
  const auto log = folder.path() / "comparison_test.poses.txt";
  const ComparisonSettings chosen = settings(loaded, 0.5, {"a4,n=2", "log:" + log.string(), "order-8"});
  Simulation simulation(loaded, chosen.panels[0].settings);
  write_file(log, to_text(record(simulation, 30, 1)));
  const Comparison comparison = simulate_comparison(loaded, chosen);
  ASSERT_EQ(comparison.runs.size(), 3u);
  EXPECT_EQ(comparison.runs[0].errors, comparison.runs[1].errors);
  EXPECT_GT(comparison.runs[0].rms_error, 1e-6);
  EXPECT_LT(comparison.runs[2].rms_error, 1e-9);
}

TEST(Comparison, CountsEnergyOfTablesFromTheStart) {
  // The table accelerates the rod of 1 kg to 2 m/s in 0.5 s, without moving it.
  const test::TemporaryFolder folder;
  const auto table = folder.write("run.csv",
                                  "t,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n"
                                  "0,rod,0.5,1.4,0,1,0,0,0,0,0,0,0,0,0\n"
                                  "0.5,rod,0.5,1.4,0,1,0,0,0,2,0,0,0,0,0\n");
  const Scene loaded = scene_named("pendulum");
  ComparisonSettings chosen = settings(loaded, 0.5, {"log:" + table.string()});
  chosen.start = 0.3;
  chosen.has_reference = false;
  chosen.quantities.energy = true;
  const std::vector<double> energies = simulate_comparison(loaded, chosen).runs[0].quantities.energies;
  EXPECT_NEAR(energies.at(0), 0.72, 1e-9);
  EXPECT_NEAR(energies.at(6), 2, 1e-9);
}

TEST(Comparison, MeasuresQuantitiesOfStripsAndOverlays) {
  const Scene loaded = scene_named("box_stack");
  ComparisonSettings choice = settings(loaded, 0.2, {"a1", "a5"});
  choice.has_reference = false;
  choice.quantities = {true, true, true, true, true, true};
  const Comparison comparison = simulate_comparison(loaded, choice);
  for (const VideoRun& run : comparison.runs) {
    const FrameQuantities& measured = run.quantities;
    ASSERT_EQ(measured.energies.size(), run.poses.size());
    EXPECT_EQ(measured.energies[0], 0);
    ASSERT_EQ(measured.gaps.size(), run.poses.size());
    EXPECT_EQ(measured.gaps.back(), 0);  // the scene has no joint
    ASSERT_EQ(measured.speeds.back().size(), loaded.bodies.size());
    EXPECT_LT(measured.speeds.back()[1], 0.05F);
    ASSERT_EQ(measured.depths.back().size(), loaded.bodies.size());
    EXPECT_LT(measured.depths.back()[1], 0.01F);
    EXPECT_FLOAT_EQ(static_cast<float>(measured.deepest.back()), std::ranges::max(measured.depths.back()));
    EXPECT_TRUE(measured.contacts.front().empty());
    EXPECT_GE(measured.contacts.back().size(), 4u);
  }
}

TEST(Comparison, CountsTurnsBetweenFrames) {
  Scene loaded = scene_named("tumbling_body");
  Expectation angle;
  angle.quantity = Quantity::angle;
  angle.bodies = {1};
  angle.direction = loaded.bodies[1].pose.orientation * Vector3::UnitX();
  loaded.bodies[1].angular_velocity = 10 * angle.direction;
  const test::TemporaryFolder folder;
  const auto log = folder.path() / "spin.poses.txt";
  // The only frame is at 1 s, 1.6 turns after the start.
  ComparisonSettings chosen = settings(loaded, 1, {"a5", "order-8", "log:" + log.string()});
  chosen.start = 1;
  chosen.has_reference = false;
  chosen.quantities.expected = &angle;
  Simulation simulation(loaded, chosen.panels[0].settings);
  write_file(log, to_text(record(simulation, static_cast<int>(std::lround(1 / loaded.step)), 1)));
  const Comparison comparison = simulate_comparison(loaded, chosen);
  for (const VideoRun& run : comparison.runs) {
    ASSERT_EQ(run.quantities.expected.size(), 1u);
    EXPECT_NEAR(run.quantities.expected[0], 10, 0.01);
  }
}

TEST(Comparison, FindsTheFirstDivergenceOfABody) {
  const Scene loaded = scene_named("pendulum");
  Comparison comparison = simulate_comparison(loaded, settings(loaded, 0.2));
  VideoRun run = comparison.runs[4];
  run.poses = comparison.reference->poses;
  EXPECT_FALSE(divergence_of(loaded, comparison, run));
  run.poses[3][1].linear.x() += 0.5;
  run.poses[4][1].linear.x() += 0.7;
  const std::optional<Divergence> divergence = divergence_of(loaded, comparison, run);
  ASSERT_TRUE(divergence);
  EXPECT_EQ(divergence->frame, 3u);
  EXPECT_EQ(divergence->body, 1);
  EXPECT_NEAR(divergence->distance, 0.5, 1e-9);
  comparison.reference->known = 3;
  EXPECT_FALSE(divergence_of(loaded, comparison, run));
}

TEST(SlowMotion, InterpolatesPosesAndAddsNoError) {
  const Scene loaded = scene_named("pendulum");
  ComparisonSettings chosen = settings(loaded, 0.5, {"a3", "a3,step=1/480"});
  chosen.frame_interval = 1.0 / 60;
  const Comparison exact = simulate_comparison(loaded, chosen);
  chosen.frame_interval = 0.2 / 30;
  const Comparison slow = simulate_comparison(loaded, chosen);
  ASSERT_EQ(slow.times.size(), 76u);
  for (std::size_t i = 0; i < 2; ++i) {
    const VideoRun& run = slow.runs[i];
    ASSERT_EQ(run.poses.size(), 76u);
    std::set<double> heights;
    for (const auto& poses : run.poses) {
      heights.insert(poses[1].linear.y());
      EXPECT_NEAR(poses[1].angular.norm(), 1, 1e-12);
    }
    EXPECT_EQ(heights.size(), 76u);
    const double error = exact.runs[i].errors.back();
    EXPECT_GT(error, 1e-6);
    EXPECT_NEAR(run.errors.back(), error, 1e-9);
    EXPECT_LE(run.rms_error, 1.05 * exact.runs[i].rms_error);
  }
}

TEST(Panel, ReadsTypedSettings) {
  const Settings base = default_settings(Algorithm::a3);
  const PanelDefaults defaults = defaults_of(base);
  const PanelChoice panel = panel_in("a5,n=4,joints=rows,tau=1,step=1/120,title=four, in rows", defaults);
  EXPECT_EQ(panel.settings.algorithm, Algorithm::a5);
  EXPECT_EQ(panel.settings.substeps, 4);
  EXPECT_EQ(panel.settings.joints, Joints::rows);
  EXPECT_EQ(panel.settings.step, 1.0 / 120);
  EXPECT_EQ(panel.title, "four, in rows");
  EXPECT_EQ(panel_in("a2,n=3", defaults).settings.iterations, 3);
  EXPECT_EQ(panel_in("a2,n=3,m=5", defaults).settings.iterations, 5);
  EXPECT_EQ(panel_in("order-8", defaults).settings.iterations, base.substeps * base.iterations);
  EXPECT_EQ(panel_in("reference", defaults).kind, PanelChoice::Kind::reference);
  for (const auto& refusal :
       {std::pair("a5,n", "'n': give KEY=VALUE"), std::pair("a5,n=x", "'substeps=x': give a whole number"),
        std::pair("a5,n=2.5", "give a whole number"), std::pair("a5,n=0", "substeps 0"),
        std::pair("a5,size=2", "'size': give some of"),
        std::pair("reference,n=2", "'n=2': a reference has its own settings"),
        std::pair("", "give a1 to a5")}) {
    const std::string message = test::message_of([&] { panel_in(refusal.first, defaults); });
    EXPECT_NE(message.find(refusal.second), std::string::npos) << refusal.first << ": " << message;
  }
}

TEST(Panel, HasDefaultsOfItsAlgorithm) {
  const Scene loop = scene_named("four_bar");
  PanelDefaults defaults{[&](Algorithm algorithm) { return usual_settings(loop, algorithm); }};
  const auto settings_in = [&](const char* panel) { return panel_in(panel, defaults).settings; };
  EXPECT_EQ(settings_in("a3").joints, Joints::plain);
  EXPECT_EQ(settings_in("a5").joints, Joints::stable);
  EXPECT_EQ(settings_in("a2").iterations, 200);
  EXPECT_EQ(settings_in("a2,n=3").iterations, 3);
  EXPECT_EQ(settings_in("soft").substeps, 4);
  EXPECT_EQ(settings_in("avbd").iterations, 10);
  EXPECT_EQ(settings_in("order-8").iterations, loop.substeps);
  defaults.has_counts = true;
  EXPECT_EQ(settings_in("a2").iterations, loop.substeps);
  EXPECT_EQ(settings_in("avbd").iterations, loop.substeps);
}

TEST(Panel, ReadsFilesWithATitle) {
  const test::TemporaryFolder folder;
  const auto read = [&](const std::string& text) {
    return read_panels(folder.write("comparison_test.toml", text), defaults_of(Settings{}));
  };
  const PanelFile panels = read(
      "title = \"Two\"\n[[panel]]\nshow = \"a5\"\nn = 8\ntitle = \"eight\"\n"
      "[[panel]]\nshow = \"log:run.poses.txt\"\n");
  EXPECT_EQ(panels.title, "Two");
  ASSERT_EQ(panels.panels.size(), 2u);
  EXPECT_EQ(panels.panels[0].settings.substeps, 8);
  EXPECT_EQ(panels.panels[0].title, "eight");
  EXPECT_EQ(panels.panels[1].log, folder.path() / "run.poses.txt");
  for (const char* const text :
       {"title = \"none\"\n", "[[panel]]\nshow = \"a5\"\nn = true\n", "[[panel]]\nn = 2\n"})
    EXPECT_THROW(read(text), Error) << text;
}

TEST(Titles, ShowDifferingSettings) {
  using Words = std::vector<std::string>;
  struct Case {
    Words panels;
    Words words;
    std::string shared;
  };
  const std::string all = "10 sub-steps · τ=0.6/0.9 · κ=1/0.7 · stable joints · 60 Hz";
  for (const Case& expected :
       {Case{{"a5,n=2", "a5,n=10"}, {"2 sub-steps", "10 sub-steps"}, all.substr(all.find("τ"))},
        Case{
            {"a1", "a3", "a5", "reference"}, {"all rows at once", "exact sub-steps", "as in Havok", ""}, all},
        Case{{"a2,m=25", "a5,n=25,m=1"}, {"25 iterations", "25 sub-steps"}, all.substr(all.find("τ"))},
        Case{{"a5,step=1/120", "a5,n=1,m=4"},
             {"10 sub-steps, 1 iteration, 120 Hz", "1 sub-step, 4 iterations, 60 Hz"},
             "τ=0.6/0.9 · κ=1/0.7 · stable joints"},
        Case{{"a1", "a5", "a5,warm_start=0.5"}, {"all rows at once", "as in Havok", "warm=0.5"}, all},
        Case{{"a5,n=2,title=two", "a5,n=10,title=ten"}, {"two", "ten"}, all.substr(all.find("τ"))}}) {
    std::vector<VideoRun> runs;
    for (const std::string& text : expected.panels)
      runs.emplace_back().panel = panel_in(text, defaults_of(default_settings(Algorithm::a5)));
    const Titles titles = titles_of(runs);
    EXPECT_EQ(titles.words, expected.words);
    EXPECT_EQ(titles.shared, expected.shared);
  }
}

TEST(Titles, NameCurvesOfVariants) {
  std::vector<VideoRun> runs;
  for (const char* const text : {"a5,n=2", "a2,m=3", "a5,n=10,warm_start=0.5"})
    runs.emplace_back().panel = panel_in(text, defaults_of(default_settings(Algorithm::a5)));
  EXPECT_EQ(curve_name(runs, runs[0].panel), "A5 n=2");
  EXPECT_EQ(curve_name(runs, runs[1].panel), "A2");
  EXPECT_EQ(curve_name(runs, runs[2].panel), "A5 n=10 warm=0.5");
}

TEST(PanelColours, DifferWithinAlgorithm) {
  const Scene loaded = scene_named("pendulum");
  ComparisonSettings chosen = settings(loaded, 0, {"a5,n=2", "a4", "a5,n=10", "a5,n=20"});
  chosen.has_reference = false;
  std::vector<Color> colors;
  for (const VideoRun& run : simulate_comparison(loaded, chosen).runs) colors.push_back(accent(run.panel));
  EXPECT_EQ(html_color(colors[0]), "#ff8a3d");
  for (std::size_t i = 0; i < colors.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      int difference = 0;
      for (std::size_t c = 0; c < 3; ++c) difference += std::abs(colors[i][c] - colors[j][c]);
      EXPECT_GT(difference, 120) << i << " and " << j;  // smallest measured: 162
    }
  }
  std::set<Color> shades;
  for (PanelChoice panel; panel.shade < 7; ++panel.shade) shades.insert(accent(panel));
  EXPECT_EQ(shades.size(), 7u);
}

TEST(StripAxis, ShowsTheExpectedQuantity) {
  const Scene loaded = scene_named("incline");
  const auto way = std::ranges::find(loaded.expected, Quantity::way, &Expectation::quantity);
  ComparisonSettings chosen = settings(loaded, way->from, {"a5"});
  chosen.has_reference = false;
  chosen.quantities.expected = &*way;
  const Comparison comparison = simulate_comparison(loaded, chosen);
  EXPECT_NEAR(comparison.runs[0].quantities.expected.back(), way->value, way->tolerance);
  const StripAxis axis = axis_of(comparison, Strip::expected);
  EXPECT_FALSE(axis.is_logarithmic);
  EXPECT_EQ(axis.mark, way->value);
  EXPECT_LE(axis.low, 0);
  EXPECT_EQ(axis.label(1.314), "1.31 m");
  EXPECT_EQ(axis.label(-1234.5), "−1234 m");
}

}  // namespace
}  // namespace substep::render
