#pragma once
/// A context with everything that scenes share: programs, samplers, the ground's disc, the shadow map.
///
/// Software OpenGL compiles a program to machine code when it first draws with it, which takes longer than
/// drawing a hundred small pictures. So renderers share devices, one for every two processors, and devices
/// outlive them. A frame sets all the state that it needs while the device's context is current.

#include <glm/vec4.hpp>
#include <map>
#include <memory>

#include "render/gl.h"
#include "render/lighting.h"
#include "render/shaders.h"
#include "render/shadow_map.h"
#include "render/targets.h"
#include "render/textures.h"
#include "sim/scene/scene.h"

namespace substep::render {

struct Device {
  Context context;
  GLuint disc = 0;           ///< vertex array of the ground
  int disc_vertices = 0;     ///< the centre, the corners, and the first corner again
  GLuint no_attributes = 0;  ///< vertex array for programs without attributes
  GLuint frame_buffer = 0;   ///< of the block Frame
  Target relief;             ///< for the heights of bodies above the ground, Relief::size² pixels
  GLuint occlusion = 0;      ///< texture, Relief::size²

  Device();

  /// Returns the map of size² texels, made when first requested.
  ShadowMap& shadow(int size) { return shadows_.try_emplace(size, objects_, size).first->second; }

  /// Uses a program and returns it. Compiles it when it is first used.
  GLuint use(const shaders::Program& program);

  /// Uses the program for a surface with more than a colour, and sets its uniforms and the culled faces.
  /// `sight`: the eye, and the distance of two neighbouring samples one metre from it. `is_behind`: draws
  /// only behind nearer_unit's depth. `shines`: see shaders::Program.
  void use_surface(const Surface& surface, const SurfaceTextures& textures, const glm::vec4& sight,
                   bool is_behind, bool shines);

 private:
  Objects objects_;
  std::map<shaders::Program, GLuint> programs_;
  std::map<int, ShadowMap> shadows_;

  void make_samplers();
  void make_disc();
};

/// Sets the uniforms of a surface for `program`, which is in use, and binds its textures.
void set_surface(GLuint program, const Surface& surface, const SurfaceTextures& textures);

/// Sets the uniforms of lamps for `program`, which is in use.
void set_lamps(GLuint program, const Lamps& lamps);

/// Returns the device with the fewest users, or a new one. May be called from any thread.
std::shared_ptr<Device> take_device();

}  // namespace substep::render
