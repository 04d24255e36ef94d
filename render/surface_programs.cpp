#include "render/surface_programs.h"

#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <string>

#include "render/frame_uniforms.h"
#include "render/gl_program.h"
#include "render/shaders.h"
#include "render/units.h"

namespace substep::render {
namespace {

constexpr std::array<const char*, 5> texture_names{"color_texture", "finish_texture", "normal_texture",
                                                   "occlusion_texture", "emission_texture"};

void set_texture_units(GLuint program) {
  glUseProgram(program);
  for (std::size_t role = 0; role < texture_names.size(); ++role) {
    glUniform1i(glGetUniformLocation(program, texture_names[role]),
                surface_texture_unit + static_cast<GLint>(role));
  }
}

}  // namespace

glm::vec4 sight_of(const View& view, int samples_high) {
  return {glm::vec3(view.eye), static_cast<float>(2 * view.tangent_y / samples_high)};
}

std::array<GLuint, shaders::shades.size()> make_ground_programs(bool with_lamps) {
  std::array<GLuint, shaders::shades.size()> programs{};
  for (const shaders::Shade shade : shaders::shades) {
    GLuint& program = programs[static_cast<std::size_t>(shade)];
    program = make_program(shaders::ground_vertex(), shaders::ground_fragment(shade, with_lamps));
    set_frame_units(program);
  }
  return programs;
}

SurfacePrograms::SurfacePrograms()
    : ground(make_ground_programs(true)), cut(make_program(shaders::cut_vertex(), shaders::cut_fragment())) {
  set_texture_units(cut);
}

GLuint SurfacePrograms::shading(bool shines, bool has_sun) {
  GLuint& program = shading_[{shines, has_sun}];
  if (program == 0) {
    program = make_program(shaders::sky_vertex(), shaders::look_shading_fragment(shines, has_sun));
    set_frame_units(program);  // which is in use then
    glUniform1i(glGetUniformLocation(program, "emission_alpha"), emission_unit);
    glUniform1i(glGetUniformLocation(program, "crevices"), crevice_unit);
  }
  return program;
}

void SurfacePrograms::set_lamps(const Lamps& lamps, bool shines) {
  for (const GLuint program : {shading(shines, lamps.has_sun), ground[0], ground[1], ground[2]}) {
    glUseProgram(program);
    glUniform1i(glGetUniformLocation(program, "light_count"), lamps.count);
    const auto send = [&](const char* name, const std::array<glm::vec4, most_lamps>& values) {
      glUniform4fv(glGetUniformLocation(program, name), most_lamps, glm::value_ptr(values[0]));
    };
    send("light_places", lamps.places);
    send("light_axes", lamps.axes);
    send("light_cones", lamps.cones);
    send("light_colors", lamps.colors);
  }
}

void SurfacePrograms::use_body(const Surface& surface, const SurfaceTextures& textures, std::size_t index,
                               const glm::vec4& sight, bool is_behind, bool shines) {
  std::array<bool, 5> has_texture{};
  for (std::size_t role = 0; role < has_texture.size(); ++role) {
    has_texture[role] = surface.textures[role].image >= 0;
  }
  const bool may_discard = surface.opacity != Surface::Opacity::opaque;
  GLuint& program = bodies_[{has_texture, may_discard, shines}];
  if (program == 0) {
    program = make_program(shaders::look_vertex(), shaders::look_fragment(has_texture, may_discard, shines));
    set_texture_units(program);
    glUniform1i(glGetUniformLocation(program, "nearer_depth"), nearer_unit);
  }
  glUseProgram(program);
  glUniform4fv(glGetUniformLocation(program, "sight"), 1, glm::value_ptr(sight));
  glUniform1f(glGetUniformLocation(program, "is_behind"), is_behind ? 1.0F : 0.0F);
  set_surface(program, surface, textures, index);
  if (may_discard || surface.has_back) {
    glDisable(GL_CULL_FACE);
  } else {
    glEnable(GL_CULL_FACE);
  }
}

void SurfacePrograms::set_surface(GLuint program, const Surface& surface, const SurfaceTextures& textures,
                                  std::size_t index) const {
  std::array<glm::vec4, 5> turns{};
  std::array<glm::vec4, 5> offsets{};
  for (std::size_t role = 0; role < turns.size(); ++role) {
    const Texture& texture = surface.textures[role];
    const BoundTexture& bound = textures.of(index, static_cast<Surface::Role>(role));
    const auto unit = static_cast<GLuint>(surface_texture_unit) + static_cast<GLuint>(role);
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(GL_TEXTURE_2D, bound.texture);
    glBindSampler(unit, bound.sampler);
    const Eigen::Matrix2f turn = texture.turn.cast<float>();
    turns[role] = {turn(0, 0), turn(0, 1), turn(1, 0), turn(1, 1)};
    const double stretch = std::sqrt(std::abs(texture.turn.determinant()));
    offsets[role] = {static_cast<float>(texture.offset.x()), static_cast<float>(texture.offset.y()),
                     static_cast<float>(texture.coordinates), bound.texels * static_cast<float>(stretch)};
  }
  const auto place = [program](const char* name) { return glGetUniformLocation(program, name); };
  glUniform4fv(place("image_turns"), 5, glm::value_ptr(turns[0]));
  glUniform4fv(place("image_offsets"), 5, glm::value_ptr(offsets[0]));
  const auto& emission = surface.emission;
  glUniform4f(place("emission"), static_cast<float>(emission[0]), static_cast<float>(emission[1]),
              static_cast<float>(emission[2]), surface.is_unlit ? 1.0F : 0.0F);
  const bool is_cut = surface.opacity == Surface::Opacity::cut;
  glUniform4f(place("opacity"), static_cast<float>(surface.alpha),
              is_cut ? static_cast<float>(surface.cut_off) : 0.0F,
              surface.opacity == Surface::Opacity::blended ? 1.0F : 0.0F, surface.has_back ? 1.0F : 0.0F);
  const bool has_normals = surface.textures[Surface::normal_texture].image >= 0;
  glUniform2f(place("strengths"), has_normals ? static_cast<float>(surface.normal_scale) : 0.0F,
              static_cast<float>(surface.occlusion_strength));
}

}  // namespace substep::render
