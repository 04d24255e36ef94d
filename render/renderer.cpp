#include "render/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat4x4.hpp>
#include <limits>
#include <stdexcept>
#include <utility>

#include "render/gl.h"
#include "render/renderer_implementation.h"
#include "render/units.h"
#include "sim/error.h"
#include "sim/math/floating_point.h"

namespace substep::render {

namespace {

struct TileSize {
  int width;
  int height;
};

/// What is drawn at once: software OpenGL takes 16384 samples a side, and 60 bytes a sample.
TileSize size_of_tile(const RenderSettings& settings) {
  constexpr int longest = 8192;
  constexpr std::int64_t most = 1 << 23;
  const bool is_one = settings.tile == 0 && settings.width <= longest && settings.height <= longest &&
                      static_cast<std::int64_t>(settings.width) * settings.height <= most;
  if (is_one) return {settings.width, settings.height};
  const int side = settings.tile == 0 ? 2048 : settings.tile;
  return {std::min(settings.width, side), std::min(settings.height, side)};
}

/// Returns whether the surface shines, lets light through or is darker in its crevices.
bool shines_or_shades(const Surface& surface) {
  return surface.opacity == Surface::Opacity::blended || surface.emission != std::array{0.0, 0.0, 0.0} ||
         surface.textures[Surface::occlusion_texture].image >= 0;
}

}  // namespace

Renderer::Implementation::Implementation(const Scene& scene, const RenderSettings& wanted,
                                         std::span<const std::vector<Coordinates>> reference)
    : settings(wanted), mesh(gather_body_mesh(scene)) {
  check(settings);
  std::vector<std::vector<Coordinates>> initial;
  if (reference.empty()) {
    initial.push_back(initial_state(scene).q);
    reference = initial;
  }
  for (const std::vector<Coordinates>& poses : reference) {
    if (poses.size() != scene.bodies.size()) throw std::logic_error("one pose per body is needed");
  }
  for (const Part& part : mesh.parts) scenery.push_back(is_scenery(part, mesh.parts));
  std::ranges::copy_if(mesh.parts, std::back_inserter(moving),
                       [](const Part& part) { return part.body != 0; });
  const double aspect = static_cast<double>(settings.width) / settings.height;
  view = scene.camera && settings.steps_back
             ? stepped_back(view_from(*scene.camera, aspect), mesh.parts, reference)
         : scene.camera ? view_from(*scene.camera, aspect)
                        : automatic_view(mesh.parts, reference, aspect);
  ground = ground_height(scene, mesh.parts);

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
  bodies = BodyBuffers(mesh);
  if (!mesh.looks.empty()) {
    programs = &device->surface_programs();
    textures = SurfaceTextures(scene, mesh.surfaces);
    shines = std::ranges::any_of(mesh.surfaces, shines_or_shades);
    lamps = lamps_of(scene, mesh.parts);
  }
  key = set_light(frame, scene, lamps, ground);
  focus = std::max(nearest, 0.1);
  const int scale = settings.antialiasing ? 2 : 1;
  const auto [tile_width, tile_height] = size_of_tile(settings);
  surfaces = Surfaces(tile_width * scale, tile_height * scale, shines);
  if (has(Surface::Opacity::blended)) layers = Layers(surfaces);
  picture = Target(tile_width, tile_height);
  lit = Lit(picture, shines);
  look_at(view);
  if (const GLenum error = glGetError(); error != GL_NO_ERROR) {
    throw Error("software OpenGL reports error " + std::to_string(error) +
                " while being set up: is libosmesa6 of Mesa 22.3 installed?");
  }
}

Renderer::Implementation::~Implementation() {
  {
    const Context::Current current(device->context);
    surfaces.end();
    kept.end();
    picture.end();
    lit.end();
    bodies.end();
    textures.end();
    layers.end();
  }
  give_back(*device);
}

/// What the next tile is to show: the whole picture, or a part of it.
void Renderer::Implementation::look_at(const View& seen) {
  tile_view = seen;
  clip_from_world = set_view(frame, tile_view, picture.width, picture.height, settings.antialiasing, focus);
}

/// The picture of what `draw_tile` draws of each tile, one after the other. Tiles lap over each other, for a
/// pixel is a mean of samples of its neighbours too.
Image Renderer::Implementation::in_tiles(const std::function<Image()>& draw_tile) {
  if (picture.width == settings.width && picture.height == settings.height) {
    look_at(view);
    return draw_tile();
  }
  constexpr int lap = 2;
  Image image(settings.width, settings.height);
  for (int top = 0, bottom = 0; top < settings.height; top = bottom) {
    const int y = std::clamp(top - lap, 0, settings.height - picture.height);
    bottom = y + picture.height == settings.height ? settings.height : y + picture.height - lap;
    for (int left = 0, right = 0; left < settings.width; left = right) {
      const int x = std::clamp(left - lap, 0, settings.width - picture.width);
      right = x + picture.width == settings.width ? settings.width : x + picture.width - lap;
      look_at(part_of(view, settings.width, settings.height, x, y, picture.width, picture.height));
      const Image drawn = draw_tile();
      for (int row = top; row < bottom; ++row) {
        std::copy_n(drawn.pixel(left - x, row - y), 3 * (right - left), image.pixel(left, row));
      }
    }
  }
  return image;
}

/// Where bodies were drawn, within `areas`.
std::vector<Rectangle> Renderer::Implementation::areas_seen() {
  const Rectangle box = bounds_of(areas, picture.width, picture.height);
  const int side = settings.antialiasing ? 2 : 1;
  depths.resize(static_cast<std::size_t>(side * box.width) * static_cast<std::size_t>(side * box.height));
  if (depths.empty()) return {};
  glReadPixels(side * box.x, side * box.y, side * box.width, side * box.height, GL_DEPTH_COMPONENT, GL_FLOAT,
               depths.data());
  return seen_areas(depths, box, side);
}

/// The light on what was drawn last, whose depth is given; it lies within `lit_areas`.
void Renderer::Implementation::light_surfaces(GLuint depth, std::span<const Rectangle> lit_areas) {
  glBindFramebuffer(GL_FRAMEBUFFER, lit.framebuffer);
  glViewport(0, 0, picture.width, picture.height);
  glActiveTexture(GL_TEXTURE0 + depth_unit);
  glBindTexture(GL_TEXTURE_2D, depth);
  glDepthFunc(GL_ALWAYS);
  glUseProgram(programs == nullptr ? device->shading_program : programs->shading(shines, lamps.has_sun));
  glBindVertexArray(device->nothing);
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glEnable(GL_SCISSOR_TEST);
  for (const Rectangle& area : lit_areas) {
    glScissor(area.x, area.y, area.width, area.height);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
  glDisable(GL_SCISSOR_TEST);
  glDepthFunc(GL_LEQUAL);
}

/// What was read last.
Drawn Renderer::Implementation::drawn() const {
  return {picture.width,  picture.height, settings.antialiasing ? 2 : 1,
          picture.pixels, lit.pixels[0],  lit.pixels[1]};
}

Image Renderer::Implementation::draw(std::span<const Coordinates> poses) {
  const Context::Current current(device->context);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  if (programs != nullptr) programs->set_lamps(lamps, shines);
  fit_shadow(poses);
  fit_occlusion(poses);
  return in_tiles([&] { return draw_tile(poses); });
}

Image Renderer::Implementation::draw_tile(std::span<const Coordinates> poses) {
  glEnable(GL_DEPTH_TEST);
  glBindBuffer(GL_UNIFORM_BUFFER, device->frame_buffer);
  glBufferData(GL_UNIFORM_BUFFER, sizeof frame, &frame, GL_STREAM_DRAW);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, device->frame_buffer);
  draw_surfaces(poses);  // which binds textures, too
  areas = areas_of(mesh.parts, poses, clip_from_world, picture.width, picture.height);
  const std::vector<Rectangle> seen = areas_seen();
  const auto bind = [](GLint unit, GLuint texture) {
    glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + unit));
    glBindTexture(GL_TEXTURE_2D, texture);
  };
  bind(shadow_nearest_unit, shadow->nearest());
  bind(shadow_test_unit, shadow->depth());
  bind(occlusion_unit, device->occlusion);
  bind(surface_unit, surfaces.textures[0]);
  bind(emission_unit, surfaces.textures[1]);
  bind(crevice_unit, surfaces.textures[2]);
  bind(shadow_depth_unit, shadow->depth());

  const auto ground_program = [&](shaders::Shade shade) {
    return (programs == nullptr ? device->ground_programs
                                : programs->ground)[static_cast<std::size_t>(shade)];
  };
  const GroundAreas ground_areas = ground_areas_of_tile();
  backdrop.complete(*device, ground_program(shaders::Shade::none), frame, ground_areas.open, picture);

  light_surfaces(surfaces.depth, seen);
  picture.start();
  draw_surroundings(*device, ground_program(shaders::Shade::sky), ground_areas.occluded);
  draw_surroundings(*device, ground_program(shaders::Shade::shadow), ground_areas.shadowed);
  picture.read();
  backdrop.copy(ground_areas.open, picture);
  lit.read(picture);
  return has(Surface::Opacity::blended) ? draw_layers(poses) : resolved(drawn());
}

