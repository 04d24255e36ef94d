#pragma once
/// The programs that draw surfaces with more than a colour, and what they are told of each. Names live as
/// long as their context.

#include <array>
#include <glm/vec4.hpp>
#include <map>
#include <tuple>

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
  std::array<GLuint, shaders::shades.size()> ground{};  ///< by Shade
  GLuint cut = 0;                                       ///< depth or colour of what is cut away in places

  SurfacePrograms();

  /// Returns the program for light. `shines`: of scenes some of whose surfaces do more than reflect.
  /// `has_sun`: of scenes in sunlight.
  GLuint shading(bool shines, bool has_sun);

  void set_lamps(const Lamps& lamps, bool shines);

  /// Uses a program for what is drawn next of a surface, and tells it what it needs. `is_behind`: only what
  /// lies behind nearer_unit's depth. Sets which faces are culled.
  void use_body(const Surface& surface, const SurfaceTextures& textures, std::size_t index,
                const glm::vec4& sight, bool is_behind, bool shines);

  /// For what is drawn next with `program`, which is in use.
  void set_surface(GLuint program, const Surface& surface, const SurfaceTextures& textures,
                   std::size_t index) const;

 private:
  std::map<std::array<bool, 2>, GLuint> shading_;  ///< by `shines` and `has_sun`
  /// By the textures that there are, whether parts may be left out, and `shines`.
  std::map<std::tuple<std::array<bool, 5>, bool, bool>, GLuint> bodies_;
};

}  // namespace substep::render
