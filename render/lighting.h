#pragma once
/// The light and the view of a frame, as shaders receive them.

#include <array>
#include <glm/glm.hpp>
#include <span>

#include "render/body_mesh.h"
#include "render/camera.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// The capacity of the shaders' arrays of lamps; further lights of a file are ignored.
inline constexpr std::size_t most_lamps = 16;

/// The scene's lights beside the sun: the uniforms of lamp() in shader_terms.cpp, whose comments explain the
/// numbers.
struct Lamps {
  int count = 0;
  int key = -1;         ///< the lamp that casts shadows; −1: the sun does
  bool has_sun = true;  ///< beside the lamps
  std::array<glm::vec4, most_lamps> places{};
  std::array<glm::vec4, most_lamps> axes{};
  std::array<glm::vec4, most_lamps> cones{};
  std::array<glm::vec4, most_lamps> colors{};
};

/// Returns lamps, dimmed where they are too bright at `parts`. The lamp brightest there casts shadows unless
/// the sun is as bright.
Lamps lamps_of(const Scene& scene, std::span<const Part> parts);

/// The block Frame of shader_terms.cpp, whose comments explain each field.
struct FrameUniforms {
  glm::mat4 clip_from_world;
  glm::mat4 shadow_from_world;
  glm::vec4 eye;
  glm::vec4 ray_corner;
  glm::vec4 ray_right;
  glm::vec4 ray_up;
  glm::vec4 key;
  glm::vec4 to_sun;
  glm::vec4 sun;
  glm::vec4 zenith;
  glm::vec4 horizon;
  glm::vec4 bounce;
  glm::vec4 ground_color;
  glm::vec4 ground_reach;
  glm::vec4 shadow_scale;
  glm::vec4 occlusion;
  glm::vec4 depth_terms;
};

/// Sets sun, sky, the light that casts shadows, and the ground at height `ground`, m. Returns
/// FrameUniforms::key in double precision.
glm::dvec4 set_light(FrameUniforms& frame, const Scene& scene, const Lamps& lamps, double ground);

/// Sets the view of a picture of width × height and how far the ground reaches, for a scene `focus`, m, from
/// the eye. Returns the map from the world to the picture.
glm::dmat4 set_view(FrameUniforms& frame, const View& view, int width, int height, bool antialiasing,
                    double focus);

}  // namespace substep::render
