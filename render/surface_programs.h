#pragma once
/// The programs that draw surfaces with more than a colour, and what they are told of each. Names live as
/// long as their context.

#include <array>
#include <glm/vec4.hpp>

#include "render/camera.h"
#include "render/gl.h"
#include "render/lamps.h"
#include "render/shaders.h"
#include "render/surface_textures.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// What samples see, for the size of what lies between them: the eye and the metres between two of them a
/// metre from it.
glm::vec4 sight_of(const View& view, int samples_high);

/// Programs for the ground in each Shade, in the light of lamps too or in that of sun and sky alone.
std::array<GLuint, shaders::shades.size()> make_ground_programs(bool with_lamps);

struct SurfacePrograms {
  GLuint body = 0;
  GLuint shading = 0;
  std::array<GLuint, shaders::shades.size()> ground{};  ///< by Shade
  GLuint cut = 0;                                       ///< depth or colour of what is cut away in places

  SurfacePrograms();

  void set_lamps(const Lamps& lamps) const;

  /// For all that is drawn next with `body`: behind nearer_unit's depth alone, or anywhere.
  void set_sight(const glm::vec4& sight, bool is_behind) const;

  /// For what is drawn next with `program`, `body` or `cut`, which is in use.
  void set_surface(GLuint program, const Surface& surface, const SurfaceTextures& textures,
                   std::size_t index) const;
};

}  // namespace substep::render
