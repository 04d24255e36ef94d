#include "sim/loading/scene_colliders.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim/geometry/triangle_mesh.h"
#include "sim/loading/collider_geometry.h"
#include "sim/loading/collider_shapes.h"

namespace substep {
namespace {

// The meshes of a node, or one mesh, in a collider's scale, and what follows from them as far as it was
// needed.
struct ColliderGeometry {
  int node;
  int mesh;
  Vector3 scale;
  NodeGeometry geometry;
  std::optional<SimplifiedHull> hull;
  std::optional<MassProperties> solid;
};

// What the mesh itself encloses; nothing where it is open or encloses next to nothing of its hull.
MassProperties solid_inside(const NodeGeometry& geometry, const Polytope& hull) {
  if (!is_closed(geometry.points, geometry.triangles)) return {};
  MassProperties solid = mass_properties(geometry.points, geometry.triangles);
  if (solid.mass < 0) {  // inside out
    solid.mass = -solid.mass;
    solid.inertia = -solid.inertia;
  }
  return solid.mass > 1e-6 * mass_properties(Shape(hull)).mass ? solid : MassProperties{};
}

class Colliders {
 public:
  explicit Colliders(SceneDraft& draft) : draft_(draft), faceted_(draft.tables.shapes.size()) {}

  void add(int node, const ColliderProperties& properties) {
    const JsonValue place = draft_.extension(node, "collider");
    const auto& [body, placement] = draft_.attachments[node];
    if (placement.linear.isZero(0)) {
      draft_.scene.warnings.push_back(place.path() + ": is left out: its node is scaled to nothing");
      return;
    }
    if (placement.sheared) {
      place.fail("is sheared or flat: a turned node stands in an unequal scale; apply the scale");
    }
    Collider collider;
    collider.body = body;
    collider.placement = placement.rigid();
    if (properties.shape >= 0) {
      collider.shape = implicit_shape(draft_.tables.shapes[properties.shape], placement.scale,
                                      faceted_[properties.shape], place, draft_.scene.warnings);
    } else {
      set_shape_of_node(collider, properties, placement.scale, place);
    }
    if (body != world_body && properties.shape >= 0 &&
        draft_.tables.shapes[properties.shape].kind == ImplicitShape::Kind::plane) {
      place.fail("a plane cannot belong to a body with motion: use a box");
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
  // Whether nothing that it touches moves the body.
  bool is_driven(int body) const {
    return body == world_body || draft_.physics[draft_.node_of_body[body]].motion->kinematic;
  }

  void set_shape_of_node(Collider& collider, const ColliderProperties& properties, const Vector3& scale,
                         const JsonValue& place) {
    ColliderGeometry& known = geometry_of(properties, scale, place);
    const NodeGeometry& geometry = known.geometry;
    const std::string what = fmt::format("{}: {}", draft_.document.file_name, place.path());
    const std::string name =
        properties.node >= 0 ? fmt::format("mesh of node '{}'", draft_.document.nodes[properties.node].name)
                             : fmt::format("mesh {}", properties.mesh);
    if (geometry.skinned) {
      draft_.scene.warnings.push_back(fmt::format(
          "{}: the skinned {} collides in the form that it has at the start", place.path(), name));
    }
    if (!properties.convex_hull && is_driven(collider.body)) {
      draft_.spend(geometry.points.size() + geometry.triangles.size(), place);
      // A closed mesh has an inside, whatever its material says of what is drawn.
      const bool two_sided = geometry.double_sided && !is_closed(geometry.points, geometry.triangles);
      collider.shape = make_triangle_mesh(geometry.points, geometry.triangles, what, two_sided);
      return;
    }
    const SimplifiedHull& hull = hull_of(known, what);
    if (!hull.warning.empty())
      draft_.scene.warnings.push_back(fmt::format("{}: {}", place.path(), hull.warning));
    collider.shape = hull.hull;
    if (properties.convex_hull) return;
    draft_.scene.warnings.push_back(
        fmt::format("{}: the {} moves, so it collides as its convex hull", place.path(), name));
    if (!known.solid) known.solid = solid_inside(geometry, hull.hull);
    if (known.solid->mass > 0)
      draft_.solids.emplace(static_cast<int>(draft_.scene.colliders.size()), *known.solid);
  }

  ColliderGeometry& geometry_of(const ColliderProperties& properties, const Vector3& scale,
                                const JsonValue& place) {
    const int node = properties.node;
    const int mesh = properties.mesh;
    for (const std::unique_ptr<ColliderGeometry>& known : geometries_) {
      if (known->node == node && known->mesh == mesh && known->scale == scale) return *known;
    }
    NodeGeometry geometry;
    if (node >= 0) {
      draft_.spend(geometry_size(draft_.document, draft_.meshes, draft_.skins, node), place);
      geometry = geometry_of_node(draft_.document, draft_.meshes, draft_.skins, node, scale, place);
    } else {
      geometry = geometry_of_mesh(draft_.meshes[mesh], scale, place);
      draft_.spend(geometry.points.size() + geometry.triangles.size(), place);
    }
    geometries_.push_back(
        std::make_unique<ColliderGeometry>(ColliderGeometry{node, mesh, scale, std::move(geometry), {}, {}}));
    return *geometries_.back();
  }

  // Nodes with a mesh each often have the same mesh, and its hull takes long.
  const SimplifiedHull& hull_of(ColliderGeometry& geometry, const std::string& what) {
    if (geometry.hull) return *geometry.hull;
    for (const std::unique_ptr<ColliderGeometry>& other : geometries_) {
      if (other->hull && other->geometry.points == geometry.geometry.points) {
        geometry.hull = other->hull;
        return *geometry.hull;
      }
    }
    geometry.hull = simplified_hull(geometry.geometry.points, what);
    return *geometry.hull;
  }

  SceneDraft& draft_;
  std::vector<std::unique_ptr<ColliderGeometry>> geometries_;
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
