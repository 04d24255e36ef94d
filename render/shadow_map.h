#pragma once
/// Maps of the shadows that the scene's key light casts.

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "render/gl.h"

namespace substep::render {

/// A light's view onto a part of the world: the sun's is orthographic, a lamp's perspective.
struct ShadowView {
  glm::dmat4 map_from_world{1};   ///< x, y, z to 0–1
  glm::dmat4 clip_from_world{1};  ///< x, y, z to −1–1
  double width = 1;               ///< m that x covers; for a lamp 1 m in front of it
  double depth = 1;               ///< m along the ray for z from 0 to 1; for a lamp at its rate 1 m in front
  double far = 1;                 ///< distance of the farthest point from a lamp, m; 1 for the sun
};

/// Returns the square view along unit `ray` that holds all points with room around them.
ShadowView fit_sun_view(const glm::dvec3& ray, std::span<const glm::dvec3> points);

/// Returns the square view from a lamp that holds all points with room around them, or those within 72° of
/// their middle.
ShadowView fit_lamp_view(const glm::dvec3& lamp, std::span<const glm::dvec3> points);

/// A depth texture of `size`² and the least depth in and around each block of its texels.
struct ShadowMap {
  static constexpr int blocks = 64;  ///< a side

  int size;  ///< a multiple of `blocks`
  GLuint framebuffer;
  GLuint depth;
  GLuint nearest;             ///< `around` as a texture
  std::vector<float> depths;  ///< of the texels
  std::vector<float> around;  ///< least depth around each block, row by row; 1 where nothing was drawn

  ShadowMap(Objects& objects, int texels);

  /// Makes the map the target and clears it.
  void start() const;
  /// Finds the least depths after drawing.
  void finish();
};

}  // namespace substep::render
