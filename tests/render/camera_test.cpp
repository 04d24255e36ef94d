#include "render/camera.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <limits>

#include "render/body_mesh.h"
#include "render/shadow_map.h"
#include "test_scenes.h"

namespace substep::render {
namespace {

using Frames = std::vector<std::vector<Coordinates>>;

constexpr double aspect = 16.0 / 9;

glm::dvec3 project(const View& view, const Vector3& point) {
  const glm::dvec4 clip = clip_from_world(view, 0.1, 1000) * glm::dvec4(point.x(), point.y(), point.z(), 1);
  return glm::dvec3(clip) / clip.w;
}

/// Views of three shapes, whose scene and frames a test may change.
class AutomaticView : public testing::Test {
 protected:
  View view(double its_aspect = aspect) const {
    return automatic_view(gather_body_mesh(scene_).parts, frames_, its_aspect);
  }

  View stepped_back_from(const View& near) const {
    return stepped_back(near, gather_body_mesh(scene_).parts, frames_);
  }

  /// Adds a frame like the first.
  std::vector<Coordinates>& add_frame() { return frames_.emplace_back(start_of(scene_)); }

  /// Returns the largest distance from the picture's middle of the corners of parts within 100 m.
  double farthest_from_middle(const View& seen) const {
    const BodyMesh mesh = gather_body_mesh(scene_);
    double farthest = 0;
    for (const auto& poses : frames_) {
      for (const Part& part : mesh.parts) {
        const Coordinates& q = poses[part.body];
        if (is_scenery(part, mesh.parts) || !(q.linear.norm() < 100)) continue;
        for (const Vector3& corner : part.corners_at(q)) {
          const glm::dvec3 p = project(seen, corner);
          farthest = std::max({farthest, std::abs(p.x), std::abs(p.y)});
          EXPECT_LT(std::abs(p.z), 1);
        }
      }
    }
    return farthest;
  }

