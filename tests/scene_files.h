#pragma once
/// The repository's scenes, by name.

#include <stdexcept>
#include <string>

#include "sim/loading/load_scene.h"
#include "tests/folders.h"

namespace substep {

/// "rod_chain": of scenes/rod_chain.gltf.
inline Scene scene_named(const std::string& name) {
  std::string file = std::string(test::source_folder) + "/scenes/";
  file += name;
  file += ".gltf";
  return load_scene(file);
}

/// Index of the body. Throws where there is none.
inline int body_named(const Scene& scene, const std::string& name) {
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    if (scene.bodies[i].name == name) return static_cast<int>(i);
  }
  throw std::runtime_error("no body " + name);
}

}  // namespace substep
