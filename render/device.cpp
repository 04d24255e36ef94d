#include "render/device.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <glm/vec3.hpp>
#include <mutex>
#include <numbers>
#include <thread>
#include <vector>

#include "render/ground.h"
#include "sim/math/rotation.h"

namespace substep::render {

Device::Device() {
  const Context::Current current(context);
  make_samplers();
  make_disc();
  no_attributes = objects_.vertex_array();
  frame_buffer = objects_.buffer();
  occlusion = objects_.texture();
  glBindTexture(GL_TEXTURE_2D, occlusion);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, Relief::size, Relief::size, 0, GL_RED, GL_FLOAT, nullptr);
  relief = Target(objects_, Relief::size, Relief::size);
}

GLuint Device::use(const shaders::Program& program) {
  GLuint& name = programs_[program];
  if (name == 0) {
    const shaders::Sources sources = shaders::sources_of(program);
    name = make_program(sources.vertex, sources.fragment);
  }
  glUseProgram(name);
  return name;
}

void Device::make_samplers() {
  for (const GLuint unit : {shadow_depth_unit, shadow_test_unit, shadow_nearest_unit, occlusion_unit,
                            depth_unit, surface_unit, emission_unit, crevice_unit, nearer_unit}) {
    const bool is_linear = unit == shadow_test_unit || unit == occlusion_unit;
    const GLint filter = is_linear ? GL_LINEAR : GL_NEAREST;
    const GLint wrap = unit == occlusion_unit ? GL_CLAMP_TO_BORDER : GL_CLAMP_TO_EDGE;
    const GLuint sampler = objects_.sampler();
    glSamplerParameteri(sampler, GL_TEXTURE_MIN_FILTER, filter);
    glSamplerParameteri(sampler, GL_TEXTURE_MAG_FILTER, filter);
    glSamplerParameteri(sampler, GL_TEXTURE_WRAP_S, wrap);
    glSamplerParameteri(sampler, GL_TEXTURE_WRAP_T, wrap);
    if (unit == shadow_test_unit) {
      glSamplerParameteri(sampler, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
      glSamplerParameteri(sampler, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
    }
    // The sky is open beyond the occlusion map.
    constexpr std::array<float, 4> open{1, 1, 1, 1};
    glSamplerParameterfv(sampler, GL_TEXTURE_BORDER_COLOR, open.data());
    glBindSampler(unit, sampler);
  }
}

void Device::make_disc() {
  constexpr int corners = 64;
  std::vector<glm::vec3> fan{{0, 0, 0}};
  for (int i = 0; i <= corners; ++i) {
    const SineCosine of = sine_cosine(-2 * std::numbers::pi * i / corners);
    fan.emplace_back(of.cosine, 0, of.sine);
  }
  disc_vertices = static_cast<int>(fan.size());
  disc = objects_.vertex_array();
  glBindVertexArray(disc);
  glBindBuffer(GL_ARRAY_BUFFER, objects_.buffer());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(fan.size() * sizeof(glm::vec3)), fan.data(),
               GL_STATIC_DRAW);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(glm::vec3), nullptr);
}

void Device::use_surface(const Surface& surface, const SurfaceTextures& textures, const glm::vec4& sight,
                         bool is_behind, bool shines) {
  shaders::Program wanted{.kind = shaders::Program::Kind::look, .shines = shines};
  wanted.may_discard = surface.opacity != Surface::Opacity::opaque;
  for (std::size_t role = 0; role < textures.size(); ++role) {
    wanted.has_texture[role] = surface.textures[role].image >= 0;
  }
  const GLuint program = use(wanted);
  glUniform4fv(glGetUniformLocation(program, "sight"), 1, glm::value_ptr(sight));
  glUniform1f(glGetUniformLocation(program, "is_behind"), is_behind ? 1.0F : 0.0F);
  set_surface(program, surface, textures);
  if (wanted.may_discard || surface.is_double_sided) {
    glDisable(GL_CULL_FACE);
  } else {
    glEnable(GL_CULL_FACE);
  }
}

void set_surface(GLuint program, const Surface& surface, const SurfaceTextures& textures) {
  std::array<glm::vec4, 5> turns{};
  std::array<glm::vec4, 5> offsets{};
  for (std::size_t role = 0; role < turns.size(); ++role) {
    const Texture& texture = surface.textures[role];
    const GLint unit = surface_texture_unit + static_cast<GLint>(role);
    bind_texture(unit, textures[role].texture);
    glBindSampler(unit, textures[role].sampler);
    const Eigen::Matrix2d& turn = texture.uv_matrix;
    turns[role] = glm::dvec4(turn(0, 0), turn(0, 1), turn(1, 0), turn(1, 1));
    const auto stretch = static_cast<float>(std::sqrt(std::abs(turn.determinant())));
    offsets[role] = {texture.offset.x(), texture.offset.y(), texture.coordinates,
                     textures[role].texels * stretch};
  }
  const auto send = [program](const char* name, std::span<const glm::vec4> values) {
    glUniform4fv(glGetUniformLocation(program, name), static_cast<GLsizei>(values.size()),
                 glm::value_ptr(values[0]));
  };
  send("image_turns", turns);
  send("image_offsets", offsets);
  const auto& [red, green, blue] = surface.emission;
  send("emission", std::array<glm::vec4, 1>{glm::dvec4(red, green, blue, surface.is_unlit ? 1 : 0)});
  const bool is_cut = surface.opacity == Surface::Opacity::cut;
  const bool is_blended = surface.opacity == Surface::Opacity::blended;
  send("opacity", std::array<glm::vec4, 1>{glm::dvec4(surface.alpha, is_cut ? surface.cut_off : 0,
                                                      is_blended ? 1 : 0, surface.is_double_sided ? 1 : 0)});
  const bool has_normals = surface.textures[Surface::normal_texture].image >= 0;
  glUniform2f(glGetUniformLocation(program, "strengths"),
              has_normals ? static_cast<float>(surface.normal_scale) : 0.0F,
              static_cast<float>(surface.occlusion_strength));
}

void set_lamps(GLuint program, const Lamps& lamps) {
  glUniform1i(glGetUniformLocation(program, "light_count"), lamps.count);
  for (const auto& [name, values] :
       {std::pair("light_positions", &lamps.places), std::pair("light_axes", &lamps.axes),
        std::pair("light_cones", &lamps.cones), std::pair("light_colors", &lamps.colors)}) {
    glUniform4fv(glGetUniformLocation(program, name), most_lamps, glm::value_ptr(values->front()));
  }
}

std::shared_ptr<Device> take_device() {
  // The pool is never destroyed, since at the end of the process the driver may end first.
  static auto& devices = *new std::vector<std::shared_ptr<Device>>;
  static std::mutex mutex;
  // Two threads keep a device busy: one draws while the other composes frames, or writes them.
  const std::size_t most = std::max(1U, std::thread::hardware_concurrency() / 2);
  const std::lock_guard lock(mutex);
  const auto users = [](const std::shared_ptr<Device>& device) { return device.use_count() - 1; };
  const auto least = std::ranges::min_element(devices, {}, users);
  if (least != devices.end() && (users(*least) == 0 || devices.size() >= most)) return *least;
  return devices.emplace_back(std::make_shared<Device>());
}

}  // namespace substep::render
