#pragma once
/// The triangles of a scene, gathered body by body for drawing.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/vertex_looks.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// As the graphics buffer holds it. Position and normal in the body frame; colour linear.
struct Vertex {
  std::array<float, 3> position;
  std::array<float, 3> normal;
  std::array<float, 3> color;
  float metallic;
  float roughness;
};

/// One visual, or one collider of a body without visuals: its box in the body frame.
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
  std::array<Vector3, 8> corners() const;
};

/// What of a body has one surface: some of its indices.
struct Piece {
  std::size_t body = 0;
  std::size_t begin = 0;
  std::size_t end = 0;
  std::size_t surface = 0;  ///< index into BodyMesh::surfaces
};

struct BodyMesh {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
  /// Body i has the indices from begin[i] up to begin[i + 1].
  std::vector<std::size_t> begin;
  std::vector<Part> parts;
  /// Where the scene needs more than vertices have, needs_looks(): of each vertex, and what is drawn with
  /// which surface; else empty.
  std::vector<LookVertex> looks;
  std::vector<Piece> pieces;
  std::vector<Surface> surfaces;
};

/// Whether the collider is a horizontal plane of the world.
bool is_ground(const Collider& collider);

/// Bodies are drawn by their visuals or, where they have none, by their colliders in a colour of their own.
/// Horizontal planes of the world are left to the ground. Triangles are wound as their normals face.
BodyMesh gather_body_mesh(const Scene& scene);

/// Whether the part is the world's and so large that neither camera nor shadow should be fitted to it.
bool is_scenery(const Part& part, std::span<const Part> parts);

}  // namespace substep::render
