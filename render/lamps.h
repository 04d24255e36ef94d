#pragma once
/// The scene's lights beside the sun, as shaders are told of them.

#include <array>
#include <glm/glm.hpp>
#include <span>

#include "render/body_mesh.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// As many as shaders::lamps() has room for; those of a file beyond them light nothing.
inline constexpr std::size_t most_lamps = 16;

/// The uniforms of shaders::lamps(), in whose declarations it stands what their numbers are.
struct Lamps {
  int count = 0;
  int key = -1;         ///< the one that casts shadows; −1: the sun does
  bool has_sun = true;  ///< beside them
  std::array<glm::vec4, most_lamps> places{};
  std::array<glm::vec4, most_lamps> axes{};
  std::array<glm::vec4, most_lamps> cones{};
  std::array<glm::vec4, most_lamps> colors{};
};

/// Returns lamps as bright as makes what is near `parts` neither black nor white. The brightest there casts
/// shadows unless the sun is as bright.
Lamps lamps_of(const Scene& scene, std::span<const Part> parts);

}  // namespace substep::render
