#include "render/shadow_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "render/picture_areas.h"
#include "render/targets.h"

namespace substep::render {

namespace {

struct Bounds {
  glm::dvec3 low = glm::dvec3(infinity);
  glm::dvec3 high = -low;

  void add(const glm::dvec3& point) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
};

constexpr double room = 1.1;  // so that penumbrae lie within the map

/// Returns two axes across the ray, and the ray.
std::array<glm::dvec3, 3> axes_along(const glm::dvec3& ray) {
  // These axes across the ray do not spin while the sun passes near an axis of the world.
  const glm::dvec3 helper = std::abs(ray.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1);
  const glm::dvec3 right = glm::normalize(glm::cross(ray, helper));
  return {right, glm::cross(right, ray), ray};
}

glm::dvec3 along(const std::array<glm::dvec3, 3>& axes, const glm::dvec3& p) {
  return {glm::dot(axes[0], p), glm::dot(axes[1], p), glm::dot(axes[2], p)};
}

}  // namespace

ShadowView fit_sun_view(const glm::dvec3& ray, std::span<const glm::dvec3> points) {
  const std::array<glm::dvec3, 3> axes = axes_along(ray);
  Bounds bounds;
  for (const glm::dvec3& point : points) bounds.add(along(axes, point));
  if (points.empty()) bounds = {glm::dvec3(-1), glm::dvec3(1)};
  const glm::dvec3 size = bounds.high - bounds.low;
  ShadowView view;
  view.width = std::max({size.x, size.y, 1e-3}) * room;
  view.depth = std::max(size.z, 1e-3) * room;
  const glm::dvec3 centre = (bounds.low + bounds.high) / 2.0;
  const glm::dvec3 scale(1 / view.width, 1 / view.width, 1 / view.depth);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      view.map_from_world[column][row] = axes[row][column] * scale[row];
      view.clip_from_world[column][row] = 2 * view.map_from_world[column][row];
    }
    view.map_from_world[3][row] = 0.5 - centre[row] * scale[row];
    view.clip_from_world[3][row] = -2 * centre[row] * scale[row];
  }
  return view;
}

ShadowView fit_lamp_view(const glm::dvec3& lamp, std::span<const glm::dvec3> points) {
  Bounds bounds;
  for (const glm::dvec3& point : points) bounds.add(point - lamp);
  const glm::dvec3 middle = points.empty() ? -lamp : (bounds.low + bounds.high) / 2.0;
  const double distance = glm::length(middle);
  const std::array<glm::dvec3, 3> axes =
      axes_along(distance > 1e-6 ? middle / distance : glm::dvec3(0, -1, 0));
  double near = std::max(distance, 1e-3);
  double far = near;
  double tangent = 0.01;
  for (const glm::dvec3& point : points) {
    const glm::dvec3 p = along(axes, point - lamp);
    const double aside = std::max(std::abs(p.x), std::abs(p.y));
    near = std::min(near, p.z);
    far = std::max(far, p.z);
    tangent = std::max(tangent, p.z > 0 ? aside / p.z : 0);
  }
  constexpr double widest = 3;
  ShadowView view;
  view.far = far;
  near = std::max(near / room, 0.02 * far);
  far *= room;
  view.width = 2 * room * std::min(tangent, widest);
  view.depth = (far - near) / (far * near);
  // The rows that give x, y, z and w of the map.
  const std::array<glm::dvec4, 4> rows{glm::dvec4(axes[0] / view.width + 0.5 * axes[2], 0),
                                       glm::dvec4(axes[1] / view.width + 0.5 * axes[2], 0),
                                       glm::dvec4(axes[2] * (far / (far - near)), -1 / view.depth),
                                       glm::dvec4(axes[2], 0)};
  for (int row = 0; row < 4; ++row) {
    const glm::dvec4& own = rows[row];
    for (int column = 0; column < 3; ++column) view.map_from_world[column][row] = own[column];
    view.map_from_world[3][row] = own[3] - glm::dot(glm::dvec3(own), lamp);
  }
  glm::dmat4 clip_from_map(2);
  clip_from_map[3] = {-1, -1, -1, 1};
  view.clip_from_world = clip_from_map * view.map_from_world;
  return view;
}

ShadowMap::ShadowMap(Objects& objects, int texels)
    : size(texels),
      framebuffer(bound_framebuffer(objects)),
      depth(attach_textures(objects, {}, texels, texels)),
      nearest(objects.texture()),
      depths(std::size_t{1} * texels * texels) {
  glReadBuffer(GL_NONE);
  glBindTexture(GL_TEXTURE_2D, nearest);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, blocks, blocks, 0, GL_RED, GL_FLOAT, nullptr);
}

void ShadowMap::start() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, size, size);
  glClear(GL_DEPTH_BUFFER_BIT);
}

void ShadowMap::finish() {
  // Reduce the map on the CPU: it is in main memory, and a pass by shaders takes longer.
  glReadPixels(0, 0, size, size, GL_DEPTH_COMPONENT, GL_FLOAT, depths.data());
  const std::vector<float> minima = block_minima(depths, size, size / blocks);
  // The widest penumbra takes samples up to two blocks away.
  constexpr int reach = 2;
  around.clear();
  for (int y = 0; y < blocks; ++y) {
    for (int x = 0; x < blocks; ++x) {
      float low = 1;
      for (int v = std::max(y - reach, 0); v <= std::min(y + reach, blocks - 1); ++v) {
        for (int u = std::max(x - reach, 0); u <= std::min(x + reach, blocks - 1); ++u) {
          low = std::min(low, minima[v * blocks + u]);
        }
      }
      around.push_back(low);
    }
  }
  glBindTexture(GL_TEXTURE_2D, nearest);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, blocks, blocks, GL_RED, GL_FLOAT, around.data());
}

}  // namespace substep::render
