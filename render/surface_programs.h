#pragma once
/// The programs that draw surfaces with textures, cut-outs or light of their own, and their uniforms.
/// OpenGL's names live as long as their context.

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

/// The size of a sample's footprint: the eye, and the distance of two neighbouring samples one metre from it.
glm::vec4 sight_of(const View& view, int samples_high);

/// Programs for the ground in each Shade, with lamps or with sun and sky alone.
std::array<GLuint, shaders::shades.size()> make_ground_programs(bool with_lamps);

struct SurfacePrograms {
  std::array<GLuint, shaders::shades.size()> ground{};  ///< by Shade
  GLuint cut = 0;                                       ///< depth or colour of surfaces with cut-outs

  SurfacePrograms();

  /// Returns the program for light. `shines`: some surfaces emit light. `has_sun`: the scene has sunlight.
  GLuint shading(bool shines, bool has_sun);

  void set_lamps(const Lamps& lamps, bool shines);

  /// Uses a program for a surface, and sets its uniforms and the culled faces. `is_behind`: draws only what
  /// lies behind nearer_unit's depth.
  void use_body(const Surface& surface, const SurfaceTextures& textures, std::size_t index,
                const glm::vec4& sight, bool is_behind, bool shines);

  /// Sets the uniforms of a surface for `program`, which is in use.
  void set_surface(GLuint program, const Surface& surface, const SurfaceTextures& textures,
                   std::size_t index) const;

 private:
  std::map<std::array<bool, 2>, GLuint> shading_;  ///< by `shines` and `has_sun`
  /// Programs by the textures in use, whether there are cut-outs, and `shines`.
  std::map<std::tuple<std::array<bool, 5>, bool, bool>, GLuint> bodies_;
};

}  // namespace substep::render
