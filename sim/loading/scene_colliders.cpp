#include <list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim/geometry/triangle_mesh.h"
#include "sim/loading/collider_shapes.h"
#include "sim/loading/scene_draft.h"

namespace substep {
namespace {

// The triangles of one mesh, or of all meshes at a node and below, in a collider's scale, and what follows
// from them as far as it was needed.
struct ColliderGeometry {
  int node = -1;
  int mesh = -1;
  Vector3 scale;
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;  ///< counter-clockwise seen from the front
  bool double_sided = false;        ///< one of its materials is
  bool skinned = false;
  std::optional<SimplifiedHull> hull;
  std::optional<MassProperties> solid;
};

/// Adds the triangles of a mesh with their vertices, not vertices that no triangle uses.
void add_triangles(const Mesh& mesh, const NodeTransform& placement, ColliderGeometry& geometry) {
  std::vector<std::uint32_t> index(mesh.positions.size(), no_index);
  for (const Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) index[corner] = 0;
  }
  for (std::size_t i = 0; i < index.size(); ++i) {
    if (index[i] == no_index) continue;
    index[i] = static_cast<std::uint32_t>(geometry.points.size());
    geometry.points.push_back(placement.linear * mesh.positions[i] + placement.translation);
  }
  const bool mirrors = placement.linear.determinant() < 0;
  for (Triangle triangle : mesh.triangles) {
    if (mirrors) std::swap(triangle[1], triangle[2]);
    geometry.triangles.push_back({index[triangle[0]], index[triangle[1]], index[triangle[2]]});
  }
}

class Colliders {
 public:
  explicit Colliders(SceneDraft& draft) : draft_(draft), faceted_(draft.tables.shapes.size()) {}

  void add(int node, const ColliderProperties& properties) {
    const JsonValue place = draft_.extension(node, "collider");
    const auto& [body, placement] = draft_.attachments[node];
    if (placement.linear.isZero(0)) return place.warn("is left out: its node is scaled to nothing");
    if (placement.sheared) {
      place.fail("is sheared or flat: a turned node stands in an unequal scale; apply the scale");
    }
    Collider collider;
    collider.body = body;
    if (properties.shape >= 0) {
      collider.placement = placement.rigid();
      const ImplicitShape& shape = draft_.tables.shapes[properties.shape];
      collider.shape = implicit_shape(shape, placement.scale, faceted_[properties.shape], place);
      if (body != world_body && shape.kind == ImplicitShape::Kind::plane) {
        place.fail("a plane cannot belong to a body with motion: use a box");
      }
    } else {
      collider.placement = {placement.translation, placement.rotation};  // the scale's signs mirror the mesh
      set_shape_of_meshes(collider, properties, placement.scale, place);
    }
    if (properties.material >= 0) collider.material = draft_.tables.materials[properties.material];
    if (properties.filter >= 0) {
      const CollisionFilter& filter = draft_.tables.filters[properties.filter];
      collider.member = filter.member;
      collider.collides_with = filter.collides_with;
      collider.in_no_system = filter.member == 0;
    }
    draft_.colliders_of[body].push_back(static_cast<int>(draft_.scene.colliders.size()));
    draft_.collider_of_node[node] = static_cast<int>(draft_.scene.colliders.size());
    draft_.scene.colliders.push_back(std::move(collider));
  }

 private:
  // True where no contact moves the body.
  bool is_driven(int body) const {
    return body == world_body || draft_.physics[draft_.node_of_body[body]].motion->kinematic;
  }

  void set_shape_of_meshes(Collider& collider, const ColliderProperties& properties, const Vector3& scale,
                           const JsonValue& place) {
    ColliderGeometry& geometry = geometry_of(properties, scale, place);
    const std::string name =
        properties.node >= 0 ? fmt::format("mesh of node '{}'", draft_.document.nodes[properties.node].name)
                             : fmt::format("mesh {}", properties.mesh);
    if (geometry.skinned) {
      place.warn("the skinned {} collides in the form that it has at the start", name);
    }
    if (!properties.convex_hull && is_driven(collider.body)) {
      draft_.spend(geometry.points.size() + geometry.triangles.size(), place);
      // A closed mesh has an inside, whatever its material says of drawing.
      const bool two_sided = geometry.double_sided && !is_closed(geometry.points, geometry.triangles);
      collider.shape = make_triangle_mesh(geometry.points, geometry.triangles, place.place(), two_sided);
      return;
    }
    const SimplifiedHull& hull = hull_of(geometry, place.place());
    if (!hull.warning.empty()) place.warn("{}", hull.warning);
    collider.shape = hull.hull;
    if (properties.convex_hull) return;
    if (!geometry.solid) {
      geometry.solid = enclosed_solid(geometry.points, geometry.triangles).value_or(MassProperties{});
      const double filled = geometry.solid->mass / mass_properties(Shape(hull.hull)).mass;
      if (!(filled > least_filled && filled <= most_filled(hull))) geometry.solid->mass = 0;
    }
    const bool is_solid = geometry.solid->mass > 0;
    place.warn("the {} moves, so it collides as its convex hull{}", name,
               is_solid ? "" : ", which also gives its mass properties");
    if (is_solid) draft_.solids.emplace(static_cast<int>(draft_.scene.colliders.size()), *geometry.solid);
  }

