#include "render/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "render/body_mesh.h"
#include "render/camera.h"
#include "render/device.h"
#include "render/gl.h"
#include "render/ground.h"
#include "render/resolve.h"
#include "render/shadow_map.h"
#include "sim/error.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

/// The block Frame of shaders.cpp, whose comments say what each is.
struct FrameUniforms {
  glm::mat4 clip_from_world;
  glm::mat4 shadow_from_world;
  glm::vec4 eye;
  glm::vec4 ray_corner;
  glm::vec4 ray_right;
  glm::vec4 ray_up;
  glm::vec4 to_sun;
  glm::vec4 sun;
  glm::vec4 zenith;
  glm::vec4 horizon;
  glm::vec4 bounce;
  glm::vec4 ground_color;
  glm::vec4 ground_reach;
  glm::vec4 shadow_scale;
  glm::vec4 occlusion;
  std::array<glm::vec4, 32> taps;
};

glm::dmat4 matrix(const Coordinates& q) {
  const Matrix3 rotation = q.angular.toRotationMatrix();
  glm::dmat4 result(1);
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) result[column][row] = rotation(row, column);
    result[3][column] = q.linear[column];
  }
  return result;
}

/// Points spread evenly over the unit disc (Vogel's spiral), such that every fourth of them is spread evenly
/// too.
std::array<glm::vec4, 32> disc_points() {
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::array<glm::vec4, 32> pairs{};
  for (int i = 0; i < 64; ++i) {
    const double radius = std::sqrt((i + 0.5) / 64);
    const SineCosine of = sine_cosine(golden * i);
    glm::vec4& pair = pairs[static_cast<std::size_t>(i / 2)];
    pair[i % 2 * 2] = static_cast<float>(radius * of.cosine);
    pair[i % 2 * 2 + 1] = static_cast<float>(radius * of.sine);
  }
  return pairs;
}

[[noreturn]] void refuse_size(int width, int height) {
  throw Error("software OpenGL cannot draw " + std::to_string(width) + " × " + std::to_string(height) +
              " samples: ask for a smaller picture");
}

/// A colour and a depth buffer to draw to.
struct Target {
  GLuint framebuffer = 0;
  GLuint color = 0;
  GLuint depth = 0;  ///< with a stencil
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;

  Target() = default;
  Target(int w, int h) : width(w), height(h), pixels(static_cast<std::size_t>(w) * h * 4) {
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glGenRenderbuffers(1, &color);
    glBindRenderbuffer(GL_RENDERBUFFER, color);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color);
    glGenRenderbuffers(1, &depth);
    glBindRenderbuffer(GL_RENDERBUFFER, depth);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH32F_STENCIL8, width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, depth);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) refuse_size(width, height);
  }

  void start() const {
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, width, height);
    glClearColor(0, 0, 0, 0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
  }

  void read() { glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data()); }

  void end() const {
    glDeleteFramebuffers(1, &framebuffer);
    glDeleteRenderbuffers(1, &color);
    glDeleteRenderbuffers(1, &depth);
  }
};

/// What is seen at each sample, for the light to be computed once however many triangles lie behind each
/// other or share the sample's neighbourhood. Its stencil is 1 where a body is seen, and belongs to `target`
/// too.
struct Surfaces {
  GLuint framebuffer = 0;
  std::array<GLuint, 3> textures{};

  Surfaces() = default;
  explicit Surfaces(const Target& target) {
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glGenTextures(3, textures.data());
    const std::array<GLenum, 3> outputs{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2};
    for (std::size_t i = 0; i < textures.size(); ++i) {
      glBindTexture(GL_TEXTURE_2D, textures[i]);
      glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, target.width, target.height, 0, GL_RGBA, GL_FLOAT, nullptr);
      glFramebufferTexture2D(GL_FRAMEBUFFER, outputs[i], GL_TEXTURE_2D, textures[i], 0);
    }
    glDrawBuffers(3, outputs.data());
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, target.depth);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      refuse_size(target.width, target.height);
  }

  void end() const {
    glDeleteFramebuffers(1, &framebuffer);
    glDeleteTextures(3, textures.data());
  }
};

