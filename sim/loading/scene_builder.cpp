#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <new>
#include <numbers>
#include <optional>

#include "sim/error.h"
#include "sim/geometry/triangle_mesh.h"
#include "sim/loading/body_inertia.h"
#include "sim/loading/collider_shapes.h"
#include "sim/loading/file_bytes.h"
#include "sim/loading/gltf_document.h"
#include "sim/loading/gltf_mesh_file.h"
#include "sim/loading/gltf_meshes.h"
#include "sim/loading/load_scene.h"
#include "sim/loading/mesh_file.h"
#include "sim/loading/mesh_scene.h"
#include "sim/loading/physics_extension.h"
#include "sim/loading/scene_appearance.h"
#include "sim/loading/scene_expectations.h"
#include "sim/loading/scene_settings.h"
#include "sim/scene/scene.h"

namespace substep {
namespace {

constexpr const char* out_of_range = "its mass, size or velocity is too large or too small to compute with";

// Moment of inertia of a ball of the default density. The cube root is Newton's: libm's differs between
// machines.
double inertia_of_ball(double mass) {
  const double cube = mass / (4.0 / 3 * std::numbers::pi * default_density);
  double radius = 1;
  for (int i = 0; i < 2000; ++i) {
    const double next = (2 * radius + cube / (radius * radius)) / 3;
    if (next == radius) break;
    radius = next;
  }
  return 0.4 * mass * radius * radius;
}

double inverse_or_infinite(double value) {
  return value == 0 ? 0 : 1 / value;
}

class SceneBuilder {
 public:
  SceneBuilder(const std::filesystem::path& file, GltfDocument document)
      : document_(std::move(document)),
        meshes_(read_meshes(document_, scene_.warnings)),
        skins_(read_skins(document_)),
        tables_(read_physics_tables(document_.root(), scene_.warnings)) {
    scene_.file = file;
    scene_.name = file.stem().string();
    scene_.hash = document_.hash;
    faceted_.resize(tables_.shapes.size());
    most_spent_ += 4 * (document_.nodes.size());
    for (const GltfMesh& mesh : meshes_) {
      for (const GltfPrimitive& primitive : mesh.primitives) {
        most_spent_ += 4 * (primitive.positions.size() + primitive.triangles.size());
      }
    }
    for (const GltfSkin& skin : skins_) most_spent_ += 4 * skin.joints.size();
  }

