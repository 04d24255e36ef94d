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
    const SunView view = fit_sun_view(ray, points);
    for (const glm::dvec3& point : points) {
      const glm::dvec3 p(view.map_from_world * glm::dvec4(point, 1));
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_GT(p[axis], 0.04);  // measured 0.045, half the room around
        EXPECT_LT(p[axis], 0.96);
      }
    }
  }
}

TEST(SunView, MeasuresMetresAlongAndAcrossTheRay) {
  const glm::dvec3 ray = glm::normalize(glm::dvec3(-0.4, -1, 0.3));
  const std::vector<glm::dvec3> points{{0, 0, 0}, {3, 1, -2}};
  const SunView view = fit_sun_view(ray, points);
  const auto map = [&view](const glm::dvec3& p) {
    return glm::dvec3(view.map_from_world * glm::dvec4(p, 1));
  };
  const glm::dvec3 along = map(ray) - map(glm::dvec3(0));
  EXPECT_NEAR(along.x, 0, 1e-12);
  EXPECT_NEAR(along.y, 0, 1e-12);
  EXPECT_NEAR(along.z * view.depth, 1, 1e-12);
  const glm::dvec3 across = glm::normalize(glm::cross(ray, glm::dvec3(0.3, 0.5, 0.8)));
  EXPECT_NEAR(glm::length(map(across) - map(glm::dvec3(0))) * view.width, 1, 1e-12);
}

}  // namespace
}  // namespace substep::render
