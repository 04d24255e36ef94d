#pragma once
/// The triangles of a scene, gathered body by body for drawing.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// A vertex in the graphics buffer. Position and normal in the body frame; colour linear.
struct Vertex {
  std::array<float, 3> position;
  std::array<float, 3> normal;
  std::array<float, 3> color;
  float metallic;
  float roughness;
};

/// Further attributes of a vertex, in a second buffer, for surfaces with more than a colour.
struct LookVertex {
  std::array<float, 4> coordinates{};      ///< two sets
  std::array<float, 4> color{1, 1, 1, 1};  ///< linear RGBA
  std::array<float, 4> tangent{};          ///< in the body frame; w: handedness; 0: none
  std::array<float, 2> density{};          ///< units of each set of coordinates in a metre of the surface
};

/// Returns the further attributes of a mesh with these positions and normals in the body frame, to which
/// `linear` took them. Missing tangents follow from the normal texture's coordinates, `set_of_normals`.
std::vector<LookVertex> look_vertices(const Mesh& mesh, const Matrix3& linear,
                                      const std::vector<Vector3>& positions,
                                      const std::vector<Vector3>& normals, int set_of_normals);

/// Returns whether drawing the scene needs more than a colour and a finish for each surface.
bool needs_looks(const Scene& scene);

/// The triangles of a visual, or of a collider where a body has no visual, and their box in the body frame.
struct Part {
  int body = world_body;
  Vector3 low = Vector3::Zero();
  Vector3 high = Vector3::Zero();
  std::size_t begin = 0;  ///< its indices in BodyMesh::indices
  std::size_t end = 0;
  /// Every edge has as many triangles on both sides and normals face outwards: from outside no back face is
  /// seen.
  bool is_closed = false;

  Vector3 centre() const { return (low + high) / 2; }
  Vector3 half_size() const { return (high - low) / 2; }
  /// Returns the corners of the box with the body at a pose.
  std::array<Vector3, 8> corners_at(const Coordinates& q) const;
};

struct BodyMesh {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<Part> parts;        ///< body by body
  std::vector<Surface> surfaces;  ///< of each part
  /// Further attributes of each vertex; empty where needs_looks() is false.
  std::vector<LookVertex> looks;
};

/// Returns whether the collider is a horizontal plane of the world.
bool is_ground(const Collider& collider);

/// Gathers the bodies' visuals or, where a body has none, its colliders in a colour of their own. Horizontal
/// planes of the world are left to the ground. Triangles are wound as their normals face.
BodyMesh gather_body_mesh(const Scene& scene);

/// Returns whether the part is the world's and so large that neither camera nor shadow should be fitted to
/// it.
bool is_scenery(const Part& part, std::span<const Part> parts);

/// Returns whether single precision can draw a body at the pose: within 1e6 m.
bool is_drawable(const Coordinates& q);

}  // namespace substep::render
