#pragma once
/// Closest points of segments and the prisms over faces, for the contacts of shapes.

#include "sim/geometry/shape.h"

namespace substep {

struct Segment {
  Vector3 from;
  Vector3 to;
};

/// The positions of closest points as fractions of the way along each segment, in [0, 1].
struct SegmentParameters {
  double on_a;
  double on_b;
};

inline Vector3 point_at(const Segment& segment, double parameter) {
  return segment.from + parameter * (segment.to - segment.from);
}

/// Returns the position of the point of `segment` closest to `point`, as a fraction in [0, 1]; 0 for a
/// segment without length.
double closest_parameter(const Segment& segment, const Vector3& point);

/// Returns one of the closest pairs of points. Segments may be points, parallel or crossing.
SegmentParameters closest_parameters(const Segment& a, const Segment& b);

/// Calls `use(corner, outward)` for each side of a face: a point of it and its unnormalised outward direction
/// in the face's plane.
template <class Use>
void for_each_side(const Polytope& polytope, std::size_t face, Use use) {
  const std::uint32_t begin = polytope.face_begin[face];
  const std::uint32_t end = polytope.face_begin[face + 1];
  for (std::uint32_t i = begin; i < end; ++i) {
    const Vector3& from = polytope.vertices[polytope.face_vertices[i]];
    const Vector3& to = polytope.vertices[polytope.face_vertices[i + 1 < end ? i + 1 : begin]];
    use(from, (to - from).cross(polytope.face_normals[face]));
  }
}

/// Returns true where the point lies in the infinite prism over and under the face.
bool is_over(const Polytope& polytope, std::size_t face, const Vector3& point);

}  // namespace substep
