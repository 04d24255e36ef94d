#pragma once
/// A context with all that does not depend on what is drawn: programs, samplers, the ground's disc, the
/// shadow map.
///
/// Software OpenGL compiles a program to machine code when it first draws with it, which takes longer than
/// drawing a hundred small pictures. So renderers share devices, one for every two processors, and devices
/// outlive them. What a frame needs of a device is set while its context is current.

#include <array>
#include <memory>

#include "render/context.h"
#include "render/gl.h"
#include "render/shaders.h"
#include "render/shadow_map.h"
#include "render/surface_programs.h"
#include "render/targets.h"

namespace substep::render {

struct Device {
  static constexpr int disc_corners = 64;
  static constexpr int disc_vertices = disc_corners + 2;  ///< the centre, and the first corner twice

  Device();

  Context context;
  int users = 0;  ///< renderers; take_device() counts them
  GLuint body_program = 0;
  GLuint shading_program = 0;
  std::array<GLuint, shaders::shades.size()> ground_programs{};  ///< by Shade
  GLuint sky_program = 0;
  GLuint depth_program = 0;
  GLuint color_program = 0;
  GLuint disc = 0;          ///< vertex array of the ground
  GLuint nothing = 0;       ///< vertex array of what needs none
  GLuint frame_buffer = 0;  ///< of the block Frame
  Target relief;            ///< Relief::size²
  GLuint occlusion = 0;     ///< texture, Relief::size²
  /// Made when first asked for: of 512² texels, or of 1024².
  ShadowMap& shadow(bool is_small);

  /// Compiled when first asked for: most scenes need none of them.
  SurfacePrograms& surface_programs();

 private:
  std::unique_ptr<SurfacePrograms> surface_programs_;
  std::unique_ptr<ShadowMap> small_shadow_;
  std::unique_ptr<ShadowMap> large_shadow_;

  void make_programs();
  void make_samplers();
  void make_disc();
};

/// The one with the fewest users, or a new one. Any thread.
Device& take_device();
void give_back(Device& device);

}  // namespace substep::render
