#pragma once
/// Triangle meshes: points at equal positions, sides that share an edge, static meshes for contacts.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "sim/geometry/shape.h"

namespace substep {

/// Returns for each point the first one at the same position, which may be itself. Points with a NaN equal no
/// other.
std::vector<std::uint32_t> welded(std::span<const Vector3> points);

/// Returns each position once, in the order of their first points.
std::vector<Vector3> distinct(std::span<const Vector3> points);

/// Throws Error that begins with `what` where a coordinate is not finite or too large for `kind` ("a convex
/// hull").
void require_near(std::span<const Vector3> points, const std::string& what, const char* kind);

/// A side of a face, from one corner to the next.
struct FaceSide {
  std::uint32_t from;
  std::uint32_t to;
  std::uint32_t face;
  std::uint32_t corner;  ///< of the face, at which the side begins

  std::uint32_t lesser_end() const { return std::min(from, to); }
  std::uint32_t greater_end() const { return std::max(from, to); }
  /// Returns the place among sorted sides, in which the sides of an edge are neighbours.
  auto order() const { return std::tuple(lesser_end(), greater_end(), from, face); }
  bool is_reverse_of(const FaceSide& other) const { return from == other.to && to == other.from; }
};

/// Returns the sides of faces, which are lists of vertices, sorted by FaceSide::order().
template <class Faces>
std::vector<FaceSide> sorted_sides(const Faces& faces) {
  std::vector<FaceSide> sides;
  sides.reserve(4 * faces.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    const auto& corners = faces[f];
    for (std::uint32_t i = 0; i < corners.size(); ++i) {
      sides.push_back({corners[i], corners[i + 1 < corners.size() ? i + 1 : 0], f, i});
    }
  }
  std::ranges::sort(sides, {}, &FaceSide::order);
  return sides;
}

/// Returns true where each edge of a mesh has two sides, in opposite directions. The sides are sorted.
bool are_paired(std::span<const FaceSide> sides);

/// Returns the mesh of these triangles, counter-clockwise seen from the front. Merges vertices at equal
/// positions, and leaves out triangles without area. By default it is one-sided: bodies behind a triangle
/// pass through it, so that a closed mesh pushes outwards alone. Throws Error that begins with `what`
/// ("hill.gltf: /meshes/2") when an index or a coordinate is out of range or no triangle has an
/// area.
TriangleMesh make_triangle_mesh(std::span<const Vector3> positions, std::span<const Triangle> triangles,
                                const std::string& what, bool two_sided = false);

/// Returns a finite plane: the rectangle |x| <= size_x/2, |z| <= size_z/2 at y = 0 with its front to +Y. An
/// infinite size is taken as 20 km. Throws Error unless both are positive.
TriangleMesh make_rectangle(double size_x, double size_z, bool two_sided);

/// Appends the triangles whose boxes meet `box`, both in the mesh's frame, in ascending order.
void find_triangles(const TriangleMesh& mesh, const Bounds& box, std::vector<std::uint32_t>& out);

}  // namespace substep
