// Makes the meshes and visuals of a scene: their normals, and the bodies that they follow.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "sim/loading/scene_appearance.h"
#include "sim/loading/scene_draft.h"

namespace substep {
namespace {

/// Returns the attributes of `vertices`, in their order, without tangents, since normals have changed.
VertexAttributes attributes_of(const VertexAttributes& attributes, std::span<const std::uint32_t> vertices) {
  const auto chosen = [&](const auto& all) {
    std::remove_cvref_t<decltype(all)> some;
    for (std::size_t i = 0; !all.empty() && i < vertices.size(); ++i) some.push_back(all[vertices[i]]);
    return some;
  };
  return {{chosen(attributes.texture_coordinates[0]), chosen(attributes.texture_coordinates[1])},
          chosen(attributes.colors),
          {}};
}

/// Returns a normal for each corner of each triangle, smooth except at creases. `areas`: twice the triangles'
/// areas times their unit normals. `directions`: the unit normals, 0 for triangles without area.
std::vector<std::array<Vector3, 3>> crease_normals(const Mesh& mesh, std::span<const Vector3> areas,
                                                   std::span<const Vector3> directions) {
  constexpr double cosine_of_crease = 0.766;       // 40°
  constexpr std::ptrdiff_t most_neighbours = 256;  // corners with more stay flat: the cost is their square

  // Sort the corners by position.
  struct Corner {
    std::uint32_t triangle;
    std::uint32_t index;
  };
  std::vector<Corner> corners;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    if (directions[i].isZero(0)) continue;
    for (std::uint32_t k = 0; k < 3; ++k) corners.push_back({i, k});
  }
  const auto position = [&](const Corner& corner) -> const Vector3& {
    return mesh.positions[mesh.triangles[corner.triangle][corner.index]];
  };
  std::ranges::sort(corners, [&](const Corner& one, const Corner& other) {
    const Vector3& a = position(one);
    const Vector3& b = position(other);
    return std::tuple(a.x(), a.y(), a.z(), one.triangle, one.index) <
           std::tuple(b.x(), b.y(), b.z(), other.triangle, other.index);
  });
  // Sum the areas around each position.
  std::vector<std::array<Vector3, 3>> normals(mesh.triangles.size());
  for (auto begin = corners.begin(); begin != corners.end();) {
    const auto end = std::find_if(begin, corners.end(),
                                  [&](const Corner& corner) { return position(corner) != position(*begin); });
    for (auto one = begin; one != end; ++one) {
      const Vector3& own = directions[one->triangle];
      Vector3 sum = areas[one->triangle];
      if (end - begin <= most_neighbours) {
        sum.setZero();
        for (auto other = begin; other != end; ++other) {
          if (directions[other->triangle].dot(own) > cosine_of_crease) sum += areas[other->triangle];
        }
      }
      const Vector3 normal = sum.stableNormalized();
      normals[one->triangle][one->index] = normal.squaredNorm() > 0.5 ? normal : own;
    }
    begin = end;
  }
  return normals;
}

/// Adds a mesh and returns its index. A mesh without a material gets the last of the surfaces.
int add_mesh(Scene& scene, Mesh mesh, const std::string& name) {
  mesh.name = name;
  if (mesh.surface < 0) mesh.surface = static_cast<int>(scene.surfaces.size()) - 1;
  scene.meshes.push_back(with_normals(std::move(mesh), Shading::flat));
  return static_cast<int>(scene.meshes.size()) - 1;
}

/// Returns the triangles of each body. A triangle follows the body whose joints have the largest sum of
/// weights at its corners; triangles without weights are left out.
std::map<int, std::vector<Triangle>> triangles_of_bodies(const GltfPrimitive& primitive,
                                                         const std::vector<int>& body_of_joint) {
  std::map<int, std::vector<Triangle>> triangles;
  for (const Triangle& triangle : primitive.triangles) {
    std::map<int, double> weights;
    for (const std::uint32_t corner : triangle) {
      const SkinInfluence& influence = primitive.influences[corner];
      for (std::size_t k = 0; k < 4; ++k) {
        if (influence.weights[k] > 0) weights[body_of_joint[influence.joints[k]]] += influence.weights[k];
      }
    }
    if (weights.empty()) continue;
    triangles[std::ranges::max_element(weights, {}, [](const auto& weight) { return weight.second; })->first]
        .push_back(triangle);
  }
  return triangles;
}

/// Adds a visual for each body that triangles of a skinned primitive follow, posed as at the start.
void add_skinned_visuals(SceneDraft& draft, std::size_t node, const GltfPrimitive& primitive,
                         const std::string& name) {
  const GltfSkin& skin = draft.skins[draft.document.nodes[node].skin];
  const JsonValue place = draft.node_json(node);
  draft.spend(skin.joints.size() + primitive.positions.size() + primitive.triangles.size(), place);
  const Mesh whole = posed(draft.document, skin, primitive, place);
  std::vector<int> body_of_joint;
  for (const int joint : skin.joints) {
    body_of_joint.push_back(draft.document.nodes[joint].in_scene ? draft.attachments[joint].body
                                                                 : world_body);
  }
  std::vector<std::uint32_t> in_submesh(whole.positions.size(), no_index);  // index of each vertex
  for (auto& [body, triangles] : triangles_of_bodies(primitive, body_of_joint)) {
    const Pose body_from_world = draft.scene.bodies[body].pose.inverse();
    Mesh submesh;
    submesh.surface = whole.surface;
    std::vector<std::uint32_t> used;
    for (Triangle triangle : triangles) {
      for (std::uint32_t& corner : triangle) {
        if (in_submesh[corner] == no_index) {
          in_submesh[corner] = static_cast<std::uint32_t>(used.size());
          used.push_back(corner);
        }
        corner = in_submesh[corner];
      }
      submesh.triangles.push_back(triangle);
    }
    for (const std::uint32_t vertex : used) {
      submesh.positions.push_back(body_from_world * whole.positions[vertex]);
      if (!whole.normals.empty()) {
        submesh.normals.push_back(body_from_world.orientation * whole.normals[vertex]);
      }
      in_submesh[vertex] = no_index;
    }
    submesh.attributes = attributes_of(whole.attributes, used);
    Visual& visual = draft.scene.visuals.emplace_back();
    visual.body = body;
    visual.mesh = add_mesh(draft.scene, std::move(submesh), name);
  }
}

}  // namespace

