// Tests metrics of runs: the split of errors, invariants, JSON and tables.

#include "sim/measure/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "sim/error.h"
#include "sim/loading/json_value.h"
#include "sim/measure/json.h"
#include "sim/measure/metrics_text.h"
#include "sim/measure/stepper.h"
#include "sim/model/usual_settings.h"
#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Metrics, PartsOfErrorAddUp) {
  const Scene scene = scene_named("rod_chain");
  const ReferenceMotion reference = reference_motion(scene, 1);
  for (const Algorithm algorithm : test::all_algorithms) {
    const Metrics m = measure(scene, usual_settings(scene, algorithm), reference);
    // The triangle inequality holds for root mean squares.
    const double parts = m.parts.stepping + m.parts.solver.value_or(0) + m.parts.model.value_or(0);
    EXPECT_LE(m.error.position.rms, parts * (1 + 1e-9)) << name(algorithm);
    EXPECT_EQ(m.parts.solver.has_value(), algorithm != Algorithm::a1);
    EXPECT_EQ(m.parts.model.has_value(), algorithm >= Algorithm::a4);
    EXPECT_TRUE(m.bounded) << name(algorithm);
  }
}

TEST(Metrics, SinkingStackIsNotBounded) {
  const Scene scene = scene_named("box_stack");
  const ReferenceMotion reference = reference_motion(scene, 1);
  const Metrics direct = measure(scene, usual_settings(scene, Algorithm::a1), reference, false);
  EXPECT_TRUE(direct.bounded);
  EXPECT_LT(direct.moved, 1e-12);
  Settings coarse = usual_settings(scene, Algorithm::a5);
  EXPECT_TRUE(measure(scene, coarse, reference, false).bounded);
  coarse.substeps = 1;
  const Metrics sinking = measure(scene, coarse, reference, false);
  EXPECT_FALSE(sinking.bounded);
  EXPECT_GT(sinking.moved, 0.3);  // measured 0.43 m, of boxes of 1 m
}

TEST(Metrics, ResidualHalvesWithFourTimesTheSweeps) {
  const Scene scene = scene_named("rod_chain");
  const ReferenceMotion reference = reference_motion(scene, 0.5);
  Settings sweeps = usual_settings(scene, Algorithm::a2);
  double before = INFINITY;
  for (const int m : {4, 16, 64, 256}) {
    sweeps.iterations = m;
    const Metrics iterated = measure(scene, sweeps, reference);
    EXPECT_LT(iterated.residual.rms, 0.5 * before) << m;
    before = iterated.residual.rms;
  }
  EXPECT_LT(before, 1e-4);
}

// Two rows keep a body of 2 kg from turning. One sweep solves them one after the other, so A2 leaves the body
// a spin, and A1 does not. Both step from one state, so that their difference is known.
TEST(Metrics, ResidualWeighsSpinsByMoments) {
  Scene scene = test::weightless_scene();
  const Vector3 moments(0.3, 0.5, 0.6);
  const Quaternion turned = rotation_quaternion({0.4, -0.7, 1.1});
  test::add_body(scene, 2, moments, {Vector3::Zero(), turned});
  scene.bodies[1].angular_velocity = {1, -2, 3};
  scene.joints.push_back(test::ball_joint(1, world_body, Vector3::Zero(), Vector3::Zero()));
  scene.joints[0].frame_a.orientation = turned.conjugate();
  scene.joints[0].limits = {test::locked(true, {true, true, false})};
  scene.duration = scene.step;
  const ReferenceMotion reference = reference_motion(scene, scene.duration);
  Settings settings = usual_settings(scene, Algorithm::a2);
  settings.joints = Joints::rows;
  settings.iterations = 1;
  const Metrics metrics = measure(scene, settings, reference);
  // The residual is measured in the step after the first.
  Simulation swept(scene, settings);
  Simulation direct(scene, usual_settings(scene, Algorithm::a1));
  swept.step();
  const State first = swept.state();
  direct.set_state(first);
  swept.step();
  direct.step();
  const Matrix3 rotation = swept.state().q[1].angular.toRotationMatrix();
  const Matrix3 inertia = rotation * moments.asDiagonal() * rotation.transpose();
  const Vector3 spin = swept.state().v[1].angular - direct.state().v[1].angular;
  EXPECT_GT(spin.norm(), 1e-3);  // measured 0.0046 rad/s
  EXPECT_NEAR(metrics.residual.largest, std::sqrt(spin.dot(inertia * spin) / 2), 1e-9);  // measured 4e-19
}

TEST(Metrics, FreeBodyKeepsMomentum) {
  Scene scene = scene_named("tumbling_body");
  scene.duration = 2;
  const ReferenceMotion reference = reference_motion(scene, 1);
  const Metrics m = measure(scene, usual_settings(scene, Algorithm::a1), reference);
  ASSERT_TRUE(m.momentum && m.angular_momentum);
  EXPECT_LT(*m.momentum, 1e-12);
  EXPECT_LT(*m.angular_momentum, 1e-12);
  const Scene held = scene_named("pendulum");
  EXPECT_FALSE(measure(held, usual_settings(held, Algorithm::a1), reference_motion(held, 0.1)).momentum);
}

TEST(Metrics, DivergedChainIsNotBounded) {
  Scene scene = scene_named("heavy_chain");
  scene.duration = 2;
  const ReferenceMotion reference = reference_motion(scene, 1);
  EXPECT_TRUE(measure(scene, usual_settings(scene, Algorithm::a1), reference, false).bounded);
  Settings coarse = usual_settings(scene, Algorithm::a5);
  coarse.substeps = 1;
  EXPECT_FALSE(measure(scene, coarse, reference, false).bounded);
  coarse.tau = 1;
  coarse.substeps = 16;
  EXPECT_TRUE(measure(scene, coarse, reference, false).bounded);
}

