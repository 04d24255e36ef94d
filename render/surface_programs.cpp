#include "render/surface_programs.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <numbers>
#include <string>

#include "render/frame_uniforms.h"
#include "render/gl_program.h"
#include "render/shaders.h"
#include "render/units.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

constexpr std::array<const char*, 5> texture_names{"color_texture", "finish_texture", "normal_texture",
                                                   "occlusion_texture", "emission_texture"};

/// As many as the shader has room for.
constexpr std::size_t most_lights = 16;

struct LightUniforms {
  std::array<glm::vec4, most_lights> places{};
  std::array<glm::vec4, most_lights> axes{};
  std::array<glm::vec4, most_lights> cones{};
  std::array<glm::vec4, most_lights> colors{};
};

glm::vec4 vector(const Vector3& v, double w) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()),
          static_cast<float>(w)};
}

double illuminance_at(const Light& light, const Vector3& place) {
  if (light.kind == Light::Kind::directional) return light.intensity;
  return light.intensity / std::max((light.position - place).squaredNorm(), 1e-4);
}

/// What lights are multiplied by: files with lamps as bright as real ones mean a camera that is stopped down.
double exposure(const Scene& scene, std::span<const Part> parts) {
  constexpr double brightest_without_exposure = 30;
  Vector3 middle = Vector3::Zero();
  for (const Part& part : parts) {
    middle += scene.bodies[static_cast<std::size_t>(part.body)].pose * part.centre();
  }
  middle /= static_cast<double>(std::max<std::size_t>(1, parts.size()));
  double brightest = 0;
  for (const Light& light : scene.lights) brightest = std::max(brightest, illuminance_at(light, middle));
  return brightest > brightest_without_exposure ? 3 / brightest : 1;
}

void set(LightUniforms& uniforms, std::size_t i, const Light& light, double brightness) {
  const bool is_far = light.kind == Light::Kind::directional;
  uniforms.places[i] = is_far ? vector(-light.direction, 0) : vector(light.position, 1);
  const double reach = std::isfinite(light.range) && !is_far ? 1 / (light.range * light.range) : 0;
  uniforms.axes[i] = vector(-light.direction, reach);
  uniforms.cones[i] = {0, 1, 0, 0};
  if (light.kind == Light::Kind::spot) {
    const double outer = sine_cosine(light.outer_angle).cosine;
    const double scale = 1 / std::max(0.001, sine_cosine(light.inner_angle).cosine - outer);
    uniforms.cones[i] = {static_cast<float>(scale), static_cast<float>(-outer * scale), 0, 0};
  }
  const Vector3 color(light.color[0], light.color[1], light.color[2]);
  uniforms.colors[i] = vector(color * (brightness * light.intensity / std::numbers::pi), 0);
}

}  // namespace

glm::vec4 sight_of(const View& view, int samples_high) {
  return {glm::vec3(view.eye), static_cast<float>(2 * view.tangent_y / samples_high)};
}

SurfacePrograms::SurfacePrograms()
    : body(make_program(shaders::look_vertex(), shaders::look_fragment())),
      shading(make_program(shaders::sky_vertex(), shaders::look_shading_fragment())),
      ground(make_program(shaders::ground_vertex(), shaders::look_ground_fragment())),
      cut(make_program(shaders::cut_vertex(), shaders::cut_fragment())) {
  set_frame_units(ground);
  set_frame_units(shading);  // which is in use then
  glUniform1i(glGetUniformLocation(shading, "emission_alpha"), emission_unit);
  glUniform1i(glGetUniformLocation(shading, "crevices"), crevice_unit);
  for (const GLuint program : {body, cut}) {
    glUseProgram(program);
    for (std::size_t role = 0; role < texture_names.size(); ++role) {
      glUniform1i(glGetUniformLocation(program, texture_names[role]),
                  surface_texture_unit + static_cast<GLint>(role));
    }
  }
  glUseProgram(body);
  glUniform1i(glGetUniformLocation(body, "nearer_depth"), nearer_unit);
}

void SurfacePrograms::set_lights(const Scene& scene, std::span<const Part> parts) const {
  LightUniforms uniforms;
  const std::size_t count = std::min(scene.lights.size(), most_lights);
  const double brightness = exposure(scene, parts);
  for (std::size_t i = 0; i < count; ++i) set(uniforms, i, scene.lights[i], brightness);
  for (const GLuint program : {shading, ground}) {
    glUseProgram(program);
    glUniform1i(glGetUniformLocation(program, "light_count"), static_cast<GLint>(count));
    const auto send = [&](const char* name, const std::array<glm::vec4, most_lights>& values) {
      glUniform4fv(glGetUniformLocation(program, name), most_lights, glm::value_ptr(values[0]));
    };
    send("light_places", uniforms.places);
    send("light_axes", uniforms.axes);
    send("light_cones", uniforms.cones);
    send("light_colors", uniforms.colors);
  }
}

void SurfacePrograms::set_sight(const glm::vec4& sight, bool is_behind) const {
  glUseProgram(body);
  glUniform4fv(glGetUniformLocation(body, "sight"), 1, glm::value_ptr(sight));
  glUniform1f(glGetUniformLocation(body, "is_behind"), is_behind ? 1.0F : 0.0F);
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
  glUniform4fv(place("turns"), 5, glm::value_ptr(turns[0]));
  glUniform4fv(place("offsets"), 5, glm::value_ptr(offsets[0]));
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

}  // namespace substep
