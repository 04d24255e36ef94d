#include "render/picture_areas.h"

#include <algorithm>
#include <cmath>
#include <glm/vec4.hpp>
#include <limits>

#include "render/body_buffers.h"

namespace substep {
namespace {

constexpr int tile = 16;

/// Tiles from the first up to the one before the last.
struct Tiles {
  int left = 0;
  int right = 0;
  int bottom = 0;
  int top = 0;
};

/// From `low` to `high` of −1 to 1, and a pixel more on each side.
void set_range(double low, double high, int pixels, int& first, int& last) {
  const auto place = [&](double at) { return (at + 1) / 2 * pixels; };
  const int tiles = (pixels + tile - 1) / tile;
  first = static_cast<int>(std::clamp(std::floor((place(low) - 1) / tile), 0.0, static_cast<double>(tiles)));
  last =
      static_cast<int>(std::clamp(std::floor((place(high) + 1) / tile) + 1, 0.0, static_cast<double>(tiles)));
}

Tiles tiles_of(const Part& part, const Coordinates& q, const glm::dmat4& clip_from_world, int width,
               int height) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  glm::dvec2 low(infinite);
  glm::dvec2 high(-infinite);
  for (const Vector3& corner : part.corners()) {
    const Vector3 p = q.angular * corner + q.linear;
    const glm::dvec4 clip = clip_from_world * glm::dvec4(p.x(), p.y(), p.z(), 1);
    // Beside or behind the eye: it may be anywhere.
    if (!(clip.w > 1e-6)) {
      low = glm::dvec2(-1);
      high = glm::dvec2(1);
      break;
    }
    low = glm::min(low, glm::dvec2(clip.x, clip.y) / clip.w);
    high = glm::max(high, glm::dvec2(clip.x, clip.y) / clip.w);
  }
  Tiles tiles;
  set_range(low.x, high.x, width, tiles.left, tiles.right);
  set_range(low.y, high.y, height, tiles.bottom, tiles.top);
  return tiles;
}

}  // namespace

std::vector<Rectangle> areas_of(std::span<const Part> parts, std::span<const Coordinates> poses,
                                const glm::dmat4& clip_from_world, int width, int height) {
  const int columns = (width + tile - 1) / tile;
  const int rows = (height + tile - 1) / tile;
  std::vector<char> is_marked(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
  const auto at = [&](int x, int y) -> char& {
    return is_marked[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
                     static_cast<std::size_t>(x)];
  };
  for (const Part& part : parts) {
    const Coordinates& q = poses[static_cast<std::size_t>(part.body)];
    if (!is_drawable(q)) continue;
    const Tiles tiles = tiles_of(part, q, clip_from_world, width, height);
    for (int y = tiles.bottom; y < tiles.top; ++y) {
      for (int x = tiles.left; x < tiles.right; ++x) at(x, y) = 1;
    }
  }
  std::vector<Rectangle> areas;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns;) {
      const int first = x;
      while (x < columns && at(x, y) != 0) ++x;
      if (x > first) areas.push_back({tile * first, tile * y, tile * (x - first), tile});
      x = std::max(x, first + 1);
    }
  }
  return areas;
}

}  // namespace substep
