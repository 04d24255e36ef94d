#include "sim/loading/collider_geometry.h"

#include <fmt/format.h>

#include <utility>

namespace substep {
namespace {

/// Adds a primitive's triangles, placed, to a geometry.
void add_triangles(const GltfPrimitive& primitive, const std::vector<Vector3>& positions,
                   const NodeTransform& placement, NodeGeometry& geometry) {
  const auto first = static_cast<std::uint32_t>(geometry.points.size());
  if (first == 0) {
    geometry.points.reserve(positions.size());
    geometry.triangles.reserve(primitive.triangles.size());
  }
  for (const Vector3& position : positions) {
    geometry.points.push_back(placement.linear * position + placement.translation);
  }
  const bool mirrors = placement.linear.determinant() < 0;
  for (Triangle triangle : primitive.triangles) {
    if (mirrors) std::swap(triangle[1], triangle[2]);
    geometry.triangles.push_back({first + triangle[0], first + triangle[1], first + triangle[2]});
  }
  geometry.double_sided = geometry.double_sided || primitive.double_sided;
}

class GeometryGatherer {
 public:
  GeometryGatherer(const GltfDocument& document, const std::vector<GltfMesh>& meshes,
                   const std::vector<GltfSkin>& skins, int root, const Vector3& scale, const JsonValue& place)
      : document_(document), meshes_(meshes), skins_(skins), root_(root), place_(place) {
    scale_ = make_transform(Vector3::Zero(), Quaternion::Identity(), scale);
    // The mesh is that of the node in its own frame: where the node itself stands does not matter.
    add(root, scale_);
  }

  NodeGeometry result() { return std::move(geometry_); }

 private:
  void add(int index, const NodeTransform& placement) {
    const GltfNode& node = document_.nodes[index];
    if (node.mesh >= 0) {
      for (const GltfPrimitive& primitive : meshes_[node.mesh].primitives) {
        if (node.skin >= 0 && !primitive.influences.empty()) {
          add_skinned(index, primitive);
        } else {
          add_triangles(primitive, primitive.positions, placement, geometry_);
        }
      }
    }
    for (const int child : node.children) add(child, compose(placement, document_.nodes[child].local));
  }

  // A skeleton places its mesh in the world, wherever the node is that wears it.
  void add_skinned(int index, const GltfPrimitive& primitive) {
    const NodeTransform& world = document_.nodes[root_].world;
    const Matrix3 back = world.linear.inverse();
    if (!back.allFinite()) place_.fail("its geometry's node is scaled to nothing along an axis");
    geometry_.skinned = true;
    add_triangles(
        primitive,
        posed_vertices(document_, skins_[document_.nodes[index].skin], primitive, document_.node_json(index))
            .positions,
        compose(scale_, make_transform(back, Vector3(-(back * world.translation)))), geometry_);
  }

  const GltfDocument& document_;
  const std::vector<GltfMesh>& meshes_;
  const std::vector<GltfSkin>& skins_;
  int root_;
  const JsonValue& place_;
  NodeTransform scale_;
  NodeGeometry geometry_;
};

}  // namespace

NodeGeometry geometry_of_mesh(const GltfMesh& mesh, const Vector3& scale, const JsonValue& place) {
  NodeGeometry geometry;
  const NodeTransform placement = make_transform(Vector3::Zero(), Quaternion::Identity(), scale);
  for (const GltfPrimitive& primitive : mesh.primitives)
    add_triangles(primitive, primitive.positions, placement, geometry);
  if (geometry.triangles.empty()) place.fail("its geometry is a mesh without triangles");
  return geometry;
}

std::size_t geometry_size(const GltfDocument& document, const std::vector<GltfMesh>& meshes,
                          const std::vector<GltfSkin>& skins, int node) {
  std::size_t size = 0;
  std::vector<int> pending = {node};
  while (!pending.empty()) {
    const GltfNode& next = document.nodes[pending.back()];
    pending.pop_back();
    pending.insert(pending.end(), next.children.begin(), next.children.end());
    ++size;
    if (next.mesh < 0) continue;
    for (const GltfPrimitive& primitive : meshes[next.mesh].primitives) {
      size += primitive.positions.size() + primitive.triangles.size();
      if (next.skin >= 0) size += skins[next.skin].joints.size();
    }
  }
  return size;
}

NodeGeometry geometry_of_node(const GltfDocument& document, const std::vector<GltfMesh>& meshes,
                              const std::vector<GltfSkin>& skins, int node, const Vector3& scale,
                              const JsonValue& place) {
  NodeGeometry geometry = GeometryGatherer(document, meshes, skins, node, scale, place).result();
  if (geometry.triangles.empty()) {
    place.fail(fmt::format("its geometry, node {} ('{}'), has no mesh of triangles", node,
                           document.nodes[node].name));
  }
  return geometry;
}

}  // namespace substep