GLuint buffer_of(GLenum target, const void* data, std::size_t bytes) {
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  glBindBuffer(target, buffer);
  glBufferData(target, static_cast<GLsizeiptr>(bytes), data, GL_STATIC_DRAW);
  return buffer;
}

const void* offset(std::size_t bytes) {
  // NOLINTNEXTLINE(performance-no-int-to-ptr): OpenGL takes places in its buffers as pointers.
  return reinterpret_cast<const void*>(bytes);
}

bool is_drawable(const Coordinates& q) {
  // Beyond this single precision turns bodies into noise.
  constexpr double farthest = 1e6;
  return q.linear.cwiseAbs().maxCoeff() < farthest && q.angular.coeffs().allFinite();
}

}  // namespace

struct Renderer::Implementation {
  std::unique_ptr<Device> device = take_device();
  RenderSettings settings;
  BodyMesh mesh;
  View view;
  glm::dmat4 clip_from_world{1};
  glm::dvec3 ray{0, -1, 0};
  double ground = 0;
  double sight = 0;  ///< farther from the eye than this, bodies neither cast shadows nor hide the sky
  std::vector<bool> scenery;  ///< of each part
  FrameUniforms frame{};

  GLuint bodies = 0;  ///< vertex array
  std::array<GLuint, 2> body_buffers{};
  Target samples;  ///< four a pixel if anti-aliased
  Surfaces surfaces;
  Target picture;

  Implementation(const Scene& scene, const RenderSettings& wanted,
                 std::span<const std::vector<Coordinates>> reference);

  ~Implementation();
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  void make_bodies();
  void set_light(const Scene& scene);
  void set_view(double focus);

  bool is_in_sight(const Coordinates& q) const;
  void fit_shadow(std::span<const Coordinates> poses);
  void fit_occlusion(std::span<const Coordinates> poses);
  void draw_bodies(GLuint program, const glm::dmat4& from_world, std::span<const Coordinates> poses);
  void draw_ground(GLuint program);
  Image draw(std::span<const Coordinates> poses);
  Image draw_colors(std::span<const Coordinates> poses);
};

Renderer::Implementation::Implementation(const Scene& scene, const RenderSettings& wanted,
                                         std::span<const std::vector<Coordinates>> reference)
    : settings(wanted), mesh(gather_body_mesh(scene)) {
  if (settings.width < 1 || settings.height < 1) throw Error("a picture needs at least one pixel each way");
  std::vector<std::vector<Coordinates>> initial;
  if (reference.empty()) {
    initial.push_back(initial_state(scene).q);
    reference = initial;
  }
  for (const std::vector<Coordinates>& poses : reference) {
    if (poses.size() != scene.bodies.size()) throw std::logic_error("one pose per body is needed");
  }
  for (const Part& part : mesh.parts) scenery.push_back(is_scenery(part, mesh.parts));
  const double aspect = static_cast<double>(settings.width) / settings.height;
  view = scene.camera ? view_from(*scene.camera, aspect) : automatic_view(mesh.parts, reference, aspect);
  ground = ground_height(scene, mesh.parts, reference);

  // How far away the scene is, which near and far planes and the ground's fading follow.
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = 1;
  for (const Part& part : mesh.parts) {
    const Coordinates& q = reference.front()[static_cast<std::size_t>(part.body)];
    const Vector3 centre = q.angular * part.centre() + q.linear;
    const double radius = part.half_size().norm();
    const double distance = (centre - Vector3(view.eye.x, view.eye.y, view.eye.z)).norm();
    nearest = std::min(nearest, distance);
    farthest = std::max(farthest, std::min(distance + radius, 1e4));
  }
  if (!(nearest < farthest)) nearest = farthest;
  // One body that a run has lost must not stretch the shadow map until it shows nothing of the others.
  sight = 3 * farthest;

  const Context::Current current(device->context);
  make_bodies();
  set_light(scene);
  set_view(std::max(nearest, 0.1));
  const int scale = settings.antialiasing ? 2 : 1;
  samples = Target(settings.width * scale, settings.height * scale);
  surfaces = Surfaces(samples);
  picture = Target(settings.width, settings.height);
  if (const GLenum error = glGetError(); error != GL_NO_ERROR) {
    throw Error("software OpenGL reports error " + std::to_string(error) +
                " while being set up: is libosmesa6 of Mesa 22.3 installed?");
  }
}

