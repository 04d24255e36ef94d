#pragma once
/// Collision shapes. Each is given in its collider's own frame; lengths in metres.

#include <array>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "sim/math/vector.h"

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

/// The half-space y <= 0: the plane's normal is +Y. A finite or double-sided plane is a TriangleMesh, see
/// make_rectangle.
struct Plane {};

/// A solid of revolution about the Y axis between y = ±half_height, whose radius changes linearly between
/// the ends: a cylinder, a cone frustum or, where one radius is 0, a cone. See make_cylinder.
struct Cylinder {
  double half_height = 0.25;
  double radius_bottom = 0.25;  ///< at y = −half_height
  double radius_top = 0.25;
};

/// The convex hull of two balls around (0, ∓half_length, 0). Where one ball holds the other, it is the
/// larger. See make_tapered_capsule.
struct TaperedCapsule {
  double half_length = 0.25;
  double radius_bottom = 0.25;  ///< of the ball around (0, −half_length, 0)
  double radius_top = 0.25;
};

/// An axis-aligned box.
using Bounds = Eigen::AlignedBox3d;

/// The index of no vertex, edge or face.
inline constexpr std::uint32_t no_index = 0xffffffffU;

/// Indices of three vertices, counter-clockwise seen from the front.
using Triangle = std::array<std::uint32_t, 3>;

/// A surface of triangles in the world or on a kinematic body. Contacts push out of its front, from which
/// corners run counter-clockwise; those of a two-sided one push to the side of the other shape's centre. It
/// has no inside and no mass. All members follow from vertices and triangles: see make_triangle_mesh.
struct TriangleMesh {
  /// A node of a tree of boxes. The root is the first node; the children of an inner node are `first` and
  /// `first` + 1.
  struct Node {
    Bounds bounds;
    std::uint32_t first = 0;  ///< child, or first triangle of a leaf
    std::uint32_t count = 0;  ///< triangles of a leaf; 0 for an inner node
  };

  std::vector<Vector3> vertices;    ///< at distinct positions
  std::vector<Triangle> triangles;  ///< in the order of the leaves
  std::vector<Vector3> normals;     ///< unit, one per triangle
  /// The triangle across the edge from corner i to corner i + 1, which has that edge in the other direction;
  /// `no_index` at a border and where more than two triangles meet.
  std::vector<std::array<std::uint32_t, 3>> neighbours;
  /// Vertex v is joined by edges to ring[ring_begin[v]] … ring[ring_begin[v + 1] − 1].
  std::vector<std::uint32_t> ring_begin;
  std::vector<std::uint32_t> ring;
  std::vector<Node> nodes;
  bool two_sided = false;
};

/// A convex polytope with non-empty interior, as its faces: planar convex polygons, counter-clockwise seen
/// from outside. Boxes, prisms, ellipsoids and hulls of meshes are all of this kind.
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
  /// Half extents where the polytope is a box about the origin; pairs of boxes take a faster path.
  std::optional<Vector3> half_box;
  /// Half axes of the ellipsoid about the origin on which the vertices lie, if they do. Mass properties and
  /// contacts with planes are then the ellipsoid's, contacts with other shapes the hull's.
  std::optional<Vector3> ellipsoid;

  std::size_t face_count() const { return face_normals.size(); }
};

using Shape = std::variant<Sphere, Capsule, Plane, Polytope, Cylinder, TaperedCapsule, TriangleMesh>;

}  // namespace substep
