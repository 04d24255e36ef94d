#pragma once
/// The search for the axis of contact between a shape and flat faces: a polytope or one triangle of a mesh.
///
/// The separation along a unit direction n, from b to a, is how far a's lowest point along n is above b's
/// highest. Its maximum over all n is the distance of two shapes that are apart and the depth of two that
/// overlap. It lies at the normal of a face, at a direction of the arc between the normals of two faces that
/// share an edge, or at the direction of a vertex's closest point. Each candidate is measured with the true
/// extents of both shapes, so that a bad candidate cannot be taken.

#include <array>
#include <cstdint>
#include <vector>

#include "sim/geometry/features.h"

namespace substep {

/// Vertices, faces and edges of a polytope or of a triangle in some frame. Refilling it keeps its memory.
struct Facets {
  /// The directions outward of an edge: those between the normals of its two faces.
  struct Arc {
    std::uint32_t from;
    std::uint32_t to;
    Vector3 first;
    Vector3 last;
  };

  std::vector<Vector3> vertices;
  std::vector<std::uint32_t> face_begin;
  std::vector<std::uint32_t> face_vertices;
  std::vector<Vector3> face_normals;
  std::vector<double> face_offsets;
  std::vector<Arc> arcs;
  double size = 0;  ///< the diameter of a ball that holds it, or a triangle's longest side

  // Members for a triangle of a mesh, unset for a polytope:
  const TriangleMesh* mesh = nullptr;
  Triangle corners{};               ///< vertices of the mesh
  std::array<bool, 3> continues{};  ///< whether the mesh continues in the same plane behind a side
  std::vector<Vector3> around;      ///< normals of the triangles behind its convex sides

  /// Copies a polytope, turned: vertex → rotation * vertex.
  void load(const Polytope& polytope, const Matrix3& rotation);
  /// Copies a triangle, moved by −origin. With `from_behind` its back is the front.
  void load(const TriangleMesh& mesh, std::uint32_t triangle, const Vector3& origin, bool from_behind);

  Segment edge(const Arc& arc) const { return {vertices[arc.from], vertices[arc.to]}; }
  /// Returns the extent of the vertices along a direction.
  Extent extent(const Vector3& direction) const { return farthest(vertices, direction); }
  /// Returns true where the mesh around the triangle's corner lies below it along `direction`, judged by its
  /// neighbours; a mesh does not push along directions of inner edges. Always true for a polytope.
  bool pushes(const Vector3& direction, std::uint32_t vertex) const;
  /// Returns the face at the farthest vertex along `direction` that faces it most.
  std::uint32_t face_towards(const Vector3& direction) const;
  /// Returns a face; `memory` holds its corners.
  Polygon polygon(std::uint32_t face, std::vector<Vector3>& memory) const;
};

/// A direction from b to a, and the separation along it.
struct FacetsAxis {
  double separation = -infinity;
  Vector3 normal = Vector3::Zero();
};

struct FacetsFaceAxis : FacetsAxis {
  bool of_b = false;       ///< the face is one of b
  std::uint32_t face = 0;  ///< of b, or the face or disc of a
};

struct FacetsEdgeAxis : FacetsAxis {
  std::uint32_t arc = no_index;    ///< of b
  bool of_neighbour = false;       ///< it is the normal of the triangle next to b
  std::uint32_t arc_a = no_index;  ///< where a has arcs
};

/// Finds contacts of a revolved solid a and facets b in one frame.
void find_revolved_facets(const RevolvedSolid& a, const Facets& b, double margin, Contacts& out);

}  // namespace substep
