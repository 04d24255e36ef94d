#include "render/video/comparison.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "render/video/composition.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/scene/scene.h"

namespace substep {
namespace {

Scene scene(const std::string& name) {
  return load_scene(std::string(SUBSTEP_SOURCE_DIR "/scenes/") + name);
}

ComparisonSettings settings(const Scene& of, double duration) {
  ComparisonSettings result;
  result.settings.step = of.step;
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
    for (const substep::Run& run : comparison.runs) {
      ASSERT_EQ(run.errors.size(), 31u);
      double mean = 0;
      for (std::size_t k = 0; k < 31; ++k) {
        double expected = 0;
        int count = 0;
        for (std::size_t body = 1; body < loaded.bodies.size(); ++body) {
          if (loaded.bodies[body].inverse_mass == 0) continue;
          expected += squared_distance_of_points(loaded.bodies[body], run.poses[k][body],
                                                 comparison.reference().poses[k][body]);
          ++count;
        }
        expected /= count;
        mean += expected / 31;
        EXPECT_NEAR(run.errors[k], std::sqrt(expected), 1e-12) << name << " frame " << k;
      }
      EXPECT_NEAR(run.rms_error, std::sqrt(mean), 1e-12);
      EXPECT_EQ(run.rms_error == 0, run.is_reference);
    }
  }
}

TEST(Comparison, PanelsHaveEqualRowSolvesAndOneClock) {
  const Scene loaded = scene("rod_chain.gltf");
  ComparisonSettings chosen = settings(loaded, 0.5);
  chosen.settings.substeps = 3;
  chosen.settings.iterations = 2;
  const Comparison comparison = simulate_comparison(loaded, chosen);
  ASSERT_EQ(comparison.runs.size(), 6u);
  EXPECT_EQ(comparison.runs[1].settings.iterations, 6);
  for (std::size_t i = 2; i < 5; ++i) EXPECT_EQ(comparison.runs[i].row_solves, comparison.runs[1].row_solves);
  EXPECT_EQ(comparison.reference().settings.step, loaded.step / 16);
  EXPECT_FALSE(comparison.is_nearest);
  for (std::size_t k = 0; k < comparison.times.size(); ++k) {
    EXPECT_NEAR(comparison.times[k], static_cast<double>(k) / 30, 1e-12);
  }
}

TEST(Comparison, AStepThatDoesNotDivideAFrameShowsTheNearest) {
  const Scene loaded = scene("pendulum.gltf");
  ComparisonSettings chosen = settings(loaded, 0.5);
  chosen.settings.step = 1.0 / 50;
  const Comparison comparison = simulate_comparison(loaded, chosen);
  EXPECT_TRUE(comparison.is_nearest);
  for (std::size_t k = 0; k < comparison.times.size(); ++k) {
    EXPECT_LE(std::abs(comparison.times[k] - static_cast<double>(k) / 30), 0.01 + 1e-12);
  }
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
    for (int y = 45; y < 135; ++y) {  // inside the second panel's picture
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

TEST(Composition, SizesThatCannotBeFilmedAreRefused) {
  const Scene loaded = scene("pendulum.gltf");
  const Comparison comparison = simulate_comparison(loaded, settings(loaded, 0));
  EXPECT_THROW(Composition(comparison, "test", 1281, 720), Error);
  EXPECT_THROW(Composition(comparison, "test", 300, 160), Error);
  EXPECT_NO_THROW(Composition(comparison, "test", 320, 180));
}

}  // namespace
}  // namespace substep