Renderer::Implementation::~Implementation() {
  {
    const Context::Current current(device->context);
    samples.end();
    surfaces.end();
    picture.end();
    glDeleteVertexArrays(1, &bodies);
    glDeleteBuffers(2, body_buffers.data());
  }
  give_back(std::move(device));
}

void Renderer::Implementation::make_bodies() {
  glGenVertexArrays(1, &bodies);
  glBindVertexArray(bodies);
  body_buffers = {
      buffer_of(GL_ARRAY_BUFFER, mesh.vertices.data(), mesh.vertices.size() * sizeof(Vertex)),
      buffer_of(GL_ELEMENT_ARRAY_BUFFER, mesh.indices.data(), mesh.indices.size() * sizeof(std::uint32_t))};
  const auto attribute = [](GLuint index, GLint count, std::size_t from) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, count, GL_FLOAT, GL_FALSE, sizeof(Vertex), offset(from));
  };
  attribute(0, 3, offsetof(Vertex, position));
  attribute(1, 3, offsetof(Vertex, normal));
  attribute(2, 3, offsetof(Vertex, color));
  attribute(3, 2, offsetof(Vertex, metallic));
}

void Renderer::Implementation::set_light(const Scene& scene) {
  const Sun sun = scene.sun.value_or(Sun{{-0.55, -1, -0.45}, {1, 0.95, 0.88}, 3});
  const double length = sun.direction.norm();
  ray = {0, -1, 0};
  if (length > 0 && std::isfinite(length)) {
    const Vector3 unit = sun.direction / length;
    ray = {unit.x(), unit.y(), unit.z()};
  }
  const glm::vec3 radiance(glm::dvec3(sun.color[0], sun.color[1], sun.color[2]) *
                           (sun.illuminance / std::numbers::pi));
  const glm::vec3 ground_color(0.46F, 0.415F, 0.36F);
  const glm::vec3 zenith(0.10F, 0.22F, 0.46F);
  const glm::vec3 horizon(0.70F, 0.78F, 0.86F);
  const glm::vec3 sky = 0.45F * zenith + 0.55F * horizon;
  const auto up = static_cast<float>(std::max(-ray.y, 0.0));
  frame.to_sun = glm::vec4(glm::vec3(-ray), 0);
  frame.sun = glm::vec4(radiance, 0);
  frame.zenith = glm::vec4(zenith, 0);
  frame.horizon = glm::vec4(horizon, 0);
  frame.bounce = glm::vec4(ground_color * (radiance * up + sky) * 0.7F, 0);
  frame.ground_color = glm::vec4(ground_color, static_cast<float>(ground));
  frame.taps = disc_points();
}

void Renderer::Implementation::set_view(double focus) {
  const double reach = 40 * focus;
  const double near = std::min(0.02 * focus, 0.1);
  clip_from_world = substep::clip_from_world(view, near, 2.5 * reach);
  frame.clip_from_world = glm::mat4(clip_from_world);
  const glm::dvec3 right = view.right * (2 * view.tangent_x / settings.width);
  const glm::dvec3 up = view.up * (2 * view.tangent_y / settings.height);
  frame.eye = glm::vec4(glm::vec3(view.eye), settings.antialiasing ? 1 : 0);
  frame.ray_corner =
      glm::vec4(glm::vec3(view.forward - view.right * view.tangent_x - view.up * view.tangent_y), 0);
  frame.ray_right = glm::vec4(glm::vec3(right), 0);
  frame.ray_up = glm::vec4(glm::vec3(up), 0);
  // Lines a decimetre apart help where the picture shows a few metres only.
  const double fine = std::clamp((8 - focus) / 4, 0.0, 1.0);
  frame.ground_reach = {static_cast<float>(2.5 * focus), static_cast<float>(reach), static_cast<float>(fine),
                        static_cast<float>(2 * reach)};
}

