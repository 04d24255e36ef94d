#include "render/shadow_map.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

namespace substep::render {
namespace {

TEST(SunView, HoldsAllPointsInItsMiddle) {
  const std::vector<glm::dvec3> points{{0, 0, 0}, {3, 1, -2}, {-1, 4, 0.5}};
  for (const glm::dvec3 ray :
       {glm::dvec3(0, -1, 0), glm::normalize(glm::dvec3(-0.4, -1, 0.3)), glm::dvec3(1, 0, 0)}) {
    const ShadowView view = fit_sun_view(ray, points);
    for (const glm::dvec3& point : points) {
      const glm::dvec3 p(view.map_from_world * glm::dvec4(point, 1));
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_GT(p[axis], 0.04);  // measured 0.045, half the room around
        EXPECT_LT(p[axis], 0.96);
      }
    }
  }
}

TEST(LampView, HoldsAllPointsInItsMiddle) {
  const std::vector<glm::dvec3> points{{0, 0, 0}, {3, 1, -2}, {-1, 4, 0.5}};
  for (const glm::dvec3 lamp : {glm::dvec3(1, 9, 2), glm::dvec3(-7, 1, 0), glm::dvec3(1, -30, 80)}) {
    const ShadowView view = fit_lamp_view(lamp, points);
    for (const glm::dvec3& point : points) {
      const glm::dvec4 p = view.map_from_world * glm::dvec4(point, 1);
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_GT(p[axis] / p.w, 0.005);  // measured 0.01 in z, 0.045 across
        EXPECT_LT(p[axis] / p.w, 0.999);  // 0.997 in z
      }
      const glm::dvec4 clip = view.clip_from_world * glm::dvec4(point, 1);
      for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(clip[axis] / clip.w, 2 * p[axis] / p.w - 1, 1e-12);
    }
  }
}

TEST(LampView, LooksAtWhatIsInFrontOfALampAmongThem) {
  const std::vector<glm::dvec3> points{{-4, 0, 0.5}, {4, 0, 0.5}, {0, 0, 5}, {0, 1, -1}};
  const ShadowView view = fit_lamp_view({0, 0, 0}, points);
  EXPECT_NEAR(view.width, 6.6, 1e-12);
  const glm::dvec4 ahead = view.map_from_world * glm::dvec4(0, 0, 5, 1);
  EXPECT_NEAR(ahead.x / ahead.w, 0.5, 0.05);
  EXPECT_LT((view.map_from_world * glm::dvec4(0, 1, -1, 1)).w, 0);
}

}  // namespace
}  // namespace substep::render
