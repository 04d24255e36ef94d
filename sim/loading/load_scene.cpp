#include "sim/loading/load_scene.h"

#include <new>
#include <utility>

#include "sim/error.h"
#include "sim/loading/file_bytes.h"
#include "sim/loading/gltf_document.h"
#include "sim/loading/gltf_mesh_file.h"
#include "sim/loading/mesh_file.h"
#include "sim/loading/mesh_scene.h"
#include "sim/loading/scene_appearance.h"
#include "sim/loading/scene_bodies.h"
#include "sim/loading/scene_colliders.h"
#include "sim/loading/scene_draft.h"
#include "sim/loading/scene_expectations.h"
#include "sim/loading/scene_joints.h"
#include "sim/loading/scene_settings.h"
#include "sim/loading/scene_visuals.h"
#include "sim/math/floating_point.h"

namespace substep {
namespace {

Scene scene_of(SceneDraft draft) {
  read_settings(draft.document, draft.scene);
  draft.read_physics();
  add_bodies(draft);
  find_attachments(draft);
  add_colliders(draft);
  place_bodies(draft);
  read_expectations(draft.document, draft.scene);
  add_joints(draft);
  read_substeps(draft.document, draft.scene);
  warn_of_floating_bodies(draft);
  add_visuals(draft);
  read_cameras_and_lights(draft.document, draft.scene);
  if (draft.document.root().find("animations")) {
    draft.scene.warnings.emplace_back("animations are ignored: nodes move as bodies or not at all");
  }
  return std::move(draft.scene);
}

Scene scene_of_plain_gltf(GltfDocument& document, const MeshOptions& options) {
  std::vector<std::string> warnings;
  const MeshFile meshes = mesh_file_of(document, warnings);
  Scene scene = mesh_scene(document.file, meshes, options);
  warnings.emplace_back("has no body of KHR_physics_rigid_bodies, so its meshes fall as bodies on a plane");
  scene.warnings.insert(scene.warnings.begin(), warnings.begin(), warnings.end());
  return scene;
}

}  // namespace

std::optional<Scene> load_still_scene(const std::filesystem::path& file) {
  const DefaultFloatingPoint environment;
  const std::string extension = lower_extension(file);
  if (extension != ".gltf" && extension != ".glb") return std::nullopt;
  try {
    GltfDocument document = read_gltf(file);
    if (!is_mesh_file(document)) return std::nullopt;
    return scene_of(SceneDraft(file, std::move(document)));
  } catch (const std::bad_alloc&) {
    throw Error(file.string() + ": is too large for this machine's memory");
  }
}

Scene load_scene(const std::filesystem::path& file, const std::optional<MeshOptions>& options) {
  const DefaultFloatingPoint environment;
  const std::string extension = lower_extension(file);
  try {
    if (extension == ".gltf" || extension == ".glb") {
      GltfDocument document = read_gltf(file);
      if (is_mesh_file(document)) return scene_of_plain_gltf(document, options.value_or(MeshOptions{}));
      if (options) {
        throw Error(file.string() + ": is a scene: mass, pose and copies of its bodies are as it has them");
      }
      return scene_of(SceneDraft(file, std::move(document)));
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
