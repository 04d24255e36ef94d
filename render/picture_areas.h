#pragma once
/// The areas of a picture in which bodies can be visible, and those in which the ground can be shaded.

#include <cstddef>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "render/body_mesh.h"
#include "sim/model/state.h"

namespace substep::render {

/// Pixels, from the picture's lower left corner.
struct Rectangle {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// Side of the square tiles that areas of a picture are made of, in pixels.
inline constexpr int area_tile = 16;

/// Returns the number of tiles that cover `pixels` in a row.
int tiles_along(int pixels);

/// Returns rectangles of the tiles of `side` pixels that have this mark; rows have `columns` tiles.
std::vector<Rectangle> rectangles(std::span<const char> marks, int columns, char mark, int side = area_tile);

/// Returns rectangles that do not overlap, of square tiles, within which all of the parts lie at `poses`.
std::vector<Rectangle> areas_of(std::span<const Part> parts, std::span<const Coordinates> poses,
                                const glm::dmat4& clip_from_world, int width, int height);

/// Returns whether a point of the parts moves in the picture by `pixels` or more between two sets of poses.
bool moves_by(double pixels, std::span<const Part> parts, std::span<const Coordinates> from,
              std::span<const Coordinates> to, const glm::dmat4& clip_from_world, int width, int height);

/// Returns the least rectangle around all areas, cut off at the picture's edges.
Rectangle bounds_of(std::span<const Rectangle> areas, int width, int height);

/// Returns the least depth in each square block of a map, row by row; 1 is the greatest.
std::vector<float> block_minima(std::span<const float> depths, std::size_t width, std::size_t block);

/// Returns rectangles of small tiles in which bodies are visible: in each a depth is below 1. `depths` has
/// those of the samples within `box`, `side` × `side` in a pixel.
std::vector<Rectangle> seen_areas(std::span<const float> depths, const Rectangle& box, int side);

/// Cells of a square map of the ground, some of which are marked.
class MarkedCells {
 public:
  /// `to_map` takes (x, z, 1) of the world to (u w, v w, w): the map is 0 ≤ u, v ≤ 1 with w > 0.
  template <typename IsMarked>
  MarkedCells(int size, const glm::dmat3& to_map, const IsMarked& is_marked) : size_(size), to_map_(to_map) {
    const auto side = static_cast<std::size_t>(size) + 1;
    below_.assign(side * side, 0);
    for (std::size_t y = 1; y < side; ++y) {
      for (std::size_t x = 1; x < side; ++x) {
        const int own = is_marked((y - 1) * (side - 1) + x - 1) ? 1 : 0;
        below_[y * side + x] =
            own + below_[y * side + x - 1] + below_[(y - 1) * side + x] - below_[(y - 1) * side + x - 1];
      }
    }
  }

  /// Returns whether a cell within the bounds of the points, or next to them, is marked; true where a point
  /// is behind the map's eye.
  bool has_any(std::span<const glm::dvec2> points) const;

 private:
  int size_;
  glm::dmat3 to_map_;
  std::vector<int> below_;  ///< number of marked cells to the left of and below each cell's corner
};

/// Tiles of the picture in which the ground may lie in marked cells of the shadow's map, in those of the
/// occlusion's alone, and all others.
struct GroundAreas {
  std::vector<Rectangle> shadowed;
  std::vector<Rectangle> occluded;
  std::vector<Rectangle> open;
};

/// Returns the ground's areas in a picture. `corner`, `right`, `up`: the ray through a pixel's corner (x, y)
/// is corner + x right + y up. `above`: the eye's height over the ground.
GroundAreas ground_areas(const glm::dvec3& eye, double above, const glm::dvec3& corner,
                         const glm::dvec3& right, const glm::dvec3& up, int width, int height,
                         const MarkedCells& shadow, const MarkedCells& occlusion);

}  // namespace substep::render
