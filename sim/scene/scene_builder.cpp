#include <fmt/format.h>

#include <cmath>
#include <new>
#include <optional>

#include "sim/error.h"
#include "sim/scene/collider_shapes.h"
#include "sim/scene/gltf_document.h"
#include "sim/scene/gltf_meshes.h"
#include "sim/scene/physics_extension.h"
#include "sim/scene/scene.h"
#include "sim/scene/scene_appearance.h"
#include "sim/scene/scene_settings.h"

namespace substep {
namespace {

// The extension leaves the mass of a motion without one to us: its shapes are as dense as water.
constexpr double default_density = 1000;  // kg/m³

constexpr const char* out_of_range = "its mass, size or velocity is too large or too small to compute with";

// Moments that differ by rounding alone belong to a symmetric body, which has no gyroscopic term: they are
// made equal, and products of inertia of that size are made 0, which leaves the axes where the shape has
// them.
PrincipalInertia symmetric_principal_inertia(Matrix3 inertia) {
  constexpr double rounding = 1e-12;
  const double largest = inertia.diagonal().cwiseAbs().maxCoeff();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      if (row != column && std::fabs(inertia(row, column)) <= rounding * largest) inertia(row, column) = 0;
    }
  }
  PrincipalInertia principal = principal_inertia(inertia);
  Vector3& moments = principal.moments;
  const auto equal = [&](int i, int j) { return std::fabs(moments[i] - moments[j]) <= rounding * largest; };
  if (equal(0, 1)) moments[1] = moments[0];
  if (equal(0, 2)) moments[2] = moments[0];
  if (equal(1, 2)) moments[2] = moments[1];
  return principal;
}

double inverse_or_infinite(double value) {
  return value == 0 ? 0 : 1 / value;
}

class SceneBuilder {
 public:
  explicit SceneBuilder(const std::filesystem::path& file)
      : document_(read_gltf(file)),
        meshes_(read_meshes(document_, scene_.warnings)),
        tables_(read_physics_tables(document_.root(), scene_.warnings)) {
    scene_.file = file;
    scene_.name = file.stem().string();
    scene_.hash = document_.hash;
  }

  Scene build() {
    read_settings(document_, scene_);
    read_physics();
    add_bodies();
    add_colliders();
    for (std::size_t body = 1; body < scene_.bodies.size(); ++body) place_body(static_cast<int>(body));
    check_bodies();
    add_joints();
    add_visuals();
    read_camera_and_sun(document_, scene_);
    if (document_.root().find("animations")) {
      scene_.warnings.emplace_back("animations are ignored: nodes move as bodies or not at all");
    }
    return std::move(scene_);
  }

 private:
  // A node as its body sees it. Before place_body, body frames are those of the bodies' nodes.
  struct Attachment {
    int body = world_body;
    NodeTransform
        in_node;  // to the frame of the body's node, without that node's scale; to the world's if static
  };

  JsonValue extension(int node, const char* part) const {
    return document_.node_json(node).extension("KHR_physics_rigid_bodies")->require(part);
  }

  void read_physics() {
    physics_.resize(document_.nodes.size());
    for (std::size_t i = 0; i < physics_.size(); ++i) {
      if (!document_.nodes[i].in_scene) continue;
      const JsonValue node = document_.node_json(static_cast<int>(i));
      physics_[i] = read_node_physics(node, tables_, document_.nodes.size());
      if (physics_[i].trigger)
        scene_.warnings.push_back(node.path() + ": a trigger is ignored: it moves nothing");
    }
  }

  void add_bodies() {
    scene_.bodies.emplace_back().name = "world";
    node_of_body_.push_back(-1);
    body_of_node_.assign(physics_.size(), world_body);
    for (std::size_t i = 0; i < physics_.size(); ++i) {
      if (!physics_[i].motion) continue;
      const GltfNode& node = document_.nodes[i];
      const int index = static_cast<int>(i);
      if (node.world.sheared) {
        document_.node_json(index).fail(
            "carries a body, but is sheared or flat: a turned node stands in an unequal scale; apply the "
            "scale");
      }
      body_of_node_[i] = static_cast<int>(scene_.bodies.size());
      scene_.bodies.emplace_back().name = node.name;
      node_of_body_.push_back(index);
    }
  }

  // Composed from the body's node downwards, not through the world, so that what is on the body's own node is
  // exactly at its origin wherever the body stands.
  Attachment attachment(int node) const {
    std::vector<int> path;
    for (int i = node; i >= 0; i = document_.nodes[i].parent) {
      if (physics_[i].motion) {
        Attachment result;
        result.body = body_of_node_[i];
        result.in_node =
            make_transform(Vector3::Zero(), Quaternion::Identity(), document_.nodes[i].world.scale);
        for (auto below = path.rbegin(); below != path.rend(); ++below) {
          result.in_node = compose(result.in_node, document_.nodes[*below].local);
        }
        return result;
      }
      path.push_back(i);
    }
    return {world_body, document_.nodes[node].world};
  }

