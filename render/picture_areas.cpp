#include "render/picture_areas.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/vec4.hpp>

#include "render/camera.h"

namespace substep::render {
namespace {

constexpr int tile = area_tile;

/// Returns the first tile, and the one after the last, of the interval from `low` to `high` within −1 to 1,
/// with a pixel more on each side.
std::array<int, 2> tile_range(double low, double high, int pixels) {
  const auto bounded = [&](double at) {
    return static_cast<int>(std::clamp(at, 0.0, static_cast<double>(tiles_along(pixels))));
  };
  return {bounded(std::floor(((low + 1) / 2 * pixels - 1) / tile)),
          bounded(std::floor(((high + 1) / 2 * pixels + 1) / tile) + 1)};
}

glm::dvec4 clip_of(const Vector3& p, const glm::dmat4& clip_from_world) {
  return clip_from_world * glm::dvec4(to_glm(p), 1);
}

/// Returns the lower left and upper right bounds, from −1 to 1, of a part in the picture; all of it where a
/// corner is beside or behind the eye.
std::array<glm::dvec2, 2> bounds_in(const Part& part, const Coordinates& q,
                                    const glm::dmat4& clip_from_world) {
  glm::dvec2 low(infinity);
  glm::dvec2 high(-infinity);
  for (const Vector3& corner : part.corners_at(q)) {
    const glm::dvec4 clip = clip_of(corner, clip_from_world);
    if (!(clip.w > 1e-6)) return {glm::dvec2(-1), glm::dvec2(1)};
    low = glm::min(low, glm::dvec2(clip) / clip.w);
    high = glm::max(high, glm::dvec2(clip) / clip.w);
  }
  return {low, high};
}

}  // namespace

int tiles_along(int pixels) {
  return (pixels + tile - 1) / tile;
}

std::vector<Rectangle> rectangles(std::span<const char> marks, int columns, char mark, int side) {
  std::vector<Rectangle> found;
  const std::size_t width = columns;
  // The index of the last rectangle that begins at each column; 0 before there is one.
  std::vector<std::size_t> last(width, 0);
  for (std::size_t row = 0; row < marks.size() / width; ++row) {
    const std::span<const char> here = marks.subspan(row * width, width);
    const int y = side * static_cast<int>(row);
    for (auto at = std::ranges::find(here, mark); at != here.end();) {
      const auto end = std::find_if(at, here.end(), [&](char other) { return other != mark; });
      const Rectangle run{side * static_cast<int>(at - here.begin()), y, side * static_cast<int>(end - at),
                          side};
      std::size_t& below = last[at - here.begin()];
      const bool is_longer = below < found.size() && found[below].x == run.x &&
                             found[below].width == run.width && found[below].y + found[below].height == y;
      if (is_longer) {
        found[below].height += side;
      } else {
        below = found.size();
        found.push_back(run);
      }
      at = std::find(end, here.end(), mark);
    }
  }
  return found;
}

std::vector<Rectangle> areas_of(std::span<const Part> parts, std::span<const Coordinates> poses,
                                const glm::dmat4& clip_from_world, int width, int height) {
  const int columns = tiles_along(width);
  std::vector<char> marks(std::size_t{1} * columns * tiles_along(height), 0);
  for (const Part& part : parts) {
    const Coordinates& q = poses[part.body];
    if (!is_drawable(q)) continue;
    const auto [low, high] = bounds_in(part, q, clip_from_world);
    const auto [left, right] = tile_range(low.x, high.x, width);
    const auto [bottom, top] = tile_range(low.y, high.y, height);
    for (int y = bottom; y < top; ++y) {
      for (int x = left; x < right; ++x) marks[std::size_t{1} * y * columns + x] = 1;
    }
  }
  return rectangles(marks, columns, 1);
}

bool moves_by(double pixels, std::span<const Part> parts, std::span<const Coordinates> from,
              std::span<const Coordinates> to, const glm::dmat4& clip_from_world, int width, int height) {
  for (const Part& part : parts) {
    const Coordinates& a = from[part.body];
    const Coordinates& b = to[part.body];
    if (a.linear == b.linear && a.angular.coeffs() == b.angular.coeffs()) continue;
    const std::array<Vector3, 8> corners_before = part.corners_at(a);
    const std::array<Vector3, 8> corners_after = part.corners_at(b);
    for (std::size_t i = 0; i < corners_before.size(); ++i) {
      const glm::dvec4 before = clip_of(corners_before[i], clip_from_world);
      const glm::dvec4 after = clip_of(corners_after[i], clip_from_world);
      if (!(before.w > 1e-6 && after.w > 1e-6)) return true;
      const glm::dvec2 shift = glm::dvec2(after) / after.w - glm::dvec2(before) / before.w;
      if (!(std::hypot(shift.x * width, shift.y * height) < 2 * pixels)) return true;
    }
  }
  return false;
}

Rectangle bounds_of(std::span<const Rectangle> areas, int width, int height) {
  if (areas.empty()) return {};
  Rectangle box{width, height, 0, 0};
  int right = 0;
  int top = 0;
  for (const Rectangle& area : areas) {
    box.x = std::min(box.x, area.x);
    box.y = std::min(box.y, area.y);
    right = std::max(right, std::min(area.x + area.width, width));
    top = std::max(top, std::min(area.y + area.height, height));
  }
  box.width = right - box.x;
  box.height = top - box.y;
  return box;
}

std::vector<float> block_minima(std::span<const float> depths, std::size_t width, std::size_t block) {
  std::vector<float> minima;
  std::vector<float> columns(width);
  for (std::size_t row = 0; row * width < depths.size();) {
    std::ranges::fill(columns, 1.0F);
    for (const std::size_t end = row + block; row < end && row * width < depths.size(); ++row) {
      const float* const depth = &depths[row * width];
      for (std::size_t x = 0; x < width; ++x) columns[x] = std::min(columns[x], depth[x]);
    }
    for (std::size_t x = 0; x < width; x += block) {
      minima.push_back(std::ranges::min(std::span(columns).subspan(x, std::min(block, width - x))));
    }
  }
  return minima;
}

std::vector<Rectangle> seen_areas(std::span<const float> depths, const Rectangle& box, int side) {
  constexpr int pixels = 4;
  std::vector<char> marks;
  for (const float depth : block_minima(depths, side * box.width, side * pixels))
    marks.push_back(depth < 1 ? 1 : 0);
  std::vector<Rectangle> areas = rectangles(marks, (box.width + pixels - 1) / pixels, 1, pixels);
  for (Rectangle& area : areas) {
    area.x += box.x;
    area.y += box.y;
  }
  return areas;
}

bool MarkedCells::has_any(std::span<const glm::dvec2> points) const {
  glm::dvec2 low(2);
  glm::dvec2 high(-1);
  for (const glm::dvec2& point : points) {
    const glm::dvec3 placed = to_map_ * glm::dvec3(point, 1);
    if (!(placed.z > 0)) return true;
    const glm::dvec2 at = glm::dvec2(placed) / placed.z;
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  // Include neighbouring cells, which interpolation reads.
  const double size = size_;
  const auto cell = [&](double at, int beside) {
    return static_cast<std::size_t>(std::clamp(std::floor(at * size) + beside, 0.0, size));
  };
  const std::size_t left = cell(low.x, -1);
  const std::size_t right = cell(high.x, 2);
  const std::size_t bottom = cell(low.y, -1);
  const std::size_t top = cell(high.y, 2);
  const std::size_t side = std::size_t{1} + size_;
  return below_[top * side + right] - below_[top * side + left] - below_[bottom * side + right] +
             below_[bottom * side + left] >
         0;
}

GroundAreas ground_areas(const glm::dvec3& eye, double above, const glm::dvec3& corner,
                         const glm::dvec3& right, const glm::dvec3& up, int width, int height,
                         const MarkedCells& shadow, const MarkedCells& occlusion) {
  const int columns = tiles_along(width);
  const int rows = tiles_along(height);
  enum Mark : char { open, occluded, shadowed };
  std::vector<char> marks;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      std::array<glm::dvec2, 4> hits{};
      int on_ground = 0;
      for (int i = 0; i < 4; ++i) {
        const int u = tile * (x + i % 2);
        const int v = tile * (y + i / 2);
        const glm::dvec3 ray = corner + right * static_cast<double>(u) + up * static_cast<double>(v);
        const double away = -above / ray.y;
        on_ground += away > 0 && away < 1e9 ? 1 : 0;
        hits[i] = glm::dvec2(eye.x + away * ray.x, eye.z + away * ray.z);
      }
      // At the horizon the ground may be anywhere; above it, there is none.
      const bool is_horizon = on_ground > 0 && on_ground < 4;
      marks.push_back(on_ground == 0                       ? open
                      : is_horizon || shadow.has_any(hits) ? shadowed
                      : occlusion.has_any(hits)            ? occluded
                                                           : open);
    }
  }
  return {rectangles(marks, columns, shadowed), rectangles(marks, columns, occluded),
          rectangles(marks, columns, open)};
}

}  // namespace substep::render