Image Renderer::Implementation::draw_colors(std::span<const Coordinates> poses) {
  const Context::Current current(device->context);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  return in_tiles([&] {
    picture.start_anew();
    draw_solid(device->color_program, clip_from_world, poses);
    if (has(Surface::Opacity::blended)) {
      draw_pieces(device->color_program, clip_from_world, poses, Surface::Opacity::blended);
    }
    // The ground is the world's.
    glm::dmat4 place(1);
    place[0][0] = place[2][2] = frame.ground_reach.w;
    place[3] = {view.eye.x, ground, view.eye.z, 1};
    glUseProgram(device->color_program);
    bodies.set_places(device->color_program, clip_from_world * place, std::array{Coordinates{}}, 0);
    draw_ground(*device, device->color_program);
    picture.read();
    return top_down(picture.pixels, picture.width, picture.height);
  });
}

void check(const RenderSettings& settings) {
  if (settings.width < 1 || settings.height < 1) throw Error("a picture needs at least one pixel each way");
  constexpr int longest = 1 << 15;
  constexpr std::int64_t most = 1 << 28;
  if (settings.width > longest || settings.height > longest ||
      static_cast<std::int64_t>(settings.width) * settings.height > most) {
    throw Error(fmt::format("a picture of {}×{} is too large: ask for at most {} pixels, and {} each way",
                            settings.width, settings.height, most, longest));
  }
}

Renderer::Renderer(const Scene& scene, const RenderSettings& settings,
                   std::span<const std::vector<Coordinates>> reference) {
  const DefaultFloatingPoint environment;
  implementation_ = std::make_unique<Implementation>(scene, settings, reference);
}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

const View& Renderer::view() const {
  return implementation_->view;
}
void Renderer::look(const View& view) {
  implementation_->view = view;
}

bool Renderer::moves_by(double pixels, std::span<const Coordinates> from,
                        std::span<const Coordinates> to) const {
  const RenderSettings& settings = implementation_->settings;
  return render::moves_by(pixels, implementation_->mesh.parts, from, to, clip_from_world(view(), 1, 2),
                          settings.width, settings.height);
}

Image Renderer::draw(std::span<const Coordinates> poses) {
  const DefaultFloatingPoint environment;
  return implementation_->draw(poses);
}
Image Renderer::draw_bodies(std::span<const Coordinates> poses) {
  const DefaultFloatingPoint environment;
  return implementation_->draw_colors(poses);
}

}  // namespace substep::render