  void add_colliders() {
    colliders_of_.resize(scene_.bodies.size());
    for (std::size_t i = 0; i < physics_.size(); ++i) {
      if (physics_[i].collider) add_collider(static_cast<int>(i), *physics_[i].collider);
    }
  }

  void add_collider(int node, const ColliderProperties& properties) {
    const JsonValue place = extension(node, "collider");
    const auto [body, placement] = attachment(node);
    if (placement.linear.isZero(0)) {
      scene_.warnings.push_back(place.path() + ": is left out: its node is scaled to nothing");
      return;
    }
    if (placement.sheared) {
      place.fail("is sheared or flat: a turned node stands in an unequal scale; apply the scale");
    }
    Collider collider;
    collider.body = body;
    collider.placement = placement.rigid();
    if (properties.shape >= 0) {
      collider.shape =
          implicit_shape(tables_.shapes[properties.shape], placement.scale, place, scene_.warnings);
    } else {
      collider.shape = hull_of_node(document_, meshes_, properties.node, placement.scale, place);
      if (!properties.convex_hull) {
        scene_.warnings.push_back(fmt::format(
            "{}: the mesh of node '{}' collides as its convex hull; say convexHull to accept that",
            place.path(), document_.nodes[properties.node].name));
      }
    }
    if (body != world_body && std::holds_alternative<Plane>(collider.shape)) {
      place.fail("a plane cannot belong to a body with motion: use a box");
    }
    if (properties.material >= 0) collider.material = tables_.materials[properties.material];
    if (properties.filter >= 0) {
      const CollisionFilter& filter = tables_.filters[properties.filter];
      collider.member = filter.member;
      collider.collides_with = filter.collides_with;
      collider.in_no_system = filter.member == 0;
    }
    colliders_of_[body].push_back(static_cast<int>(scene_.colliders.size()));
    scene_.colliders.push_back(std::move(collider));
  }

  // All colliders of the body as one solid, in its node's frame. Where they overlap, the overlap counts
  // twice.
  MassProperties shape_properties(int body) const {
    MassProperties sum;
    for (const int index : colliders_of_[body]) {
      const Collider& collider = scene_.colliders[index];
      const MassProperties one = transformed(mass_properties(collider.shape), collider.placement);
      sum = sum.mass > 0 ? combined(sum, one) : one;
    }
    return sum;
  }

  // Sets the body's masses, frame and velocities, and moves its colliders into that frame.
  void place_body(int index) {
    Body& body = scene_.bodies[index];
    const int node = node_of_body_[index];
    const MotionProperties& motion = *physics_[node].motion;
    const NodeTransform& world = document_.nodes[node].world;
    const JsonValue place = extension(node, "motion");
    const MassProperties shapes = shape_properties(index);
    if (!colliders_of_[index].empty() && !(shapes.mass > 0 && std::isfinite(shapes.mass)))
      place.fail(out_of_range);

    Pose node_from_body;
    node_from_body.position = shapes.centre_of_mass;
    if (motion.centre_of_mass) node_from_body.position = world.scale.cwiseProduct(*motion.centre_of_mass);

    const bool has_mass = motion.mass || shapes.mass > 0;
    if (!motion.kinematic && !has_mass) {
      place.fail("needs a 'mass', as the body has no collider to take it from");
    }
    const double mass = motion.mass.value_or(shapes.mass * default_density);
    if (!motion.kinematic) body.inverse_mass = inverse_or_infinite(mass);

    if (motion.inertia_diagonal) {
      node_from_body.orientation = motion.inertia_orientation;
      if (!motion.kinematic) body.inverse_inertia = motion.inertia_diagonal->unaryExpr(&inverse_or_infinite);
    } else if (shapes.mass > 0) {
      // About the shapes' own centre, also where the file places the centre of mass elsewhere: how the mass
      // is then spread is not known.
      const PrincipalInertia principal = symmetric_principal_inertia(with_mass(shapes, mass).inertia);
      node_from_body.orientation = principal.orientation;
      if (body.inverse_mass > 0) body.inverse_inertia = principal.moments.cwiseInverse();
    } else if (body.inverse_mass > 0) {
      place.fail("needs an 'inertiaDiagonal', as the body has no collider to take it from");
    }

    body.gravity_factor = motion.gravity_factor;
    body.body_from_node = node_from_body.inverse();
    body.pose = world.rigid() * node_from_body;
    body.pose.orientation.normalize();
    // A mirroring node turns its directions round; an axis of rotation is turned round twice.
    body.linear_velocity = world.rotation * motion.linear_velocity;
    if (world.mirrors()) body.linear_velocity = -body.linear_velocity;
    body.angular_velocity = world.rotation * motion.angular_velocity;

    for (const int collider : colliders_of_[index]) {
      Pose& placement = scene_.colliders[collider].placement;
      placement = in_body(body, placement);
    }
  }

