#include "sim/loading/scene_visuals.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sim/loading/scene_appearance.h"

namespace substep {
namespace {

int surface_of(const SceneDraft& draft, const GltfPrimitive& primitive) {
  return primitive.material < 0 ? static_cast<int>(draft.scene.surfaces.size()) - 1 : primitive.material;
}

// Each triangle goes with the body of the joint that holds most of its corners.
void add_skinned_visuals(SceneDraft& draft, int node, const GltfPrimitive& primitive,
                         const std::string& name) {
  const GltfSkin& skin = draft.skins[draft.document.nodes[node].skin];
  draft.spend(skin.joints.size() + primitive.positions.size() + primitive.triangles.size(),
              draft.document.node_json(node));
  const PosedVertices posed = posed_vertices(draft.document, skin, primitive, draft.document.node_json(node));
  std::vector<int> body_of_joint;
  for (const int joint : skin.joints) {
    body_of_joint.push_back(draft.document.nodes[joint].in_scene ? draft.attachments[joint].body
                                                                 : world_body);
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
    const Pose body_from_world = draft.scene.bodies[body].pose.inverse();
    std::vector<Vector3> positions;
    std::vector<Vector3> normals;
    std::vector<std::uint32_t> used;
    for (Triangle& triangle : triangles) {
      for (std::uint32_t& corner : triangle) {
        if (in_piece[corner] == none) {
          in_piece[corner] = static_cast<std::uint32_t>(used.size());
          used.push_back(corner);
          positions.push_back(body_from_world * posed.positions[corner]);
          if (!posed.normals.empty()) normals.push_back(body_from_world.orientation * posed.normals[corner]);
        }
        corner = in_piece[corner];
      }
    }
    for (const std::uint32_t vertex : used) in_piece[vertex] = none;
    VertexLooks looks = looks_of(primitive.looks, used);
    looks.tangents.clear();  // the skeleton turns them
    Visual& visual = draft.scene.visuals.emplace_back();
    visual.mesh = static_cast<int>(draft.scene.meshes.size());
    visual.body = body;
    draft.scene.meshes.push_back(drawn_mesh(std::move(positions), std::move(normals), std::move(triangles),
                                            name, surface_of(draft, primitive), std::move(looks)));
  }
}

}  // namespace

void add_visuals(SceneDraft& draft) {
  draft.scene.surfaces = read_surfaces(draft.document, draft.scene.images, draft.scene.warnings);
  constexpr std::size_t most_visuals = 200'000;
  std::vector<int> first_mesh(draft.meshes.size(), -1);  // among the scene's, of each mesh of the document
  bool skinned = false;
  // Colliders no longer need the meshes; only skins need them more than once.
  const auto taken = [&](GltfPrimitive& primitive) {
    return draft.skins.empty() ? std::move(primitive) : primitive;
  };
  for (std::size_t i = 0; i < draft.document.nodes.size(); ++i) {
    const GltfNode& node = draft.document.nodes[i];
    if (!node.in_scene || node.mesh < 0) continue;
    GltfMesh& mesh = draft.meshes[node.mesh];
    const std::string name =
        draft.document.item_of("meshes", node.mesh).name(fmt::format("mesh {}", node.mesh));
    if (draft.scene.visuals.size() + mesh.primitives.size() > most_visuals) {
      draft.document.node_json(static_cast<int>(i))
          .fail(fmt::format("with it more than {} pieces are to be drawn", most_visuals));
    }
    const auto has_skin = [](const GltfPrimitive& primitive) { return !primitive.influences.empty(); };
    if (node.skin >= 0 && std::ranges::any_of(mesh.primitives, has_skin)) {
      skinned = true;
      for (const GltfPrimitive& primitive : mesh.primitives) {
        if (has_skin(primitive)) add_skinned_visuals(draft, static_cast<int>(i), primitive, name);
      }
      continue;
    }
    int& first = first_mesh[node.mesh];
    if (first < 0) {
      first = static_cast<int>(draft.scene.meshes.size());
      for (GltfPrimitive& primitive : mesh.primitives) {
        GltfPrimitive drawn = taken(primitive);
        draft.scene.meshes.push_back(drawn_mesh(std::move(drawn.positions), std::move(drawn.normals),
                                                std::move(drawn.triangles), name, surface_of(draft, drawn),
                                                std::move(drawn.looks)));
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
      visual.mesh = first + static_cast<int>(k);
      draft.scene.visuals.push_back(visual);
    }
  }
  if (skinned) {
    draft.scene.warnings.emplace_back(
        "skinned meshes are drawn in rigid pieces, each with the body that holds most of it");
  }
}

}  // namespace substep
