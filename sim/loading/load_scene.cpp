#include "sim/loading/load_scene.h"

#include <new>
#include <utility>

#include "sim/error.h"
#include "sim/loading/file_bytes.h"
#include "sim/loading/mesh_file.h"
#include "sim/loading/mesh_scene.h"
#include "sim/loading/scene_appearance.h"
#include "sim/loading/scene_draft.h"
#include "sim/loading/scene_settings.h"
#include "sim/math/floating_point.h"

namespace substep {
namespace {

bool is_gltf(const std::filesystem::path& file) {
  const std::string extension = lower_extension(file);
  return extension == ".gltf" || extension == ".glb";
}

void read_physics(SceneDraft& draft) {
  draft.physics.resize(draft.document.nodes.size());
  for (std::size_t i = 0; i < draft.physics.size(); ++i) {
    if (!draft.document.nodes[i].in_scene) continue;
    draft.physics[i] = read_node_physics(draft.document, i, draft.tables);
  }
}

Scene scene_of(SceneDraft draft) {
  read_settings(draft.document, draft.scene);
  read_physics(draft);
  add_bodies(draft);
  add_colliders(draft);
  place_bodies(draft);
  read_expectations(draft.document, draft.scene);
  add_joints(draft);
  read_substeps(draft.document, draft.scene);
  warn_of_floating_bodies(draft);
  add_visuals(draft);
  read_cameras_and_lights(draft.document, draft.scene);
  draft.scene.hash = draft.document.hash;  // with the images, which visuals read
  draft.scene.warnings = std::move(draft.document.source->warnings);
  return std::move(draft.scene);
}

Scene scene_of_plain_gltf(GltfDocument& document, const MeshOptions& options) {
  Scene scene = mesh_scene(document.file, mesh_file_of(document), options);
  std::vector<std::string>& warnings = document.source->warnings;
  warnings.emplace_back(
      "has no body of KHR_physics_rigid_bodies, so its meshes fall as bodies on a plane, without its cameras "
      "and lights");
  scene.warnings.insert(scene.warnings.begin(), warnings.begin(), warnings.end());
  return scene;
}

/// Calls `load` with the default rounding of floating-point numbers. Throws Error where memory runs out.
template <typename Load>
auto loaded(const std::filesystem::path& file, const Load& load) {
  const DefaultFloatingPoint environment;
  try {
    return load();
  } catch (const std::bad_alloc&) {
    throw Error(file.string() + ": is too large for this machine's memory");
  }
}

}  // namespace

SceneDraft::SceneDraft(GltfDocument read)
    : document(std::move(read)),
      meshes(read_meshes(document)),
      skins(read_skins(document)),
      tables(read_physics_tables(document)) {
  scene.file = document.file;
  scene.name = document.file.stem().string();
  most_spent += 4 * document.nodes.size();
  for (const GltfMesh& mesh : meshes) most_spent += 4 * mesh.size();
  for (const GltfSkin& skin : skins) most_spent += 4 * skin.joints.size();
}

void SceneDraft::spend(std::size_t size, const JsonValue& place) {
  spent += size;
  if (spent > most_spent) {
    place.fail(
        "with it what collides and what wears a skin has more than {} nodes, vertices, triangles and "
        "joints, a hundred thousand and four times what the file has",
        most_spent);
  }
}

std::optional<Scene> load_still_scene(const std::filesystem::path& file) {
  return loaded(file, [&]() -> std::optional<Scene> {
    if (!is_gltf(file)) return std::nullopt;
    GltfDocument document = read_gltf(file);
    if (!is_mesh_file(document)) return std::nullopt;
    return scene_of(SceneDraft(std::move(document)));
  });
}

Scene load_scene(const std::filesystem::path& file, const std::optional<MeshOptions>& options) {
  return loaded(file, [&] {
    if (is_gltf(file)) {
      GltfDocument document = read_gltf(file);
      if (is_mesh_file(document)) return scene_of_plain_gltf(document, options.value_or(MeshOptions{}));
      if (options)
        throw Error(file.string() + ": is a scene: mass, pose and copies of its bodies are as it has them");
      return scene_of(SceneDraft(std::move(document)));
    }
    if (is_mesh_extension(lower_extension(file))) {
      return mesh_scene(file, read_mesh_file(file), options.value_or(MeshOptions{}));
    }
    read_bytes(file, file.string());  // throws where there is no such file
    throw Error(file.string() +
                ": is neither a scene (.gltf, .glb) nor a mesh in a format that is read (.obj, .stl, .ply, "
                ".dae, …)");
  });
}

std::vector<std::filesystem::path> scene_files(const std::filesystem::path& file) {
  std::vector<std::filesystem::path> result{file};
  if (!is_gltf(file)) return result;
  const GltfDocument document = read_gltf(file);
  for (const auto& [path, bytes] : document.files_beside) result.push_back(path);
  for (const JsonValue& json : document.root().items("images")) {
    const auto uri = json.find("uri");
    if (const auto image = uri ? file_of_uri(*uri, document) : std::nullopt) result.push_back(*image);
  }
  return result;
}

}  // namespace substep
