#pragma once
/// Collision shapes. Each is given in its collider's own frame; lengths in metres.

#include <array>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "sim/vector.h"

namespace substep {

/// A ball around the origin.
struct Sphere {
  double radius = 0.5;
};

/// All points within `radius` of the segment from (0, −half_length, 0) to (0, +half_length, 0).
struct Capsule {
  double half_length = 0.25;
  double radius = 0.25;
};

/// The half-space y <= 0: the plane's normal is +Y.
struct Plane {};

/// A box of any placement: `pose` takes its own frame, where it is |x| <= half_size, to the polytope's.
struct OrientedBox {
  Pose pose;
  Vector3 half_size = Vector3::Zero();
};

/// A convex polytope with non-empty interior, as its faces: planar convex polygons, counter-clockwise seen
/// from outside. Boxes, cylinders (as prisms) and hulls of meshes are all of this kind.
struct Polytope {
  std::vector<Vector3> vertices;
  /// Face f has the vertices face_vertices[face_begin[f]] … face_vertices[face_begin[f+1] − 1].
  std::vector<std::uint32_t> face_begin;
  std::vector<std::uint32_t> face_vertices;
  std::vector<Vector3> face_normals;  ///< unit, outward
  std::vector<double> face_offsets;   ///< the face lies in normal · x = offset
  /// Each edge once: its two end vertices.
  std::vector<std::array<std::uint32_t, 2>> edges;
  /// The faces on both sides of each edge: the first has it in the direction given by `edges`.
  std::vector<std::array<std::uint32_t, 2>> edge_faces;
  Vector3 centre = Vector3::Zero();  ///< the mean vertex, which lies inside; not the centre of mass
  double bounding_radius = 0;        ///< of the smallest ball about `centre` that holds the polytope
  double inner_radius = 0;           ///< of the largest ball about `centre` that the polytope holds
  std::optional<OrientedBox> box;    ///< set where the polytope was made as a box: such pairs are quicker

  std::size_t face_count() const { return face_normals.size(); }
};

using Shape = std::variant<Sphere, Capsule, Plane, Polytope>;

}  // namespace substep
