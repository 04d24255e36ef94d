#pragma once
/// Reads KHR_physics_rigid_bodies and KHR_implicit_shapes, checked but not yet applied to nodes, and the
/// draft of glTF 2.1, whose `shapes` at the root replace KHR_implicit_shapes.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/loading/gltf_document.h"
#include "sim/scene/scene.h"

namespace substep {

/// One entry of KHR_implicit_shapes or of glTF 2.1's `shapes`, in its own units.
struct ImplicitShape {
  enum class Kind { sphere, box, capsule, cylinder, plane, mesh };
  Kind kind = Kind::sphere;
  Vector3 size = Vector3::Ones();  ///< box: full extents
  double radius_bottom = 0;        ///< a sphere's radius too
  double radius_top = 0;
  double height = 0;  ///< capsule: between the centres of its spheres
  /// Size of a plane along x and z.
  std::array<double, 2> plane_size{infinity, infinity};
  bool double_sided = false;  ///< plane: collides on both sides
  int mesh = -1;              ///< index of the mesh of glTF 2.1's `convex` and `concave`
  bool convex_hull = false;   ///< true for `convex`
};

struct MotionProperties {
  bool kinematic = false;
  std::optional<double> mass;  ///< kg; 0 is infinite
  std::optional<Vector3> centre_of_mass;
  std::optional<Vector3> inertia_diagonal;  ///< kg·m²; a component 0 is infinite
  Quaternion inertia_orientation = Quaternion::Identity();
  Vector3 linear_velocity = Vector3::Zero();   ///< node space
  Vector3 angular_velocity = Vector3::Zero();  ///< node space
  double gravity_factor = 1;
};

struct ColliderProperties {
  int shape = -1;  ///< index into PhysicsTables::shapes; −1: `node` or `mesh` is the shape
  int node = -1;   ///< the node whose meshes make the shape
  int mesh = -1;   ///< the mesh that makes the shape
  bool convex_hull = false;
  int material = -1;
  int filter = -1;
};

struct NodePhysics {
  std::optional<MotionProperties> motion;
  std::optional<ColliderProperties> collider;
  bool has_joint = false;  ///< add_joints() reads it
};

struct CollisionFilter {
  std::uint64_t member = 0;
  std::uint64_t collides_with = ~std::uint64_t{0};
};

/// The tables at the document's root.
struct PhysicsTables {
  std::vector<ImplicitShape> shapes;
  std::vector<ContactMaterial> materials;
  std::vector<CollisionFilter> filters;
  std::vector<Joint> joints;  ///< without their bodies
};

/// Reads the tables at the root. Warns of unknown keys and of values without effect. Throws Error.
PhysicsTables read_physics_tables(const GltfDocument& document);
/// Reads a node's physics; warns and throws as read_physics_tables() does.
NodePhysics read_node_physics(const GltfDocument& document, std::size_t node, const PhysicsTables& tables);

}  // namespace substep
