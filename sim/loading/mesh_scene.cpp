#include "sim/loading/mesh_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "sim/loading/collider_shapes.h"
#include "sim/loading/file_bytes.h"
#include "sim/loading/gltf_meshes.h"
#include "sim/loading/scene_appearance.h"
#include "sim/math/fnv1a.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

constexpr int most_copies = 1000;
constexpr double most_height = 1e5;  // m; the renderer shows nothing farther

Quaternion quaternion_of(const Vector3& degrees) {
  Quaternion rotation = Quaternion::Identity();
  for (int axis = 0; axis < 3; ++axis) {
    rotation = rotation_quaternion(degrees[axis] * (std::numbers::pi / 180) * Vector3::Unit(axis)) * rotation;
  }
  return rotation.normalized();
}

void check(const MeshOptions& options, const std::string& file) {
  const auto require = [&](bool condition, const std::string& what) {
    if (!condition) throw Error("{}: {}", file, what);
  };
  const auto require_positive = [&](double value, const char* what) {
    require(value > 0 && std::isfinite(value), fmt::format("the {} must be above 0, but is {}", what, value));
  };
  require_positive(options.scale, "scale");
  require_positive(options.density, "density");
  if (options.mass) require_positive(*options.mass, "mass");
  if (options.height) {
    require(*options.height >= 0 && *options.height <= most_height,
            fmt::format("the height must be from 0 to {:g} m, but is {}", most_height, *options.height));
  }
  require(options.rotation.allFinite() && options.rotation.cwiseAbs().maxCoeff() <= 360,
          "the rotation must be three angles within ±360 degrees");
  require(options.copies >= 1 && options.copies <= most_copies,
          fmt::format("the copies must be from 1 to {}, but are {}", most_copies, options.copies));
}

/// An object as a body, without its initial pose.
struct Solid {
  Body body;
  Pose file_from_body;
  Polytope hull;       // in the file's frame, metres
  int first_mesh = 0;  // of the scene
  int meshes = 0;
};

class MeshSceneBuilder {
 public:
  MeshSceneBuilder(const std::filesystem::path& file, MeshFile meshes, const MeshOptions& options)
      : file_(file.string()), options_(options) {
    check(options, file_);
    scene_.file = file;
    scene_.name = file.stem().string();
    // Hash the options, too, since poses depend on them.
    scene_.hash =
        fnv1a(fmt::format("{} {} {} {} {} {} {} {}", options.scale, options.density,
                          options.mass.value_or(-1), options.height.value_or(-1), options.rotation.x(),
                          options.rotation.y(), options.rotation.z(), options.copies),
              meshes.hash);
    scene_.bodies.emplace_back().name = "world";
    scene_.colliders.emplace_back().shape = Plane{};
    scene_.surfaces = std::move(meshes.surfaces);
    scene_.images = std::move(meshes.images);
    scene_.warnings = std::move(meshes.warnings);
    for (MeshObject& object : meshes.objects) {
      try {
        add_solid(object);
      } catch (const Error& failure) {
        if (solids_.empty() && &object == &meshes.objects.back())
          throw Error("{}: {}", file_, failure.what());
        scene_.warnings.push_back(fmt::format("{}; it is left out", failure.what()));
      }
    }
    if (solids_.size() * static_cast<std::size_t>(options.copies) > most_bodies) {
      throw Error("{}: {} meshes in {} copies are more than {} bodies, the most that are made", file_,
                  solids_.size(), options.copies, most_bodies);
    }
    const double size = bounds(Quaternion::Identity()).sizes().maxCoeff();
    const std::string extension = lower_extension(file);
    const bool states_unit = extension == ".3mf" || extension == ".amf" || extension == ".fbx";
    if (size > 20 || size < 0.01 || (states_unit && options.scale == 1)) {
      scene_.warnings.push_back(fmt::format(
          "it is {:.3g} m large: where its unit{} is not the metre, say how many metres one is, such as "
          "--scale 0.001",
          size, states_unit ? ", which is not read," : ""));
    }
  }

  Scene build() {
    const Quaternion turned = quaternion_of(options_.rotation);
    const Bounds box = bounds(turned);
    const Vector3 centre = box.min() + box.sizes() / 2;
    double radius = 0;  // about the vertical through the centre, about which copies are rotated
    for (const Solid& solid : solids_) {
      for (const Vector3& vertex : solid.hull.vertices) {
        const Vector3 offset = turned * vertex - centre;
        radius = std::max(radius, std::sqrt(offset.x() * offset.x() + offset.z() * offset.z()));
      }
    }
    const double height = box.sizes().y();
    const double start = options_.height.value_or(box.sizes().maxCoeff() / 2);
    for (int copy = 0; copy < options_.copies; ++copy) {
      Vector3 position(0, start + height / 2, 0);
      Quaternion about_vertical = Quaternion::Identity();
      if (options_.copies > 1) position += position_of_copy(copy, radius, height);
      if (copy > 0) {
        constexpr double golden_angle = 2.399963229728653;  // rotates no two copies alike
        about_vertical = rotation_quaternion(copy * golden_angle * Vector3::UnitY());
      }
      const Pose world_from_file{position - about_vertical * centre, (about_vertical * turned).normalized()};
      for (const Solid& solid : solids_) add_body(solid, world_from_file, copy);
    }
    return std::move(scene_);
  }