bool Renderer::Implementation::is_in_sight(const Coordinates& q) const {
  return is_drawable(q) && (q.linear - Vector3(view.eye.x, view.eye.y, view.eye.z)).norm() < sight;
}

void Renderer::Implementation::fit_shadow(std::span<const Coordinates> poses) {
  std::vector<glm::dvec3> points;
  for (std::size_t i = 0; i < mesh.parts.size(); ++i) {
    const Part& part = mesh.parts[i];
    const Coordinates& q = poses[static_cast<std::size_t>(part.body)];
    if (scenery[i] || !is_in_sight(q)) continue;
    for (const Vector3& corner : part.corners()) {
      const Vector3 p = q.angular * corner + q.linear;
      points.emplace_back(p.x(), p.y(), p.z());
    }
  }
  const SunView sun = fit_sun_view(ray, points);
  frame.shadow_from_world = glm::mat4(sun.map_from_world);
  const double texel = sun.width / ShadowMap::size;
  frame.shadow_scale = {static_cast<float>(1 / sun.width), static_cast<float>(0.001 + 0.6 * texel),
                        static_cast<float>(sun.depth), settings.shadows ? 1.0F : 0.0F};
  if (!settings.shadows) return;
  device->shadow->start();
  glEnable(GL_DEPTH_CLAMP);
  draw_bodies(device->depth_program, sun.clip_from_world, poses);
  glDisable(GL_DEPTH_CLAMP);
  device->shadow->finish();
}

void Renderer::Implementation::fit_occlusion(std::span<const Coordinates> poses) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  Vector3 low = Vector3::Constant(infinite);
  Vector3 high = -low;
  double largest = 0.01;
  for (std::size_t i = 0; i < mesh.parts.size(); ++i) {
    const Part& part = mesh.parts[i];
    const Coordinates& q = poses[static_cast<std::size_t>(part.body)];
    const Vector3 centre = q.angular * part.centre() + q.linear;
    if (scenery[i] || !is_in_sight(q)) continue;
    low = low.cwiseMin(centre);
    high = high.cwiseMax(centre);
    largest = std::max(largest, part.half_size().norm());
  }
  if (!(low.x() < infinite)) low = high = Vector3::Zero();
  const double width = std::max(high.x() - low.x(), high.z() - low.z()) + 6 * largest;
  std::vector<Coordinates> drawn(poses.begin(), poses.end());
  for (Coordinates& q : drawn) {
    if (!is_in_sight(q)) q = {{0, infinite, 0}, Quaternion::Identity()};
  }
  const GroundOcclusion map = ground_occlusion(mesh.parts, drawn, ground, (low.x() + high.x() - width) / 2,
                                               (low.z() + high.z() - width) / 2, width);
  frame.occlusion = {static_cast<float>(map.corner_x), static_cast<float>(map.corner_z),
                     static_cast<float>(1 / map.width), static_cast<float>(1 / largest)};
  glBindTexture(GL_TEXTURE_2D, device->occlusion);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, GroundOcclusion::size, GroundOcclusion::size, GL_RED, GL_FLOAT,
                  map.openness.data());
}

void Renderer::Implementation::draw_bodies(GLuint program, const glm::dmat4& from_world,
                                           std::span<const Coordinates> poses) {
  glUseProgram(program);
  glBindVertexArray(bodies);
  const GLint clip_from_body = glGetUniformLocation(program, "clip_from_body");
  const GLint world_from_body = glGetUniformLocation(program, "world_from_body");
  const GLint color = glGetUniformLocation(program, "color");
  for (std::size_t i = 0; i + 1 < mesh.begin.size(); ++i) {
    const std::size_t count = mesh.begin[i + 1] - mesh.begin[i];
    if (count == 0 || !is_drawable(poses[i])) continue;
    const glm::dmat4 world = matrix(poses[i]);
    glUniformMatrix4fv(clip_from_body, 1, GL_FALSE, glm::value_ptr(glm::mat4(from_world * world)));
    if (world_from_body >= 0) {
      glUniformMatrix4fv(world_from_body, 1, GL_FALSE, glm::value_ptr(glm::mat4(world)));
    }
    if (color >= 0) {
      const std::size_t code = i + 1;
      glUniform3f(color, static_cast<float>(code & 0xff) / 255, static_cast<float>(code >> 8 & 0xff) / 255,
                  static_cast<float>(code >> 16 & 0xff) / 255);
    }
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(count), GL_UNSIGNED_INT,
                   offset(mesh.begin[i] * sizeof(std::uint32_t)));
  }
}

