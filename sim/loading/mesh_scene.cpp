#include "sim/loading/mesh_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/error.h"
#include "sim/loading/body_inertia.h"
#include "sim/loading/collider_shapes.h"
#include "sim/loading/crease_normals.h"
#include "sim/loading/load_scene.h"
#include "sim/loading/scene_appearance.h"
#include "sim/math/fnv1a.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

constexpr int most_copies = 1000;
constexpr double most_height = 1e5;  // m; the renderer shows nothing farther

struct Bounds {
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;

  void include(const Vector3& point) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  Vector3 extent() const { return high - low; }
  Vector3 centre() const { return low + extent() / 2; }
};

Quaternion quaternion_of(const Vector3& degrees) {
  Quaternion rotation = Quaternion::Identity();
  for (int axis = 0; axis < 3; ++axis) {
    rotation = rotation_quaternion(degrees[axis] * (std::numbers::pi / 180) * Vector3::Unit(axis)) * rotation;
  }
  return rotation.normalized();
}

void check(const MeshOptions& options, const std::string& file) {
  const auto require = [&](bool condition, const std::string& what) {
    if (!condition) throw Error(fmt::format("{}: {}", file, what));
  };
  const auto positive = [](double value) { return value > 0 && std::isfinite(value); };
  require(positive(options.scale), fmt::format("the scale must be above 0, but is {}", options.scale));
  require(positive(options.density), fmt::format("the density must be above 0, but is {}", options.density));
  if (options.mass)
    require(positive(*options.mass), fmt::format("the mass must be above 0, but is {}", *options.mass));
  if (options.height) {
    require(*options.height >= 0 && *options.height <= most_height,
            fmt::format("the height must be from 0 to {:g} m, but is {}", most_height, *options.height));
  }
  require(options.rotation.allFinite() && options.rotation.cwiseAbs().maxCoeff() <= 360,
          "the rotation must be three angles within ±360 degrees");
  require(options.copies >= 1 && options.copies <= most_copies,
          fmt::format("the copies must be from 1 to {}, but are {}", most_copies, options.copies));
}

// An object as a body, without its start.
struct Solid {
  std::string name;
  std::vector<int> meshes;  // of the scene
  Polytope hull;            // in the file's frame, metres
  MassProperties properties;
  Pose file_from_body;
  Vector3 moments;
};

class MeshSceneBuilder {
 public:
  MeshSceneBuilder(const std::filesystem::path& file, const MeshFile& meshes, const MeshOptions& options)
      : file_(file.string()), options_(options) {
    check(options, file_);
    scene_.file = file;
    scene_.name = file.stem().string();
    // Hash the options, too: with others the scene's poses do not fit.
    scene_.hash =
        fnv1a(fmt::format("{} {} {} {} {} {} {} {}", options.scale, options.density,
                          options.mass.value_or(-1), options.height.value_or(-1), options.rotation.x(),
                          options.rotation.y(), options.rotation.z(), options.copies),
              meshes.hash);
    scene_.bodies.emplace_back().name = "world";
    scene_.colliders.emplace_back().shape = Plane{};
    scene_.surfaces = meshes.surfaces;
    scene_.images = meshes.images;
    for (const MeshObject& object : meshes.objects) add_solid(object);
    if (solids_.size() * static_cast<std::size_t>(options.copies) > most_bodies) {
      throw Error(fmt::format("{}: {} meshes in {} copies are more than {} bodies, the most that are made",
                              file_, solids_.size(), options.copies, most_bodies));
    }
    warn_of_size();
  }

  Scene build() {
    const Quaternion turned = quaternion_of(options_.rotation);
    Bounds bounds;
    for (const Solid& solid : solids_) {
      for (const Vector3& vertex : solid.hull.vertices) bounds.include(turned * vertex);
    }
    const Vector3 centre = bounds.centre();
    double radius = 0;  // about the vertical through the centre: turned about it, copies stay as wide
    for (const Solid& solid : solids_) {
      for (const Vector3& vertex : solid.hull.vertices) {
        const Vector3 offset = turned * vertex - centre;
        radius = std::max(radius, std::sqrt(offset.x() * offset.x() + offset.z() * offset.z()));
      }
    }
    const double height = bounds.extent().y();
    const double start = options_.height.value_or(bounds.extent().maxCoeff() / 2);
    for (int copy = 0; copy < options_.copies; ++copy) {
      Pose world_from_file;
      Vector3 place(0, start + height / 2, 0);
      Quaternion about_vertical = Quaternion::Identity();
      if (copy > 0 || options_.copies > 1) place += place_of_copy(copy, radius, height);
      if (copy > 0) {
        constexpr double golden_angle = 2.399963229728653;  // no two copies stand alike
        about_vertical = rotation_quaternion(copy % 1000 * golden_angle * Vector3::UnitY());
      }
      world_from_file.orientation = (about_vertical * turned).normalized();
      world_from_file.position = place - about_vertical * centre;
      for (const Solid& solid : solids_) add_body(solid, world_from_file, copy);
    }
    return std::move(scene_);
  }

 private:
  static constexpr std::size_t most_bodies = 10'000;

