#include "render/shadow_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace substep::render {

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

ShadowMap::ShadowMap(int texels)
    : size(texels), depths_(static_cast<std::size_t>(size) * static_cast<std::size_t>(size)) {
  glGenTextures(1, &depth_);
  glBindTexture(GL_TEXTURE_2D, depth_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, size, size, 0, GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
  glGenFramebuffers(1, &framebuffer_);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth_, 0);
  glDrawBuffer(GL_NONE);
  glReadBuffer(GL_NONE);
  glGenTextures(1, &nearest_);
  glBindTexture(GL_TEXTURE_2D, nearest_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, blocks, blocks, 0, GL_RED, GL_FLOAT, nullptr);
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
  const auto width = static_cast<std::size_t>(size);
  const std::size_t block = width / blocks;
  constexpr auto count = static_cast<std::size_t>(blocks);
  std::vector<float> nearest(count * count);
  std::vector<float> columns(width);
  for (std::size_t v = 0; v < count; ++v) {
    std::fill(columns.begin(), columns.end(), 1.0F);
    for (std::size_t y = v * block; y < (v + 1) * block; ++y) {
      const float* const row = &depths_[y * width];
      for (std::size_t x = 0; x < width; ++x) columns[x] = std::min(columns[x], row[x]);
    }
    for (std::size_t u = 0; u < count; ++u) {
      const auto begin = columns.begin() + static_cast<std::ptrdiff_t>(u * block);
      nearest[v * count + u] = *std::min_element(begin, begin + static_cast<std::ptrdiff_t>(block));
    }
  }
  // The widest penumbra takes samples up to two blocks away.
  constexpr int reach = 2;
  around_.clear();
  for (int y = 0; y < blocks; ++y) {
    for (int x = 0; x < blocks; ++x) {
      float low = 1;
      for (int v = std::max(y - reach, 0); v <= std::min(y + reach, blocks - 1); ++v) {
        for (int u = std::max(x - reach, 0); u <= std::min(x + reach, blocks - 1); ++u) {
          low = std::min(low, nearest[static_cast<std::size_t>(v) * count + static_cast<std::size_t>(u)]);
        }
      }
      around_.push_back(low);
    }
  }
  glBindTexture(GL_TEXTURE_2D, nearest_);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, blocks, blocks, GL_RED, GL_FLOAT, around_.data());
}

}  // namespace substep::render