  ColliderGeometry& geometry_of(const ColliderProperties& properties, const Vector3& scale,
                                const JsonValue& place) {
    const int node = properties.node;
    const int mesh = properties.mesh;
    for (ColliderGeometry& known : geometries_) {
      if (known.node == node && known.mesh == mesh && known.scale == scale) return known;
    }
    ColliderGeometry& geometry = geometries_.emplace_back();
    geometry.node = node;
    geometry.mesh = mesh;
    geometry.scale = scale;
    // The node's own place does not count: its meshes are in its own frame.
    if (node >= 0) add_node(node, scaling(scale), geometry, place);
    if (node < 0) add_mesh(draft_.meshes[mesh], -1, scaling(scale), geometry, place);
    if (geometry.triangles.empty() && node < 0) place.fail("its geometry is a mesh without triangles");
    if (geometry.triangles.empty()) {
      place.fail("its geometry, node {} ('{}'), has no mesh of triangles", node,
                 draft_.document.nodes[node].name);
    }
    return geometry;
  }

  /// Adds the meshes at a node and below.
  void add_node(int index, const NodeTransform& placement, ColliderGeometry& geometry,
                const JsonValue& place) {
    draft_.spend(1, place);
    const GltfNode& node = draft_.document.nodes[index];
    if (node.mesh >= 0) add_mesh(draft_.meshes[node.mesh], index, placement, geometry, place);
    for (const int child : node.children) {
      add_node(child, compose(placement, draft_.document.nodes[child].local), geometry, place);
    }
  }

  /// Adds a mesh, of `node` where it is ≥ 0.
  void add_mesh(const GltfMesh& mesh, int node, const NodeTransform& placement, ColliderGeometry& geometry,
                const JsonValue& place) {
    draft_.spend(mesh.size(), place);
    const int skin = node < 0 ? -1 : draft_.document.nodes[node].skin;
    for (const GltfPrimitive& primitive : mesh.primitives) {
      if (skin >= 0) draft_.spend(draft_.skins[skin].joints.size(), place);
      geometry.double_sided = geometry.double_sided || primitive.double_sided;
      if (skin < 0 || primitive.influences.empty()) {
        add_triangles(primitive, placement, geometry);
        continue;
      }
      // A skeleton places its mesh in the world, wherever the node is that wears it.
      const NodeTransform& world = draft_.document.nodes[geometry.node].world;
      const Matrix3 back = world.linear.inverse();
      if (!back.allFinite()) place.fail("its geometry's node is scaled to nothing along an axis");
      geometry.skinned = true;
      const NodeTransform from_world = make_transform(back, Vector3(-(back * world.translation)));
      add_triangles(posed(draft_.document, draft_.skins[skin], primitive, draft_.node_json(node)),
                    compose(scaling(geometry.scale), from_world), geometry);
    }
  }

  // Nodes with a mesh each often have the same mesh, and its hull takes long.
  const SimplifiedHull& hull_of(ColliderGeometry& geometry, const std::string& what) {
    for (const ColliderGeometry& other : geometries_) {
      if (geometry.hull) break;
      if (other.hull && other.points == geometry.points) geometry.hull = other.hull;
    }
    if (!geometry.hull) geometry.hull = simplified_hull(geometry.points, what);
    return *geometry.hull;
  }

  SceneDraft& draft_;
  std::list<ColliderGeometry> geometries_;
  std::vector<std::optional<Polytope>> faceted_;  // of each implicit shape, unscaled
};

}  // namespace

void add_colliders(SceneDraft& draft) {
  draft.colliders_of.resize(draft.scene.bodies.size());
  draft.collider_of_node.assign(draft.physics.size(), -1);
  Colliders colliders(draft);
  for (std::size_t i = 0; i < draft.physics.size(); ++i) {
    if (draft.physics[i].collider) colliders.add(static_cast<int>(i), *draft.physics[i].collider);
  }
}

}  // namespace substep
