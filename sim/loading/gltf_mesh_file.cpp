#include "sim/loading/gltf_mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "sim/error.h"
#include "sim/loading/gltf_meshes.h"
#include "sim/loading/scene_appearance.h"

namespace substep {
namespace {

// Nodes may share a mesh, and each makes its own body of it.
constexpr std::size_t most_objects = 1000;
constexpr std::size_t most_shared = 200'000;  // vertices and triangles

std::size_t size_of(const GltfMesh& mesh) {
  std::size_t size = 0;
  for (const GltfPrimitive& primitive : mesh.primitives)
    size += primitive.positions.size() + primitive.triangles.size();
  return size;
}

MeshPart placed(MeshPart part, const NodeTransform& world) {
  for (Vector3& position : part.positions) position = world.linear * position + world.translation;
  // Normals stay square to the surface under a scale that differs along its axes.
  const Matrix3 of_normals = world.linear.inverse().transpose();
  for (Vector3& normal : part.normals) normal = (of_normals * normal).stableNormalized();
  const bool is_mirrored = world.linear.determinant() < 0;
  if (is_mirrored) {
    for (Triangle& triangle : part.triangles) std::swap(triangle[1], triangle[2]);
  }
  for (std::array<float, 4>& tangent : part.looks.tangents) {
    const Vector3 turned = (world.linear * Vector3(tangent[0], tangent[1], tangent[2])).stableNormalized();
    for (int i = 0; i < 3; ++i) tangent[i] = static_cast<float>(turned[i]);
    if (is_mirrored) tangent[3] = -tangent[3];
  }
  return part;
}

}  // namespace

bool is_mesh_file(const GltfDocument& document) {
  const JsonValue root = document.root();
  const auto names_physics = [](const JsonValue& object) {
    const auto extensions = object.find("extensions");
    return extensions && extensions->json().is_object() &&
           extensions->json().contains("KHR_physics_rigid_bodies");
  };
  if (names_physics(root)) return false;
  const auto extras = root.find("extras");
  if (extras && extras->json().is_object() && extras->json().contains("substep")) return false;
  const auto used = root.find("extensionsUsed");
  if (used && used->json().is_array()) {
    for (const auto& name : used->json()) {
      if (name == "KHR_physics_rigid_bodies") return false;
    }
  }
  bool draws = false;
  for (std::size_t i = 0; i < document.nodes.size(); ++i) {
    if (names_physics(document.node_json(static_cast<int>(i)))) return false;
    draws = draws || (document.nodes[i].in_scene && document.nodes[i].mesh >= 0);
  }
  return draws;
}

MeshFile mesh_file_of(GltfDocument& document, std::vector<std::string>& warnings) {
  const std::vector<GltfMesh> meshes = read_meshes(document, warnings);
  const std::vector<GltfSkin> skins = read_skins(document);
  MeshFile file;
  file.hash = document.hash;
  file.surfaces = read_surfaces(document, file.images, warnings);
  std::set<std::string> names{"world"};  // of body 0
  std::size_t own = 0;                   // vertices and triangles, were no mesh shared
  for (const GltfMesh& mesh : meshes) own += size_of(mesh);
  const std::size_t most = std::max(own, most_shared);
  std::size_t size = 0;
  for (std::size_t i = 0; i < document.nodes.size(); ++i) {
    const GltfNode& node = document.nodes[i];
    if (!node.in_scene || node.mesh < 0) continue;
    MeshObject object;
    size += size_of(meshes[node.mesh]);
    if (size > most || file.objects.size() >= most_objects) {
      document.node_json(static_cast<int>(i))
          .fail(fmt::format(
              "with it the meshes to drop are more than {} or have more than {} vertices and triangles",
              most_objects, most));
    }
    for (const GltfPrimitive& primitive : meshes[node.mesh].primitives) {
      MeshPart part;
      part.surface = primitive.material;
      part.looks = primitive.looks;
      part.triangles = primitive.triangles;
      if (part.triangles.empty()) continue;
      if (node.skin >= 0 && !primitive.influences.empty()) {
        PosedVertices posed =
            posed_vertices(document, skins[node.skin], primitive, document.node_json(static_cast<int>(i)));
        part.positions = std::move(posed.positions);
        part.normals = std::move(posed.normals);
        part.looks.tangents.clear();  // the skeleton turns them
      } else if (std::fabs(node.world.linear.determinant()) > 0) {
        part.positions = primitive.positions;
        part.normals = primitive.normals;
        part = placed(std::move(part), node.world);
      } else {
        continue;  // scaled to nothing
      }
      const auto finite = [](const Vector3& vector) { return vector.allFinite(); };
      if (!std::ranges::all_of(part.positions, finite)) {
        document.node_json(static_cast<int>(i)).fail("is scaled or moved too far to compute with");
      }
      if (!std::ranges::all_of(part.normals, finite)) part.normals.clear();
      object.parts.push_back(std::move(part));
    }
    if (object.parts.empty()) continue;
    const std::string base = node.name.empty() ? document.file.stem().string() : node.name;
    object.name = base;
    for (int use = 2; !names.insert(object.name).second; ++use)
      object.name = fmt::format("{} #{}", base, use);
    file.objects.push_back(std::move(object));
  }
  if (file.objects.empty()) {
    throw Error(document.file_name +
                ": has no body of the extension KHR_physics_rigid_bodies and no mesh of triangles to drop");
  }
  return file;
}

}  // namespace substep
