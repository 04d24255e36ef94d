#include "render/camera.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include "render/body_mesh.h"
#include "sim/geometry/convex_hull.h"
#include "sim/math/rotation.h"
#include "test_scenes.h"

namespace substep::render {
namespace {

constexpr double aspect = 16.0 / 9;

glm::dvec3 project(const View& view, const Vector3& point) {
  const glm::dvec4 clip = clip_from_world(view, 0.1, 1000) * glm::dvec4(point.x(), point.y(), point.z(), 1);
  return glm::dvec3(clip) / clip.w;
}

TEST(View, ASceneCameraLooksAlongItsMinusZ) {
  Camera camera;
  camera.pose = {{1, 2, 3}, rotation_quaternion({0.2, -0.7, 0.1})};
  camera.vertical_field_of_view = 0.8;
  const View view = view_from(camera, aspect);
  const glm::dvec3 ahead = project(view, camera.pose * Vector3(0, 0, -5));
  EXPECT_NEAR(ahead.x, 0, 1e-12);  // measured 2e-16
  EXPECT_NEAR(ahead.y, 0, 1e-12);
  // The picture's upper edge is half the field of view above the axis: tan 0.4 = 0.42279321873816178.
  const glm::dvec3 edge = project(view, camera.pose * Vector3(0, 5 * 0.42279321873816178, -5));
  EXPECT_NEAR(edge.y, 1, 1e-12);
  const glm::dvec3 side = project(view, camera.pose * Vector3(5 * aspect * 0.42279321873816178, 0, -5));
  EXPECT_NEAR(side.x, 1, 1e-12);
}

/// Corners of all moving parts over all frames, as far from the picture's middle as any of them gets.
double farthest_from_middle(const Scene& scene, const std::vector<std::vector<Coordinates>>& frames) {
  const BodyMesh mesh = gather_body_mesh(scene);
  const View view = automatic_view(mesh.parts, frames, aspect);
  double farthest = 0;
  for (const auto& poses : frames) {
    for (const Part& part : mesh.parts) {
      if (is_scenery(part, mesh.parts)) continue;
      const Coordinates& q = poses[static_cast<std::size_t>(part.body)];
      if (!(q.linear.norm() < 100)) continue;
      for (const Vector3& corner : part.corners()) {
        const glm::dvec3 p = project(view, q.angular * corner + q.linear);
        farthest = std::max({farthest, std::abs(p.x), std::abs(p.y)});
        EXPECT_LT(std::abs(p.z), 1);
      }
    }
  }
  return farthest;
}

TEST(View, TheAutomaticCameraSeesAllThatMovesAndFillsThePicture) {
  Scene scene = three_shapes();
  std::vector<std::vector<Coordinates>> frames{initial_state(scene).q};
  EXPECT_NEAR(farthest_from_middle(scene, frames), 1 / 1.12, 1e-9);  // measured 1e-15 off
  for (int k = 1; k <= 30; ++k) {
    frames.push_back(frames.back());
    frames.back()[1].linear += Vector3(0.2, 0.1, -0.05);
    frames.back()[3].angular = compose(rotation_quaternion({0.1, 0.1, 0}), frames.back()[3].angular);
  }
  EXPECT_NEAR(farthest_from_middle(scene, frames), 1 / 1.12, 1e-9);
}

TEST(View, BodiesThatAreGoneAndSceneryDoNotPullTheCamera) {
  Scene scene = three_shapes();
  std::vector<std::vector<Coordinates>> frames{initial_state(scene).q};
  const View near = automatic_view(gather_body_mesh(scene).parts, frames, aspect);
  frames.push_back(frames[0]);
  frames[1][1].linear = {1e9, 0, 0};
  frames[1][2].linear = Vector3::Constant(std::numeric_limits<double>::quiet_NaN());
  scene.colliders.emplace_back().shape = Plane{};
  scene.colliders.back().placement.orientation = rotation_quaternion({0, 0, 0.5});
  const View view = automatic_view(gather_body_mesh(scene).parts, frames, aspect);
  EXPECT_EQ(view.eye, near.eye);
}

TEST(View, KeepsBodiesLargeOnALargeGround) {
  Scene scene = three_shapes();
  std::vector<std::vector<Coordinates>> frames{initial_state(scene).q};
  const View near = automatic_view(gather_body_mesh(scene).parts, frames, aspect);
  double largest = 0;
  for (const Part& part : gather_body_mesh(scene).parts) {
    if (part.body != world_body) largest = std::max(largest, part.half_size().maxCoeff());
  }
  // Five times as large as the largest body, it is no scenery.
  scene.colliders.emplace_back().shape = box({10 * largest, 0.1, 10 * largest});
  const BodyMesh mesh = gather_body_mesh(scene);
  ASSERT_FALSE(is_scenery(mesh.parts.back(), mesh.parts));
  const View view = automatic_view(mesh.parts, frames, aspect);
  const double distance = glm::length(near.eye);
  EXPECT_LT(glm::length(view.eye) / distance, 1.3);  // measured 1.18
}

TEST(View, ACameraStepsBackAsFarAsIsNeeded) {
  const Scene scene = three_shapes();
  const BodyMesh mesh = gather_body_mesh(scene);
  std::vector<std::vector<Coordinates>> frames{initial_state(scene).q};
  const View wide = automatic_view(mesh.parts, frames, 1);
  // It sees all: nothing is changed.
  EXPECT_EQ(stepped_back(wide, mesh.parts, frames).eye, wide.eye);
  View near = wide;
  near.eye += near.forward * 1.0;
  // What is lost does not count, what moves within the scene does.
  frames.push_back(frames[0]);
  frames[1][1].linear += Vector3(0.3, 0.2, 0);
  frames[1][2].linear = {1e9, 0, 0};
  const View view = stepped_back(near, mesh.parts, frames);
  EXPECT_NEAR(glm::length(glm::cross(view.eye - near.eye, near.forward)), 0, 1e-12);
  double farthest = 0;
  for (const Part& part : mesh.parts) {
    for (const std::size_t k : {0, 1}) {
      const Coordinates& q = frames[k][static_cast<std::size_t>(part.body)];
      if (is_scenery(part, mesh.parts) || q.linear.norm() > 100) continue;
      for (const Vector3& corner : part.corners()) {
        const glm::dvec3 p = project(view, q.angular * corner + q.linear);
        farthest = std::max({farthest, std::abs(p.x), std::abs(p.y)});
      }
    }
  }
  EXPECT_NEAR(farthest, 1 / 1.04, 1e-9);
}

TEST(View, ACameraStepsBackForTheLastThatLeaves) {
  const Scene scene = three_shapes();
  std::vector<std::vector<Coordinates>> frames{initial_state(scene).q};
  const View near = automatic_view(gather_body_mesh(scene).parts, frames, 1);
  // All but one go off; the last leaves, too, but not as far.
  frames.push_back(frames[0]);
  for (std::size_t body = 1; body < frames[1].size(); ++body) frames[1][body].linear = {1e9, 0, 0};
  frames[1][1].linear = {40, 0, 0};
  const View view = stepped_back(near, gather_body_mesh(scene).parts, frames);
  const glm::dvec3 p = project(view, frames[1][1].linear);
  EXPECT_LT(std::max(std::abs(p.x), std::abs(p.y)), 1);
  EXPECT_GT(std::abs(p.x), 0.8);
}

TEST(View, ACameraDoesNotStepBackForARail) {
  Scene scene = three_shapes();
  const std::vector<std::vector<Coordinates>> frames{initial_state(scene).q};
  View near = automatic_view(gather_body_mesh(scene).parts, frames, 1);
  near.eye = glm::dvec3(0, 1, 0) - near.forward * 2.5;
  const auto eye = [&] { return stepped_back(near, gather_body_mesh(scene).parts, frames).eye; };
  const glm::dvec3 without = eye();
  // Of 5.8 m, at 2.5 m: too short to be scenery.
  scene.colliders.emplace_back().shape = box({5.8, 0.02, 0.1});
  EXPECT_EQ(eye(), without);
}

TEST(View, ACameraStepsBackForAPostButNotForOneLongerThanThePictureIsWide) {
  Scene scene = three_shapes();
  const std::vector<std::vector<Coordinates>> frames{initial_state(scene).q};
  View near = automatic_view(gather_body_mesh(scene).parts, frames, 16.0 / 9);
  near.eye = glm::dvec3(0, 1, 0) - near.forward * 2.5;
  const auto eye = [&] { return stepped_back(near, gather_body_mesh(scene).parts, frames).eye; };
  const glm::dvec3 without = eye();
  scene.colliders.emplace_back().shape = box({0.2, 4, 0.02});
  scene.colliders.back().placement.position = {0, 1.3, 0};
  EXPECT_EQ(eye(), without);
  scene.colliders.back().shape = box({0.2, 3.1, 0.02});
  EXPECT_GT(glm::dot(without - eye(), near.forward), 0.1);
}

TEST(View, AnEmptySceneStillHasAView) {
  const Scene scene = empty_scene();
  const std::vector<std::vector<Coordinates>> frames{initial_state(scene).q};
  const View view = automatic_view(gather_body_mesh(scene).parts, frames, aspect);
  EXPECT_LT(std::abs(project(view, {0, 0, 0}).x), 0.3);  // measured 0.06
  EXPECT_LT(std::abs(project(view, {0, 0, 0}).y), 0.3);  // measured 0.18
}

}  // namespace
}  // namespace substep::render