TEST(Metrics, InitialViolationIsSubtracted) {
  // A chain of 1.5 m cannot close joints 2 m apart; boxes that start 0.125 m inside each other are lifted.
  const auto is_bounded = [](const std::string& name, Algorithm algorithm) {
    const Scene scene = scene_named(name);
    ReferenceMotion none;
    none.motion = {scene.step, {initial_state(scene)}};
    return measure(scene, usual_settings(scene, algorithm), none, false).bounded;
  };
  EXPECT_FALSE(is_bounded("short_chain", Algorithm::a1));  // its joints open to 19 m
  EXPECT_TRUE(is_bounded("short_chain", Algorithm::a5));
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a5})
    EXPECT_TRUE(is_bounded("overlap", algorithm));
}

TEST(Json, RoundTripKeepsBits) {
  Scene scene = scene_named("heavy_chain");
  scene.duration = 0.5;
  Metrics m = measure(scene, usual_settings(scene, Algorithm::a5), reference_motion(scene, 0.25));
  m.expected = {{"height", "m", Bound::at_most, 0.1, 0.01, 1.0 / 3},
                {"way", "m", Bound::at_least, -2, 0.5, INFINITY},
                {"time", "s", Bound::equal, 1.5, 0.1, 1.25}};
  m.energy_scale = 7;
  Metrics gone = m;
  gone.error.position.rms = INFINITY;
  gone.diverged = 0.5;
  for (const Metrics& known : {m, gone}) {
    const Metrics read = metrics_in(Json::parse(to_json(known).dump()));
    EXPECT_EQ(to_json(read), to_json(known));
    EXPECT_EQ(read.error.position.rms, known.error.position.rms);
    EXPECT_EQ(read.parts.model, known.parts.model);
    EXPECT_EQ(read.energy_scale, known.energy_scale);
    EXPECT_EQ(read.diverged, known.diverged);
    EXPECT_FALSE(read.momentum);
    ASSERT_EQ(read.expected.size(), 3u);
    EXPECT_EQ(read.expected[1].measured, INFINITY);
    EXPECT_EQ(read.expected[1].bound, Bound::at_least);
    EXPECT_EQ(read.expected[1].tolerance, 0.5);
  }
  EXPECT_THROW(metrics_in(Json::object()), Error);
  EXPECT_THROW(times_in(Json(3)), Error);
}

TEST(MeasurementTables, HaveRowForEachRun) {
  Scene scene = scene_named("pendulum");
  scene.duration = 0.5;
  SceneMeasurement measurement;
  measurement.scene = scene.name;
  measurement.size = size_of(scene);
  measurement.duration = scene.duration;
  measurement.reference = reference_motion(scene, 0.5);
  for (const Algorithm algorithm : {Algorithm::a1, Algorithm::a5}) {
    const Settings settings = usual_settings(scene, algorithm);
    measurement.runs.push_back({settings, {}, measure(scene, settings, measurement.reference), {}});
  }
  const std::string table = to_text(measurement, true, false);
  const std::string compact = to_text(measurement, false, false);
  EXPECT_THAT(table, HasSubstr(measurement.reference.method));
  EXPECT_THAT(table, HasSubstr("A5  n=10 m=1 τ=0.6/0.9 κ=1/0.7 stable  h=1/60"));
  // The period is longer than half a second, so it is left out; the energy is not.
  EXPECT_THAT(table, HasSubstr("largest change of energy, J"));
  EXPECT_THAT(table, Not(HasSubstr("swings")));
  EXPECT_THAT(table, Not(HasSubstr("CPU time")));
  const std::size_t known = table.find("known figure, over the whole duration");
  ASSERT_NE(known, std::string::npos);
  const std::string head = table.substr(known, table.find('\n', known) - known);
  EXPECT_THAT(head, testing::AllOf(HasSubstr(" A1 "), HasSubstr(" A5 ")));
  EXPECT_THAT(compact, testing::AllOf(HasSubstr("h=1/60, n=10."), HasSubstr("Known figures: ")));
  for (MeasuredSettings& run : measurement.runs) run.times = RunTimes{0.001, 0.0009, 0.0011, 3, {1, 2, 3, 4}};
  EXPECT_THAT(to_text(measurement, true, false), HasSubstr("CPU time"));
  EXPECT_THAT(to_text(measurement, true, true),
              HasSubstr("\n| A5  n=10 m=1 τ=0.6/0.9 κ=1/0.7 stable  h=1/60 | "));
}

// A flywheel's angle can be wrong while its centre stays in place.
TEST(MeasurementTables, ShowErrorsThatAreTurnsAlone) {
  SceneMeasurement measurement;
  measurement.size = 1;
  measurement.reference.horizon = 1;
  measurement.runs.resize(1);
  Metrics& metrics = measurement.runs[0].metrics;
  metrics.joint_gap = 1e-14;
  metrics.error.orientation.rms = 0.36;
  EXPECT_THAT(to_text(measurement, false, false),
              testing::AllOf(HasSubstr("RMS turn, rad"), HasSubstr("0.36")));
  metrics.error.position.rms = 0.01;
  EXPECT_THAT(to_text(measurement, false, false), Not(HasSubstr("RMS turn, rad")));
}

TEST(StageTimes, ArePositiveForEachStage) {
  Scene scene = scene_named("box_stack");
  scene.duration = 3 * scene.step;
  const StageTimes times = time_run(scene, usual_settings(scene, Algorithm::a5), 1).stages;
  for (const double time : {times.geometry, times.formulation, times.velocities, times.coordinates})
    EXPECT_GT(time, 0);
}

}  // namespace
}  // namespace substep
