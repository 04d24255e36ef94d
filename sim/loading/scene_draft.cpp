#include "sim/loading/scene_draft.h"

#include <fmt/format.h>

#include <utility>

namespace substep {

SceneDraft::SceneDraft(const std::filesystem::path& file, GltfDocument read)
    : document(std::move(read)),
      meshes(read_meshes(document, scene.warnings)),
      skins(read_skins(document)),
      tables(read_physics_tables(document.root(), {document.nodes.size(), meshes.size()}, scene.warnings)) {
  scene.file = file;
  scene.name = file.stem().string();
  scene.hash = document.hash;
  most_spent += 4 * document.nodes.size();
  for (const GltfMesh& mesh : meshes) {
    for (const GltfPrimitive& primitive : mesh.primitives) {
      most_spent += 4 * (primitive.positions.size() + primitive.triangles.size());
    }
  }
  for (const GltfSkin& skin : skins) most_spent += 4 * skin.joints.size();
}

void SceneDraft::read_physics() {
  physics.resize(document.nodes.size());
  for (std::size_t i = 0; i < physics.size(); ++i) {
    if (!document.nodes[i].in_scene) continue;
    const JsonValue node = document.node_json(static_cast<int>(i));
    physics[i] = read_node_physics(node, tables, {document.nodes.size(), meshes.size()}, scene.warnings);
    if (physics[i].trigger)
      scene.warnings.push_back(node.path() + ": a trigger is ignored: it moves nothing");
  }
}

JsonValue SceneDraft::extension(int node, const char* part) const {
  return document.node_json(node).extension("KHR_physics_rigid_bodies")->require(part);
}

void SceneDraft::spend(std::size_t size, const JsonValue& place) {
  spent += size;
  if (spent > most_spent) {
    place.fail(
        fmt::format("with it what collides and what wears a skin has more than {} nodes, vertices, "
                    "triangles and joints, a hundred thousand and four times what the file has",
                    most_spent));
  }
}

}  // namespace substep