  Scene build() {
    read_settings(document_, scene_);
    read_physics();
    add_bodies();
    find_attachments();
    add_colliders();
    for (std::size_t body = 1; body < scene_.bodies.size(); ++body) place_body(static_cast<int>(body));
    check_bodies();
    read_expectations(document_, scene_);
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

  // A node's meshes in a collider's scale, and what follows from them as far as it was needed.
  struct ColliderGeometry {
    int node;
    Vector3 scale;
    NodeGeometry geometry;
    std::optional<SimplifiedHull> hull;
    std::optional<MassProperties> solid;
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
  void find_attachments() {
    attachments_.resize(document_.nodes.size());
    std::vector<int> pending;
    for (std::size_t i = 0; i < document_.nodes.size(); ++i) {
      if (document_.nodes[i].parent < 0) pending.push_back(static_cast<int>(i));
    }
    while (!pending.empty()) {
      const int index = pending.back();
      pending.pop_back();
      const GltfNode& node = document_.nodes[index];
      Attachment& own = attachments_[index];
      if (physics_[index].motion) {
        own.body = body_of_node_[index];
        own.in_node = make_transform(Vector3::Zero(), Quaternion::Identity(), node.world.scale);
      } else if (node.parent >= 0 && attachments_[node.parent].body != world_body) {
        own.body = attachments_[node.parent].body;
        own.in_node = compose(attachments_[node.parent].in_node, node.local);
      } else {
        own.in_node = node.world;
      }
      pending.insert(pending.end(), node.children.begin(), node.children.end());
    }
  }

  void add_colliders() {
    colliders_of_.resize(scene_.bodies.size());
    for (std::size_t i = 0; i < physics_.size(); ++i) {
      if (physics_[i].collider) add_collider(static_cast<int>(i), *physics_[i].collider);
    }
  }

  void add_collider(int node, const ColliderProperties& properties) {
    const JsonValue place = extension(node, "collider");
    const auto& [body, placement] = attachments_[node];
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
      collider.shape = implicit_shape(tables_.shapes[properties.shape], placement.scale,
                                      faceted_[properties.shape], place, scene_.warnings);
    } else {
      set_shape_of_node(collider, properties, placement.scale, place);
    }
    if (body != world_body && properties.shape >= 0 &&
        tables_.shapes[properties.shape].kind == ImplicitShape::Kind::plane) {
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

  // Whether nothing that it touches moves the body.
  bool is_driven(int body) const {
    return body == world_body || physics_[node_of_body_[body]].motion->kinematic;
  }

  void set_shape_of_node(Collider& collider, const ColliderProperties& properties, const Vector3& scale,
                         const JsonValue& place) {
    ColliderGeometry& known = geometry_of(properties.node, scale, place);
    const NodeGeometry& geometry = known.geometry;
    const std::string what = fmt::format("{}: {}", document_.file_name, place.path());
    const std::string& name = document_.nodes[properties.node].name;
    if (geometry.skinned) {
      scene_.warnings.push_back(
          fmt::format("{}: the skinned mesh of node '{}' collides in the form that it has at the start",
                      place.path(), name));
    }
    if (!properties.convex_hull && is_driven(collider.body)) {
      spend(geometry.points.size() + geometry.triangles.size(), place);
      // A closed mesh has an inside, whatever its material says of what is drawn.
      const bool two_sided = geometry.double_sided && !is_closed(geometry.points, geometry.triangles);
      collider.shape = make_triangle_mesh(geometry.points, geometry.triangles, what, two_sided);
      return;
    }
    const SimplifiedHull& hull = hull_of(known, what);
    if (!hull.warning.empty()) scene_.warnings.push_back(fmt::format("{}: {}", place.path(), hull.warning));
    collider.shape = hull.hull;
    if (properties.convex_hull) return;
    scene_.warnings.push_back(fmt::format(
        "{}: the mesh of node '{}' moves, so it collides as its convex hull", place.path(), name));
    if (!known.solid) known.solid = solid_inside(geometry, hull.hull);
    if (known.solid->mass > 0) solids_.emplace(static_cast<int>(scene_.colliders.size()), *known.solid);
  }

  // What the mesh itself encloses; nothing where it is open or encloses next to nothing of its hull.
  static MassProperties solid_inside(const NodeGeometry& geometry, const Polytope& hull) {
    if (!is_closed(geometry.points, geometry.triangles)) return {};
    MassProperties solid = mass_properties(geometry.points, geometry.triangles);
    if (solid.mass < 0) {  // inside out
      solid.mass = -solid.mass;
      solid.inertia = -solid.inertia;
    }
    return solid.mass > 1e-6 * mass_properties(Shape(hull)).mass ? solid : MassProperties{};
  }

  ColliderGeometry& geometry_of(int node, const Vector3& scale, const JsonValue& place) {
    for (const std::unique_ptr<ColliderGeometry>& known : geometries_) {
      if (known->node == node && known->scale == scale) return *known;
    }
    spend(geometry_size(document_, meshes_, skins_, node), place);
    geometries_.push_back(std::make_unique<ColliderGeometry>(ColliderGeometry{
        node, scale, geometry_of_node(document_, meshes_, skins_, node, scale, place), {}, {}}));
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

  // Colliders and skins may share their meshes, so that a small file asks for much.
  void spend(std::size_t size, const JsonValue& place) {
    spent_ += size;
    if (spent_ > most_spent_) {
      place.fail(
          fmt::format("with it what collides and what wears a skin has more than {} nodes, vertices, "
                      "triangles and joints, a hundred thousand and four times what the file has",
                      most_spent_));
    }
  }

  // All colliders of the body as one solid, in its node's frame. Where they overlap, the overlap counts
  // twice.
  MassProperties shape_properties(int body) const {
    MassProperties sum;
    for (const int index : colliders_of_[body]) {
      const Collider& collider = scene_.colliders[index];
      const auto solid = solids_.find(index);
      const MassProperties one = transformed(
          solid != solids_.end() ? solid->second : mass_properties(collider.shape), collider.placement);
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
    const bool has_volume = std::ranges::any_of(colliders_of_[index], [&](int collider) {
      return !std::holds_alternative<TriangleMesh>(scene_.colliders[collider].shape);
    });
    if (!std::isfinite(shapes.mass) || (has_volume && !(shapes.mass > 0))) place.fail(out_of_range);

    Pose node_from_body;
    node_from_body.position = shapes.centre_of_mass;
    if (motion.centre_of_mass) node_from_body.position = world.scale.cwiseProduct(*motion.centre_of_mass);

    double mass = motion.mass.value_or(shapes.mass * default_density);
    if (!motion.kinematic && !motion.mass && shapes.mass == 0) {
      mass = 1;
      scene_.warnings.push_back(place.path() +
                                ": has neither 'mass' nor a collider to take it from: it gets 1 kg");
    }
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
      body.inverse_inertia.setConstant(1 / inertia_of_ball(mass));
      scene_.warnings.push_back(
          place.path() +
          ": has neither 'inertiaDiagonal' nor a collider to take it from: it gets that of a ball of water");
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
      const Attachment& attached = attachments_[end];
      if (attached.in_node.sheared && !attached.in_node.turned) {
        place.fail(fmt::format("node {} ('{}') is sheared or flat, so the joint has no frame there", end,
                               document_.nodes[end].name));
      }
      if (attached.in_node.sheared) {
        scene_.warnings.push_back(
            fmt::format("{}: node {} ('{}') is turned inside an unequal scale; the joint's frame is turned "
                        "without the scale",
                        place.path(), end, document_.nodes[end].name));
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
    constexpr std::size_t most_visuals = 200'000;
    std::vector<int> first_mesh(meshes_.size(), -1);  // among the scene's, of each mesh of the document
    bool skinned = false;
    // Colliders have what they need of the meshes; only skins need them more than once.
    const auto taken = [&](GltfPrimitive& primitive) {
      return skins_.empty() ? std::move(primitive) : primitive;
    };
    for (std::size_t i = 0; i < document_.nodes.size(); ++i) {
      const GltfNode& node = document_.nodes[i];
      if (!node.in_scene || node.mesh < 0) continue;
      GltfMesh& mesh = meshes_[node.mesh];
      const std::string name = document_.item_of("meshes", node.mesh).name(fmt::format("mesh {}", node.mesh));
      if (scene_.visuals.size() + mesh.primitives.size() > most_visuals) {
        document_.node_json(static_cast<int>(i))
            .fail(fmt::format("with it more than {} pieces are to be drawn", most_visuals));
      }
      const auto has_skin = [](const GltfPrimitive& primitive) { return !primitive.influences.empty(); };
      if (node.skin >= 0 && std::ranges::any_of(mesh.primitives, has_skin)) {
        skinned = true;
        for (const GltfPrimitive& primitive : mesh.primitives) {
          if (has_skin(primitive)) add_skinned_visuals(static_cast<int>(i), primitive, name);
        }
        continue;
      }
      int& first = first_mesh[node.mesh];
      if (first < 0) {
        first = static_cast<int>(scene_.meshes.size());
        for (GltfPrimitive& primitive : mesh.primitives) {
          GltfPrimitive drawn = taken(primitive);
          scene_.meshes.push_back(drawn_mesh(std::move(drawn.positions), std::move(drawn.normals),
                                             std::move(drawn.triangles), name, surface_of(drawn)));
        }
      }
      const auto& [body, placement] = attachments_[i];
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
    if (skinned) {
      scene_.warnings.emplace_back(
          "skinned meshes are drawn in rigid pieces, each with the body that holds most of it");
    }
  }

  int surface_of(const GltfPrimitive& primitive) const {
    return primitive.material < 0 ? static_cast<int>(scene_.surfaces.size()) - 1 : primitive.material;
  }

  // Each triangle goes with the body of the joint that holds most of its corners.
  void add_skinned_visuals(int node, const GltfPrimitive& primitive, const std::string& name) {
    const GltfSkin& skin = skins_[document_.nodes[node].skin];
    spend(skin.joints.size() + primitive.positions.size() + primitive.triangles.size(),
          document_.node_json(node));
    const PosedVertices posed = posed_vertices(document_, skin, primitive, document_.node_json(node));
    std::vector<int> body_of_joint;
    for (const int joint : skin.joints) {
      body_of_joint.push_back(document_.nodes[joint].in_scene ? attachments_[joint].body : world_body);
    }
    std::map<int, std::vector<Triangle>> pieces;
    for (const Triangle& triangle : primitive.triangles) {
      std::map<int, double> shares;
      for (const std::uint32_t corner : triangle) {
        const SkinInfluence& influence = primitive.influences[corner];
        for (std::size_t k = 0; k < 4; ++k) {
          if (influence.weights[k] > 0) shares[body_of_joint[influence.joints[k]]] += influence.weights[k];
        }
      }
      if (shares.empty()) continue;
      const auto most = std::ranges::max_element(
          shares, [](const auto& one, const auto& other) { return one.second < other.second; });
      pieces[most->first].push_back(triangle);
    }
    constexpr std::uint32_t none = ~std::uint32_t{0};
    std::vector<std::uint32_t> in_piece(posed.positions.size(), none);  // the vertices of one piece at a time
    for (auto& [body, triangles] : pieces) {
      const Pose body_from_world = scene_.bodies[body].pose.inverse();
      std::vector<Vector3> positions;
      std::vector<Vector3> normals;
      std::vector<std::uint32_t> used;
      for (Triangle& triangle : triangles) {
        for (std::uint32_t& corner : triangle) {
          if (in_piece[corner] == none) {
            in_piece[corner] = static_cast<std::uint32_t>(used.size());
            used.push_back(corner);
            positions.push_back(body_from_world * posed.positions[corner]);
            if (!posed.normals.empty())
              normals.push_back(body_from_world.orientation * posed.normals[corner]);
          }
          corner = in_piece[corner];
        }
      }
      for (const std::uint32_t vertex : used) in_piece[vertex] = none;
      Visual& visual = scene_.visuals.emplace_back();
      visual.mesh = static_cast<int>(scene_.meshes.size());
      visual.body = body;
      scene_.meshes.push_back(drawn_mesh(std::move(positions), std::move(normals), std::move(triangles), name,
                                         surface_of(primitive)));
    }
  }

  Scene scene_;  // first: reading the rest adds warnings
  GltfDocument document_;
  std::vector<GltfMesh> meshes_;
  std::vector<GltfSkin> skins_;
  PhysicsTables tables_;
  std::vector<NodePhysics> physics_;
  std::vector<Attachment> attachments_;         // of the nodes
  std::vector<int> body_of_node_;               // the world's where the node carries none
  std::vector<int> node_of_body_;               // −1 for the world
  std::vector<std::vector<int>> colliders_of_;  // each body's, as indices
  std::vector<std::unique_ptr<ColliderGeometry>> geometries_;
  std::vector<std::optional<Polytope>> faceted_;  // of each implicit shape, unscaled
  std::size_t most_spent_ = 100'000;
  std::size_t spent_ = 0;
  std::map<int, MassProperties> solids_;  // of colliders whose mesh fills less than their shape
};

Scene scene_of_plain_gltf(const GltfDocument& document, const MeshOptions& options) {
  std::vector<std::string> warnings;
  const MeshFile meshes = mesh_file_of(document, warnings);
  Scene scene = mesh_scene(document.file, meshes, options);
  warnings.emplace_back("has no body of KHR_physics_rigid_bodies, so its meshes fall as bodies on a plane");
  scene.warnings.insert(scene.warnings.begin(), warnings.begin(), warnings.end());
  return scene;
}

}  // namespace

Scene load_scene(const std::filesystem::path& file, const std::optional<MeshOptions>& options) {
  const std::string extension = lower_extension(file);
  try {
    if (extension == ".gltf" || extension == ".glb") {
      GltfDocument document = read_gltf(file);
      if (is_mesh_file(document)) return scene_of_plain_gltf(document, options.value_or(MeshOptions{}));
      if (options) {
        throw Error(file.string() + ": is a scene: mass, pose and copies of its bodies are as it has them");
      }
      return SceneBuilder(file, std::move(document)).build();
    }
    if (is_mesh_extension(extension)) {
      return mesh_scene(file, read_mesh_file(file), options.value_or(MeshOptions{}));
    }
  } catch (const std::bad_alloc&) {
    throw Error(file.string() + ": is too large for this machine's memory");
  }
  read_bytes(file, file.string());  // where there is no such file, that is the news
  throw Error(
      file.string() +
      ": is neither a scene (.gltf, .glb) nor a mesh in a format that is read (.obj, .stl, .ply, .dae, …)");
}

}  // namespace substep