  Scene scene_ = three_shapes();
  Frames frames_{start_of(scene_)};
};

using SteppedBackView = AutomaticView;

TEST(View, LooksAlongMinusZOfTheCamera) {
  const Camera camera{{{1, 2, 3}, rotation_quaternion({0.2, -0.7, 0.1})}, 0.8};
  const View view = view_from(camera, aspect);
  // The picture's upper edge is half the field of view above the axis: tan 0.4 = 0.42279321873816178.
  constexpr double tangent = 0.42279321873816178;
  const glm::dvec3 ahead = project(view, camera.pose * Vector3(0, 0, -5));
  EXPECT_NEAR(ahead.x, 0, 1e-12);  // measured 2e-16
  EXPECT_NEAR(ahead.y, 0, 1e-12);
  EXPECT_NEAR(project(view, camera.pose * Vector3(0, 5 * tangent, -5)).y, 1, 1e-12);
  EXPECT_NEAR(project(view, camera.pose * Vector3(5 * aspect * tangent, 0, -5)).x, 1, 1e-12);
}

TEST_F(AutomaticView, HoldsMovingBodiesAndFillsThePicture) {
  EXPECT_NEAR(farthest_from_middle(view()), 1 / 1.12, 1e-9);  // measured 1e-15 off
  for (int k = 1; k <= 30; ++k) {
    frames_.push_back(frames_.back());
    frames_.back()[1].linear += Vector3(0.2, 0.1, -0.05);
    frames_.back()[3].angular = compose(rotation_quaternion({0.1, 0.1, 0}), frames_.back()[3].angular);
  }
  EXPECT_NEAR(farthest_from_middle(view()), 1 / 1.12, 1e-9);
  // The same scene far from the origin is seen alike.
  const glm::dvec3 eye = view().eye;
  for (std::vector<Coordinates>& poses : frames_) {
    for (Coordinates& q : poses) q.linear += Vector3(5000, 0, 3000);
  }
  EXPECT_NEAR(glm::distance(view().eye, eye + glm::dvec3(5000, 0, 3000)), 0, 1e-6);
}

TEST_F(AutomaticView, IgnoresLostBodiesAndScenery) {
  const View near = view();
  std::vector<Coordinates>& poses = add_frame();
  poses[1].linear = {1e9, 0, 0};
  poses[2].linear = Vector3::Constant(std::numeric_limits<double>::quiet_NaN());
  poses[3].linear = {0, 1e5, 0};
  scene_.colliders.emplace_back().shape = Plane{};
  scene_.colliders.back().placement.orientation = rotation_quaternion({0, 0, 0.5});
  EXPECT_EQ(view().eye, near.eye);
}

TEST_F(AutomaticView, KeepsBodiesLargeOnLargeGround) {
  const View near = view();
  double largest = 0;
  for (const Part& part : gather_body_mesh(scene_).parts) {
    if (part.body != world_body) largest = std::max(largest, part.half_size().maxCoeff());
  }
  // Five times as large as the largest body, the ground is no scenery.
  scene_.colliders.emplace_back().shape = box({10 * largest, 0.1, 10 * largest});
  const BodyMesh mesh = gather_body_mesh(scene_);
  ASSERT_FALSE(is_scenery(mesh.parts.back(), mesh.parts));
  EXPECT_LT(glm::length(view().eye) / glm::length(near.eye), 1.3);  // measured 1.18
}

TEST_F(AutomaticView, ShowsTheOriginOfAnEmptyScene) {
  scene_ = empty_scene();
  frames_ = {start_of(scene_)};
  const glm::dvec3 origin = project(view(), {0, 0, 0});
  EXPECT_LT(std::abs(origin.x), 0.3);  // measured 0.06
  EXPECT_LT(std::abs(origin.y), 0.3);  // measured 0.18
}

TEST_F(SteppedBackView, MovesLeastSufficientDistance) {
  View near = view(1);
  EXPECT_EQ(stepped_back_from(near).eye, near.eye);
  near.eye += near.forward * 1.0;
  // A lost body does not count, one that moves within the scene does.
  std::vector<Coordinates>& poses = add_frame();
  poses[1].linear += Vector3(0.3, 0.2, 0);
  poses[2].linear = {1e9, 0, 0};
  const View back = stepped_back_from(near);
  EXPECT_NEAR(glm::length(glm::cross(back.eye - near.eye, near.forward)), 0, 1e-12);
  EXPECT_NEAR(farthest_from_middle(back), 1 / 1.04, 1e-9);
}

TEST_F(SteppedBackView, HoldsTheLastBodyThatLeaves) {
  const View near = view(1);
  std::vector<Coordinates>& poses = add_frame();
  for (std::size_t body = 1; body < poses.size(); ++body) poses[body].linear = {1e9, 0, 0};
  poses[1].linear = {40, 0, 0};
  const glm::dvec3 p = project(stepped_back_from(near), poses[1].linear);
  EXPECT_LT(std::max(std::abs(p.x), std::abs(p.y)), 1);
  EXPECT_GT(std::abs(p.x), 0.8);
}

TEST_F(SteppedBackView, HoldsPostsButNoLongRails) {
  const auto steps_by = [&](double its_aspect, const Vector3& size, const Vector3& position) {
    scene_ = three_shapes();
    View near = view(its_aspect);
    near.eye = glm::dvec3(0, 1, 0) - near.forward * 2.5;
    const glm::dvec3 without = stepped_back_from(near).eye;
    scene_.colliders.emplace_back().shape = box(size);
    scene_.colliders.back().placement.position = position;
    return glm::dot(without - stepped_back_from(near).eye, near.forward);
  };
  EXPECT_EQ(steps_by(1, {5.8, 0.02, 0.1}, {0, 0, 0}), 0);  // a rail, too short to be scenery
  EXPECT_EQ(steps_by(aspect, {0.2, 4, 0.02}, {0, 1.3, 0}), 0);
  EXPECT_GT(steps_by(aspect, {0.2, 3.1, 0.02}, {0, 1.3, 0}), 0.1);
}

/// Expects all coordinates of the points in a light's map to lie between two fractions of it.
void expect_all_within(const ShadowView& view, const std::vector<glm::dvec3>& points, double near,
                       double far) {
  for (const glm::dvec3& point : points) {
    const glm::dvec4 p = view.map_from_world * glm::dvec4(point, 1);
    const glm::dvec4 clip = view.clip_from_world * glm::dvec4(point, 1);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GT(p[axis] / p.w, near);
      EXPECT_LT(p[axis] / p.w, far);
      EXPECT_NEAR(clip[axis] / clip.w, 2 * p[axis] / p.w - 1, 1e-12);
    }
  }
}

TEST(ShadowView, HoldsAllPointsInItsMiddle) {
  const std::vector<glm::dvec3> points{{0, 0, 0}, {3, 1, -2}, {-1, 4, 0.5}};
  for (const glm::dvec3 ray :
       {glm::dvec3(0, -1, 0), glm::normalize(glm::dvec3(-0.4, -1, 0.3)), glm::dvec3(1, 0, 0)}) {
    expect_all_within(fit_sun_view(ray, points), points, 0.04, 0.96);  // measured 0.045, half the room around
  }
  for (const glm::dvec3 lamp : {glm::dvec3(1, 9, 2), glm::dvec3(-7, 1, 0), glm::dvec3(1, -30, 80)}) {
    // Measured 0.01 and 0.997 in z, 0.045 across.
    expect_all_within(fit_lamp_view(lamp, points), points, 0.005, 0.999);
  }
}

TEST(ShadowView, LimitsAngleOfLamps) {
  const ShadowView view =
      fit_lamp_view({0, 0, 0}, std::vector<glm::dvec3>{{-4, 0, 0.5}, {4, 0, 0.5}, {0, 0, 5}, {0, 1, -1}});
  EXPECT_NEAR(view.width, 6.6, 1e-12);
  const glm::dvec4 ahead = view.map_from_world * glm::dvec4(0, 0, 5, 1);
  EXPECT_NEAR(ahead.x / ahead.w, 0.5, 0.05);
  EXPECT_LT((view.map_from_world * glm::dvec4(0, 1, -1, 1)).w, 0);
}

}  // namespace
}  // namespace substep::render
