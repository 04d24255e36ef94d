#include "sim/loading/crease_normals.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <tuple>

#include "sim/loading/scene_appearance.h"

namespace substep {

Mesh smoothly_drawn_mesh(const std::vector<Vector3>& positions, const std::vector<Triangle>& triangles,
                         const std::string& name, int surface, const VertexLooks& looks) {
  constexpr double cosine_of_crease = 0.766;       // 40°
  constexpr std::ptrdiff_t most_neighbours = 256;  // a position with more costs their square

  // Twice the area of each triangle along its normal, and its direction alone.
  std::vector<Vector3> areas(triangles.size());
  std::vector<Vector3> directions(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Vector3& a = positions[triangles[i][0]];
    areas[i] = (positions[triangles[i][1]] - a).cross(positions[triangles[i][2]] - a);
    directions[i] = areas[i].stableNormalized();
  }
  // All corners, those at one position together.
  struct Corner {
    std::uint32_t triangle;
    std::uint32_t index;
  };
  std::vector<Corner> corners;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    if (!(directions[i].squaredNorm() > 0.5)) continue;  // no area, so nothing to see
    for (std::uint32_t k = 0; k < 3; ++k) corners.push_back({i, k});
  }
  const auto position = [&](const Corner& corner) -> const Vector3& {
    return positions[triangles[corner.triangle][corner.index]];
  };
  std::ranges::sort(corners, [&](const Corner& one, const Corner& other) {
    const Vector3& a = position(one);
    const Vector3& b = position(other);
    return std::tuple(a.x(), a.y(), a.z(), one.triangle, one.index) <
           std::tuple(b.x(), b.y(), b.z(), other.triangle, other.index);
  });
  std::vector<std::array<Vector3, 3>> normals(triangles.size());
  for (auto begin = corners.begin(); begin != corners.end();) {
    const auto end = std::find_if(begin, corners.end(),
                                  [&](const Corner& corner) { return position(corner) != position(*begin); });
    for (auto one = begin; one != end; ++one) {
      const Vector3& own = directions[one->triangle];
      Vector3 sum = areas[one->triangle];
      if (end - begin <= most_neighbours) {
        sum.setZero();
        for (auto other = begin; other != end; ++other) {
          if (directions[other->triangle].dot(own) > cosine_of_crease) sum += areas[other->triangle];
        }
      }
      normals[one->triangle][one->index] = sum.stableNormalized();
    }
    begin = end;
  }
  Mesh mesh;
  mesh.name = name;
  mesh.surface = surface;
  std::vector<std::uint32_t> drawn;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (!(directions[i].squaredNorm() > 0.5)) continue;
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::size_t k = 0; k < 3; ++k) {
      mesh.positions.push_back(positions[triangles[i][k]]);
      const Vector3& normal = normals[i][k];
      mesh.normals.push_back(normal.squaredNorm() > 0.5 ? normal : directions[i]);
    }
    mesh.triangles.push_back({first, first + 1, first + 2});
    drawn.insert(drawn.end(), triangles[i].begin(), triangles[i].end());
  }
  mesh.looks = looks_of(looks, drawn);
  mesh.looks.tangents.clear();  // they were square to other normals
  return mesh;
}

}  // namespace substep
