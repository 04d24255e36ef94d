#pragma once
/// The repository's scenes, by name.

#include <filesystem>
#include <stdexcept>
#include <string>

#include "sim/loading/load_scene.h"
#include "tests/folders.h"

namespace substep {

/// Returns the folder of the scenes.
inline std::filesystem::path scenes_folder() {
  return std::filesystem::path(test::source_folder) / "scenes";
}

/// "rod_chain": of scenes/rod_chain.gltf.
inline Scene scene_named(const std::string& name) {
  return load_scene(scenes_folder() / (name + ".gltf"));
}

/// Index of the body. Throws where there is none.
inline int body_named(const Scene& scene, const std::string& name) {
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    if (scene.bodies[i].name == name) return static_cast<int>(i);
  }
  throw std::runtime_error("no body " + name);
}

}  // namespace substep
