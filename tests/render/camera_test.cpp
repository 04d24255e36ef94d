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

View automatic(const Scene& scene, const Frames& frames, double its_aspect = aspect) {
  return automatic_view(gather_body_mesh(scene).parts, frames, its_aspect);
}

/// Returns how far from the picture's middle any corner gets of parts that are within 100 m.
double farthest_from_middle(const View& view, const Scene& scene, const Frames& frames) {
  const BodyMesh mesh = gather_body_mesh(scene);
  double farthest = 0;
  for (const auto& poses : frames) {
    for (const Part& part : mesh.parts) {
      const Coordinates& q = poses[part.body];
      if (is_scenery(part, mesh.parts) || !(q.linear.norm() < 100)) continue;
      for (const Vector3& corner : part.corners_at(q)) {
        const glm::dvec3 p = project(view, corner);
        farthest = std::max({farthest, std::abs(p.x), std::abs(p.y)});
        EXPECT_LT(std::abs(p.z), 1);
      }
    }
  }
  return farthest;
}

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

TEST(AutomaticView, HoldsMovingBodiesAndFillsThePicture) {
  const Scene scene = three_shapes();
  Frames frames{start_of(scene)};
  EXPECT_NEAR(farthest_from_middle(automatic(scene, frames), scene, frames), 1 / 1.12, 1e-9);
  for (int k = 1; k <= 30; ++k) {
    frames.push_back(frames.back());
    frames.back()[1].linear += Vector3(0.2, 0.1, -0.05);
    frames.back()[3].angular = compose(rotation_quaternion({0.1, 0.1, 0}), frames.back()[3].angular);
  }
  EXPECT_NEAR(farthest_from_middle(automatic(scene, frames), scene, frames), 1 / 1.12, 1e-9);
}

TEST(AutomaticView, IgnoresLostBodiesAndScenery) {
  Scene scene = three_shapes();
  Frames frames{start_of(scene)};
  const View near = automatic(scene, frames);
  frames.push_back(frames[0]);
  frames[1][1].linear = {1e9, 0, 0};
  frames[1][2].linear = Vector3::Constant(std::numeric_limits<double>::quiet_NaN());
  scene.colliders.emplace_back().shape = Plane{};
  scene.colliders.back().placement.orientation = rotation_quaternion({0, 0, 0.5});
  EXPECT_EQ(automatic(scene, frames).eye, near.eye);
}

TEST(AutomaticView, KeepsBodiesLargeOnALargeGround) {
  Scene scene = three_shapes();
  const Frames frames{start_of(scene)};
  const View near = automatic(scene, frames);
  double largest = 0;
  for (const Part& part : gather_body_mesh(scene).parts) {
    if (part.body != world_body) largest = std::max(largest, part.half_size().maxCoeff());
  }
  // Five times as large as the largest body, the ground is no scenery.
  scene.colliders.emplace_back().shape = box({10 * largest, 0.1, 10 * largest});
  const BodyMesh mesh = gather_body_mesh(scene);
  ASSERT_FALSE(is_scenery(mesh.parts.back(), mesh.parts));
  EXPECT_LT(glm::length(automatic(scene, frames).eye) / glm::length(near.eye), 1.3);  // measured 1.18
}

TEST(AutomaticView, ShowsTheOriginOfAnEmptyScene) {
  const Scene scene = empty_scene();
  const View view = automatic(scene, {start_of(scene)});
  EXPECT_LT(std::abs(project(view, {0, 0, 0}).x), 0.3);  // measured 0.06
  EXPECT_LT(std::abs(project(view, {0, 0, 0}).y), 0.3);  // measured 0.18
}

TEST(SteppedBackView, MovesAsFarAsIsNeeded) {
  const Scene scene = three_shapes();
  const BodyMesh mesh = gather_body_mesh(scene);
  Frames frames{start_of(scene)};
  const View wide = automatic(scene, frames, 1);
  EXPECT_EQ(stepped_back(wide, mesh.parts, frames).eye, wide.eye);
  View near = wide;
  near.eye += near.forward * 1.0;
  // A lost body does not count, one that moves within the scene does.
  frames.push_back(frames[0]);
  frames[1][1].linear += Vector3(0.3, 0.2, 0);
  frames[1][2].linear = {1e9, 0, 0};
  const View view = stepped_back(near, mesh.parts, frames);
  EXPECT_NEAR(glm::length(glm::cross(view.eye - near.eye, near.forward)), 0, 1e-12);
  EXPECT_NEAR(farthest_from_middle(view, scene, frames), 1 / 1.04, 1e-9);
}

TEST(SteppedBackView, HoldsTheLastBodyThatLeaves) {
  const Scene scene = three_shapes();
  Frames frames{start_of(scene)};
  const View near = automatic(scene, frames, 1);
  frames.push_back(frames[0]);
  for (std::size_t body = 1; body < frames[1].size(); ++body) frames[1][body].linear = {1e9, 0, 0};
  frames[1][1].linear = {40, 0, 0};
  const View view = stepped_back(near, gather_body_mesh(scene).parts, frames);
  const glm::dvec3 p = project(view, frames[1][1].linear);
  EXPECT_LT(std::max(std::abs(p.x), std::abs(p.y)), 1);
  EXPECT_GT(std::abs(p.x), 0.8);
}

TEST(SteppedBackView, HoldsPostsButNotWhatIsLongerThanThePictureIsWide) {
  struct Case {
    double aspect;
    Vector3 size;
    Vector3 position;
    bool is_held;
  };
  // The rail is too short to be scenery.
  for (const Case& one :
       {Case{1, {5.8, 0.02, 0.1}, {0, 0, 0}, false}, Case{aspect, {0.2, 4, 0.02}, {0, 1.3, 0}, false},
        Case{aspect, {0.2, 3.1, 0.02}, {0, 1.3, 0}, true}}) {
    Scene scene = three_shapes();
    const Frames frames{start_of(scene)};
    View near = automatic(scene, frames, one.aspect);
    near.eye = glm::dvec3(0, 1, 0) - near.forward * 2.5;
    const auto eye = [&] { return stepped_back(near, gather_body_mesh(scene).parts, frames).eye; };
    const glm::dvec3 without = eye();
    scene.colliders.emplace_back().shape = box(one.size);
    scene.colliders.back().placement.position = one.position;
    if (one.is_held) {
      EXPECT_GT(glm::dot(without - eye(), near.forward), 0.1);
    } else {
      EXPECT_EQ(eye(), without) << one.size.transpose();
    }
  }
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

TEST(ShadowView, LooksAtWhatIsInFrontOfALampAmongThem) {
  const ShadowView view =
      fit_lamp_view({0, 0, 0}, std::vector<glm::dvec3>{{-4, 0, 0.5}, {4, 0, 0.5}, {0, 0, 5}, {0, 1, -1}});
  EXPECT_NEAR(view.width, 6.6, 1e-12);
  const glm::dvec4 ahead = view.map_from_world * glm::dvec4(0, 0, 5, 1);
  EXPECT_NEAR(ahead.x / ahead.w, 0.5, 0.05);
  EXPECT_LT((view.map_from_world * glm::dvec4(0, 1, -1, 1)).w, 0);
}

}  // namespace
}  // namespace substep::render