  static Pose in_body(const Body& body, const Pose& in_node) {
    Pose pose = body.body_from_node * in_node;
    pose.orientation.normalize();
    return pose;
  }

  // Numbers that are fine one by one can overflow together.
  void check_bodies() const {
    const auto finite = [](const Pose& pose) {
      return pose.position.allFinite() && pose.orientation.coeffs().allFinite();
    };
    for (std::size_t i = 1; i < scene_.bodies.size(); ++i) {
      const Body& body = scene_.bodies[i];
      if (!std::isfinite(body.inverse_mass) || !body.inverse_inertia.allFinite() ||
          !(body.inverse_inertia.minCoeff() >= 0) || !finite(body.pose) || !finite(body.body_from_node) ||
          !body.linear_velocity.allFinite() || !body.angular_velocity.allFinite()) {
        extension(node_of_body_[i], "motion").fail(out_of_range);
      }
    }
  }

  void add_joints() {
    for (std::size_t i = 0; i < physics_.size(); ++i) {
      if (physics_[i].joint) add_joint(static_cast<int>(i), *physics_[i].joint);
    }
  }

  void add_joint(int node, const JointProperties& properties) {
    const JsonValue place = extension(node, "joint");
    const int connected = properties.connected_node;
    if (!document_.nodes[connected].in_scene) {
      place.require("connectedNode")
          .fail(fmt::format("the joint leads to node {} ('{}'), which is not in the scene", connected,
                            document_.nodes[connected].name));
    }
    Joint joint;
    joint.name = document_.nodes[node].name;
    joint.enable_collision = properties.enable_collision;
    const auto frame = [&](int end, int& body) {
      const Attachment attached = attachment(end);
      if (attached.in_node.sheared) {
        place.fail(fmt::format("node {} ('{}') is sheared or flat, so the joint has no frame there", end,
                               document_.nodes[end].name));
      }
      body = attached.body;
      return in_body(scene_.bodies[body], attached.in_node.rigid());
    };
    joint.frame_a = frame(node, joint.body_a);
    joint.frame_b = frame(connected, joint.body_b);
    if (joint.body_a == joint.body_b) {
      place.fail(joint.body_a == world_body
                     ? "joins two nodes of which neither belongs to a body: give one of them a 'motion'"
                     : fmt::format("joins the body '{}' to itself", scene_.bodies[joint.body_a].name));
    }
    const JointDescription& description = tables_.joints[properties.description];
    joint.limits = description.limits;
    joint.drives = description.drives;
    scene_.joints.push_back(std::move(joint));
  }

  void add_visuals() {
    scene_.surfaces = read_surfaces(document_, scene_.warnings);
    std::vector<int> first_mesh(meshes_.size(), -1);  // among the scene's, of each mesh of the document
    bool skinned = false;
    for (std::size_t i = 0; i < document_.nodes.size(); ++i) {
      const GltfNode& node = document_.nodes[i];
      if (!node.in_scene || node.mesh < 0) continue;
      skinned = skinned || node.skinned;
      const GltfMesh& mesh = meshes_[node.mesh];
      int& first = first_mesh[node.mesh];
      if (first < 0) {
        first = static_cast<int>(scene_.meshes.size());
        const int no_material = static_cast<int>(scene_.surfaces.size()) - 1;
        const auto name = document_.item_of("meshes", node.mesh).find("name");
        for (const GltfPrimitive& primitive : mesh.primitives) {
          scene_.meshes.push_back(drawn_mesh(primitive,
                                             name ? name->text() : fmt::format("mesh {}", node.mesh),
                                             primitive.material < 0 ? no_material : primitive.material));
        }
      }
      const auto [body, placement] = attachment(static_cast<int>(i));
      const Pose& body_from_node = scene_.bodies[body].body_from_node;
      Visual visual;
      visual.body = body;
      visual.linear = body_from_node.orientation.toRotationMatrix() * placement.linear;
      visual.translation = body_from_node * placement.translation;
      if (!(std::fabs(visual.linear.determinant()) > 0)) continue;  // scaled to nothing
      for (std::size_t k = 0; k < mesh.primitives.size(); ++k) {
        visual.mesh = first + static_cast<int>(k);
        scene_.visuals.push_back(visual);
      }
    }
    if (skinned) scene_.warnings.emplace_back("skins are ignored: meshes are drawn as they were modelled");
  }

  Scene scene_;  // first: reading the rest adds warnings
  GltfDocument document_;
  std::vector<GltfMesh> meshes_;
  PhysicsTables tables_;
  std::vector<NodePhysics> physics_;
  std::vector<int> body_of_node_;               // the world's where the node carries none
  std::vector<int> node_of_body_;               // −1 for the world
  std::vector<std::vector<int>> colliders_of_;  // each body's, as indices
};

}  // namespace

Scene load_scene(const std::filesystem::path& file) {
  try {
    return SceneBuilder(file).build();
  } catch (const std::bad_alloc&) {
    throw Error(file.string() + ": is too large for this machine's memory");
  }
}

}  // namespace substep
