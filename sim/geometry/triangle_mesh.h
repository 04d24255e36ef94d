#pragma once
/// Static triangle meshes: their construction, and the search for triangles near a box.

#include <span>
#include <string>
#include <vector>

#include "sim/geometry/shape.h"

namespace substep {

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
