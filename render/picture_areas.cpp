#include "render/picture_areas.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/vec4.hpp>
#include <limits>

#include "render/body_buffers.h"

namespace substep::render {
namespace {

constexpr int tile = area_tile;

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
  const int tiles = tiles_along(pixels);
  first = static_cast<int>(std::clamp(std::floor((place(low) - 1) / tile), 0.0, static_cast<double>(tiles)));
  last =
      static_cast<int>(std::clamp(std::floor((place(high) + 1) / tile) + 1, 0.0, static_cast<double>(tiles)));
}

glm::dvec4 clip_of(const Vector3& point, const Coordinates& q, const glm::dmat4& clip_from_world) {
  const Vector3 p = q.angular * point + q.linear;
  return clip_from_world * glm::dvec4(p.x(), p.y(), p.z(), 1);
}

Tiles tiles_of(const Part& part, const Coordinates& q, const glm::dmat4& clip_from_world, int width,
               int height) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  glm::dvec2 low(infinite);
  glm::dvec2 high(-infinite);
  for (const Vector3& corner : part.corners()) {
    const glm::dvec4 clip = clip_of(corner, q, clip_from_world);
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

int tiles_along(int pixels) {
  return (pixels + tile - 1) / tile;
}

std::vector<Rectangle> rectangles(std::span<const char> marks, int columns, char mark, int side) {
  std::vector<Rectangle> found;
  const auto width = static_cast<std::size_t>(columns);
  std::vector<std::size_t> last(width,
                                0);  // of those that begin at a column; may be another column's at first
  for (std::size_t row = 0; row < marks.size() / width; ++row) {
    const std::span<const char> here = marks.subspan(row * width, width);
    const int y = side * static_cast<int>(row);
    for (auto at = std::ranges::find(here, mark); at != here.end();) {
      const auto end = std::find_if(at, here.end(), [&](char other) { return other != mark; });
      const Rectangle run{side * static_cast<int>(at - here.begin()), y, side * static_cast<int>(end - at),
                          side};
      std::size_t& below = last[static_cast<std::size_t>(at - here.begin())];
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
  std::vector<char> marks(static_cast<std::size_t>(columns) * static_cast<std::size_t>(tiles_along(height)),
                          0);
  for (const Part& part : parts) {
    const Coordinates& q = poses[static_cast<std::size_t>(part.body)];
    if (!is_drawable(q)) continue;
    const Tiles tiles = tiles_of(part, q, clip_from_world, width, height);
    for (int y = tiles.bottom; y < tiles.top; ++y) {
      for (int x = tiles.left; x < tiles.right; ++x) {
        marks[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x)] =
            1;
      }
    }
  }
  return rectangles(marks, columns, 1);
}

bool moves_by(double pixels, std::span<const Part> parts, std::span<const Coordinates> from,
              std::span<const Coordinates> to, const glm::dmat4& clip_from_world, int width, int height) {
  for (const Part& part : parts) {
    const Coordinates& a = from[static_cast<std::size_t>(part.body)];
    const Coordinates& b = to[static_cast<std::size_t>(part.body)];
    if (a.linear == b.linear && a.angular.coeffs() == b.angular.coeffs()) continue;
    for (const Vector3& corner : part.corners()) {
      const glm::dvec4 before = clip_of(corner, a, clip_from_world);
      const glm::dvec4 after = clip_of(corner, b, clip_from_world);
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

std::vector<Rectangle> seen_areas(std::span<const float> depths, const Rectangle& box, int side) {
  constexpr int pixels = 4;
  const auto width = static_cast<std::size_t>(side * box.width);
  const auto samples = static_cast<std::size_t>(side * pixels);
  const std::size_t columns = (width + samples - 1) / samples;
  std::vector<char> marks;
  std::vector<float> nearest(columns * samples, 1.0F);
  for (std::size_t row = 0; row * width < depths.size();) {
    std::ranges::fill(nearest, 1.0F);
    for (const std::size_t end = row + samples; row < end && row * width < depths.size(); ++row) {
      const float* const depth = &depths[row * width];
      for (std::size_t x = 0; x < width; ++x) nearest[x] = std::min(nearest[x], depth[x]);
    }
    for (std::size_t x = 0; x < nearest.size(); x += samples) {
      const auto begin = nearest.begin() + static_cast<std::ptrdiff_t>(x);
      marks.push_back(*std::min_element(begin, begin + static_cast<std::ptrdiff_t>(samples)) < 1 ? 1 : 0);
    }
  }
  std::vector<Rectangle> areas = rectangles(marks, static_cast<int>(columns), 1, pixels);
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
    const glm::dvec3 placed = place_ * glm::dvec3(point, 1);
    if (!(placed.z > 0)) return true;
    const glm::dvec2 at = glm::dvec2(placed) / placed.z;
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  // The cells beside take part where the map is read between cells.
  const auto cell = [&](double at, int beside) {
    return static_cast<std::size_t>(
        std::clamp(std::floor(at * size_) + beside, 0.0, static_cast<double>(size_)));
  };
  const std::size_t left = cell(low.x, -1);
  const std::size_t right = cell(high.x, 2);
  const std::size_t bottom = cell(low.y, -1);
  const std::size_t top = cell(high.y, 2);
  const auto side = static_cast<std::size_t>(size_) + 1;
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
        hits[static_cast<std::size_t>(i)] = glm::dvec2(eye.x + away * ray.x, eye.z + away * ray.z);
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
