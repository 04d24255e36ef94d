#include "render/device.h"

#include <algorithm>
#include <array>
#include <glm/vec3.hpp>
#include <mutex>
#include <numbers>
#include <thread>
#include <vector>

#include "render/frame_uniforms.h"
#include "render/gl_program.h"
#include "render/ground.h"
#include "render/shaders.h"
#include "render/units.h"
#include "sim/math/rotation.h"

namespace substep::render {
namespace {

GLuint sampler(GLint filter, bool compares) {
  GLuint name = 0;
  glGenSamplers(1, &name);
  glSamplerParameteri(name, GL_TEXTURE_MIN_FILTER, filter);
  glSamplerParameteri(name, GL_TEXTURE_MAG_FILTER, filter);
  glSamplerParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glSamplerParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  if (compares) {
    glSamplerParameteri(name, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glSamplerParameteri(name, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  }
  return name;
}

/// Is never destroyed, since at the end of the process the driver may end first.
struct Pool {
  std::mutex mutex;
  std::vector<std::unique_ptr<Device>> devices;
};
Pool& pool() {
  static Pool* const devices = new Pool;
  return *devices;
}

}  // namespace

Device::Device() {
  const Context::Current current(context);
  make_programs();
  make_samplers();
  make_disc();
  glGenVertexArrays(1, &nothing);
  glGenBuffers(1, &frame_buffer);
  glGenTextures(1, &occlusion);
  glBindTexture(GL_TEXTURE_2D, occlusion);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, Relief::size, Relief::size, 0, GL_RED, GL_FLOAT, nullptr);
  relief = Target(Relief::size, Relief::size);
}

void Device::make_programs() {
  body_program = make_program(shaders::body_vertex(), shaders::body_fragment());
  shading_program = make_program(shaders::sky_vertex(), shaders::shading_fragment());
  ground_programs = make_ground_programs(false);
  sky_program = make_program(shaders::sky_vertex(), shaders::sky_fragment());
  depth_program = make_program(shaders::depth_vertex(), shaders::depth_fragment());
  color_program = make_program(shaders::color_vertex(), shaders::color_fragment());
  for (const GLuint program : {shading_program, sky_program}) {
    set_frame_units(program);
  }
}

SurfacePrograms& Device::surface_programs() {
  if (!surface_programs_) surface_programs_ = std::make_unique<SurfacePrograms>();
  return *surface_programs_;
}

ShadowMap& Device::shadow(bool is_small) {
  std::unique_ptr<ShadowMap>& map = is_small ? small_shadow_ : large_shadow_;
  if (!map) map = std::make_unique<ShadowMap>(is_small ? 512 : 1024);
  return *map;
}

void Device::make_samplers() {
  glBindSampler(shadow_depth_unit, sampler(GL_NEAREST, false));
  glBindSampler(shadow_test_unit, sampler(GL_LINEAR, true));
  for (const GLuint unit :
       {shadow_nearest_unit, depth_unit, surface_unit, emission_unit, crevice_unit, nearer_unit}) {
    glBindSampler(unit, sampler(GL_NEAREST, false));
  }
  const GLuint occlusion_sampler = sampler(GL_LINEAR, false);
  const std::array<float, 4> open{1, 1, 1, 1};
  glSamplerParameteri(occlusion_sampler, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  glSamplerParameteri(occlusion_sampler, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
  glSamplerParameterfv(occlusion_sampler, GL_TEXTURE_BORDER_COLOR, open.data());
  glBindSampler(occlusion_unit, occlusion_sampler);
}

void Device::make_disc() {
  glGenVertexArrays(1, &disc);
  glBindVertexArray(disc);
  std::vector<glm::vec3> fan{{0, 0, 0}};
  for (int i = 0; i <= disc_corners; ++i) {
    const SineCosine of = sine_cosine(-2 * std::numbers::pi * i / disc_corners);
    fan.emplace_back(of.cosine, 0, of.sine);
  }
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  glBindBuffer(GL_ARRAY_BUFFER, buffer);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(fan.size() * sizeof(glm::vec3)), fan.data(),
               GL_STATIC_DRAW);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(glm::vec3), nullptr);
}

Device& take_device() {
  // Two threads keep a device busy: one draws while the other composes frames, or writes them.
  const std::size_t most = std::max(1U, std::thread::hardware_concurrency() / 2);
  Pool& all = pool();
  const std::lock_guard lock(all.mutex);
  const auto users = [](const std::unique_ptr<Device>& device) { return device->users; };
  auto least = std::ranges::min_element(all.devices, {}, users);
  if (least == all.devices.end() || ((*least)->users > 0 && all.devices.size() < most)) {
    all.devices.push_back(std::make_unique<Device>());
    least = all.devices.end() - 1;
  }
  ++(*least)->users;
  return **least;
}

void give_back(Device& device) {
  const std::lock_guard lock(pool().mutex);
  --device.users;
}

}  // namespace substep::render
