// Metrics of runs: the parts of errors, invariants, and the tables.

#include "sim/measure/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "sim/error.h"
#include "sim/measure/metrics_json.h"
#include "sim/measure/metrics_text.h"
#include "sim/measure/stage_times.h"
#include "sim/model/usual_settings.h"
#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

TEST(Metrics, PartsOfTheErrorAddUp) {
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

TEST(Metrics, A1HasNoSolverError) {
  const Scene scene = scene_named("rod_chain");
  const ReferenceMotion reference = reference_motion(scene, 0.5);
  const Metrics direct = measure(scene, usual_settings(scene, Algorithm::a1), reference);
  EXPECT_EQ(direct.residual.largest, 0);
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
  Scene scene = test::empty_scene();
  Body body;
  body.name = "body";
  body.inverse_mass = 0.5;
  body.inverse_inertia = {1 / 0.3, 1 / 0.5, 1 / 0.6};
  body.pose.orientation = rotation_quaternion({0.4, -0.7, 1.1});
  body.angular_velocity = {1, -2, 3};
  scene.bodies.push_back(body);
  Joint joint;
  joint.name = "joint";
  joint.body_a = 1;
  joint.body_b = world_body;
  joint.frame_a.orientation = body.pose.orientation.conjugate();
  joint.limits.push_back(test::locked(true, {true, true, false}));
  scene.joints.push_back(joint);
  scene.gravity.setZero();
  scene.duration = scene.step;
  const ReferenceMotion reference = reference_motion(scene, scene.duration);
  Settings settings = usual_settings(scene, Algorithm::a2);
  settings.joints = Joints::rows;
  settings.iterations = 1;
  const Metrics metrics = measure(scene, settings, reference);
  // The step after the first is judged.
  Simulation swept(scene, settings);
  Simulation direct(scene, usual_settings(scene, Algorithm::a1));
  swept.step();
  const State first = swept.state();
  direct.set_state(first);
  swept.step();
  direct.step();
  const Matrix3 rotation = swept.state().q[1].angular.toRotationMatrix();
  const Matrix3 inertia = rotation * body.inverse_inertia.cwiseInverse().asDiagonal() * rotation.transpose();
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
  EXPECT_LT(*m.angular_momentum, 1e-12);  // the gyroscopic step keeps it
  EXPECT_FALSE(measure(scene_named("pendulum"), usual_settings(scene_named("pendulum"), Algorithm::a1),
                       reference_motion(scene_named("pendulum"), 0.1))
                   .momentum);
}

TEST(Metrics, DivergedChainIsNotBounded) {
  Scene scene = scene_named("heavy_chain");
  scene.duration = 2;
  const ReferenceMotion reference = reference_motion(scene, 1);
  EXPECT_TRUE(measure(scene, usual_settings(scene, Algorithm::a1), reference, false).bounded);
  Settings coarse = usual_settings(scene, Algorithm::a5);
  coarse.substeps = 1;
  EXPECT_FALSE(measure(scene, coarse, reference, false).bounded);
  Settings fine = usual_settings(scene, Algorithm::a5);
  fine.tau = 1;
  fine.substeps = 16;
  EXPECT_TRUE(measure(scene, fine, reference, false).bounded);
}

TEST(Metrics, InitialViolationIsSubtracted) {
  // No chain of 1.5 m closes joints 2 m apart; boxes that start 0.125 m inside each other are lifted.
  const auto is_bounded = [](const std::string& name, Algorithm algorithm) {
    const Scene scene = scene_named(name);
    ReferenceMotion none;
    none.motion = {scene.step, {initial_state(scene)}};
    return measure(scene, usual_settings(scene, algorithm), none, false).bounded;
  };
  EXPECT_TRUE(is_bounded("short_chain", Algorithm::a5));
  EXPECT_FALSE(is_bounded("short_chain", Algorithm::a1));  // its joints open to 19 m
  EXPECT_TRUE(is_bounded("overlap", Algorithm::a5));
  EXPECT_TRUE(is_bounded("overlap", Algorithm::a1));
}

/// Returns the JSON as read from a file.
nlohmann::ordered_json through_text(const nlohmann::ordered_json& json) {
  return nlohmann::ordered_json::parse(json.dump());
}

TEST(Json, RoundTripKeepsBits) {
  Scene scene = scene_named("heavy_chain");
  scene.duration = 0.5;
  const ReferenceMotion reference = reference_motion(scene, 0.25);
  const Metrics m = measure(scene, usual_settings(scene, Algorithm::a5), reference);
  Metrics known = m;
  known.expected = {{"height", "m", Bound::at_most, 0.1, 0.01, 1.0 / 3},
                    {"way", "m", Bound::at_least, -2, 0.5, INFINITY},
                    {"time", "s", Bound::equal, 1.5, 0.1, 1.25}};
  const Metrics read = metrics_in(through_text(to_json(known)));
  EXPECT_EQ(to_json(read), to_json(known));
  ASSERT_EQ(read.expected.size(), 3u);
  EXPECT_EQ(read.expected[0].measured, 1.0 / 3);
  EXPECT_EQ(read.expected[0].bound, Bound::at_most);
  EXPECT_EQ(read.expected[1].measured, INFINITY);
  EXPECT_EQ(read.expected[1].bound, Bound::at_least);
  EXPECT_EQ(read.expected[2].tolerance, 0.1);
  const Metrics back = metrics_in(through_text(to_json(m)));
  EXPECT_EQ(to_json(back), to_json(m));
  EXPECT_EQ(back.error.position.rms, m.error.position.rms);
  EXPECT_EQ(back.parts.model, m.parts.model);
  EXPECT_FALSE(back.momentum);
  Metrics gone;
  gone.error.position.rms = INFINITY;
  gone.diverged = 0.5;
  EXPECT_EQ(metrics_in(through_text(to_json(gone))).error.position.rms, INFINITY);
  EXPECT_THROW(metrics_in("{}"), Error);
  EXPECT_THROW(times_in("3"), Error);
}

TEST(Penetration, EqualsDepthOfOverlap) {
  const Scene scene = scene_named("box_stack");
  PenetrationMeter meter(scene);
  State state = initial_state(scene);
  EXPECT_NEAR(meter.depth(state), 0, 1e-12);
  state.q.back().linear.y() -= 0.0625;
  EXPECT_NEAR(meter.depth(state), 0.0625, 1e-12);
}

TEST(Size, EqualsDiameterOfBoundingBall) {
  // Ten cubes of 1 m: 9 m between the outer centres, and their half diagonals.
  EXPECT_NEAR(size_of(scene_named("box_stack")), 9 + std::sqrt(3), 1e-9);
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
  const std::string table = to_table(measurement, true);
  EXPECT_NE(table.find(measurement.reference.method), std::string::npos);
  EXPECT_NE(table.find("A5  n=10 m=1 τ=0.6/0.9 κ=1/0.7 stable  h=1/60"), std::string::npos);
  // The period is longer than half a second, so it is left out; the energy is not.
  EXPECT_NE(table.find("largest change of energy, J"), std::string::npos);
  EXPECT_EQ(table.find("swings"), std::string::npos);
  EXPECT_EQ(table.find("CPU time"), std::string::npos);
  const std::size_t known = table.find("known for the whole duration");
  ASSERT_NE(known, std::string::npos);
  const std::string head = table.substr(known, table.find('\n', known) - known);
  EXPECT_NE(head.find(" A1 "), std::string::npos) << head;
  EXPECT_NE(head.find(" A5 "), std::string::npos) << head;
  const std::string compact = to_table(measurement);
  EXPECT_NE(compact.find("h=1/60, n=10."), std::string::npos) << compact;
  EXPECT_NE(compact.find("Known figures: "), std::string::npos) << compact;
  measurement.runs[0].times = RunTimes{0.001, 0.0009, 0.0011, 3, {1, 2, 3, 4}};
  measurement.runs[1].times = RunTimes{0.002, 0.0019, 0.0021, 3, {1, 2, 3, 4}};
  EXPECT_NE(to_table(measurement, true).find("CPU time"), std::string::npos);
}

TEST(StageTimes, ArePositiveForEachStage) {
  Scene scene = scene_named("box_stack");
  scene.duration = 3 * scene.step;
  const StageTimes times = time_run(scene, usual_settings(scene, Algorithm::a5), 1).stages;
  for (const double time : {times.geometry, times.formulation, times.coordinates}) EXPECT_GT(time, 0);
}

}  // namespace
}  // namespace substep
