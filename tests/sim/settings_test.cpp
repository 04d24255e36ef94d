// Names of settings.

#include "sim/model/settings.h"

#include <gtest/gtest.h>

#include "sim/model/usual_settings.h"

namespace substep {
namespace {

TEST(Settings, AreFoundByTheirNames) {
  for (const Algorithm algorithm :
       {Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    EXPECT_EQ(algorithm_named(name(algorithm)), algorithm);
  }
  for (const Joints joints : {Joints::rows, Joints::plain, Joints::stable})
    EXPECT_EQ(joints_named(name(joints)), joints);
  EXPECT_EQ(algorithm_named("a6"), std::nullopt);
  EXPECT_EQ(joints_named(""), std::nullopt);
}

TEST(Settings, FollowScene) {
  Scene scene;
  EXPECT_EQ(usual_settings(scene, Algorithm::a5).substeps, default_settings(Algorithm::a5).substeps);
  scene.step = 0.02;
  scene.substeps = 45;
  const Settings a2 = usual_settings(scene, Algorithm::a2);
  EXPECT_EQ(a2.step, 0.02);
  EXPECT_EQ(a2.iterations, 45);
  const Settings a3 = usual_settings(scene, Algorithm::a3);
  EXPECT_EQ(a3.substeps, 45);
  EXPECT_EQ(a3.iterations, 1);
}

}  // namespace
}  // namespace substep