 private:
  static constexpr std::size_t most_bodies = 10'000;

  /// Returns positions in layers of two by two, each shifted against the one below it, so that no towers
  /// arise.
  static Vector3 position_of_copy(int copy, double radius, double height) {
    const double spacing = 2.1 * radius;
    const int layer = copy / 4;
    const double aside = layer % 2 == 0 ? 0 : 0.35;
    return {spacing * (copy % 2 - 0.5 + aside), 1.1 * height * layer, spacing * (copy / 2 % 2 - 0.5 + aside)};
  }

  Bounds bounds(const Quaternion& rotation) const {
    Bounds box;
    for (const Solid& solid : solids_) {
      for (const Vector3& vertex : solid.hull.vertices) box.extend(rotation * vertex);
    }
    return box;
  }

  template <typename... Args>
  void warn(const Solid& solid, fmt::format_string<Args...> text, Args&&... args) {
    scene_.warnings.push_back(
        fmt::format("mesh '{}': {}", solid.body.name, fmt::format(text, std::forward<Args>(args)...)));
  }

  void add_solid(MeshObject& object) {
    Solid solid;
    solid.body.name = names_.add(object.name);
    const std::string where = fmt::format("mesh '{}'", object.name);
    std::vector<Vector3> positions;
    std::vector<Triangle> triangles;
    for (const Mesh& mesh : object.meshes) {
      const auto first = static_cast<std::uint32_t>(positions.size());
      for (const Vector3& position : mesh.positions) positions.push_back(options_.scale * position);
      for (const Triangle& triangle : mesh.triangles) {
        triangles.push_back({first + triangle[0], first + triangle[1], first + triangle[2]});
      }
    }
    // Ignore vertices that no triangle uses.
    std::vector<Vector3> corners;
    for (const Triangle& triangle : triangles) {
      for (const std::uint32_t corner : triangle) corners.push_back(positions[corner]);
    }
    SimplifiedHull simplified = simplified_hull(corners, where);
    solid.hull = std::move(simplified.hull);
    if (!simplified.warning.empty()) warn(solid, "{}", simplified.warning);
    set_mass(solid, enclosed_solid(positions, triangles), most_filled(simplified), where);
    solid.first_mesh = static_cast<int>(scene_.meshes.size());
    solid.meshes = static_cast<int>(object.meshes.size());
    for (Mesh& mesh : object.meshes) {
      mesh.name = object.name;
      scene_.meshes.push_back(with_normals(std::move(mesh), Shading::creased));
    }
    solids_.push_back(std::move(solid));
  }

  /// Sets mass and principal axes: those of a solid of at most `most` times the hull's volume, or the hull's.
  void set_mass(Solid& solid, const std::optional<MassProperties>& exact, double most,
                const std::string& where) {
    MassProperties properties = mass_properties(solid.hull);
    const double hull_volume = properties.mass;
    if (!exact) {
      warn(solid,
           "is not closed, or more than two triangles share an edge, so its mass properties are those of its "
           "convex hull");
    } else if (!(exact->mass > least_filled * hull_volume && exact->mass <= most * hull_volume)) {
      warn(solid,
           "cuts through itself or has parts that face inwards, so its mass properties are those of its "
           "convex hull");
    } else {
      properties = *exact;
      if (hull_volume > 1.01 * exact->mass) {
        warn(solid, "collides as its convex hull, which has {:.2f} times its volume",
             hull_volume / exact->mass);
      }
    }
    const double mass = options_.mass.value_or(properties.mass * options_.density);
    const PrincipalInertia principal = symmetric_principal_inertia(with_mass(properties, mass).inertia);
    solid.file_from_body = {properties.centre_of_mass, principal.orientation};
    solid.body.body_from_node = solid.file_from_body.inverse();
    solid.body.inverse_mass = 1 / mass;
    solid.body.inverse_inertia = principal.moments.cwiseInverse();
    if (!(mass > 0 && std::isfinite(solid.body.inverse_mass) && principal.moments.minCoeff() > 0 &&
          solid.body.inverse_inertia.allFinite() && principal.moments.allFinite())) {
      throw Error(where +
                  ": its mass or size is too large or too small to compute with; --scale sets its size");
    }
  }

  void add_body(const Solid& solid, const Pose& world_from_file, int copy) {
    const int index = static_cast<int>(scene_.bodies.size());
    Body& body = scene_.bodies.emplace_back(solid.body);
    if (copy > 0) body.name = names_.add(fmt::format("{} copy {}", body.name, copy + 1));
    body.pose = world_from_file * solid.file_from_body;
    body.pose.orientation.normalize();
    Collider& collider = scene_.colliders.emplace_back();
    collider.body = index;
    collider.shape = solid.hull;
    collider.placement = body.body_from_node;
    Visual visual;
    visual.body = index;
    visual.linear = options_.scale * body.body_from_node.orientation.toRotationMatrix();
    visual.translation = body.body_from_node.position;
    for (visual.mesh = solid.first_mesh; visual.mesh < solid.first_mesh + solid.meshes; ++visual.mesh) {
      scene_.visuals.push_back(visual);
    }
  }