void Renderer::Implementation::draw_ground(GLuint program) {
  // The ground gives way to what the scene draws at its height.
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(1, 8);
  glUseProgram(program);
  glBindVertexArray(device->disc);
  glDrawArrays(GL_TRIANGLE_FAN, 0, Device::disc_vertices);
  glDisable(GL_POLYGON_OFFSET_FILL);
}

Image Renderer::Implementation::draw(std::span<const Coordinates> poses) {
  const Context::Current current(device->context);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  fit_shadow(poses);
  fit_occlusion(poses);
  glBindBuffer(GL_UNIFORM_BUFFER, device->frame_buffer);
  glBufferData(GL_UNIFORM_BUFFER, sizeof frame, &frame, GL_STREAM_DRAW);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, device->frame_buffer);
  const auto bind = [](GLint unit, GLuint texture) {
    glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + unit));
    glBindTexture(GL_TEXTURE_2D, texture);
  };
  bind(shadow_range_unit, device->shadow->range());
  bind(shadow_test_unit, device->shadow->depth());
  bind(occlusion_unit, device->occlusion);
  bind(position_unit, surfaces.textures[0]);
  bind(normal_unit, surfaces.textures[1]);
  bind(color_unit, surfaces.textures[2]);
  bind(shadow_depth_unit, device->shadow->depth());

  // Ground and sky are smooth in themselves: one sample a pixel is enough, and they are most of the picture.
  picture.start();
  draw_ground(device->ground_program);
  glUseProgram(device->sky_program);
  glBindVertexArray(device->nothing);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  picture.read();
  Image image = top_down(picture.pixels, settings.width, settings.height);

  // The bodies, where the ground does not hide them.
  samples.start();
  glBindFramebuffer(GL_FRAMEBUFFER, surfaces.framebuffer);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  draw_ground(device->ground_depth_program);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glEnable(GL_STENCIL_TEST);
  glStencilFunc(GL_ALWAYS, 1, 0xff);
  glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
  draw_bodies(device->body_program, clip_from_world, poses);
  // Then the light on them.
  glBindFramebuffer(GL_FRAMEBUFFER, samples.framebuffer);
  glStencilFunc(GL_EQUAL, 1, 0xff);
  glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
  glDisable(GL_DEPTH_TEST);
  glUseProgram(device->shading_program);
  glBindVertexArray(device->nothing);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDisable(GL_STENCIL_TEST);
  samples.read();
  cover(image, samples.pixels, settings.antialiasing ? 2 : 1);
  return image;
}

Image Renderer::Implementation::draw_colors(std::span<const Coordinates> poses) {
  const Context::Current current(device->context);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  picture.start();
  draw_bodies(device->color_program, clip_from_world, poses);
  // The ground is the world's.
  glUseProgram(device->color_program);
  glm::dmat4 place(1);
  place[0][0] = place[2][2] = frame.ground_reach.w;
  place[3] = {view.eye.x, ground, view.eye.z, 1};
  glUniformMatrix4fv(glGetUniformLocation(device->color_program, "clip_from_body"), 1, GL_FALSE,
                     glm::value_ptr(glm::mat4(clip_from_world * place)));
  glUniform3f(glGetUniformLocation(device->color_program, "color"), 1.0F / 255, 0, 0);
  draw_ground(device->color_program);
  picture.read();
  return top_down(picture.pixels, settings.width, settings.height);
}

Renderer::Renderer(const Scene& scene, const RenderSettings& settings,
                   std::span<const std::vector<Coordinates>> reference)
    : implementation_(std::make_unique<Implementation>(scene, settings, reference)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

Image Renderer::draw(std::span<const Coordinates> poses) {
  return implementation_->draw(poses);
}
Image Renderer::draw_bodies(std::span<const Coordinates> poses) {
  return implementation_->draw_colors(poses);
}

}  // namespace substep
