#include "render/shadow_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace substep {

SunView fit_sun_view(const glm::dvec3& ray, std::span<const glm::dvec3> points) {
  // Any axes across the ray do; these do not spin while the sun passes near an axis of the world.
  const glm::dvec3 helper = std::abs(ray.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1);
  const glm::dvec3 right = glm::normalize(glm::cross(ray, helper));
  const std::array<glm::dvec3, 3> axes{right, glm::cross(right, ray), ray};
  glm::dvec3 low(std::numeric_limits<double>::infinity());
  glm::dvec3 high = -low;
  for (const glm::dvec3& point : points) {
    const glm::dvec3 p(glm::dot(axes[0], point), glm::dot(axes[1], point), glm::dot(axes[2], point));
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  if (points.empty()) {
    low = glm::dvec3(-1);
    high = glm::dvec3(1);
  }
  SunView view;
  constexpr double room = 1.1;  // so that penumbrae lie within the map
  view.width = std::max({high.x - low.x, high.y - low.y, 1e-3}) * room;
  view.depth = std::max(high.z - low.z, 1e-3) * room;
  const glm::dvec3 centre = (low + high) / 2.0;
  const glm::dvec3 scale(1 / view.width, 1 / view.width, 1 / view.depth);
  glm::dmat4 map(1);
  glm::dmat4 clip(1);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      map[column][row] = axes[static_cast<std::size_t>(row)][column] * scale[row];
      clip[column][row] = 2 * map[column][row];
    }
    map[3][row] = 0.5 - centre[row] * scale[row];
    clip[3][row] = -2 * centre[row] * scale[row];
  }
  view.map_from_world = map;
  view.clip_from_world = clip;
  return view;
}

ShadowMap::ShadowMap()
    : depths_(static_cast<std::size_t>(size) * size),
      low_(static_cast<std::size_t>(blocks) * blocks),
      high_(low_.size()) {
  glGenTextures(1, &depth_);
  glBindTexture(GL_TEXTURE_2D, depth_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, size, size, 0, GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
  glGenFramebuffers(1, &framebuffer_);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth_, 0);
  glDrawBuffer(GL_NONE);
  glReadBuffer(GL_NONE);
  glGenTextures(1, &range_);
  glBindTexture(GL_TEXTURE_2D, range_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RG32F, blocks, blocks, 0, GL_RG, GL_FLOAT, nullptr);
}

void ShadowMap::start() {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glViewport(0, 0, size, size);
  glDepthMask(GL_TRUE);
  glClear(GL_DEPTH_BUFFER_BIT);
}

void ShadowMap::finish() {
  // The map is in main memory anyway, and here a pass over it is cheaper than shaders'.
  glReadPixels(0, 0, size, size, GL_DEPTH_COMPONENT, GL_FLOAT, depths_.data());
  std::fill(low_.begin(), low_.end(), 1.0F);
  std::fill(high_.begin(), high_.end(), 0.0F);
  for (std::size_t y = 0; y < size; ++y) {
    for (std::size_t column = 0; column < blocks; ++column) {
      const float* depth = &depths_[y * size + column * block];
      float low = depth[0];
      float high = depth[0];
      for (std::size_t i = 1; i < block; ++i) {
        low = std::min(low, depth[i]);
        high = std::max(high, depth[i]);
      }
      const std::size_t index = y / block * blocks + column;
      low_[index] = std::min(low_[index], low);
      high_[index] = std::max(high_[index], high);
    }
  }
  // The widest penumbra takes samples up to two blocks away.
  constexpr int reach = 2;
  std::vector<float> range;
  range.reserve(2 * low_.size());
  for (int y = 0; y < blocks; ++y) {
    for (int x = 0; x < blocks; ++x) {
      float low = 1;
      float high = 0;
      for (int v = std::max(y - reach, 0); v <= std::min(y + reach, blocks - 1); ++v) {
        for (int u = std::max(x - reach, 0); u <= std::min(x + reach, blocks - 1); ++u) {
          low = std::min(low, low_[static_cast<std::size_t>(v) * blocks + static_cast<std::size_t>(u)]);
          high = std::max(high, high_[static_cast<std::size_t>(v) * blocks + static_cast<std::size_t>(u)]);
        }
      }
      range.push_back(low);
      range.push_back(high);
    }
  }
  glBindTexture(GL_TEXTURE_2D, range_);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, blocks, blocks, GL_RG, GL_FLOAT, range.data());
}

}  // namespace substep