  // Layers of two by two, each moved aside from the one below it, so that they do not stand as towers.
  static Vector3 place_of_copy(int copy, double radius, double height) {
    const double spacing = 2.1 * radius;
    const int layer = copy / 4;
    const double aside = layer % 2 == 0 ? 0 : 0.35;
    return {spacing * (copy % 2 - 0.5 + aside), 1.1 * height * layer, spacing * (copy / 2 % 2 - 0.5 + aside)};
  }

  void add_solid(const MeshObject& object) {
    Solid solid;
    solid.name = object.name;
    const std::string where = fmt::format("{}: mesh '{}'", file_, object.name);
    std::vector<Vector3> positions;
    std::vector<Triangle> triangles;
    for (const MeshPart& part : object.parts) {
      const auto first = static_cast<std::uint32_t>(positions.size());
      for (const Vector3& position : part.positions) positions.push_back(options_.scale * position);
      for (const Triangle& triangle : part.triangles) {
        triangles.push_back({first + triangle[0], first + triangle[1], first + triangle[2]});
      }
      solid.meshes.push_back(add_mesh(object.name, part));
    }
    // Ignore vertices that no triangle has.
    std::vector<Vector3> corners;
    for (const Triangle& triangle : triangles) {
      for (const std::uint32_t corner : triangle) corners.push_back(positions[corner]);
    }
    const std::string place = fmt::format("mesh '{}'", object.name);
    SimplifiedHull simplified = simplified_hull(corners, where);
    solid.hull = std::move(simplified.hull);
    if (!simplified.warning.empty()) {
      scene_.warnings.push_back(fmt::format("{}: {}", place, simplified.warning));
    }
    solid.properties = mass_properties(solid.hull);
    const double hull_volume = solid.properties.mass;
    if (!is_closed(positions, triangles)) {
      scene_.warnings.push_back(place +
                                ": is not closed, so its mass properties are those of its convex hull");
    } else {
      MassProperties exact = mass_properties(positions, triangles);
      if (exact.mass < 0) {  // inside out
        exact.mass = -exact.mass;
        exact.inertia = -exact.inertia;
      }
      if (exact.mass > 1e-6 * hull_volume && exact.mass <= 1.001 * hull_volume) {
        solid.properties = exact;
        if (hull_volume > 1.01 * exact.mass) {
          scene_.warnings.push_back(
              fmt::format("{}: collides as its convex hull, which has {:.2f} times its volume", place,
                          hull_volume / exact.mass));
        }
      } else {
        scene_.warnings.push_back(
            place + ": cuts through itself, so its mass properties are those of its convex hull");
      }
    }
    solid.properties =
        with_mass(solid.properties, options_.mass.value_or(solid.properties.mass * options_.density));
    const PrincipalInertia principal = symmetric_principal_inertia(solid.properties.inertia);
    solid.file_from_body = {solid.properties.centre_of_mass, principal.orientation};
    solid.moments = principal.moments;
    const double mass = solid.properties.mass;
    if (!(mass > 0 && std::isfinite(1 / mass) && principal.moments.minCoeff() > 0 &&
          principal.moments.cwiseInverse().allFinite() && principal.moments.allFinite())) {
      throw Error(where +
                  ": its mass or size is too large or too small to compute with; --scale sets its size");
    }
    solids_.push_back(std::move(solid));
  }

  int add_mesh(const std::string& name, const MeshPart& part) {
    int surface = part.surface;
    if (part.color) {
      surface = static_cast<int>(scene_.surfaces.size());
      Surface& added = scene_.surfaces.emplace_back();
      added.name = name;
      added.base_color = *part.color;
    }
    scene_.meshes.push_back(
        part.normals.empty()
            ? smoothly_drawn_mesh(part.positions, part.triangles, name, surface, part.looks)
            : drawn_mesh(part.positions, part.normals, part.triangles, name, surface, part.looks));
    return static_cast<int>(scene_.meshes.size()) - 1;
  }

  void warn_of_size() {
    Bounds bounds;
    for (const Solid& solid : solids_) {
      for (const Vector3& vertex : solid.hull.vertices) bounds.include(vertex);
    }
    const double size = bounds.extent().maxCoeff();
    if (size > 20 || size < 0.01) {
      scene_.warnings.push_back(fmt::format(
          "it is {:.3g} m large: where its unit is not the metre, say how many metres one is, such as "
          "--scale 0.001",
          size));
    }
  }

  void add_body(const Solid& solid, const Pose& world_from_file, int copy) {
    const int index = static_cast<int>(scene_.bodies.size());
    Body& body = scene_.bodies.emplace_back();
    body.name = copy == 0 ? solid.name : fmt::format("{} copy {}", solid.name, copy + 1);
    body.inverse_mass = 1 / solid.properties.mass;
    body.inverse_inertia = solid.moments.cwiseInverse();
    body.body_from_node = solid.file_from_body.inverse();
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
    for (const int mesh : solid.meshes) {
      visual.mesh = mesh;
      scene_.visuals.push_back(visual);
    }
  }

  Scene scene_;
  std::string file_;
  MeshOptions options_;
  std::vector<Solid> solids_;
};

}  // namespace

Scene mesh_scene(const std::filesystem::path& file, const MeshFile& meshes, const MeshOptions& options) {
  return MeshSceneBuilder(file, meshes, options).build();
}

}  // namespace substep