  Scene scene_;
  std::string file_;
  MeshOptions options_;
  std::vector<Solid> solids_;
  UniqueNames names_;
};

Mesh placed(Mesh mesh, const NodeTransform& world) {
  for (Vector3& position : mesh.positions) position = world.linear * position + world.translation;
  // Keep normals perpendicular to the surface under a scale that differs along its axes.
  const Matrix3 of_normals = world.linear.inverse().transpose();
  for (Vector3& normal : mesh.normals) normal = (of_normals * normal).stableNormalized();
  const bool is_mirrored = world.linear.determinant() < 0;
  if (is_mirrored) {
    for (Triangle& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  }
  for (std::array<float, 4>& tangent : mesh.attributes.tangents) {
    const Vector3 turned = (world.linear * Vector3(tangent[0], tangent[1], tangent[2])).stableNormalized();
    for (int i = 0; i < 3; ++i) tangent[i] = static_cast<float>(turned[i]);
    if (is_mirrored) tangent[3] = -tangent[3];
  }
  return mesh;
}

/// Returns the meshes of a node, placed in the world; those that are scaled to nothing are left out.
std::vector<Mesh> placed_meshes(const GltfDocument& document, const GltfNode& node, const GltfMesh& mesh,
                                const std::vector<GltfSkin>& skins, const JsonValue& place) {
  const auto finite = [](const Vector3& vector) { return vector.allFinite(); };
  std::vector<Mesh> meshes;
  for (const GltfPrimitive& primitive : mesh.primitives) {
    if (primitive.triangles.empty()) continue;
    if (node.skin >= 0 && !primitive.influences.empty()) {
      meshes.push_back(posed(document, skins[node.skin], primitive, place));
    } else if (std::fabs(node.world.linear.determinant()) > 0) {
      meshes.push_back(placed(primitive, node.world));
    } else {
      place.warn("is left out: it is flat or scaled to nothing");
      continue;
    }
    Mesh& added = meshes.back();
    if (!std::ranges::all_of(added.positions, finite))
      place.fail("is scaled or moved too far to compute with");
    if (!std::ranges::all_of(added.normals, finite)) added.normals.clear();
  }
  return meshes;
}

}  // namespace

Scene mesh_scene(const std::filesystem::path& file, MeshFile meshes, const MeshOptions& options) {
  return MeshSceneBuilder(file, std::move(meshes), options).build();
}

bool is_mesh_file(const GltfDocument& document) {
  const JsonValue root = document.root();
  const auto has = [](const std::optional<JsonValue>& object, const char* key) {
    return object && object->json().is_object() && object->json().contains(key);
  };
  const auto names_physics = [&](const JsonValue& object) {
    return has(object.find("extensions"), "KHR_physics_rigid_bodies");
  };
  if (names_physics(root) || has(root.find("extras"), "substep")) return false;
  for (const JsonValue& name : root.items("extensionsUsed")) {
    if (name.text() == "KHR_physics_rigid_bodies") return false;
  }
  bool draws = false;
  for (std::size_t i = 0; i < document.nodes.size(); ++i) {
    if (names_physics(document.item_of("nodes", i))) return false;
    draws = draws || (document.nodes[i].in_scene && document.nodes[i].mesh >= 0);
  }
  return draws;
}

MeshFile mesh_file_of(GltfDocument& document) {
  // Nodes may share a mesh, and each becomes a body with a copy of it.
  constexpr std::size_t most_objects = 1000;
  constexpr std::size_t most_shared = 200'000;  // vertices and triangles
  const std::vector<GltfMesh> meshes = read_meshes(document);
  const std::vector<GltfSkin> skins = read_skins(document);
  MeshFile file;
  file.surfaces = read_surfaces(document, file.images);
  file.hash = document.hash;
  std::size_t own = 0;  // vertices and triangles with each mesh once
  for (const GltfMesh& mesh : meshes) own += mesh.size();
  const std::size_t most = std::max(own, most_shared);
  std::size_t size = 0;
  for (std::size_t i = 0; i < document.nodes.size(); ++i) {
    const GltfNode& node = document.nodes[i];
    if (!node.in_scene || node.mesh < 0) continue;
    const JsonValue place = document.item_of("nodes", i);
    size += meshes[node.mesh].size();
    if (size > most || file.objects.size() >= most_objects) {
      place.fail("with it the meshes to drop are more than {} or have more than {} vertices and triangles",
                 most_objects, most);
    }
    std::vector<Mesh> placed = placed_meshes(document, node, meshes[node.mesh], skins, place);
    if (!placed.empty()) file.objects.push_back({node.name, std::move(placed)});
  }
  if (file.objects.empty()) {
    throw Error(document.source->name +
                ": has no body of the extension KHR_physics_rigid_bodies and no mesh of triangles to drop");
  }
  return file;
}

}  // namespace substep