Mesh with_normals(Mesh mesh, Shading shading) {
  if (!mesh.normals.empty()) return mesh;
  std::vector<Vector3> areas;
  std::vector<Vector3> directions;
  for (const Triangle& triangle : mesh.triangles) {
    const Vector3& a = mesh.positions[triangle[0]];
    areas.emplace_back((mesh.positions[triangle[1]] - a).cross(mesh.positions[triangle[2]] - a));
    directions.emplace_back(areas.back().stableNormalized());
    if (!(directions.back().squaredNorm() > 0.5)) directions.back().setZero();  // no area, so nothing to see
  }
  std::vector<std::array<Vector3, 3>> smooth;
  if (shading == Shading::creased) smooth = crease_normals(mesh, areas, directions);
  Mesh drawn;
  drawn.name = std::move(mesh.name);
  drawn.surface = mesh.surface;
  std::vector<std::uint32_t> corners;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (directions[i].isZero(0)) continue;
    const auto first = static_cast<std::uint32_t>(drawn.positions.size());
    for (std::size_t k = 0; k < 3; ++k) {
      corners.push_back(mesh.triangles[i][k]);
      drawn.positions.push_back(mesh.positions[corners.back()]);
      drawn.normals.push_back(smooth.empty() ? directions[i] : smooth[i][k]);
    }
    drawn.triangles.push_back({first, first + 1, first + 2});
  }
  drawn.attributes = attributes_of(mesh.attributes, corners);
  return drawn;
}

void add_visuals(SceneDraft& draft) {
  constexpr std::size_t most_visuals = 200'000;
  draft.scene.surfaces = read_surfaces(draft.document, draft.scene.images);
  std::vector<int> first_mesh(draft.meshes.size(), -1);  // of each document's mesh: its first scene mesh
  bool any_skinned = false;
  for (std::size_t i = 0; i < draft.document.nodes.size(); ++i) {
    const GltfNode& node = draft.document.nodes[i];
    if (!node.in_scene || node.mesh < 0) continue;
    GltfMesh& mesh = draft.meshes[node.mesh];
    const std::string name =
        draft.document.item_of("meshes", node.mesh).name(fmt::format("mesh {}", node.mesh));
    if (draft.scene.visuals.size() + mesh.primitives.size() > most_visuals) {
      draft.node_json(i).fail("with it more than {} primitives are to be drawn", most_visuals);
    }
    const auto is_skinned = [&](const GltfPrimitive& primitive) {
      return node.skin >= 0 && !primitive.influences.empty();
    };
    for (const GltfPrimitive& primitive : mesh.primitives) {
      if (!is_skinned(primitive)) continue;
      add_skinned_visuals(draft, i, primitive, name);
      any_skinned = true;
    }
    if (std::ranges::all_of(mesh.primitives, is_skinned)) continue;
    int& first = first_mesh[node.mesh];
    if (first < 0) {
      first = static_cast<int>(draft.scene.meshes.size());
      for (GltfPrimitive& primitive : mesh.primitives) {
        // Copy the primitive where skins may need it again.
        add_mesh(draft.scene, draft.skins.empty() ? std::move(primitive) : primitive, name);
      }
    }
    const auto& [body, placement] = draft.attachments[i];
    const Pose& body_from_node = draft.scene.bodies[body].body_from_node;
    Visual visual;
    visual.body = body;
    visual.linear = body_from_node.orientation.toRotationMatrix() * placement.linear;
    visual.translation = body_from_node * placement.translation;
    if (!(std::fabs(visual.linear.determinant()) > 0)) continue;  // scaled to nothing
    for (std::size_t k = 0; k < mesh.primitives.size(); ++k) {
      if (is_skinned(mesh.primitives[k])) continue;
      visual.mesh = first + static_cast<int>(k);
      draft.scene.visuals.push_back(visual);
    }
  }
  if (any_skinned) {
    draft.document.source->warnings.emplace_back(
        "skinned meshes are drawn in rigid pieces, each with the body that holds most of it");
  }
}

}  // namespace substep
